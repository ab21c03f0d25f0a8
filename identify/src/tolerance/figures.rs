//! Figures of tests with their uncertainties.

use std::f64::consts::SQRT_2;

use abbe_model::instrument::ballbar::BAR;
use abbe_model::session::tolerance::TestFigure;
use abbe_model::session::{Prior, Session};

use crate::circular::{CircularTest, DirectionFigures};

/// Measured values of one quantity, all of which have to be within its limits.
pub(super) struct Measured {
    pub values: Vec<f64>,
    pub u: f64,
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
    let range_um = mean_um * SQRT_2;
    let of_directions =
        |value: fn(&DirectionFigures) -> f64| -> Vec<f64> { found.directions.iter().map(value).collect() };
    let both = |value: Option<f64>| value.into_iter().collect::<Vec<f64>>();
    let (values, u_um) = match figure {
        TestFigure::CircularDeviation => (of_directions(|direction| direction.circular_deviation_um), range_um),
        TestFigure::BidirectionalCircularDeviation => (both(found.bidirectional_circular_deviation_um), range_um),
        TestFigure::Hysteresis => (both(found.hysteresis_um), range_um),
        TestFigure::SynchronousErrorMotion => {
            (some(found, |direction| direction.synchronous_error_motion_um), range_um)
        }
        // The range of single runs, not of their mean.
        TestFigure::AsynchronousErrorMotion => {
            (some(found, |direction| direction.asynchronous_error_motion_um), noise_um * SQRT_2)
        }
        TestFigure::MeanBidirectionalRadialDeviation => {
            (both(found.mean_bidirectional_radial_deviation_um), mean_um.hypot(bar_u_um(session, test)?))
        }
        TestFigure::RadialDeviation => {
            let ends = [
                of_directions(|direction| direction.radial_deviation_max_um),
                of_directions(|direction| direction.radial_deviation_min_um),
            ];
            (ends.concat(), mean_um.hypot(bar_u_um(session, test)?))
        }
    };
    if values.is_empty() {
        return Err(format!(
            "test \"{test}\" has no {}: it needs {}",
            figure.word().replace('_', " "),
            match figure {
                TestFigure::SynchronousErrorMotion => "a full turn of a rotary axis, with the linear axes at rest",
                TestFigure::AsynchronousErrorMotion =>
                    "a full turn of a rotary axis, with the linear axes at rest, and several runs in one direction",
                _ => "both directions",
            }
        ));
    }
    if contains_set_up(found, figure) && balls_are_uncertain(session, test) {
        return Err(format!(
            "{} of test \"{test}\" contains the set-up of the balls, which its uncertainty does not cover",
            figure.word().replace('_', " ")
        ));
    }
    let u = u_um.hypot(instrument_u_um);
    if u <= 0.0 {
        return Err("the uncertainty is not quantified: state `instrument_u_um`".to_string());
    }
    Ok(Measured { values, u, unit: "um".to_string() })
}

/// Whether a figure contains the set-up of the balls: lengths of a rotary sweep do, and every figure of an arc from
/// which no centre is removed.
fn contains_set_up(found: &CircularTest, figure: TestFigure) -> bool {
    const HALF_TURN_DEG: f64 = 180.0 * 0.99;
    let is_length = matches!(figure, TestFigure::RadialDeviation | TestFigure::MeanBidirectionalRadialDeviation);
    // Differences between runs and directions do not contain it.
    let is_difference = matches!(figure, TestFigure::AsynchronousErrorMotion | TestFigure::Hysteresis);
    (found.radius_mm.is_none() && is_length) || (found.arc_deg < HALF_TURN_DEG && !is_difference)
}

/// Whether the position of a ball of a test is not known exactly.
fn balls_are_uncertain(session: &Session, test: &str) -> bool {
    let found = session.tests.iter().find(|other| other.name == test);
    found.is_some_and(|test| test.priors.iter().take(BAR).any(|prior| !matches!(prior, Prior::Known)))
}

/// The values of both directions that exist.
fn some(found: &CircularTest, value: fn(&DirectionFigures) -> Option<f64>) -> Vec<f64> {
    found.directions.iter().filter_map(value).collect()
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
