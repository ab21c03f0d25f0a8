//! Completes a plan to a session with readings: its planned states, each with the reading of a machine without errors.

use std::sync::Arc;

use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test, motion, planned};

use crate::error::IdentifyError;
use crate::heldout::Folds;
use crate::noise::{Noise, NoiseSource};
use crate::problem::Problem;
use crate::unit::ReadingUnit;

/// Assumed pause between two tests, s.
const BETWEEN_TESTS_S: f64 = 120.0;

/// A session in which every test has readings: its data, or its planned states with nominal readings. With
/// `planned_only`, a test with a movement uses its planned states even if it has data.
///
/// # Errors
/// If a test has neither data nor a movement, or a movement leaves the travel.
pub fn complete(session: &Session, planned_only: bool) -> Result<Session, IdentifyError> {
    let mut complete = session.clone();
    let mut clock_s = 0.0;
    for test in &mut complete.tests {
        let moves = !matches!(test.motion, None | Some(motion::Motion::List));
        if test.readings.is_none() || (planned_only && moves) {
            let mut readings = planned(session, test)?;
            readings.time_s.iter_mut().for_each(|time| *time += clock_s);
            test.readings = Some(Arc::new(readings));
        }
        let end = test.readings.as_ref().and_then(|readings| readings.time_s.last().copied());
        clock_s = end.map_or(clock_s, |end| end + BETWEEN_TESTS_S);
    }
    Ok(complete)
}

/// The planned states of one test with the readings of a machine without errors.
///
/// # Errors
/// If the movement leaves the travel or there is none.
pub fn planned(session: &Session, test: &Test) -> Result<Readings, IdentifyError> {
    let mut readings = planned::planned(&session.machine, test)?;
    let model = TestModel::new(Arc::clone(&session.machine), test.station.clone(), &readings);
    readings.observed = model.readings(&SlotValues::zero(model.slots()));
    readings.channels_to_columns(&session.machine, &test.station);
    Ok(readings)
}

/// The least-squares problem of a complete session. Its folds are the tests, so that every test has its own triangular
/// factor.
///
/// # Errors
/// See [`Problem::new`].
pub fn problem_by_test(session: &Session, noise: Noise) -> Result<Problem, IdentifyError> {
    let mut problem = Problem::new(session, noise, 0)?;
    fold_by_test(&mut problem);
    Ok(problem)
}

/// Makes the folds of a problem its tests.
pub fn fold_by_test(problem: &mut Problem) {
    problem.folds = Folds::by_test(&problem.models);
}

/// Assumed noise of a reading if neither the session nor its data determine it: 1 µm, the accuracy that makers of ball
/// bars state.
const ASSUMED_NOISE_MM: f64 = 1e-3;

/// The noise of readings of which nothing is known.
pub(crate) fn assumed_noise() -> Noise {
    Noise::white(ASSUMED_NOISE_MM, NoiseSource::Assumed)
}

/// The warning about a noise that the session does not state.
pub(crate) fn noise_warning(noise: &Noise, unit: ReadingUnit) -> Option<String> {
    let found = match noise.source {
        NoiseSource::Stated => return None,
        NoiseSource::Assumed => "is assumed",
        NoiseSource::Repeats | NoiseSource::Residual | NoiseSource::Model => "is estimated from its data",
    };
    Some(format!("the session states no `{}`: {} {found}", unit.noise_key(), unit.text(noise.sigma_mm * 1e3, 2)))
}

/// The noise model of a plan: that of the session, that of its data, or the assumed one.
///
/// # Errors
/// If the data cannot be fitted.
pub(crate) fn noise_of(session: &Session) -> Result<Noise, IdentifyError> {
    if let Some(sigma) = session.stated_noise_mm() {
        return Ok(Noise::white(sigma, NoiseSource::Stated));
    }
    if session.tests.iter().all(|test| test.readings.is_some()) {
        return Ok(crate::fit::prepare(session, 1)?.0.noise);
    }
    Ok(assumed_noise())
}
