//! `abbe plan --improve`, `--separate`.

use std::path::PathBuf;

use abbe::files::SourceMap;
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use abbe::plan::design::Goal;
use abbe::plan::improve::{self, ImproveOptions, Improvement};
use abbe::plan::variations::TestVariations;
use clap::Args;

use crate::cli::values::{self, Words};
use crate::cli::{SessionArguments, next_session};

/// Maximum number of proposed tests. Each one is a search over all candidate tests.
const MAX_TESTS: usize = 24;

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
    #[command(flatten)]
    pub candidates: CandidateArguments,
    /// Write the session with the result in it: the proposed tests stand at its end, with all positions.
    ///
    /// Example: --improve 2 --write next.toml
    #[arg(long, value_name = "FILE", requires = "next_test")]
    pub write: Option<PathBuf>,
}

impl ImproveArguments {
    /// Whether a next test is requested.
    pub fn asked(&self) -> bool {
        self.improve.is_some() || self.separate.is_some()
    }

    /// Refuses to write a session with other mounts or priors than the session file states.
    pub fn refuse_overrides(&self, are_given: bool) -> Result<(), Diagnostic> {
        let message = "`--write` with `--one-spindle-ball` or `--setup-um` would write a session that is not the planned one: \
                       state the mount or the uncertainties in the session file, then plan without these options";
        match self.write.is_some() && are_given {
            true => Err(Diagnostic::other(message.to_string())),
            false => Ok(()),
        }
    }

    /// Writes the session with the proposed tests, if requested.
    pub fn write(
        &self,
        found: &Improvement,
        sources: &SourceMap,
        session: &SessionArguments,
    ) -> Result<(), Diagnostic> {
        let Some(path) = &self.write else {
            return Ok(());
        };
        if found.steps.is_empty() {
            let message = format!("`--write`: no candidate test helps, so that {} is not written", path.display());
            return Err(Diagnostic::other(message));
        }
        next_session::write(path, sources, session, |text| {
            found.steps.iter().try_for_each(|step| text.add_block(&step.proposal))
        })
    }

    /// Proposes tests, if they are requested.
    pub fn run(&self, problem: &Problem) -> Result<Option<Improvement>, Diagnostic> {
        if !self.asked() {
            return Ok(None);
        }
        let (candidates, by_minute) = (self.candidates.tests()?, self.candidates.by_minute());
        if let Some(pair) = &self.separate {
            let pair = pair.split_once(',').map(|(a, b)| [a.trim(), b.trim()]).filter(|[a, b]| a != b).ok_or_else(|| {
                Diagnostic::other(format!(
                    "`--separate {pair}`: two different effects with a comma between them are expected, as in EZC~C:h2,EAC~C:h1"
                ))
            })?;
            return Ok(Some(improve::separating(problem, pair, &candidates, by_minute)?));
        }
        let tests = values::count("--improve", "tests", self.improve.unwrap_or(1), MAX_TESTS)?;
        let options = ImproveOptions { goal: Goal::WorstUncertainty, tests, by_minute };
        Ok(Some(improve::improve(problem, &candidates, &options)?))
    }
}

/// The share of a range that is tried beside the whole range if gain per minute is compared.
const HALF: f64 = 0.5;

/// Directions of a sweep: whether there and back.
const DIRECTIONS: Words<bool> = &[("both", true), ("one", false)];

/// The candidate tests.
#[derive(Args)]
pub struct CandidateArguments {
    /// Lengths of the available bars.
    ///
    /// Example: --improve 1 --bars-mm 50,100,150,300
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test", allow_hyphen_values = true)]
    bars_mm: Option<Vec<f64>>,
    /// Distances of the ball from the rotary axis that moves it.
    ///
    /// Example: --improve 1 --radii-mm 50,100
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test", allow_hyphen_values = true)]
    radii_mm: Option<Vec<f64>>,
    /// Heights of the ball along that axis.
    ///
    /// Example: --improve 1 --heights-mm 0,75,150
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test", allow_hyphen_values = true)]
    heights_mm: Option<Vec<f64>>,
    /// Feeds to try, as multiples of the session's feed
    /// [default: 1, and a second feed if an effect depends on speed or time].
    ///
    /// Example: --improve 1 --feeds 0.5,1,2
    #[arg(long, value_name = "TIMES,…", value_delimiter = ',', requires = "next_test", allow_hyphen_values = true)]
    feeds: Option<Vec<f64>>,
    /// Shares of the range of a sweep to try, about its middle [default: 1; with --setup-min or --test-min 1,0.5].
    ///
    /// Example: --improve 1 --sweep-shares 1,0.5,0.25
    #[arg(long = "sweep-shares", value_name = "SHARE,…", value_delimiter = ',', requires = "next_test")]
    ranges: Option<Vec<f64>>,
    /// Directions to try, `both` for there and back [default: both; with --setup-min or --test-min both,one].
    ///
    /// Example: --improve 1 --directions both,one
    #[arg(long, value_name = "WAYS,…", value_delimiter = ',', value_parser = values::words(DIRECTIONS), requires = "next_test")]
    directions: Option<Vec<bool>>,
    /// Exclude tests in which linear axes follow a rotary axis. The errors of the linear axes then play no part.
    #[arg(long, requires = "next_test")]
    no_follow: bool,
    /// Travel of the sensor in the bar, in each direction. No test exceeds it.
    ///
    /// Example: --reach-mm 2
    #[arg(long, value_name = "MM", default_value_t = 1.0, allow_negative_numbers = true)]
    reach_mm: f64,
    /// Mount a spindle ball for each proposed test.
    #[arg(long, requires = "next_test")]
    remount_spindle_ball: bool,
    /// Time to mount a ball. If it is stated, the gain per minute is compared.
    ///
    /// Example: --improve 1 --setup-min 5
    #[arg(long, value_name = "MIN", requires = "next_test", allow_negative_numbers = true)]
    setup_min: Option<f64>,
    /// Time to prepare a test. If it is stated, the gain per minute is compared.
    ///
    /// Example: --improve 1 --test-min 1
    #[arg(long, value_name = "MIN", requires = "next_test", allow_negative_numbers = true)]
    test_min: Option<f64>,
}

impl CandidateArguments {
    /// Travel of the sensor in the bar, in each direction, mm.
    pub fn reach_mm(&self) -> Result<f64, Diagnostic> {
        values::DISTANCE_MM.check("--reach-mm", self.reach_mm)
    }

    /// Whether gain per minute is compared.
    pub fn by_minute(&self) -> bool {
        self.setup_min.is_some() || self.test_min.is_some()
    }

    /// The candidate tests.
    pub fn tests(&self) -> Result<TestVariations, Diagnostic> {
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
            candidates.both_directions.clone_from(directions);
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
}
