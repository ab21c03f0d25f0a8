//! The R-test: three displacement sensors in a nest around a master ball measure its position, as the vector
//! `P_s − P_w`.
//!
//! The vector is in the table frame if the nest is on the table (E-setting), and in the tool frame if the nest is in
//! the spindle (Es-setting):
//!
//! ```text
//! E:   m = T_w⁻¹·P_s − w          Es:   m = s − T_s⁻¹·P_w          r = D · Rᵀ(ω₁, φ₁, θ₁) · m
//! ```
//!
//! `w` and `s` are the points of table and tool that nominally coincide. ω₁, φ₁, θ₁ are the orientation errors of the
//! nest. The rows of `D` are the measuring directions of the sensors; without `D` the reading is already in X, Y, Z.
//! Yamaji, Hamabata & Ihara, Evaluation of linear axis motion error of machine tools using an R-test device (HPC 2014),
//! Section 4: sensor outputs become machine coordinates by `R = R_φ·R_θ·R_ω` (Eqs. 1–3). The matrices above Eq. 1 are
//! printed in a different order from the expanded equations and the text.

use super::{InstrumentParameter, SharedBy, displaced};
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::frames::{Coordinate, Point, Rotation, SinCos, turn_about};
use crate::scalar::{Nominal, Scalar};

/// Both points, then ω₁, φ₁ and θ₁ of the nest.
pub const PARAMETERS: [InstrumentParameter; 9] = [
    InstrumentParameter::length("workpiece_ball", "x", SharedBy::Setup),
    InstrumentParameter::length("workpiece_ball", "y", SharedBy::Setup),
    InstrumentParameter::length("workpiece_ball", "z", SharedBy::Setup),
    InstrumentParameter::length("spindle_ball", "x", SharedBy::SpindleSetup),
    InstrumentParameter::length("spindle_ball", "y", SharedBy::SpindleSetup),
    InstrumentParameter::length("spindle_ball", "z", SharedBy::SpindleSetup),
    InstrumentParameter::angle("sensor", "omega", SharedBy::Sensors),
    InstrumentParameter::angle("sensor", "phi", SharedBy::Sensors),
    InstrumentParameter::angle("sensor", "theta", SharedBy::Sensors),
];

/// Index of ω₁ in [`PARAMETERS`].
pub const SENSOR: usize = 6;

/// The body that carries the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// E: the sensors on the table, the master ball in the spindle.
    Table,
    /// Es: the sensors in the spindle, the master ball on the table.
    Spindle,
}

/// An R-test as set up for one test, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct RTest<N> {
    /// The body that carries the sensors.
    pub setting: Setting,
    /// The point on the table, in the table frame: the centre of the nest in E, of the master ball in Es.
    pub workpiece_ball: [N; 3],
    /// The point in the spindle, in the tool frame: the centre of the master ball in E, of the nest in Es.
    pub spindle_ball: [N; 3],
    /// The measuring direction of each sensor in the carrying frame, row by row; `None` if readings are in that frame.
    pub sensors: Option<[[N; 3]; 3]>,
}

/// Three rotations between sensors and machine: `R = R_φ·R_θ·R_ω` with
///
/// ```text
///       ⎛ 1    0     0   ⎞        ⎛ cos φ  0  −sin φ ⎞        ⎛  cos θ  sin θ  0 ⎞
/// R_ω = ⎜ 0  cos ω  sin ω⎟  R_φ = ⎜   0    1     0   ⎟  R_θ = ⎜ −sin θ  cos θ  0 ⎟
///       ⎝ 0 −sin ω  cos ω⎠        ⎝ sin φ  0   cos φ ⎠        ⎝    0      0    1 ⎠
/// ```
///
/// ```
/// use abbe_model::frames::{Point, Rotation};
/// use abbe_model::instrument::rtest::Orientation;
///
/// // Eq. (4) of the paper: sensor u measures cos(−35.264°)·X + sin(−35.264°)·Z.
/// let angles: [f64; 3] = [135.0_f64, -35.264, 0.0].map(f64::to_radians);
/// let machine = Orientation::new(angles, Rotation::Exact).to_machine(Point([1.0, 0.0, 0.0])).0;
/// assert!((machine[0] - 0.81650).abs() < 1e-5 && machine[1] == 0.0 && (machine[2] + 0.57735).abs() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Orientation<S> {
    omega: SinCos<S>,
    phi: SinCos<S>,
    theta: SinCos<S>,
}

impl<S: Scalar> Orientation<S> {
    /// From ω, φ, θ in radians. The small-angle form replaces the sine by the angle and the cosine by 1, as in Eqs. (7)
    /// to (9), which keep products of two angles and omit their squares.
    pub fn new(angles: [S; 3], rotation: Rotation) -> Self {
        let [omega, phi, theta] = angles.map(|angle| match rotation {
            Rotation::Exact => {
                let (sin, cos) = angle.sin_cos();
                SinCos { sin, cos }
            }
            Rotation::SmallAngle => SinCos { sin: angle, cos: S::constant(1.0) },
        });
        Orientation { omega, phi, theta }
    }

    /// `R · v`: from sensor coordinates to the frame that carries the sensors.
    pub fn to_machine(&self, sensors: Point<S>) -> Point<S> {
        let [omega, phi, theta] =
            [self.omega, self.phi, self.theta].map(|turn| SinCos { sin: -turn.sin, cos: turn.cos });
        let about_u = turn_about(Coordinate::X, omega, sensors);
        let about_w = turn_about(Coordinate::Z, theta, about_u);
        turn_about(Coordinate::Y, phi, about_w)
    }

    /// `Rᵀ · v`: from the carrying frame to sensor coordinates.
    pub fn to_sensors(&self, machine: Point<S>) -> Point<S> {
        let about_v = turn_about(Coordinate::Y, self.phi, machine);
        let about_w = turn_about(Coordinate::Z, self.theta, about_v);
        turn_about(Coordinate::X, self.omega, about_w)
    }
}

impl<N: Nominal> RTest<N> {
    /// `P_s − P_w` in the frame that carries the sensors, mm.
    pub fn difference<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: &impl Fn(usize) -> Option<S>,
    ) -> Point<S> {
        let workpiece = displaced(self.workpiece_ball, 0, unknown);
        let spindle = displaced(self.spindle_ball, 3, unknown);
        match self.setting {
            Setting::Table => {
                let ball = machine.tool_point(state, errors, spindle);
                machine.table_point(state, errors, ball).minus(workpiece)
            }
            Setting::Spindle => {
                let ball = machine.workpiece_point(state, errors, workpiece);
                spindle.minus(machine.spindle_point(state, errors, ball))
            }
        }
    }

    /// The reading: the three sensor values, or the vector in the carrying frame, mm.
    pub fn read<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Point<S> {
        let mut vector = self.difference(machine, state, errors, &unknown);
        let carried = (SENSOR..SENSOR + 3).any(|index| unknown(index).is_some());
        if carried {
            let angles = std::array::from_fn(|i| unknown(SENSOR + i).unwrap_or_else(|| S::constant(0.0)));
            vector = Orientation::new(angles, machine.rotation).to_sensors(vector);
        }
        let Some(sensors) = &self.sensors else {
            return vector;
        };
        let [x, y, z] = vector.0;
        Point(sensors.map(|[a, b, c]| x * a + y * b + z * c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each sensor angle transforms the reading by the transpose of its own matrix above, and by nothing else.
    #[test]
    fn sensor_orientation_errors_rotate_the_reading() {
        let machine = Machine {
            name: "none".into(),
            axes: Vec::new(),
            workpiece_side: 0,
            rotation: Rotation::Exact,
            gravity: [0.0, 0.0, -1.0],
        };
        let [x, y, z] = [0.03, -0.05, 0.07];
        let vectors =
            RTest { setting: Setting::Table, workpiece_ball: [0.0; 3], spindle_ball: [x, y, z], sensors: None };
        let directions = [[0.6, 0.8, 0.0], [0.0, 0.6, 0.8], [0.8, 0.0, 0.6]];
        let counts = RTest { sensors: Some(directions), ..vectors.clone() };
        let (sin, cos) = 0.4_f64.sin_cos();
        for (index, turned) in [
            [x, cos * y - sin * z, sin * y + cos * z],
            [cos * x + sin * z, y, -sin * x + cos * z],
            [cos * x - sin * y, sin * x + cos * y, z],
        ]
        .into_iter()
        .enumerate()
        {
            let askew = |unknown: usize| (unknown == SENSOR + index).then_some(0.4);
            let near = |found: [f64; 3], expected: [f64; 3]| {
                let far = (0..3).any(|i| (found[i] - expected[i]).abs() > 1e-15);
                assert!(!far, "angle {index}: {found:?}, not {expected:?}");
            };
            near(vectors.read(&machine, &[], &[], askew).0, turned);
            let counted = directions.map(|direction| (0..3).map(|i| direction[i] * turned[i]).sum());
            near(counts.read(&machine, &[], &[], askew).0, counted);
        }
    }
}
