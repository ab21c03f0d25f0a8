//! `abbe plan --improve`, `--separate`, `--range`.

use abbe::identify::IdentifyError;
use abbe::identify::plan::criterion::Goal;
use abbe::identify::plan::improve::{ImproveOptions, Improvement, improve};
use abbe::identify::plan::range::Shrinkage;
use abbe::identify::plan::test_variations::TestVariations;
use abbe::identify::problem::Problem;
use abbe::identify::results::Interval;
use abbe::identify::trace::library;
use abbe::model::words::counted;
use clap::{Args, ValueEnum};

use super::digits::three_digits;
use crate::cli::failure::Failure;
use crate::cli::table;

/// The share of a range that is tried besides the whole where gain is judged by the minute.
const HALF: f64 = 0.5;

/// Tests that are proposed at most: each is sought over the whole menu, beside all before it.
const MAX_TESTS: usize = 24;

/// Whether a sweep comes back.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Directions {
    Both,
    One,
}

/// What a next test is sought with.
#[derive(Args)]
#[command(group = clap::ArgGroup::new("next_test").args(["improve", "separate"]))]
pub struct ImproveArguments {
    /// Propose this many tests that most lower the worst uncertainty.
    #[arg(long, value_name = "TESTS", num_args = 0..=1, default_missing_value = "1", conflicts_with = "separate")]
    improve: Option<usize>,
    /// Propose a test that tells two effects apart, by their identifiers: EZC~C:h2,EAC~C:h1.
    #[arg(long, value_name = "A,B")]
    separate: Option<String>,
    /// Bars of the kit.
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test")]
    bars_mm: Option<Vec<f64>>,
    /// Distances of the ball from the axis that it is mounted about.
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test")]
    radii_mm: Option<Vec<f64>>,
    /// Heights of the ball along that axis.
    #[arg(long, value_name = "MM,…", value_delimiter = ',', requires = "next_test")]
    heights_mm: Option<Vec<f64>>,
    /// Feeds to try, as multiples of the session's; by default a second one where an effect depends on speed or time.
    #[arg(long, value_name = "TIMES,…", value_delimiter = ',', requires = "next_test")]
    feeds: Option<Vec<f64>>,
    /// Shares of a sweep's range to try, about its middle [default: 1; by the minute 1,0.5].
    #[arg(
        long = "sweep-shares",
        value_name = "SHARE,…",
        value_delimiter = ',',
        requires = "next_test"
    )]
    ranges: Option<Vec<f64>>,
    /// Directions to try [default: both; by the minute both,one].
    #[arg(long, value_name = "WAYS,…", value_delimiter = ',', requires = "next_test")]
    directions: Option<Vec<Directions>>,
    /// Leave out tests in which linear axes follow: their errors are then no part of the question.
    #[arg(long, requires = "next_test")]
    no_follow: bool,
    /// Travel of the bar's sensor either way: what a test may not exceed.
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    reach_mm: f64,
    /// Every test has a spindle ball mounted for it alone.
    #[arg(long, requires = "next_test")]
    remount_spindle_ball: bool,
    /// Time that mounting a ball takes; stating it weighs gains by the minute.
    #[arg(long, value_name = "MIN", requires = "next_test")]
    setup_min: Option<f64>,
    /// Time that preparing a test takes; stating it weighs gains by the minute.
    #[arg(long, value_name = "MIN", requires = "next_test")]
    test_min: Option<f64>,
}

impl ImproveArguments {
    /// Whether a next test is asked for.
    pub fn asked(&self) -> bool {
        self.improve.is_some() || self.separate.is_some()
    }

    /// Travel of the bar's sensor either way, mm.
    pub fn reach_mm(&self) -> Result<f64, Failure> {
        not_negative("--reach-mm", self.reach_mm)
    }

    /// Whether gain is weighed against time.
    fn by_minute(&self) -> bool {
        self.setup_min.is_some() || self.test_min.is_some()
    }

    fn menu(&self) -> Result<TestVariations, Failure> {
        let mut menu = TestVariations {
            reach_mm: self.reach_mm()?,
            ..TestVariations::default()
        };
        let checked = |flag: &str, list: &[f64], least: f64| match list
            .iter()
            .find(|value| !value.is_finite() || **value < least)
        {
            Some(value) => Err(Failure::Other(format!(
                "`{flag}`: {value} mm is no length that can be tried"
            ))),
            None => Ok(list.to_vec()),
        };
        if let Some(bars) = &self.bars_mm {
            menu.bars_mm = checked("--bars-mm", bars, 1.0)?;
        }
        if let Some(radii) = &self.radii_mm {
            menu.radii_mm = checked("--radii-mm", radii, 1.0)?;
        }
        if let Some(heights) = &self.heights_mm {
            menu.heights_mm = checked("--heights-mm", heights, 0.0)?;
        }
        if self.by_minute() {
            menu.ranges.push(HALF);
            menu.both_directions.push(false);
        }
        let shares = |flag: &str, list: &[f64], most: f64| match list
            .iter()
            .find(|value| !(**value > 0.0 && **value <= most))
        {
            Some(value) if most == 1.0 => Err(Failure::Other(format!(
                "`{flag}`: {value} is no share of a range; it lies above 0 and at most at 1"
            ))),
            Some(value) => Err(Failure::Other(format!(
                "`{flag}`: {value} is no multiple of a feed; it has to be a positive number"
            ))),
            None => Ok(list.to_vec()),
        };
        if let Some(feeds) = &self.feeds {
            menu.feeds = shares("--feeds", feeds, f64::MAX)?;
        }
        if let Some(ranges) = &self.ranges {
            menu.ranges = shares("--sweep-shares", ranges, 1.0)?;
        }
        if let Some(directions) = &self.directions {
            menu.both_directions = directions.iter().map(|ways| *ways == Directions::Both).collect();
        }
        menu.follow = !self.no_follow;
        menu.keep_spindle_ball = !self.remount_spindle_ball;
        let stated = |flag: &str, value: Option<f64>, usual: f64| match value {
            Some(value) => not_negative(flag, value),
            None => Ok(usual),
        };
        menu.setup_min = stated("--setup-min", self.setup_min, menu.setup_min)?;
        menu.test_min = stated("--test-min", self.test_min, menu.test_min)?;
        Ok(menu)
    }

    /// Proposes tests.
    pub fn run(&self, problem: &Problem<'_>) -> Result<Improvement, Failure> {
        let menu = self.menu()?;
        let by_minute = self.by_minute();
        if let Some(pair) = &self.separate {
            let Some((a, b)) = pair.split_once(',').filter(|(a, b)| a.trim() != b.trim()) else {
                return Err(Failure::Other(format!(
                    "`--separate {pair}`: it takes two effects with a comma between them, as EZC~C:h2,EAC~C:h1"
                )));
            };
            let mut both = problem.clone();
            for id in [a, b] {
                add(&mut both, id.trim())?;
            }
            let menu = menu.for_effects(&both.parameters.effects);
            let goal = Goal::Separation {
                effect: a.trim().to_string(),
                coefficients: Vec::new(),
            };
            return Ok(improve(
                &both,
                &menu,
                &ImproveOptions {
                    goal,
                    tests: 1,
                    by_minute,
                },
            )?);
        }
        let tests = self.improve.unwrap_or(1);
        if !(1..=MAX_TESTS).contains(&tests) {
            return Err(Failure::Other(format!(
                "`--improve {tests}`: from 1 to {MAX_TESTS} tests are proposed"
            )));
        }
        let options = ImproveOptions {
            goal: Goal::WorstUncertainty,
            tests,
            by_minute,
        };
        Ok(improve(problem, &menu, &options)?)
    }
}

/// A number that may be 0.
fn not_negative(flag: &str, value: f64) -> Result<f64, Failure> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err(Failure::Other(format!(
            "`{flag} {value}`: it has to be 0 or more"
        )))
    }
}

/// Adds an effect of the library by its identifier.
fn add(problem: &mut Problem<'_>, id: &str) -> Result<(), IdentifyError> {
    if problem.parameters.effects.iter().any(|effect| effect.id() == id) {
        return Ok(());
    }
    let candidates = library::candidates(problem)?;
    let Some(candidate) = candidates.iter().find(|candidate| candidate.effect.id() == id) else {
        let id_stem = id.split(':').next().unwrap_or(id);
        let mut alike: Vec<String> = candidates
            .iter()
            .map(|c| c.effect.id())
            .filter(|other| other.starts_with(id_stem))
            .collect();
        alike.dedup();
        alike.truncate(6);
        let hint = if alike.is_empty() {
            "identifiers are component~driver:shape, as EZC~C:h2".to_string()
        } else {
            format!("there are {}", alike.join(", "))
        };
        return Err(IdentifyError::Request(format!(
            "`{id}` is no effect of the library for this plan; {hint}"
        )));
    };
    problem.add_effect(&candidate.effect)
}

/// Prints what is proposed.
pub fn print(found: &Improvement) {
    say!(
        "{} candidate tests; {} now: {}",
        counted(found.candidate_tests, "entry"),
        found.criterion,
        three_digits(found.before)
    );
    if found.steps.is_empty() {
        say!("no candidate test improves it");
        return;
    }
    for (number, step) in found.steps.iter().enumerate() {
        say!("\n{}. {}", number + 1, step.test);
        say!(
            "   {} → {}, {:.1} min{}",
            found.criterion,
            three_digits(step.after),
            step.duration_min,
            if step.new_setup { " with the set-up" } else { "" }
        );
        say!(
            "   workpiece ball {}, spindle ball {}, bar {} mm",
            point(step.workpiece_ball_mm),
            point(step.spindle_ball_mm),
            step.bar_mm
        );
        if !step.makes_identifiable.is_empty() {
            say!("   makes identifiable {}", step.makes_identifiable.join(", "));
        }
    }
    say!("");
    let mut header = vec!["error".to_string(), "now".to_string()];
    header.extend((1..=found.steps.len()).map(|number| format!("with {number}")));
    let rows: Vec<Vec<String>> = found
        .uncertainties_before
        .iter()
        .enumerate()
        .map(|(k, before)| {
            let mut row = vec![before.id.clone(), three_digits(before.u)];
            row.extend(
                found
                    .steps
                    .iter()
                    .map(|step| three_digits(step.uncertainties[k].u)),
            );
            row
        })
        .collect();
    table::print(&header.iter().map(String::as_str).collect::<Vec<_>>(), &rows);
    for exchange in &found.exchanged {
        say!("exchanged: {exchange}");
    }
    say!("\nBest by themselves:");
    for other in &found.alternatives {
        say!(
            "  {}  {} ({:.1} min)",
            three_digits(other.after),
            other.test,
            other.duration_min
        );
    }
}

fn point(mm: [f64; 3]) -> String {
    let cells: Vec<String> = mm.iter().map(|x| format!("{x:.1}")).collect();
    format!("({}) mm", cells.join(", "))
}

/// Header of [`range_rows`].
pub const RANGES: [&str; 5] = ["test", "axis", "planned", "least", "doubles first"];

/// How far each sweep can shrink, a row a sweep.
pub fn range_rows(ranges: &[Shrinkage]) -> Vec<Vec<String>> {
    let row = |range: &Shrinkage| {
        let span = |Interval { low, high }: Interval| format!("{low:.0} … {high:.0} {}", range.unit);
        vec![
            range.test.clone(),
            range.axis.clone(),
            span(range.range),
            range.minimum_range.map_or("can be left out".into(), span),
            range.first_to_double.clone().unwrap_or("—".into()),
        ]
    };
    ranges.iter().map(row).collect()
}

/// Prints how far sweeps can shrink.
pub fn print_ranges(ranges: &[Shrinkage]) {
    say!("\nHow far each sweep can shrink about its middle before an uncertainty doubles:");
    table::print(&RANGES, &range_rows(ranges));
}
