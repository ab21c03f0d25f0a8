//! `abbe plan`.

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
}

/// Help of the command.
pub const EXAMPLES: &str = "Examples:
  abbe plan sessions/hermle-c600u/chapter5.toml
  abbe plan sessions/hermle-c600u/chapter5.toml --setup-um 1 --no-effects --json plan.json";

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
    let analysis = plan::analyse(&session, &options)?;
    tables::print(&analysis);
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &analysis)?;
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
