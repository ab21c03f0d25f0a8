//! Figures of tests with their uncertainties.

use std::f64::consts::SQRT_2;

use abbe_model::instrument::ballbar::BAR;
use abbe_model::session::tolerance::TestFigure;
use abbe_model::session::{Prior, Session};

use crate::circular::CircularTest;
use crate::figure::{self, Figure};

/// Measured values of one quantity with their standard uncertainties. All have to be within its limits.
pub(super) struct Measured {
    pub values: Vec<(f64, f64)>,
    pub unit: String,
}

/// A figure of a test, or why there is none.
pub(super) fn measured(
    session: &Session,
    circular: &[CircularTest],
    test: &str,
    figure: TestFigure,
    noise_um: f64,
    instrument_u_um: f64,
) -> Result<Measured, String> {
    let Some(found) = circular.iter().find(|found| found.test == test) else {
        return Err(format!("test \"{test}\" has no circular figures: it has no readings, or its path is no circle"));
    };
    let runs = found.directions.iter().map(|direction| direction.runs).min().unwrap_or(1).max(1) as f64;
    let mean_um = noise_um / runs.sqrt();
    let u_um = match figure {
        // The range of single runs, not of their mean.
        TestFigure::AsynchronousErrorMotion => noise_um * SQRT_2,
        TestFigure::MeanBidirectionalRadialDeviation | TestFigure::RadialDeviation => {
            mean_um.hypot(bar_u_um(session, test)?)
        }
        _ => mean_um * SQRT_2,
    };
    let ends = ["max", "min"].map(|end| format!("{}_{end}", figure.word()));
    let ids = if figure == TestFigure::RadialDeviation { ends.to_vec() } else { vec![figure.word().to_string()] };
    let lists = || found.directions.iter().map(|direction| &direction.figures).chain([&found.figures]);
    let values: Vec<&Figure> = ids.iter().flat_map(|id| lists().filter_map(|list| figure::find(list, id))).collect();
    if values.is_empty() {
        const ERROR_MOTION: &str =
            "a full turn of a rotary axis, with the linear axes at rest and the bar radial to the axis";
        return Err(format!(
            "test \"{test}\" has no {}: it needs {}",
            figure.word().replace('_', " "),
            match figure {
                TestFigure::SynchronousErrorMotion => ERROR_MOTION.to_string(),
                TestFigure::AsynchronousErrorMotion => format!("{ERROR_MOTION}, and several runs in one direction"),
                _ => "both directions".to_string(),
            }
        ));
    }
    if values.iter().any(|found| found.set_up_u.is_infinite()) {
        return Err(format!(
            "{} of test \"{test}\" contains the position of a ball that is not known: state workpiece_ball_u_um and \
             spindle_ball_u_um",
            figure.word().replace('_', " ")
        ));
    }
    let with_u = |found: &Figure| (found.value, u_um.hypot(instrument_u_um).hypot(found.set_up_u));
    let values: Vec<(f64, f64)> = values.into_iter().map(with_u).collect();
    if values.iter().any(|(_, u)| *u <= 0.0) {
        return Err("the uncertainty is not quantified: state `instrument_u_um`".to_string());
    }
    Ok(Measured { values, unit: "um".to_string() })
}

/// Standard uncertainty of the length of the bar of a test, µm; the reason if nothing is known about the length.
fn bar_u_um(session: &Session, test: &str) -> Result<f64, String> {
    let found = session.tests.iter().find(|other| other.name == test);
    match found.and_then(|test| test.priors.get(BAR)) {
        Some(Prior::Gaussian(u)) => Ok(u * 1e3),
        Some(Prior::Free) => Err("the bar length is not calibrated: state bar_u_um".to_string()),
        _ => Ok(0.0),
    }
}
