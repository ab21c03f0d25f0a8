//! `abbe plan --improve`, `--separate`, `--range`.

use std::path::PathBuf;

use abbe::identify::IdentifyError;
use abbe::identify::candidates::library;
use abbe::identify::plan::criterion::Goal;
use abbe::identify::plan::improve::{ImproveOptions, Improvement, improve};
use abbe::identify::plan::test_variations::TestVariations;
use abbe::identify::problem::Problem;
use abbe::model::effect::Effect;
use abbe::model::files::SourceMap;
use abbe::model::words::counted;
use clap::{Args, ValueEnum};

use crate::cli::failure::Failure;
use crate::cli::{SessionArguments, next_session, output, values};
use crate::report::next_test as present;
use crate::report::number::three_digits;

/// The share of a range that is tried beside the whole range if gain per minute is compared.
const HALF: f64 = 0.5;

/// Maximum number of proposed tests. Each one is a search over all candidate tests.
const MAX_TESTS: usize = 24;

/// Directions of a sweep.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Directions {
    /// There and back.
    Both,
    /// There only.
    One,
}

/// The search for a next test.
#[derive(Args)]
#[command(group = clap::ArgGroup::new("next_test").args(["improve", "separate"]))]
pub struct ImproveArguments {
    /// Propose tests that most lower the largest standard uncertainty (1 µm counts as 1″); 1 test if no number is
    /// given.
    ///
    /// Example: --improve 2
    #[arg(long, value_name = "TESTS", num_args = 0..=1, default_missing_value = "1", conflicts_with = "separate")]
    improve: Option<usize>,
    /// Propose a test that separates two effects, named by their identifiers.
    ///
    /// Example: --separate EZC~C:h2,EAC~C:h1
    #[arg(long, value_name = "A,B", allow_hyphen_values = true)]
    separate: Option<String>,
    /// Lengths of the available bars.
    ///
    /// Example: --improve 1 --bars-mm 50,100,150,300
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test")]
    bars_mm: Option<Vec<f64>>,
    /// Distances of the ball from the rotary axis that moves it.
    ///
    /// Example: --improve 1 --radii-mm 50,100
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test")]
    radii_mm: Option<Vec<f64>>,
    /// Heights of the ball along that axis.
    ///
    /// Example: --improve 1 --heights-mm 0,75,150
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test")]
    heights_mm: Option<Vec<f64>>,
    /// Feeds to try, as multiples of the session's feed
    /// [default: 1, and a second feed if an effect depends on speed or time].
    ///
    /// Example: --improve 1 --feeds 0.5,1,2
    #[arg(long, value_name = "TIMES,…", value_delimiter = ',', requires = "next_test")]
    feeds: Option<Vec<f64>>,
    /// Shares of the range of a sweep to try, about its middle [default: 1; with --setup-min or --test-min 1,0.5].
    ///
    /// Example: --improve 1 --sweep-shares 1,0.5,0.25
    #[arg(long = "sweep-shares", value_name = "SHARE,…", value_delimiter = ',', requires = "next_test")]
    ranges: Option<Vec<f64>>,
    /// Directions to try [default: both; with --setup-min or --test-min both,one].
    ///
    /// Example: --improve 1 --directions both,one
    #[arg(long, value_name = "WAYS,…", value_delimiter = ',', requires = "next_test")]
    directions: Option<Vec<Directions>>,
    /// Exclude tests in which linear axes follow a rotary axis. The errors of the linear axes then play no part.
    #[arg(long, requires = "next_test")]
    no_follow: bool,
    /// Travel of the sensor in the bar, in each direction. No test exceeds it.
    ///
    /// Example: --reach-mm 2
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    reach_mm: f64,
    /// Mount a spindle ball for each proposed test.
    #[arg(long, requires = "next_test")]
    remount_spindle_ball: bool,
    /// Time to mount a ball. If it is stated, the gain per minute is compared.
    ///
    /// Example: --improve 1 --setup-min 5
    #[arg(long, value_name = "MIN", requires = "next_test")]
    setup_min: Option<f64>,
    /// Time to prepare a test. If it is stated, the gain per minute is compared.
    ///
    /// Example: --improve 1 --test-min 1
    #[arg(long, value_name = "MIN", requires = "next_test")]
    test_min: Option<f64>,
    /// Write the session with the proposed tests at its end, with all positions.
    ///
    /// Example: --improve 2 --write next.toml
    #[arg(long, value_name = "FILE", requires = "next_test")]
    write: Option<PathBuf>,
}

impl ImproveArguments {
    /// Whether a next test is requested.
    pub fn asked(&self) -> bool {
        self.improve.is_some() || self.separate.is_some()
    }

    /// The file of the session with the proposed tests.
    pub fn file(&self) -> Option<&PathBuf> {
        self.write.as_ref()
    }

    /// Writes the session with the proposed tests, if requested.
    pub fn write(&self, found: &Improvement, sources: &SourceMap, session: &SessionArguments) -> Result<(), Failure> {
        let Some(path) = &self.write else {
            return Ok(());
        };
        let blocks = found.steps.iter().map(|step| step.session_toml.clone()).filter(|block| !block.is_empty());
        next_session::write(path, sources, session, |text| {
            let mut blocks = blocks;
            blocks.try_for_each(|block| text.add_block(&block))
        })
    }

    /// Travel of the sensor in the bar, in each direction, mm.
    pub fn reach_mm(&self) -> Result<f64, Failure> {
        values::DISTANCE_MM.check("--reach-mm", self.reach_mm)
    }

    /// Whether gain per minute is compared.
    fn by_minute(&self) -> bool {
        self.setup_min.is_some() || self.test_min.is_some()
    }

    fn candidate_tests(&self) -> Result<TestVariations, Failure> {
        let mut candidates = TestVariations { reach_mm: self.reach_mm()?, ..TestVariations::default() };
        if let Some(bars) = &self.bars_mm {
            candidates.bars_mm = values::LENGTH_MM.all("--bars-mm", bars)?;
        }
        if let Some(radii) = &self.radii_mm {
            candidates.radii_mm = values::LENGTH_MM.all("--radii-mm", radii)?;
        }
        if let Some(heights) = &self.heights_mm {
            candidates.heights_mm = values::DISTANCE_MM.all("--heights-mm", heights)?;
        }
        if self.by_minute() {
            candidates.ranges.push(HALF);
            candidates.both_directions.push(false);
        }
        if let Some(feeds) = &self.feeds {
            candidates.feeds = values::FEED.all("--feeds", feeds)?;
        }
        if let Some(ranges) = &self.ranges {
            candidates.ranges = values::SHARE.all("--sweep-shares", ranges)?;
        }
        if let Some(directions) = &self.directions {
            candidates.both_directions = directions.iter().map(|ways| *ways == Directions::Both).collect();
        }
        candidates.follow = !self.no_follow;
        candidates.keep_spindle_ball = !self.remount_spindle_ball;
        let stated = |flag: &str, value: Option<f64>, usual: f64| match value {
            Some(value) => values::MINUTES.check(flag, value),
            None => Ok(usual),
        };
        candidates.setup_min = stated("--setup-min", self.setup_min, candidates.setup_min)?;
        candidates.test_min = stated("--test-min", self.test_min, candidates.test_min)?;
        Ok(candidates)
    }

    /// Proposes tests.
    pub fn run(&self, problem: &Problem) -> Result<Improvement, Failure> {
        let candidates = self.candidate_tests()?;
        let by_minute = self.by_minute();
        if let Some(pair) = &self.separate {
            let Some((a, b)) = pair.split_once(',').filter(|(a, b)| a.trim() != b.trim()) else {
                return Err(Failure::Other(format!(
                    "`--separate {pair}`: two different effects with a comma between them are expected, as in EZC~C:h2,EAC~C:h1"
                )));
            };
            let mut both = problem.clone();
            for id in [a, b] {
                add(&mut both, id.trim())?;
            }
            let candidates = candidates.for_effects(&both.parameters.effects);
            let goal = Goal::Separation { effect: a.trim().to_string(), coefficients: Vec::new() };
            return Ok(improve(&both, &candidates, &ImproveOptions { goal, tests: 1, by_minute })?);
        }
        let tests = self.improve.unwrap_or(1);
        if !(1..=MAX_TESTS).contains(&tests) {
            return Err(Failure::Other(format!(
                "`--improve {tests}`: a number of tests from 1 to {MAX_TESTS} is expected"
            )));
        }
        let options = ImproveOptions { goal: Goal::WorstUncertainty, tests, by_minute };
        Ok(improve(problem, &candidates, &options)?)
    }
}

/// Adds an effect of the library by its identifier.
fn add(problem: &mut Problem, id: &str) -> Result<(), IdentifyError> {
    if problem.parameters.effects.iter().any(|effect| effect.id() == id) {
        return Ok(());
    }
    problem.add_effect(&effect(problem, id)?)
}

/// An effect of the library by its identifier.
pub fn effect(problem: &Problem, id: &str) -> Result<Effect, IdentifyError> {
    let candidates = library::candidates(problem)?;
    let Some(candidate) = candidates.iter().find(|candidate| candidate.effect.id() == id) else {
        let before_shape = id.split(':').next().unwrap_or(id);
        let mut alike: Vec<String> =
            candidates.iter().map(|c| c.effect.id()).filter(|other| other.starts_with(before_shape)).collect();
        alike.dedup();
        alike.truncate(6);
        let hint = if alike.is_empty() {
            "identifiers are component~driver:shape, as in EZC~C:h2".to_string()
        } else {
            format!("similar ones: {}", alike.join(", "))
        };
        return Err(IdentifyError::Request(format!("`{id}` is not in the library of effects for this plan; {hint}")));
    };
    Ok(candidate.effect.clone())
}

/// Prints the proposed tests.
pub fn print(found: &Improvement) {
    let criterion = present::criterion(found);
    say!(
        "{}. With the plan: {criterion} {}",
        counted(found.candidate_tests, "candidate test"),
        three_digits(found.before)
    );
    if found.steps.is_empty() {
        say!("No candidate test improves it.");
        return;
    }
    for (number, step) in found.steps.iter().enumerate() {
        say!("\n{}. {}", number + 1, step.test);
        say!(
            "   {criterion} {}, {:.1} min{}",
            three_digits(step.after),
            step.duration_min,
            if step.new_setup { " including the set-up" } else { "" }
        );
        let point = |mm: [f64; 3]| mm.map(|x| format!("{x:.1}")).join(", ");
        say!(
            "   workpiece ball ({}) mm, spindle ball ({}) mm, bar {} mm",
            point(step.workpiece_ball_mm),
            point(step.spindle_ball_mm),
            step.bar_mm
        );
        if !step.makes_identifiable.is_empty() {
            say!("   makes identifiable: {}", step.makes_identifiable.join(", "));
        }
    }
    output::print(&present::uncertainties(found));
    for exchange in &found.exchanged {
        say!("replaced by a further search: {exchange}");
    }
    output::print(&present::alternatives(found));
}
