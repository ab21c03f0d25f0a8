//! `abbe plan`.

mod improve;
mod tables;

use abbe::identify::plan::{self, PlanOptions};
use abbe::model::session::{Prior, Session};
use clap::Args;

use super::failure::Failure;
use super::{CommonArguments, SessionArguments, output, read_session};

/// `abbe plan SESSION`
#[derive(Args)]
pub struct PlanArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    /// Standard deviation of a reading, in place of the session's.
    #[arg(long, value_name = "UM")]
    noise_um: Option<f64>,
    /// Standard uncertainty of every set-up length, in place of the session's.
    #[arg(long, value_name = "UM")]
    setup_um: Option<f64>,
    /// Take the planned movements even where there are data.
    #[arg(long)]
    planned: bool,
    /// Leave out what undeclared effects would do.
    #[arg(long)]
    no_effects: bool,
    #[command(flatten)]
    improve: improve::ImproveArguments,
    /// How far each sweep can shrink before an uncertainty doubles.
    #[arg(long)]
    range: bool,
}

/// Help of the command.
pub const EXAMPLES: &str = "Examples:
  abbe plan sessions/hermle-c600u/chapter5.toml
  abbe plan sessions/hermle-c600u/chapter5.toml --setup-um 1 --no-effects --json plan.json
  abbe plan sessions/hermle-c600u/chapter5.toml --improve 2 --bars-mm 50,100,150,300
  abbe plan sessions/hermle-c600u/chapter5.toml --separate EZC~C:h2,EAC~C:h1";

/// Runs `abbe plan`.
pub fn run(arguments: &PlanArguments) -> Result<(), Failure> {
    let mut session = read_session(&arguments.session)?;
    if let Some(u_um) = arguments.setup_um {
        set_priors(&mut session, positive("--setup-um", u_um)?);
    }
    let noise_mm = arguments
        .noise_um
        .map(|um| positive("--noise-um", um))
        .transpose()?;
    let options = PlanOptions {
        noise_mm,
        planned_only: arguments.planned,
        effects: !arguments.no_effects,
    };
    if arguments.improve.asked() || arguments.range {
        return next_test(arguments, &session, &options);
    }
    let analysis = plan::analyse(&session, &options)?;
    tables::print(&analysis);
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &analysis)?;
    }
    Ok(())
}

/// What `--improve`, `--separate` and `--range` ask for.
#[derive(serde::Serialize)]
struct NextTest {
    #[serde(skip_serializing_if = "Option::is_none")]
    improvement: Option<plan::improve::Improvement>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    ranges: Vec<plan::range::Shrinkage>,
}

fn next_test(arguments: &PlanArguments, session: &Session, options: &PlanOptions) -> Result<(), Failure> {
    let (complete, noise) = plan::prepared(session, options)?;
    let problem = plan::states::problem_by_test(&complete, noise)?;
    let improvement = if arguments.improve.asked() {
        let improvement = arguments.improve.run(&problem)?;
        improve::print(&improvement);
        Some(improvement)
    } else {
        None
    };
    let ranges = if arguments.range {
        plan::range::shrinkages(&problem)?
    } else {
        Vec::new()
    };
    if arguments.range {
        improve::print_ranges(&ranges);
    }
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &NextTest { improvement, ranges })?;
    }
    Ok(())
}

/// A length in µm that has to be positive, in mm.
fn positive(flag: &str, um: f64) -> Result<f64, Failure> {
    if um.is_finite() && um > 0.0 {
        Ok(um * 1e-3)
    } else {
        Err(Failure::Other(format!(
            "`{flag} {um}`: it has to be a positive number of µm"
        )))
    }
}

/// Gives every set-up length that is known within an uncertainty this one.
fn set_priors(session: &mut Session, u_mm: f64) {
    use abbe::model::instrument::InsideUnit;
    for test in &mut session.tests {
        let unknowns = test.station.kind().unknowns();
        for (prior, unknown) in test.priors.iter_mut().zip(unknowns) {
            if matches!(prior, Prior::Gaussian(_)) && unknown.unit == InsideUnit::Millimetre {
                *prior = Prior::Gaussian(u_mm);
            }
        }
    }
}
