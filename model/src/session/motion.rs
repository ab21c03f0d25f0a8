//! Motion of the axes in a planned test.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::document::value::Count;

/// Largest number of readings of one planned test.
pub const MAX_READINGS: usize = 1_000_000;

/// The motion of a planned test: what moves, and how. Without one the data contain the states.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// What moves.
    pub moved: Moved,
    /// How it moves.
    pub course: Course,
}

/// What moves in a planned test. Axes are indices in the machine, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub enum Moved {
    /// One axis, while the others are fixed.
    Axis(usize),
    /// Two linear axes on a circle.
    Circle {
        /// The axes of the plane.
        axes: [usize; 2],
        /// Radius.
        radius: f64,
        /// Centre relative to the workpiece ball, along the directions of R.
        centre: [f64; 3],
    },
    /// Linear axes on a line: along a diagonal of their travels.
    Line {
        /// The axes in the order in which they move in turn.
        axes: Vec<usize>,
        /// Positions of the axes at the start of the line and at its end.
        ends: Vec<[f64; 2]>,
        /// Whether the axes of each step move one after the other, with a reading after each.
        in_turn: bool,
    },
    /// A rotary axis, and linear axes that keep the spindle ball at a constant offset from the workpiece ball.
    Follow {
        /// The rotary axis.
        axis: usize,
        /// Direction of the bar.
        offset: FollowOffset,
    },
}

/// The course of a motion: the range of its coordinate, the step between readings, the speed, and the traversals. The
/// coordinate is the position of an axis, the angle of a circle, or the distance along a line, mm or rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Start.
    pub from: f64,
    /// End.
    pub to: f64,
    /// The step between readings.
    pub step: f64,
    /// Speed of the axis, mm/s or rad/s; along a circle or a line, mm/s.
    pub speed: f64,
    /// How often it is traversed.
    pub traversals: Traversals,
}

/// How often a motion is traversed, with the keys of `sweep` and `path`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Traversals {
    /// Number of runs; default 1.
    pub runs: Option<Count<1, MAX_READINGS>>,
    /// Whether each run has a forward and a backward traversal; default true.
    pub both_directions: Option<bool>,
}

impl Traversals {
    /// Runs that each consist of a forward traversal, and of a backward one if in `both_directions`.
    pub fn new(runs: usize, both_directions: bool) -> Traversals {
        Traversals { runs: Some(Count(runs)), both_directions: Some(both_directions) }
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.runs.map_or(1, |Count(runs)| runs)
    }

    /// Whether each run has a backward traversal.
    pub fn both_directions(&self) -> bool {
        self.both_directions.unwrap_or(true)
    }

    /// Each traversal in turn: whether it is backward.
    pub fn are_backward(&self) -> impl ExactSizeIterator<Item = bool> {
        let each = if self.both_directions() { 2 } else { 1 };
        (0..self.runs() * each).map(move |traversal| traversal % each == 1)
    }
}

impl Course {
    /// The coordinates at the readings of a traversal: `from`, `from + step`, … up to `to`.
    pub fn positions(&self) -> Vec<f64> {
        let Course { from, to, step, .. } = *self;
        let ratio = (to - from).abs() / step;
        let count = (ratio + 1e-6).floor() as usize;
        let whole = (ratio - count as f64).abs() < 1e-6;
        let at = |k: usize| if whole && k == count { to } else { from + (to - from).signum() * step * k as f64 };
        (0..=count).map(at).collect()
    }

    /// A share of the range about its middle.
    pub fn part(self, share: f64) -> Course {
        let (middle, half) = (0.5 * (self.from + self.to), 0.5 * share * (self.to - self.from));
        if share == 1.0 { self } else { Course { from: middle - half, to: middle + half, ..self } }
    }

    /// One traversal of another range in so many steps.
    pub fn once(self, [from, to]: [f64; 2], steps: usize) -> Course {
        Course { from, to, step: (to - from).abs() / steps as f64, traversals: Traversals::new(1, false), ..self }
    }
}

impl Motion {
    /// The axes that it names: not those that follow.
    pub fn axes(&self) -> &[usize] {
        match &self.moved {
            Moved::Axis(axis) | Moved::Follow { axis, .. } => std::slice::from_ref(axis),
            Moved::Circle { axes, .. } => axes,
            Moved::Line { axes, .. } => axes,
        }
    }

    /// The axis whose position is the coordinate of the course, if it is one.
    pub fn axis(&self) -> Option<usize> {
        match self.moved {
            Moved::Axis(axis) | Moved::Follow { axis, .. } => Some(axis),
            Moved::Circle { .. } | Moved::Line { .. } => None,
        }
    }

    /// Whether the coordinate of the course is an angle.
    pub fn is_angular(&self, machine: &Machine) -> bool {
        match self.moved {
            Moved::Axis(axis) => machine.axes[axis].kind == AxisKind::Rotary,
            Moved::Circle { .. } | Moved::Follow { .. } => true,
            Moved::Line { .. } => false,
        }
    }

    /// The feed in mm/min, or in °/min of a rotary axis, and whether it is the latter.
    pub fn feed(&self, machine: &Machine) -> (f64, bool) {
        let kind = self.axis().map_or(AxisKind::Linear, |axis| machine.axes[axis].kind);
        (60.0 * kind.to_display(self.course.speed), kind == AxisKind::Rotary)
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The last step ends exactly at the end if the path is a whole number of steps, and before it otherwise.
    #[test]
    fn steps_end_where_they_should() {
        let steps =
            |from, to, step| Course { from, to, step, speed: 1.0, traversals: Traversals::default() }.positions();
        // Three times 0.1 is not 0.3, nor is 0.7 seven times 0.1.
        assert_eq!(steps(0.0, 0.3, 0.1), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(steps(0.7, 0.0, 0.1).last(), Some(&0.0));
        assert_eq!(steps(0.0, 0.7, 0.1).last(), Some(&0.7));
        assert_eq!(steps(1.0, -1.0, 0.75), [1.0, 0.25, -0.5]);
        assert_eq!(steps(0.0, 1.0, 2.0), [0.0]);
        assert_eq!(steps(2.0, 2.0, 1.0), [2.0]);
    }
}
