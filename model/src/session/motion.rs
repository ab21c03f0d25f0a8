//! How the axes move in a planned test.

use super::readings::Readings;
use super::{Session, Test, plan};
use crate::chain::Machine;
use crate::error::ModelError;
use crate::instrument::Station;

/// Most readings of one planned test.
pub const MAX_READINGS: usize = 1_000_000;

/// Pause between the tests of a planned session, s.
const BETWEEN_TESTS_S: f64 = 120.0;

/// The movement of a planned test, positions in mm and rad.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// One axis sweeps, the others stand.
    Sweep {
        /// Index of the axis in the machine.
        axis: usize,
        /// Where it starts.
        from: f64,
        /// Where it ends.
        to: f64,
        /// The step between readings.
        step: f64,
        /// Speed in mm/s or rad/s.
        speed: f64,
        /// How often it goes.
        runs: usize,
        /// Whether each run goes there and back as two traversals.
        both_directions: bool,
    },
    /// Two linear axes move on a circle.
    Circle {
        /// The first axis of the plane, by index.
        first: usize,
        /// The second.
        second: usize,
        /// mm.
        radius: f64,
        /// Centre, counted from the workpiece ball in the directions of R, mm.
        centre: [f64; 3],
        /// rad.
        from: f64,
        /// rad.
        to: f64,
        /// rad.
        step: f64,
        /// Path speed, mm/s.
        speed: f64,
        /// How often it goes.
        runs: usize,
        /// Whether each run goes there and back as two traversals.
        both_directions: bool,
    },
    /// A rotary axis turns and the linear axes keep the spindle ball at a constant offset from the workpiece ball.
    Follow {
        /// The rotary axis, by index.
        axis: usize,
        /// rad.
        from: f64,
        /// rad.
        to: f64,
        /// rad.
        step: f64,
        /// rad/s.
        speed: f64,
        /// How often it goes.
        runs: usize,
        /// Whether each run goes there and back as two traversals.
        both_directions: bool,
        /// Direction of the bar.
        offset: FollowOffset,
    },
    /// The states come from the data file.
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
    /// No bar: the tool point stays on the point of the table over which it stands before the axis turns.
    None,
    /// No bar: the tool point stays on the instrument's point of the table.
    Touching,
}

/// How many times the speed of the ball on its circle of `radius_mm` the programmed feed is, where a control reads a degree as a millimetre: with
/// the ball at `v = R·ω` and the rotary axis at `v·180/(π·R)` degrees,
///
/// ```text
/// F = v · √(1 + (180/(π·R))²)
/// ```
///
/// so that the ball goes at `F` *divided* by the root. Eq. (12) of Yamaji, Hamabata & Ihara (2014) multiplies: it gives the feed to be programmed
/// for a wanted speed, not the actual speed under a programmed feed.
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

/// The states that a test is planned to read at: positions, runs and times, with nothing observed yet.
///
/// A test without a movement of its own (`path = { kind = "list" }`) gives those of its data.
///
/// # Errors
/// If an axis would leave its travel, the balls cannot be kept where the path wants them, or there is no plan.
pub fn planned(machine: &Machine, test: &Test) -> Result<Readings, ModelError> {
    checked_plan(machine, test).map_err(|(message, help)| ModelError::Plan { message, help })
}

/// The plan of every test of a session, one after the other in time.
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

/// As [`planned`], a fault as message and help.
pub(crate) fn checked_plan(machine: &Machine, test: &Test) -> Result<Readings, (String, String)> {
    let mut readings = match &test.motion {
        Some(Motion::List) | None => {
            let Some(data) = &test.readings else {
                return Err((
                    format!(
                        "test \"{}\" has no movement to plan and no data to take its states from",
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

/// What an axis does beyond its travel, if one does.
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
            let outside = |q: f64| axis.kind.outside(q);
            Some(format!(
                "axis `{}` goes to {:.3} {unit}; its travel is {} to {} {unit}",
                axis.name,
                outside(*beyond),
                outside(least),
                outside(greatest),
                unit = axis.kind.unit(),
            ))
        })
}

/// The axes that a movement names.
pub(crate) fn moved(motion: Option<&Motion>) -> Vec<usize> {
    match motion {
        Some(Motion::Sweep { axis, .. } | Motion::Follow { axis, .. }) => vec![*axis],
        Some(Motion::Circle { first, second, .. }) => vec![*first, *second],
        Some(Motion::List) | None => Vec::new(),
    }
}

/// Puts linear axes that a circle does not move, and that the test leaves open, where the circle's centre lies in its plane.
pub(crate) fn stand(
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
    ) = (plan::pair(station), motion)
    {
        let open: Vec<usize> = plan::linear_axes(machine)
            .into_iter()
            .filter(|axis| !listed[*axis] || axis == first || axis == second)
            .collect();
        let placed = plan::placed(machine, &pair, at, &open, *centre);
        for axis in open {
            if axis != *first && axis != *second {
                at[axis] = placed.0[axis];
            }
        }
    }
}
