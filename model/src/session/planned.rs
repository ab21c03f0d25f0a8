//! Planned states of tests: positions, runs and times that follow from their motions, within the travel of the axes.

use super::motion::{Motion, Moved};
use super::readings::Readings;
use super::{Session, Test, trajectory};
use crate::Diagnostic;
use crate::chain::Machine;
use crate::instrument::{Checked, Station};
use crate::words::number;

/// Pause between the tests of a planned session, s.
const BETWEEN_TESTS_S: f64 = 120.0;

/// The planned states of a test: positions, runs and times, with no observations.
///
/// For a test without a motion of its own (`path = { kind = "list" }`), the states of its data.
///
/// # Errors
/// If an axis would exceed its travel, if the balls cannot be placed on the path, or if there is no plan.
pub fn planned(machine: &Machine, test: &Test) -> Result<Readings, Diagnostic> {
    checked_plan(machine, test).map_err(|(message, help)| Diagnostic::session(message, help))
}

/// Checks that the instrument reaches at every position of a planned motion, as a program needs it.
///
/// # Errors
/// As [`planned`], and if it does not reach; the message names the position.
pub fn reaches(machine: &Machine, test: &Test) -> Result<(), Diagnostic> {
    let readings = planned(machine, test)?;
    let found = test.station.check_planned(&Checked { machine, test: &test.name, readings: &readings });
    found.map_err(|(message, help)| Diagnostic::session(message, help))
}

/// The planned states of a test that its instrument reads as it is set up; `None` if an axis would leave its travel, or a
/// reading would be none.
pub fn feasible(machine: &Machine, test: &Test) -> Option<Readings> {
    let readings = checked_plan(machine, test).ok()?;
    let checked = Checked { machine, test: &test.name, readings: &readings };
    test.station.check_set_up(&checked).ok()?;
    Some(readings)
}

/// The planned states of every test of a session, consecutive in time.
///
/// # Errors
/// As [`planned`].
pub fn planned_session(session: &Session) -> Result<Vec<Readings>, Diagnostic> {
    let mut start_s = 0.0;
    session
        .tests
        .iter()
        .map(|test| {
            let mut readings = planned(&session.machine, test)?;
            for time in &mut readings.time_s {
                *time += start_s;
            }
            if let Some(end_s) = readings.time_s.last() {
                start_s = end_s + BETWEEN_TESTS_S;
            }
            Ok(readings)
        })
        .collect()
}

/// As [`planned`], with an error as message and help.
pub fn checked_plan(machine: &Machine, test: &Test) -> Result<Readings, (String, String)> {
    let Some(motion) = &test.motion else {
        return test.readings.as_deref().cloned().ok_or_else(|| {
            (
                format!("test \"{}\" has neither a motion nor data from which its states follow", test.name),
                "add `sweep = { … }` or `path = { … }`, or read its data".into(),
            )
        });
    };
    let mut readings = trajectory::states(machine, test, motion)?;
    readings.channels = test.station.channels().len();
    readings.observed = vec![0.0; readings.rows() * readings.channels];
    match beyond_travel(machine, &readings) {
        None => Ok(readings),
        Some(beyond) => Err((
            format!("test \"{}\": {beyond}", test.name),
            "plan within the travel of the machine, or correct `travel_mm` / `travel_deg`".into(),
        )),
    }
}

/// A description of the first axis that exceeds its travel.
pub fn beyond_travel(machine: &Machine, readings: &Readings) -> Option<String> {
    machine.axes.iter().zip(&readings.positions).find_map(|(axis, positions)| {
        let [least, greatest] = axis.travel?;
        let slack = 1e-9 * (1.0 + least.abs().max(greatest.abs()));
        let beyond = positions.iter().find(|&&q| q < least - slack || q > greatest + slack)?;
        let displayed = |q: f64| axis.kind.to_display(q);
        Some(format!(
            "axis `{}` goes to {:.3} {unit}; its travel is {} to {} {unit}",
            axis.name,
            displayed(*beyond),
            number(displayed(least)),
            number(displayed(greatest)),
            unit = axis.kind.unit(),
        ))
    })
}

/// Sets linear axes that a circle does not move, and that the test does not state, so that the centre of the circle
/// lies in its plane.
pub fn centre_circle(
    machine: &Machine,
    station: &Station<f64>,
    motion: Option<&Motion>,
    listed: &[bool],
    at: &mut [f64],
) {
    let circle = motion.and_then(|Motion { moved, .. }| match moved {
        Moved::Circle { axes, centre, .. } => Some((axes, centre)),
        _ => None,
    });
    let (Some(pair), Some((axes, centre))) = (station.between_points(), circle) else { return };
    let is_open = |axis: &usize| !listed[*axis] || axes.contains(axis);
    let open: Vec<usize> = trajectory::linear_axes(machine).into_iter().filter(is_open).collect();
    let (placed, _) = trajectory::solve_linear_axes(machine, &pair, at, &open, *centre);
    for axis in open.into_iter().filter(|axis| !axes.contains(axis)) {
        at[axis] = placed[axis];
    }
}
