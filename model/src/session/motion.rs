//! Motion of the axes in a planned test.

use super::readings::Readings;
use super::{Session, Test, plan};
use crate::chain::Machine;
use crate::error::ModelError;
use crate::instrument::Station;

/// Largest number of readings of one planned test.
pub const MAX_READINGS: usize = 1_000_000;

/// Pause between the tests of a planned session, s.
const BETWEEN_TESTS_S: f64 = 120.0;

/// The motion of a planned test, positions in mm and rad.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// One axis moves, the others are fixed.
    Sweep {
        /// Index of the axis in the machine.
        axis: usize,
        /// Start position.
        from: f64,
        /// End position.
        to: f64,
        /// The step between readings.
        step: f64,
        /// Speed in mm/s or rad/s.
        speed: f64,
        /// Number of runs.
        runs: usize,
        /// Whether each run consists of a forward and a backward traversal.
        both_directions: bool,
    },
    /// Two linear axes move on a circle.
    Circle {
        /// The first axis of the plane, by index.
        first: usize,
        /// The second.
        second: usize,
        /// Radius, mm.
        radius: f64,
        /// Centre relative to the workpiece ball, along the directions of R, mm.
        centre: [f64; 3],
        /// Start angle, rad.
        from: f64,
        /// End angle, rad.
        to: f64,
        /// Angular step between readings, rad.
        step: f64,
        /// Path speed, mm/s.
        speed: f64,
        /// Number of runs.
        runs: usize,
        /// Whether each run consists of a forward and a backward traversal.
        both_directions: bool,
    },
    /// A rotary axis rotates and the linear axes keep the spindle ball at a constant offset from the workpiece ball.
    Follow {
        /// The rotary axis, by index.
        axis: usize,
        /// Start angle, rad.
        from: f64,
        /// End angle, rad.
        to: f64,
        /// Angular step between readings, rad.
        step: f64,
        /// Speed of the rotary axis, rad/s.
        speed: f64,
        /// Number of runs.
        runs: usize,
        /// Whether each run consists of a forward and a backward traversal.
        both_directions: bool,
        /// Direction of the bar.
        offset: FollowOffset,
    },
    /// The data file contains the states.
    List,
}

/// Direction of the bar while linear axes follow a rotary axis (ISO 10791-6, BK1 and BK2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FollowOffset {
    /// Away from the axis.
    Radial,
    /// Along the path of the workpiece ball.
    Tangential,
    /// Along the axis.
    Axial,
    /// No bar: the tool point follows the point of the table below it at the start.
    None,
    /// No bar: the tool point follows the instrument's point of the table.
    Touching,
}

/// Ratio of the programmed feed to the speed of the ball on its circle of `radius_mm`, for a control that treats a degree as a
/// millimetre. The ball moves at `v = R·ω` and the rotary axis at `v·180/(π·R)` degrees,
///
/// ```text
/// F = v · √(1 + (180/(π·R))²)
/// ```
///
/// so that the speed of the ball is `F` *divided* by the root. Eq. (12) of Yamaji, Hamabata & Ihara (2014) multiplies: it gives the feed
/// to be programmed for a desired speed, not the actual speed for a programmed feed.
///
/// ```
/// use abbe_model::session::motion::programmed_over_path_feed;
///
/// // On a circle of 180/π mm a degree is a millimetre.
/// assert!((programmed_over_path_feed(180.0 / std::f64::consts::PI) - 2.0_f64.sqrt()).abs() < 1e-12);
/// ```
pub fn programmed_over_path_feed(radius_mm: f64) -> f64 {
    1.0_f64.hypot(180.0 / (std::f64::consts::PI * radius_mm))
}

/// The planned states of a test: positions, runs and times, with no observations.
///
/// For a test without a motion of its own (`path = { kind = "list" }`), the states of its data.
///
/// # Errors
/// If an axis would exceed its travel, if the balls cannot be placed on the path, or if there is no plan.
pub fn planned(machine: &Machine, test: &Test) -> Result<Readings, ModelError> {
    checked_plan(machine, test).map_err(|(message, help)| ModelError::Plan { message, help })
}

/// The planned states of every test of a session, consecutive in time.
///
/// # Errors
/// As [`planned`].
pub fn planned_session(session: &Session) -> Result<Vec<Readings>, ModelError> {
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
pub(crate) fn checked_plan(machine: &Machine, test: &Test) -> Result<Readings, (String, String)> {
    let mut readings = match &test.motion {
        Some(Motion::List) | None => {
            let Some(data) = &test.readings else {
                return Err((
                    format!(
                        "test \"{}\" has neither a motion nor data from which its states follow",
                        test.name
                    ),
                    "add `sweep = { … }` or `path = { … }`, or read its data".into(),
                ));
            };
            return Ok(data.clone());
        }
        Some(motion) => plan::states(machine, test, motion)?,
    };
    readings.coordinates = test.station.kind().coordinates();
    readings.observed = vec![0.0; readings.rows() * readings.coordinates];
    match beyond_travel(machine, &readings) {
        None => Ok(readings),
        Some(beyond) => Err((
            format!("test \"{}\": {beyond}", test.name),
            "plan within the travel of the machine, or correct `travel_mm` / `travel_deg`".into(),
        )),
    }
}

/// A description of the first axis that exceeds its travel.
pub(crate) fn beyond_travel(machine: &Machine, readings: &Readings) -> Option<String> {
    machine
        .axes
        .iter()
        .zip(&readings.positions)
        .find_map(|(axis, positions)| {
            let [least, greatest] = axis.travel?;
            let slack = 1e-9 * (1.0 + least.abs().max(greatest.abs()));
            let beyond = positions
                .iter()
                .find(|&&q| q < least - slack || q > greatest + slack)?;
            let displayed = |q: f64| axis.kind.to_display(q);
            Some(format!(
                "axis `{}` goes to {:.3} {unit}; its travel is {} to {} {unit}",
                axis.name,
                displayed(*beyond),
                displayed(least),
                displayed(greatest),
                unit = axis.kind.unit(),
            ))
        })
}

/// The axes that a motion names.
pub(crate) fn named_axes(motion: Option<&Motion>) -> Vec<usize> {
    match motion {
        Some(Motion::Sweep { axis, .. } | Motion::Follow { axis, .. }) => vec![*axis],
        Some(Motion::Circle { first, second, .. }) => vec![*first, *second],
        Some(Motion::List) | None => Vec::new(),
    }
}

/// Sets linear axes that a circle does not move, and that the test does not state, so that the centre of the circle lies in its plane.
pub(crate) fn centre_circle(
    machine: &Machine,
    station: &Station<f64>,
    motion: Option<&Motion>,
    listed: &[bool],
    at: &mut [f64],
) {
    if let (
        Some(pair),
        Some(Motion::Circle {
            first,
            second,
            centre,
            ..
        }),
    ) = (plan::bar_between_points(station), motion)
    {
        let open: Vec<usize> = plan::linear_axes(machine)
            .into_iter()
            .filter(|axis| !listed[*axis] || axis == first || axis == second)
            .collect();
        let placed = plan::solve_linear_axes(machine, &pair, at, &open, *centre);
        for axis in open {
            if axis != *first && axis != *second {
                at[axis] = placed.0[axis];
            }
        }
    }
}
