//! Completes a plan to a session with readings: its planned states, each with the reading of a machine without errors.

use std::sync::Arc;

use abbe_identify::heldout::Folds;
use abbe_identify::noise::{Noise, NoiseSource};
use abbe_identify::problem::Problem;
use abbe_identify::start;
use abbe_model::Diagnostic;
use abbe_model::instrument::Station;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test, planned};
use abbe_model::unit::Unit;

/// Assumed pause between two tests, s.
const BETWEEN_TESTS_S: f64 = 120.0;

/// A session in which every test has readings: its data, or its planned states with nominal readings. With
/// `planned_only`, a test with a movement uses its planned states even if it has data. An instrument that data of the
/// session place stands there in its planned tests too.
///
/// # Errors
/// If a test has neither data nor a movement, or a movement leaves the travel.
pub fn complete(session: &Session, planned_only: bool) -> Result<Session, Diagnostic> {
    let mut complete = session.clone();
    let mut clock_s = 0.0;
    let placed = start::stations(session, &session.tests);
    for (test, station) in complete.tests.iter_mut().zip(&placed) {
        if test.readings.is_none() || (planned_only && test.motion.is_some()) {
            let mut readings = planned(session, test, station)?;
            readings.time_s.iter_mut().for_each(|time| *time += clock_s);
            test.readings = Some(Arc::new(readings));
        }
        let end = test.readings.as_ref().and_then(|readings| readings.time_s.last().copied());
        clock_s = end.map_or(clock_s, |end| end + BETWEEN_TESTS_S);
    }
    Ok(complete)
}

/// The planned states of one test with the readings of a machine without errors, of the instrument where it stands.
///
/// # Errors
/// If the movement leaves the travel or there is none.
pub fn planned(session: &Session, test: &Test, station: &Station<f64>) -> Result<Readings, Diagnostic> {
    let mut readings = planned::planned(&session.machine, test)?;
    let model = TestModel::new(Arc::clone(&session.machine), station.clone(), &readings);
    readings.observed = model.readings(&SlotValues::zero(model.slots()));
    readings.channels_to_columns(&session.machine, station);
    Ok(readings)
}

/// The least-squares problem of a complete session. Its folds are the tests, so that every test has its own triangular
/// factor.
///
/// # Errors
/// See [`Problem::new`].
pub fn problem_by_test(session: &Session, noise: Noise) -> Result<Problem, Diagnostic> {
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
pub(crate) fn noise_warning(noise: &Noise, unit: Unit) -> Option<String> {
    let found = match noise.source {
        NoiseSource::Stated => return None,
        NoiseSource::Assumed => "is assumed",
        NoiseSource::Repeats | NoiseSource::Targets | NoiseSource::Residual | NoiseSource::Model => {
            "is estimated from its data"
        }
    };
    Some(format!("the session states no `noise_{unit}`: {} {found}", unit.text(noise.sigma_mm * 1e3, 2)))
}

/// The noise model of a plan: that of the session, that of its data, or the assumed one.
///
/// # Errors
/// If the data cannot be fitted.
pub(crate) fn noise_of(session: &Session) -> Result<Noise, Diagnostic> {
    if let Some(sigma) = session.stated_noise_mm() {
        return Ok(Noise::white(sigma, NoiseSource::Stated));
    }
    if session.tests.iter().all(|test| test.readings.is_some()) {
        return Ok(abbe_identify::fit::prepare(session, 1)?.0.noise);
    }
    Ok(assumed_noise())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::noise::{Noise, NoiseSource};
    use abbe_identify::series::paths::set_ups;

    use super::{complete, problem_by_test};

    /// The C tests of Jiang (2014): the pivot turns on a circle of 100 mm about Z, and the spindle ball stays where the
    /// extended bar reaches it, √(R_e² − R²) above.
    #[test]
    fn the_pivot_turns_about_the_spindle_ball() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/chapter5.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let plan = complete(&session, true).unwrap();
        let problem = problem_by_test(&plan, Noise::white(3e-4, NoiseSource::Stated)).unwrap();
        let found = set_ups(&problem);
        let c150 = found.iter().find(|path| path.test == "C150").unwrap();
        for (workpiece, tool) in c150.workpiece_mm.iter().zip(&c150.tool_mm) {
            assert!((workpiece[0].hypot(workpiece[1]) - 100.0).abs() < 1e-9 && workpiece[2].abs() < 1e-9);
            assert!(tool[0].abs() < 1e-9 && (tool[2] - (149.9946_f64.powi(2) - 1e4).sqrt()).abs() < 1e-9);
        }
        let names: Vec<&str> = c150.axes.iter().map(|axis| axis.0.as_str()).collect();
        assert_eq!((names, c150.is_path), (vec!["C", "A"], true));
    }
}
