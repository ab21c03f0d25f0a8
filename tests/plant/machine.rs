//! The machine of the tests, `w C A b Y X Z t`, and the distance of the two balls with displaced bodies.

use super::component::{AxisName, Cartesian, Component};
use super::pose::{Axis, Joint};
use nalgebra::Vector3;

/// All deviations from the nominal machine. Millimetre, radian and second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Displacement {
    /// Error motions by [`AxisName::index`].
    pub motion: [[f64; 6]; 5],
    /// Location errors by [`AxisName::index`].
    pub location: [[f64; 6]; 5],
    /// True minus commanded axis position, mm or rad.
    pub position: [f64; 5],
    /// Offset of the workpiece ball in the table frame, mm.
    pub workpiece_ball: [f64; 3],
    /// Offset of the spindle ball in the tool frame, mm.
    pub spindle_ball: [f64; 3],
    /// True minus stated bar length, mm.
    pub bar: f64,
    /// Relative gain error of the sensor.
    pub gain: f64,
    /// Delay of the sensor reading, s.
    pub delay: f64,
}

impl Displacement {
    /// Adds an error to one component, in mm, rad, s, or (gain) as a ratio.
    pub fn add(&mut self, component: Component, value: f64) {
        match component {
            Component::Motion(freedom, axis) => self.motion[axis.index()][freedom.index()] += value,
            Component::Location(freedom, axis) => {
                self.location[axis.index()][freedom.index()] += value;
            }
            Component::WorkpieceBall(Cartesian(i)) => self.workpiece_ball[i] += value,
            Component::SpindleBall(Cartesian(i)) => self.spindle_ball[i] += value,
            Component::Bar => self.bar += value,
            Component::Sensor => self.gain += value,
            Component::Trigger => self.delay += value,
        }
    }
}

/// Commanded positions and velocities by [`AxisName::index`]: mm and rad, mm/s and rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Commanded {
    /// Axis positions.
    pub position: [f64; 5],
    /// Axis velocities.
    pub velocity: [f64; 5],
}

/// Stated positions of both balls and stated bar length, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stated {
    /// Workpiece ball in the frame of the body that carries it.
    pub workpiece_ball_mm: [f64; 3],
    /// The axis that carries it: C, or A below it.
    pub workpiece_ball_on: AxisName,
    /// Spindle ball in the tool frame.
    pub spindle_ball_mm: [f64; 3],
    /// Bar length.
    pub bar_mm: f64,
}

/// A five-axis machine with two rotary axes under the table: `P_w = T_A T_C w`, `P_s = T_Y T_X T_Z s`.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// By [`AxisName::index`].
    pub axes: [Axis; 5],
}

impl Default for Machine {
    /// The Hermle C600U of the samples: every axis along a direction of R through its origin.
    fn default() -> Machine {
        let axis = |joint, direction| Axis { joint, direction, origin_mm: Vector3::zeros() };
        Machine {
            axes: [
                axis(Joint::Linear, Vector3::x()),
                axis(Joint::Linear, Vector3::y()),
                axis(Joint::Linear, Vector3::z()),
                axis(Joint::Rotary, Vector3::x()),
                axis(Joint::Rotary, Vector3::z()),
            ],
        }
    }
}

impl Machine {
    /// A point carried by `axes` (from the bed outwards), in R, mm.
    fn carried(
        &self,
        axes: &[AxisName],
        position: &[f64; 5],
        displacement: &Displacement,
        point_mm: Vector3<f64>,
    ) -> Vector3<f64> {
        axes.iter().rev().fold(point_mm, |point, axis| {
            let i = axis.index();
            self.axes[i].motion(position[i], &displacement.location[i], &displacement.motion[i]).apply(point)
        })
    }

    /// `P_w` in R, mm, of a ball on the C table.
    pub fn workpiece_point(
        &self,
        position: &[f64; 5],
        displacement: &Displacement,
        point_mm: [f64; 3],
    ) -> Vector3<f64> {
        self.workpiece_point_on(AxisName::C, position, displacement, point_mm)
    }

    /// `P_w` in R, mm, of a ball on this axis, with what lies between it and the bed.
    pub fn workpiece_point_on(
        &self,
        on: AxisName,
        position: &[f64; 5],
        displacement: &Displacement,
        point_mm: [f64; 3],
    ) -> Vector3<f64> {
        let point = Vector3::from(point_mm) + Vector3::from(displacement.workpiece_ball);
        let axes = if on == AxisName::A { &[AxisName::A][..] } else { &[AxisName::A, AxisName::C] };
        self.carried(axes, position, displacement, point)
    }

    /// `P_s` in R, mm.
    pub fn tool_point(&self, position: &[f64; 5], displacement: &Displacement, point_mm: [f64; 3]) -> Vector3<f64> {
        let point = Vector3::from(point_mm) + Vector3::from(displacement.spindle_ball);
        self.carried(&[AxisName::Y, AxisName::X, AxisName::Z], position, displacement, point)
    }

    /// The reading without noise and rounding, mm: the true distance minus the error of the bar, with the gain error of
    /// the sensor applied about the stated length.
    pub fn reading_mm(&self, commanded: &Commanded, stated: &Stated, displacement: &Displacement) -> f64 {
        let position: [f64; 5] = std::array::from_fn(|i| {
            commanded.position[i] + displacement.position[i] - commanded.velocity[i] * displacement.delay
        });
        let on = stated.workpiece_ball_on;
        let workpiece = self.workpiece_point_on(on, &position, displacement, stated.workpiece_ball_mm);
        let tool = self.tool_point(&position, displacement, stated.spindle_ball_mm);
        let deviation = (workpiece - tool).norm() - displacement.bar - stated.bar_mm;
        stated.bar_mm + deviation * (1.0 + displacement.gain)
    }

    /// The moment of a unit weight at the workpiece ball about the A axis, mm: `d · ((p − o) × g)` with g = −Z and the
    /// nominal chain.
    pub fn gravity_moment_a_mm(&self, position: &[f64; 5], stated: &Stated) -> f64 {
        let axis = &self.axes[AxisName::A.index()];
        let Stated { workpiece_ball_on: on, workpiece_ball_mm, .. } = *stated;
        let ball = self.workpiece_point_on(on, position, &Displacement::default(), workpiece_ball_mm);
        axis.direction.dot(&(ball - axis.origin_mm).cross(&-Vector3::z()))
    }
}
