//! `abbe study`: simulate and analyse many sessions.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use abbe::fleet::store::{IfClaimed, Store};
use abbe::fleet::study::draw::Draw;
use abbe::fleet::study::file::{self, Study};
use abbe::fleet::study::summary::summary;
use abbe::fleet::{FleetError, study};
use abbe::model::words::counted;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use super::failure::Failure;
use super::interrupt::Interrupts;
use super::json::{self, Origin};
use super::output::{self, Outputs};
use super::run::MAX_THREADS;
use crate::report::study as present;

/// Examples of `abbe study`.
pub const HELP: &str = "A study file states plans, effects and noise. Every combination is simulated and analysed: \
how often the true effect is found (named or among the aliases), how often another one is claimed, how many 95 % \
intervals contain the true value, each with its standard error. Plans are ranked by the errors that they determine, then by uncertainty. Draws \
follow from the study file and their number alone; finished ones are kept in --out.

Example of a study file:
  [study]
  analysis = \"trace\"
  draws = 100
  location_um = 20
  location_arcsec = 8
  [[plan]]
  name = \"four tests\"
  session = \"chapter5.toml\"
  [[noise]]
  name = \"white\"
  um = 0.3
  [[effect]]
  name = \"none\"
  [[effect]]
  name = \"axial, twice per turn\"
  size = 5
  effect = { component = \"EZC\", driver = \"C\", shape = \"harmonic\", order = 2 }

Example:
  abbe study studies/small.toml --out study --threads 2";

/// `abbe study STUDY --out DIR`
#[derive(Args)]
pub struct StudyArguments {
    /// The study file.
    #[arg(value_name = "STUDY")]
    study: PathBuf,
    /// Folder of the draws; new, or that of an earlier run.
    ///
    /// Example: --out study
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of threads for all draws together.
    ///
    /// Example: --threads 4
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
    /// Write the result as JSON; `-` writes it, and nothing else, to standard output.
    ///
    /// Example: --json study.json
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the combinations as CSV.
    ///
    /// Example: --csv study.csv
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

/// Runs `abbe study`.
pub fn run(arguments: &StudyArguments, quiet: bool) -> Result<(), Failure> {
    if !(1..=MAX_THREADS).contains(&arguments.threads) {
        return Err(Failure::CommandLine(format!(
            "`--threads {}`: a number of threads from 1 to {MAX_THREADS} is expected",
            arguments.threads
        )));
    }
    let outputs = Outputs::new(arguments.json.iter().chain(&arguments.csv))?;
    outputs.refuse_overwrite([arguments.study.as_path()])?;
    let study = file::read(&arguments.study)?;
    let store = Store::open(&arguments.out)?;
    store.remove_stale();
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(study.draws() as u64) };
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos} of {len} draws, {eta} left") {
        bar.set_style(style);
    }
    let draws = draws(&study, &store, arguments.threads, &bar)?;
    bar.finish_and_clear();
    let result = summary(&draws);
    if outputs.tables(quiet) {
        say!("{}", counted(result.draws, "draw"));
        output::print(&present::cells("Combinations", &result.cells));
        output::print(&present::cells("Effects over all plans and noise", &result.effects));
        output::print(&present::cells("Plans, best first", &result.ranking));
        for draw in draws.iter().filter(|draw| draw.error.is_some()).take(1) {
            let message = draw.error.as_deref().unwrap_or_default();
            say!("\nThe first draw without a result, {} in {}: {message}", draw.effect, draw.plan);
        }
    }
    if let Some(path) = &arguments.csv {
        output::write_whole(path, &output::csv(&present::cells("", &result.cells))?)?;
    }
    if let Some(path) = &arguments.json {
        json::write(path, Origin::of_files(&study.stamp), Some(study.file.study.seed), &result)?;
    }
    Ok(())
}

/// All draws; finished ones are read.
fn draws(study: &Study, store: &Store, threads: usize, bar: &ProgressBar) -> Result<Vec<Draw>, Failure> {
    let interrupts = Interrupts::noticed();
    let stopped = AtomicBool::new(false);
    let goes_on = || !interrupts.came() && !stopped.load(Ordering::Relaxed);
    let one = |number: usize, if_claimed: IfClaimed| -> Result<Option<Draw>, FleetError> {
        let draw = study::run(study, number, store, if_claimed, &goes_on);
        let draw = draw.inspect_err(|_| stopped.store(true, Ordering::Relaxed))?;
        Ok(draw.map(|(_, draw)| draw).inspect(|_| bar.inc(1)))
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|cause| Failure::Other(format!("the threads cannot be started: {cause}")))?;
    let numbers = (0..study.draws()).into_par_iter().with_max_len(1);
    let mut all: Vec<Result<Option<Draw>, FleetError>> =
        pool.install(|| numbers.map(|number| one(number, IfClaimed::Skip)).collect());
    // Those that other processes make: they are done, or the processes have ended.
    let claimed: Vec<_> = all.iter_mut().enumerate().filter(|(_, draw)| matches!(draw, Ok(None))).collect();
    pool.install(|| {
        claimed.into_par_iter().with_max_len(1).for_each(|(number, draw)| *draw = one(number, IfClaimed::Wait));
    });
    let done = all.iter().filter(|draw| draw.is_ok()).count();
    let (mut draws, mut interrupted) = (Vec::with_capacity(done), false);
    for draw in all {
        match draw {
            Ok(draw) => draws.extend(draw),
            Err(FleetError::Interrupted) => interrupted = true,
            Err(error) => return Err(error.into()),
        }
    }
    if interrupted {
        let message = format!("interrupted: {done} of {} done; the same command continues", study.draws());
        return Err(Failure::Interrupted(message));
    }
    Ok(draws)
}
