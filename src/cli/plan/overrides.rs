//! Noise and priors of the command line in place of those of the session.

use abbe::model::session::{Prior, Session};

use crate::cli::failure::Failure;
use crate::cli::values;

/// Replaces the standard uncertainty of every set-up length that has a Gaussian prior, and mounts one spindle ball.
pub fn apply(session: &mut Session, setup_um: Option<f64>, one_spindle_ball: bool) -> Result<(), Failure> {
    if let Some(u_um) = setup_um {
        set_priors(session, values::length_um("--setup-um", u_um)?);
    }
    if one_spindle_ball {
        session.tests.iter_mut().for_each(|test| test.spindle_setup = "all tests".to_string());
    }
    Ok(())
}

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
