//! Rotation errors of a machine: what a sensor of angles reads of a frame.
//!
//! `Q = A·Nᵀ` turns the commanded orientation of a frame, `N`, into the actual one, `A`, both in R. The directions
//! `bᵢ` of the reference and `aᵢ = Q·bᵢ` of the frame, three of each, give the rotation vector `θ·n` of `Q`:
//!
//! ```text
//! ½ Σ bᵢ × aᵢ = sin θ · n        θ = sin θ · (1 + sin²θ/6 + 3·sin⁴θ/40 + …)
//! ```

use serde::{Deserialize, Serialize};

use schemars::JsonSchema;

use crate::chain::{AxisPosition, BodyErrors, Frame, Machine};
use crate::frames::{Point, Rotation, SmallMotion, cross};
use crate::scalar::{Nominal, Scalar};

/// The frame whose rotation is read, and its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
pub enum Body {
    /// The tool against the table.
    #[default]
    Relative,
    /// The tool against the bed.
    Tool,
    /// The table against the bed.
    Table,
}

impl Body {
    /// The frame that turns, and its reference.
    pub(crate) fn frames(self) -> [Frame; 2] {
        match self {
            Body::Relative => [Frame::Tool, Frame::Table],
            Body::Tool => [Frame::Tool, Frame::Bed],
            Body::Table => [Frame::Table, Frame::Bed],
        }
    }
}

impl Machine {
    /// The rotation vector of a frame against another in R, rad: its rotation in addition to the commanded one. The series
    /// ends after the third term, so that 20 mrad are exact to 10⁻¹³ rad.
    pub fn rotation_error<S: Scalar>(
        &self,
        state: &[AxisPosition<S::Nominal>],
        errors: &[BodyErrors<S>],
        [frame, against]: [Frame; 2],
    ) -> Point<S> {
        let turned = |frame| self.turned(state, errors, frame, None);
        self.rotation_vector(turned(frame), turned(against))
    }

    /// The rotation vector of a frame in R, rad, as [`Machine::rotation_error`], with a small rotation of a body in the
    /// frame before the axes, and of the frame that it is read in after them.
    pub fn rotation_error_of_body<S: Scalar>(
        &self,
        state: &[AxisPosition<S::Nominal>],
        errors: &[BodyErrors<S>],
        frame: Frame,
        [in_frame, in_r]: [Option<&SmallMotion<S>>; 2],
    ) -> Point<S> {
        let frame = self.turned(state, errors, frame, in_frame);
        let frame = match in_r {
            Some(motion) => {
                let directions = frame.unwrap_or_else(|| std::array::from_fn(unit));
                Some(directions.map(|direction| motion.rotate(direction)))
            }
            None => frame,
        };
        self.rotation_vector(frame, None)
    }

    /// The rotation vector that turns the directions of a reference into those of a frame; `None` for those of R.
    fn rotation_vector<S: Scalar>(&self, frame: Option<[Point<S>; 3]>, reference: Option<[Point<S>; 3]>) -> Point<S> {
        let mut sum = Point([S::constant(0.0); 3]);
        if frame.is_none() && reference.is_none() {
            return sum;
        }
        for i in 0..3 {
            let of = |directions: &Option<[Point<S>; 3]>| directions.as_ref().map_or_else(|| unit(i), |all| all[i]);
            sum = sum.plus(cross(of(&reference).0, of(&frame)));
        }
        let half = Point(sum.0.map(|x| x * S::Nominal::constant(0.5)));
        if self.rotation == Rotation::SmallAngle {
            return half;
        }
        let square = half.0.iter().fold(S::constant(0.0), |sum, x| sum + *x * *x);
        let series = square * (square * S::Nominal::constant(0.075) + S::Nominal::constant(1.0 / 6.0));
        let factor = series + S::Nominal::constant(1.0);
        Point(half.0.map(|x| x * factor))
    }

    /// A direction of a frame in R.
    pub fn direction_in_r<S: Scalar>(
        &self,
        frame: Frame,
        state: &[AxisPosition<S::Nominal>],
        errors: &[BodyErrors<S>],
        direction: Point<S>,
    ) -> Point<S> {
        let turn = |direction, axis: usize| errors[axis].turn(&self.axes[axis], &state[axis], direction);
        self.carriers(frame).fold(direction, turn)
    }

    /// The directions of R as a frame carries them from its commanded to its actual orientation; `None` without
    /// errors. A small rotation turns them in the frame.
    fn turned<S: Scalar>(
        &self,
        state: &[AxisPosition<S::Nominal>],
        errors: &[BodyErrors<S>],
        frame: Frame,
        in_frame: Option<&SmallMotion<S>>,
    ) -> Option<[Point<S>; 3]> {
        let turns = self.carriers(frame).any(|axis| !errors[axis].turns_nothing());
        if !turns && in_frame.is_none() {
            return None;
        }
        // Outwards from the bed on the way back, inwards on the way to it.
        let back = |direction, axis: usize| BodyErrors::turn_back(&self.axes[axis], &state[axis], direction);
        Some(std::array::from_fn(|i| {
            let commanded = self.carriers(frame).rev().fold(unit(i), back);
            let commanded = in_frame.map_or(commanded, |motion| motion.rotate(commanded));
            self.direction_in_r(frame, state, errors, commanded)
        }))
    }
}

/// A direction of R.
fn unit<S: Scalar>(i: usize) -> Point<S> {
    Point(std::array::from_fn(|k| S::constant(if i == k { 1.0 } else { 0.0 })))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, Vector3};

    use super::*;
    use crate::axis::AxisKind;

    /// Against rotation matrices multiplied in order: the logarithm of `A·Nᵀ`, and of `(A_t N_tᵀ)(A_w N_wᵀ)ᵀ`.
    #[test]
    fn the_rotation_error_is_the_logarithm_of_the_turn_from_the_commanded_orientation() {
        let machine = Machine::from_code("wCAbYXBt").unwrap();
        let positions = [0.7, -0.4, 120.0, -80.0, 1.1];
        let state = machine.axis_positions(&positions);
        let size = |axis: usize, k: usize| {
            1e-3 * (1.0 + (3 * axis + k) as f64 % 5.0) * if k.is_multiple_of(2) { 1.0 } else { -1.0 }
        };
        let slots = crate::chain::ERRORS_PER_AXIS;
        let errors = machine.body_errors(|_| true, |slot| size(slot / slots, slot % slots));
        let small = |six: [f64; 6]| {
            let about = |k: usize, angle: f64| {
                let axis = Vector3::from_fn(|i, _| if i == k { 1.0 } else { 0.0 });
                *Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle).matrix()
            };
            about(0, six[3]) * about(1, six[4]) * about(2, six[5])
        };
        let turn = |axis: usize, with_errors: bool| -> Matrix3<f64> {
            let of = &machine.axes[axis];
            let about = nalgebra::Unit::new_normalize(Vector3::from(of.direction));
            let own = match of.kind {
                AxisKind::Rotary => *Rotation3::from_axis_angle(&about, positions[axis]).matrix(),
                AxisKind::Linear => Matrix3::identity(),
            };
            if !with_errors {
                return own;
            }
            let six = |first: usize| std::array::from_fn(|k| size(axis, first + k));
            let location = if of.kind == AxisKind::Rotary { small(six(0)) } else { Matrix3::identity() };
            location * small(six(6)) * own
        };
        // From the bed outwards on either side: A then C, and Y, X, B.
        let side = |axes: &[usize], with_errors: bool| -> Matrix3<f64> {
            axes.iter().fold(Matrix3::identity(), |all, axis| all * turn(*axis, with_errors))
        };
        let from_commanded = |axes: &[usize]| -> Matrix3<f64> { side(axes, true) * side(axes, false).transpose() };
        let (tool, table) = (from_commanded(&[2, 3, 4]), from_commanded(&[1, 0]));
        for (body, turned) in [(Body::Tool, tool), (Body::Table, table), (Body::Relative, tool * table.transpose())] {
            let expected = Rotation3::from_matrix_unchecked(turned).scaled_axis();
            let found = Vector3::from(machine.rotation_error::<f64>(&state, &errors, body.frames()).0);
            assert!((found - expected).norm() < 1e-12, "{body:?}: {found} instead of {expected}");
        }
    }
}
