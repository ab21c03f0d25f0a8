//! Motion of the axes in a planned test.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest number of readings of one planned test.
pub const MAX_READINGS: usize = 1_000_000;

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
    /// Linear axes move on a line: along a diagonal of their travels.
    Line {
        /// The axes that move, by index, in the order in which they do so in turn.
        axes: Vec<usize>,
        /// Positions of the axes at the start of the line and at its end, mm.
        ends: Vec<[f64; 2]>,
        /// Start of the motion, as a distance along the line, mm.
        from: f64,
        /// Its end.
        to: f64,
        /// The step between readings along the line, mm.
        step: f64,
        /// Path speed, mm/s.
        speed: f64,
        /// Number of runs.
        runs: usize,
        /// Whether each run consists of a forward and a backward traversal.
        both_directions: bool,
        /// Whether the axes of each step move one after the other, with a reading after each.
        in_turn: bool,
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
pub enum FollowOffset {
    /// Away from the axis.
    Radial,
    /// Along the path of the workpiece ball.
    Tangential,
    /// Along the axis.
    Axial,
    /// No bar: the tool point follows the point of the table below it at the start.
    #[serde(skip)]
    None,
    /// No bar: the tool point follows the instrument's point of the table.
    #[serde(skip)]
    Touching,
}

/// Ratio of the programmed feed to the speed of the ball on its circle of `radius_mm`, for a control that treats a
/// degree as a millimetre. The ball moves at `v = R·ω` and the rotary axis at `v·180/(π·R)` degrees,
///
/// ```text
/// F = v · √(1 + (180/(π·R))²)
/// ```
///
/// so that the speed of the ball is `F` *divided* by the root. Eq. (12) of Yamaji, Hamabata & Ihara (2014) multiplies:
/// it gives the feed to be programmed for a desired speed, not the actual speed for a programmed feed.
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

/// The length of a line of linear axes from the positions at its ends, mm.
pub fn length_of(ends: &[[f64; 2]]) -> f64 {
    ends.iter().map(|[start, end]| (end - start).powi(2)).sum::<f64>().sqrt()
}
