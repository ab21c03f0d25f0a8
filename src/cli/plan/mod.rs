//! `abbe plan`: analyse identifiability and predicted uncertainty of planned tests.

pub mod global;
pub mod improve;
pub mod patterns;
mod poses;
mod screen;

use abbe::identify::noise::NoiseSource;
use abbe::identify::plan::clearance::Clearance;
use abbe::identify::plan::poses::without_place;
use abbe::identify::plan::{self, PlanOptions};
use abbe::model::files::{self, ReadOptions, SourceMap};
use abbe::model::instrument::Station;
use abbe::model::instrument::rtest::Setting;
use abbe::model::session::{Prior, Session};
use clap::Args;

use super::failure::Failure;
use super::message::print_warnings;
use super::report::ReportArguments;
use super::{CommonArguments, SessionArguments, output, read_session, values};

/// `abbe plan SESSION`
#[derive(Args)]
pub struct PlanArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    report: ReportArguments,
    /// List everything that the first screen folds: confounded parameters, sensitivities, budgets, correlations,
    /// observability indices, contribution of each test, undeclared effects.
    #[arg(long)]
    all: bool,
    /// Standard deviation of a reading, instead of the session's.
    ///
    /// Example: --noise-um 0.5
    #[arg(long, value_name = "UM")]
    noise_um: Option<f64>,
    /// Standard uncertainty of every set-up length with a prior, instead of the session's.
    ///
    /// Example: --setup-um 1
    #[arg(long, value_name = "UM")]
    setup_um: Option<f64>,
    /// Use one mounted spindle ball for all tests.
    #[arg(long)]
    one_spindle_ball: bool,
    /// Use the planned movements even if there are data.
    #[arg(long)]
    planned: bool,
    /// Check the clearance of spindle and table with the table upright: diameters of spindle and table, height and
    /// width of the device, length of the shaft from jig to ball, length of the jig.
    ///
    /// Example: --clearance-mm 80,320,60,80,150,50
    #[arg(long, value_name = "DS,DT,H,W,L,T", conflicts_with_all = ["improve", "separate", "range"])]
    clearance_mm: Option<String>,
    /// Do not screen undeclared effects.
    #[arg(long)]
    no_effects: bool,
    #[command(flatten)]
    improve: improve::ImproveArguments,
    #[command(flatten)]
    poses: poses::PoseArguments,
    #[command(flatten)]
    patterns: patterns::PatternArguments,
    #[command(flatten)]
    global: global::GlobalArguments,
    /// Find the smallest range of each sweep that does not double an uncertainty.
    #[arg(long)]
    range: bool,
}

/// Examples of `abbe plan`.
pub const HELP: &str = "Examples:
  abbe plan sessions/hermle-c600u/chapter5.toml
  abbe plan sessions/hermle-c600u/chapter5.toml --all --report plan.html
  abbe plan sessions/hermle-c600u/chapter5.toml --noise-um 0.5 --no-effects
  abbe plan sessions/hermle-c600u/chapter5.toml --setup-um 1 --no-effects --json plan.json
  abbe plan sessions/hermle-c600u/chapter5.toml --improve 2 --bars-mm 50,100,150,300
  abbe plan sessions/hermle-c600u/chapter5.toml --improve 2 --write next.toml
  abbe plan sessions/hermle-c600u/chapter5.toml --separate EZC~C:h2,EAC~C:h1
  abbe plan sessions/hermle-c600u/chapter5.toml --patterns patterns.csv \\
      --error EY0A=10um --error EB0A=0.01deg
  abbe plan sessions/hermle-c600u/chapter5.toml --range
  abbe plan sessions/ur10/session.toml --poses 30 --noise-um 50 --poses-csv ur10.csv
  abbe plan sessions/hermle-c600u/chapter5.toml --global --vary EZC~C:h2=2um --samples 64

The first screen answers in this order: identifiable errors and rank; predicted standard uncertainty u and expanded \
uncertainty U = 2u; what is confounded; what to do next; the verdict, which names the worst determined error and what \
limits it. --all adds sensitivities, budgets, correlations, observability indices and undeclared effects.";

/// Runs `abbe plan`.
pub fn run(arguments: &PlanArguments) -> Result<(), Failure> {
    arguments.report.check()?;
    let others = [arguments.patterns.file(), arguments.report.file(), arguments.improve.file(), arguments.poses.file()];
    let outputs = arguments.common.outputs(&others)?;
    let tables = outputs.tables(arguments.common.quiet);
    if arguments.poses.asked() {
        return poses(arguments, &outputs, tables);
    }
    // The written session has the mounts and the priors of the file, not those of the command line.
    if arguments.improve.file().is_some() && (arguments.one_spindle_ball || arguments.setup_um.is_some()) {
        return Err(Failure::Other(
            "`--write` with `--one-spindle-ball` or `--setup-um` would write a session that is not the planned one: \
             state the mount or the uncertainties in the session file, then plan without these options"
                .to_string(),
        ));
    }
    let (mut session, sources) = read_session(&arguments.session, &outputs)?;
    if arguments.patterns.asked() {
        return arguments.patterns.run((&session, &sources), &arguments.common, tables);
    }
    if let Some(u_um) = arguments.setup_um {
        set_priors(&mut session, positive("--setup-um", u_um)?);
    }
    if arguments.one_spindle_ball {
        session.tests.iter_mut().for_each(|test| test.spindle_setup = "all tests".to_string());
    }
    let noise_mm = arguments.noise_um.map(|um| positive("--noise-um", um)).transpose()?;
    let options = PlanOptions {
        noise_mm,
        planned_only: arguments.planned,
        effects: !arguments.no_effects,
        reach_mm: arguments.improve.reach_mm()?,
    };
    if arguments.global.asked() {
        let (complete, noise) = plan::prepared(&session, &options)?;
        let problem = plan::states::problem_by_test(&complete, noise)?;
        let found = arguments.global.run(&problem, arguments.common.seed)?;
        if tables {
            global::print(&found);
        }
        return arguments.common.write_json(&sources, &found);
    }
    if arguments.improve.asked() || arguments.range {
        return next_test(arguments, (&session, &sources), &options, tables);
    }
    let mut analysis = plan::analyse(&session, &options)?;
    if let Some(sizes) = &arguments.clearance_mm {
        analysis.warnings.extend(clearance(&session, sizes)?);
    }
    if tables {
        let (complete, noise) = plan::prepared(&session, &options)?;
        let problem = plan::states::problem_by_test(&complete, noise)?;
        let improvable = plan::candidate_tests::has_candidates(&problem);
        screen::print(&analysis, &arguments.session, improvable, arguments.all);
    }
    print_warnings(&analysis.warnings);
    arguments.common.write_json(&sources, &analysis)?;
    if arguments.report.asked() {
        let (complete, noise) = plan::prepared(&session, &options)?;
        let problem = plan::states::problem_by_test(&complete, noise)?;
        let document = crate::report::pages::plan::document(&problem, &analysis)?;
        arguments.report.write(&document, (&session, &sources), arguments.common.seed)?;
    }
    Ok(())
}

/// Poses, without the data of the session unless only they tell where a socket is.
fn poses(arguments: &PlanArguments, outputs: &output::Outputs, tables: bool) -> Result<(), Failure> {
    let reading = ReadOptions { read_data: false, ..arguments.session.options() };
    let source = files::text(&arguments.session.session, "the session file")?;
    let (mut session, mut sources) = files::session_of(&source, &reading)?;
    if let Some(test) = without_place(&session, &arguments.poses.tests(&session)?).first() {
        let with_data = files::session_of(&source, &arguments.session.options());
        (session, sources) = with_data.map_err(|error| {
            Failure::Other(format!(
                "test \"{}\" states no `socket_mm`, and its data do not tell where its socket is: {error}",
                test.name
            ))
        })?;
    }
    outputs.refuse_overwrite_of_sources(&sources)?;
    let noise_mm = arguments.noise_um.map(|um| positive("--noise-um", um)).transpose()?;
    let found = arguments.poses.run(&session, noise_mm, arguments.common.seed, tables)?;
    print_warnings(&found.warnings);
    arguments.common.write_json(&sources, &found)
}

/// Proposed tests, and ranges that suffice.
#[derive(serde::Serialize, schemars::JsonSchema)]
pub struct NextTest {
    /// Standard deviation of one scalar reading, µm.
    noise_um: f64,
    /// Source of `noise_um`: `stated` by session or user, `repeats` or `residual` of its readings, or `assumed`.
    noise_source: NoiseSource,
    /// The tests that `--improve` or `--separate` proposes.
    #[serde(skip_serializing_if = "Option::is_none")]
    improvement: Option<plan::improve::Improvement>,
    /// The sweeps that `--range` examines.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    ranges: Vec<plan::range::Shrinkage>,
}

fn next_test(
    arguments: &PlanArguments,
    (session, sources): (&Session, &SourceMap),
    options: &PlanOptions,
    tables: bool,
) -> Result<(), Failure> {
    let (complete, noise) = plan::prepared(session, options)?;
    let problem = plan::states::problem_by_test(&complete, noise)?;
    let (noise_um, noise_source) = (problem.noise.sigma_mm * 1e3, problem.noise.source);
    let of_noise = crate::report::fit::noise(noise_um, noise_source);
    let improvement = if arguments.improve.asked() {
        let improvement = arguments.improve.run(&problem)?;
        if tables {
            say!("{of_noise}");
            improve::print(&improvement);
        }
        arguments.improve.write(&improvement, sources, &arguments.session)?;
        Some(improvement)
    } else {
        None
    };
    let ranges = if arguments.range { plan::range::shrinkages(&problem)? } else { Vec::new() };
    if arguments.range && tables {
        if improvement.is_none() {
            say!("{of_noise}");
        }
        output::print(&crate::report::next_test::ranges(&ranges));
    }
    let found = NextTest { noise_um, noise_source, improvement, ranges };
    arguments.common.write_json(sources, &found)?;
    if arguments.report.asked() {
        let document = crate::report::pages::next_test::document(&problem, found.improvement.as_ref(), &found.ranges);
        arguments.report.write(&document, (session, sources), arguments.common.seed)?;
    }
    Ok(())
}

/// Collisions, with the device where the R-tests of the session have it, else both on the table and in the spindle.
fn clearance(session: &Session, sizes: &str) -> Result<Vec<String>, Failure> {
    let numbers: Vec<f64> = sizes.split(',').filter_map(|size| size.trim().parse().ok()).collect();
    let &[spindle_mm, table_mm, device_height_mm, device_width_mm, shaft_mm, jig_mm] = numbers.as_slice() else {
        return Err(Failure::Other(format!(
            "`--clearance-mm {sizes}`: six lengths are expected: diameters of spindle and table, height and width of the device, shaft, jig"
        )));
    };
    values::SIZE_MM.all("--clearance-mm", &numbers)?;
    let settings: Vec<Setting> = session
        .tests
        .iter()
        .filter_map(|test| match &test.station {
            Station::RTest(rtest) => Some(rtest.setting),
            _ => None,
        })
        .collect();
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

/// A positive length in µm, converted to mm.
fn positive(flag: &str, um: f64) -> Result<f64, Failure> {
    Ok(values::DEVIATION_UM.check(flag, um)? * 1e-3)
}

/// Replaces the standard uncertainty of every set-up length that has a Gaussian prior.
fn set_priors(session: &mut Session, u_mm: f64) {
    use abbe::model::instrument::InternalUnit;
    for test in &mut session.tests {
        let unknowns = test.station.kind().unknowns();
        for (prior, unknown) in test.priors.iter_mut().zip(unknowns) {
            if matches!(prior, Prior::Gaussian(_)) && unknown.unit == InternalUnit::Millimetre {
                *prior = Prior::Gaussian(u_mm);
            }
        }
    }
}
