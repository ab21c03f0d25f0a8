//! `abbe plan`: analyse identifiability and predicted uncertainty of planned tests.

mod improve;

use std::path::PathBuf;

use abbe::analysis::{Plan, PlanningOptions, problem_of};
use abbe::identify::patterns::{Patterns, patterns, usual_sizes};
use abbe::identify::problem::Problem;
use abbe::identify::quantity::Given;
use abbe::model::Diagnostic;
use abbe::model::instrument::rtest::Setting;
use abbe::model::session::Session;
use abbe::plan::PlanOptions;
use abbe::plan::clearance::Clearance;
use abbe::plan::global::{GlobalAnalysis, GlobalOptions, global};
use abbe::plan::improve::NextTest;
use abbe::plan::range::shrinkages;
use clap::Args;

use super::results::Read;
use super::{CommonArguments, Global, SessionArguments, output, read_session, values};
use crate::report::{self, patterns as present};

/// `abbe plan SESSION`
#[derive(Args)]
pub struct PlanArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    options: PlanningOptions,
    /// Check the clearance of an R-test device with the table upright: diameters of spindle and table, height and width
    /// of the device, length of the shaft from jig to ball, length of the jig.
    ///
    /// Example: --device-mm 80,320,60,80,150,50
    #[arg(long, value_name = "DS,DT,H,W,L,T", allow_hyphen_values = true, conflicts_with_all = ["improve", "separate", "range"])]
    device_mm: Option<String>,
    #[command(flatten)]
    improve: improve::ImproveArguments,
    #[command(flatten)]
    patterns: PatternArguments,
    #[command(flatten)]
    global: GlobalArguments,
    /// Find the smallest range of each sweep that does not double an uncertainty.
    #[arg(long)]
    range: bool,
}

/// Examples of `abbe plan`.
pub const HELP: &str = include_str!("../help/plan.txt");

/// Runs `abbe plan`.
pub fn run(arguments: &PlanArguments, _: Global) -> Result<(), Diagnostic> {
    let common = &arguments.common;
    let others = [&arguments.patterns.patterns, &arguments.improve.write];
    let outputs = common.output.prepared(&others.map(Option::as_ref))?;
    // The written session has the mounts and the priors of the file, not those of the command line.
    let planning = &arguments.options;
    arguments.improve.refuse_overrides(planning.one_spindle_ball || planning.setup_um.is_some())?;
    let (mut session, sources) = read_session(&arguments.session, &outputs)?;
    if let Some(um) = planning.setup_um {
        values::length_um("--setup-um", um)?;
    }
    planning.set_up(&mut session);
    let session = session;
    let read = Read::session(&session, &sources, common.seed);
    if arguments.patterns.patterns.is_some() {
        let found = arguments.patterns.run(&session)?;
        return common.output.put(&outputs, &report::patterns::report(&session, &found.patterns), &found, &read);
    }
    let options = PlanOptions {
        noise_mm: planning.noise_um.map(|um| values::length_um("--noise-um", um)).transpose()?,
        planned_only: planning.planned,
        effects: !planning.no_effects,
        reach_mm: arguments.improve.candidates.reach_mm()?,
    };
    let problem = problem_of(&session, &options)?;
    if arguments.global.global {
        let found = arguments.global.run(&problem, common.seed)?;
        return common.output.put(&outputs, &report::plan::global::report(&session, &found), &found, &read);
    }
    if arguments.improve.asked() || arguments.range {
        let improvement = arguments.improve.run(&problem)?;
        if let Some(improvement) = &improvement {
            arguments.improve.write(improvement, &sources, &arguments.session)?;
        }
        let ranges = if arguments.range { shrinkages(&problem)? } else { Vec::new() };
        let found = NextTest::new(&problem, improvement, ranges);
        return common.output.put(&outputs, &report::next::report(&problem, &found), &found, &read);
    }
    let mut found = Plan::of(&session, problem, &options)?;
    if let Some(sizes) = &arguments.device_mm {
        found.analysis.warnings.extend(faults(&session, sizes)?);
    }
    let commands = arguments.session.commands::<Plan>(1, &PlanningOptions { no_effects: false, ..planning.clone() })?;
    common.output.put_found(&outputs, &found, &commands, &read)
}

/// Collisions, with the device where the R-tests of the session have it, else both on the table and in the spindle.
pub fn faults(session: &Session, sizes: &str) -> Result<Vec<String>, Diagnostic> {
    let numbers: Vec<f64> = sizes.split(',').filter_map(|size| size.trim().parse().ok()).collect();
    let &[spindle_mm, table_mm, device_height_mm, device_width_mm, shaft_mm, jig_mm] = numbers.as_slice() else {
        return Err(Diagnostic::other(format!(
            "`--device-mm {sizes}`: six lengths are expected: diameters of spindle and table, height and width of the device, shaft, jig"
        )));
    };
    values::SIZE_MM.all("--device-mm", &numbers)?;
    let settings: Vec<Setting> = session.tests.iter().filter_map(|test| Some(test.station.rtest()?.setting)).collect();
    let faults = [(Setting::Table, "device on the table"), (Setting::Spindle, "device in the spindle")]
        .into_iter()
        .filter(|(setting, _)| settings.is_empty() || settings.contains(setting))
        .flat_map(|(setting, words)| {
            let device_on_table = setting == Setting::Table;
            let clearance = Clearance {
                spindle_mm,
                table_mm,
                device_height_mm,
                device_width_mm,
                shaft_mm,
                jig_mm,
                device_on_table,
            };
            clearance.faults().into_iter().map(move |fault| format!("{words}: {fault}"))
        });
    Ok(faults.collect())
}

/// Trace patterns: the change of the readings by each error alone.
#[derive(Args)]
struct PatternArguments {
    /// Write the change of each reading by each error alone (its trace pattern), by the exact chain.
    ///
    /// Example: --patterns patterns.csv
    #[arg(
        long,
        value_name = "FILE.csv",
        conflicts_with_all = ["improve", "separate", "range", "device_mm", "noise_um", "setup_um"]
    )]
    pub patterns: Option<PathBuf>,
    /// Value of an error; may be repeated [default of --patterns: all errors that the session estimates, 10 µm and 0.01°].
    ///
    /// Example: --patterns patterns.csv --error EY0A=10um --error EB0A=0.01deg
    #[arg(long = "error", value_name = "NAME=VALUE", allow_hyphen_values = true, requires = "patterns")]
    errors: Vec<String>,
}

impl PatternArguments {
    /// Writes the patterns.
    pub fn run(&self, session: &Session) -> Result<Patterns, Diagnostic> {
        let given: Vec<Given> = self.errors.iter().map(|text| Given::parse(text)).collect::<Result<_, _>>()?;
        let given = if given.is_empty() { usual_sizes(session) } else { given };
        let found = patterns(session, &given)?;
        if let Some(path) = &self.patterns {
            output::write_whole(path, &output::csv(&present::readings(&found, session))?)?;
        }
        Ok(found)
    }
}

/// Global sensitivity.
#[derive(Args)]
struct GlobalArguments {
    /// Sobol' indices of each identified error by set-up errors, noise and undeclared effects, with the full fit,
    /// beside the linear prediction.
    #[arg(long, conflicts_with_all = ["improve", "separate", "range", "patterns", "device_mm"])]
    pub global: bool,
    /// Size of an input of --global: half the range of an undeclared effect, or the standard deviation of a set-up
    /// parameter instead of its prior; may be repeated.
    ///
    /// Example: --global --vary EZC~C:h2=2um --vary bar=5um
    #[arg(long = "vary", value_name = "NAME=SIZE", requires = "global", allow_hyphen_values = true)]
    vary: Vec<String>,
    /// Number of samples of --global, a power of two.
    ///
    /// Example: --global --samples 1024
    #[arg(long, value_name = "N", default_value_t = 256, requires = "global")]
    samples: usize,
}

/// Largest number of samples.
const MAX_SAMPLES: usize = 1 << 16;

impl GlobalArguments {
    /// Analyses a plan.
    pub fn run(&self, problem: &Problem, seed: u64) -> Result<GlobalAnalysis, Diagnostic> {
        if !self.samples.is_power_of_two() || !(8..=MAX_SAMPLES).contains(&self.samples) {
            return Err(Diagnostic::other(format!(
                "`--samples {}`: a power of two from 8 to {MAX_SAMPLES} is expected",
                self.samples
            )));
        }
        let vary = self.vary.iter().map(|text| Given::parse(text)).collect::<Result<Vec<_>, _>>()?;
        if let Some((text, _)) = self.vary.iter().zip(&vary).find(|(_, given)| given.value <= 0.0) {
            return Err(Diagnostic::other(format!(
                "`--vary {text}`: half the range or a standard deviation is expected, a number above 0"
            )));
        }
        global(problem, &GlobalOptions { samples: self.samples, seed, vary })
    }
}
