//! `abbe plan`.

mod digits;
pub mod improve;
mod patterns;
mod tables;

use abbe::identify::plan::clearance::Clearance;
use abbe::identify::plan::{self, PlanOptions};
use abbe::model::files::SourceMap;
use abbe::model::instrument::Station;
use abbe::model::instrument::rtest::Setting;
use abbe::model::session::limits::{LARGEST, MIN_UM};
use abbe::model::session::{Prior, Session};
use clap::Args;

use super::failure::Failure;
use super::fit::print_warnings;
use super::report::ReportArguments;
use super::{CommonArguments, SessionArguments, output, read_session};

/// `abbe plan SESSION`
#[derive(Args)]
pub struct PlanArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    faces: ReportArguments,
    /// Standard deviation of a reading, in place of the session's.
    #[arg(long, value_name = "UM")]
    noise_um: Option<f64>,
    /// Standard uncertainty of every set-up length, in place of the session's.
    #[arg(long, value_name = "UM")]
    setup_um: Option<f64>,
    /// One spindle ball stays mounted for all tests, whatever the session says.
    #[arg(long)]
    one_spindle_ball: bool,
    /// Take the planned movements even where there are data.
    #[arg(long)]
    planned: bool,
    /// Check that spindle and table stay clear when the table stands on end: diameters of spindle and table, height and width of the device,
    /// shaft from jig to ball, jig.
    #[arg(long, value_name = "DS,DT,H,W,L,T", conflicts_with_all = ["improve", "separate", "range"])]
    clearance_mm: Option<String>,
    /// Leave out what undeclared effects would do.
    #[arg(long)]
    no_effects: bool,
    #[command(flatten)]
    improve: improve::ImproveArguments,
    #[command(flatten)]
    patterns: patterns::PatternArguments,
    /// How far each sweep can shrink before an uncertainty doubles.
    #[arg(long)]
    range: bool,
}

/// Help of the command.
pub const EXAMPLES: &str = "Examples:
  abbe plan sessions/hermle-c600u/chapter5.toml
  abbe plan sessions/hermle-c600u/chapter5.toml --setup-um 1 --no-effects --json plan.json
  abbe plan sessions/hermle-c600u/chapter5.toml --improve 2 --bars-mm 50,100,150,300
  abbe plan sessions/hermle-c600u/chapter5.toml --separate EZC~C:h2,EAC~C:h1
  abbe plan sessions/hermle-c600u/chapter5.toml --patterns patterns.csv \\
      --error EY0A=10um --error EB0A=0.01deg";

/// Runs `abbe plan`.
pub fn run(arguments: &PlanArguments) -> Result<(), Failure> {
    arguments.faces.check()?;
    let outputs = arguments
        .common
        .outputs(&[arguments.patterns.file(), arguments.faces.file()])?;
    let tables = outputs.tables(arguments.common.quiet);
    let (mut session, sources) = read_session(&arguments.session, &outputs)?;
    if arguments.patterns.asked() {
        return arguments
            .patterns
            .run(&session, arguments.common.json.as_deref(), tables);
    }
    if let Some(u_um) = arguments.setup_um {
        set_priors(&mut session, positive("--setup-um", u_um)?);
    }
    if arguments.one_spindle_ball {
        session
            .tests
            .iter_mut()
            .for_each(|test| test.spindle_setup = "all tests".to_string());
    }
    let noise_mm = arguments
        .noise_um
        .map(|um| positive("--noise-um", um))
        .transpose()?;
    let options = PlanOptions {
        noise_mm,
        planned_only: arguments.planned,
        effects: !arguments.no_effects,
        reach_mm: arguments.improve.reach_mm()?,
    };
    if arguments.improve.asked() || arguments.range {
        return next_test(arguments, (&session, &sources), &options, tables);
    }
    let mut analysis = plan::analyse(&session, &options)?;
    if let Some(sizes) = &arguments.clearance_mm {
        analysis.warnings.extend(clearance(&session, sizes)?);
    }
    if tables {
        tables::print(&analysis);
    }
    print_warnings(&analysis.warnings);
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &analysis)?;
    }
    if arguments.faces.asked() {
        let (complete, noise) = plan::prepared(&session, &options)?;
        let problem = plan::states::problem_by_test(&complete, noise)?;
        let document = crate::report::plan::document(&problem, &analysis)?;
        let method = crate::report::plan::method(&analysis);
        arguments
            .faces
            .write(&document, &method, (&session, &sources), arguments.common.seed)?;
    }
    Ok(())
}

/// What `--improve`, `--separate` and `--range` ask for.
#[derive(serde::Serialize, schemars::JsonSchema)]
pub struct NextTest {
    #[serde(skip_serializing_if = "Option::is_none")]
    improvement: Option<plan::improve::Improvement>,
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
    let improvement = if arguments.improve.asked() {
        let improvement = arguments.improve.run(&problem)?;
        if tables {
            improve::print(&improvement);
        }
        Some(improvement)
    } else {
        None
    };
    let ranges = if arguments.range {
        plan::range::shrinkages(&problem)?
    } else {
        Vec::new()
    };
    if arguments.range && tables {
        improve::print_ranges(&ranges);
    }
    let found = NextTest { improvement, ranges };
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &found)?;
    }
    if arguments.faces.asked() {
        let document =
            crate::report::next_test::document(&problem, found.improvement.as_ref(), &found.ranges);
        let method = crate::report::next_test::method();
        arguments
            .faces
            .write(&document, &method, (session, sources), arguments.common.seed)?;
    }
    Ok(())
}

/// What would touch: with the device where the R-tests of the session have it, else on the table and in the spindle.
fn clearance(session: &Session, sizes: &str) -> Result<Vec<String>, Failure> {
    let numbers: Vec<f64> = sizes
        .split(',')
        .filter_map(|size| size.trim().parse().ok())
        .collect();
    let valid = |size: &f64| size.is_finite() && *size > 0.0;
    let &[
        spindle_mm,
        table_mm,
        device_height_mm,
        device_width_mm,
        shaft_mm,
        jig_mm,
    ] = numbers.as_slice()
    else {
        return Err(Failure::Other(format!(
            "`--clearance-mm {sizes}`: it takes six lengths: diameters of spindle and table, height and width of the device, shaft, jig"
        )));
    };
    if !numbers.iter().all(valid) {
        return Err(Failure::Other(format!(
            "`--clearance-mm {sizes}`: every length has to be positive"
        )));
    }
    let settings: Vec<Setting> = session
        .tests
        .iter()
        .filter_map(|test| match &test.station {
            Station::RTest(rtest) => Some(rtest.setting),
            _ => None,
        })
        .collect();
    let faults = [
        (Setting::Table, "device on the table"),
        (Setting::Spindle, "device in the spindle"),
    ]
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
        clearance
            .faults()
            .into_iter()
            .map(move |fault| format!("{words}: {fault}"))
    });
    Ok(faults.collect())
}

/// A length in µm that has to be positive, in mm.
fn positive(flag: &str, um: f64) -> Result<f64, Failure> {
    if (MIN_UM..=LARGEST).contains(&um) {
        Ok(um * 1e-3)
    } else {
        Err(Failure::Other(format!(
            "`{flag} {um}`: it has to be a positive number of µm, {MIN_UM:e} to {LARGEST:e}"
        )))
    }
}

/// Gives every set-up length that is known within an uncertainty this one.
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
