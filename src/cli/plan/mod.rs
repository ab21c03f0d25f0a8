//! `abbe plan`: analyse identifiability and predicted uncertainty of planned tests.

mod global;
mod improve;
mod patterns;
mod set_up;

use abbe::analysis::{Plan, PlanningOptions, problem_of};
use abbe::model::Diagnostic;
use abbe::plan::PlanOptions;
use abbe::plan::next::NextTest;
use abbe::plan::range::shrinkages;
use clap::Args;

use super::results::Read;
use super::{CommonArguments, Global, SessionArguments, read_session, values};
use crate::report;

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
    patterns: patterns::PatternArguments,
    #[command(flatten)]
    global: global::GlobalArguments,
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
        found.analysis.warnings.extend(set_up::faults(&session, sizes)?);
    }
    let commands = arguments.session.commands::<Plan>(1, &PlanningOptions { no_effects: false, ..planning.clone() })?;
    common.output.put_found(&outputs, &found, &commands, &read)
}
