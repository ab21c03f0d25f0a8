//! Components of an R-test vector in three frames: the sensor frame, the reference frame R, and the frame of the
//! turning rotary axis.
//!
//! ```text
//! x-wise, y-wise, z-wise        d · X, d · Y, d · Z       R's directions: the share of each linear axis is the same at every position
//! radial, tangential, axial     d · r, d · (a × r), d · a
//! ```
//!
//! `a` is the direction of the turning axis, as carried by the axes beneath it. `r` is the direction from the axis to
//! the ball. For a C axis with the ball at +X at C = 0, radial and tangential are Eqs. (10) and (11) of Yamaji,
//! Hamabata & Ihara (2014): radial `X cos C + Y sin C`, tangential `−X sin C + Y cos C`.

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
use abbe_model::frames::{Point, cross};
use abbe_model::instrument::InstrumentKind;
use abbe_model::instrument::rtest::{Orientation, RTest, SENSOR};
use abbe_model::session::{placing, readings::Readings};
use nalgebra::{Matrix3, Vector3};

use crate::error;
use crate::fit::Fit;
use crate::problem::Problem;

/// Distance of the ball from the turning axis below which it has no radial direction, mm.
const ON_THE_AXIS_MM: f64 = 1e-6;

/// The components of a vector, mm, in three frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionFrame {
    /// In the frame that carries the sensors.
    pub sensors: [f64; 3],
    /// Along X, Y, Z of R.
    pub wise: [f64; 3],
    /// Radial, tangential, axial; `None` if no single rotary axis turns in the test, or if the ball lies on it.
    pub turning: Option<[f64; 3]>,
}

/// The components of one reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionComponents {
    /// The reading.
    pub reading: DirectionFrame,
    /// Its residual.
    pub residual: DirectionFrame,
}

/// The components of every reading, test by test. The sensors' directions and the fitted ω₁, φ₁, θ₁ are undone.
///
/// # Errors
/// If the session's instrument is no R-test.
pub fn views(problem: &Problem, fit: &Fit) -> Result<Vec<Vec<DirectionComponents>>, Diagnostic> {
    let machine = &problem.session.machine;
    let values = problem.slot_values(&fit.beta);
    let mut all = Vec::with_capacity(problem.tests.len());
    for (number, test) in problem.tests.iter().enumerate() {
        let (Some(rtest), Some(readings)) = (test.station.rtest(), &test.readings) else {
            let (found, expected) = (test.station.kind(), InstrumentKind::RTest);
            return Err(error::other_instrument("directional components", found, expected));
        };
        let angles = std::array::from_fn(|i| values[number].constant[machine.error_slots() + SENSOR + i]);
        let orientation = Orientation::new(angles, machine.rotation);
        let turning = turning(machine, readings);
        let mut state = Vec::new();
        let viewed = (0..readings.rows())
            .map(|row| {
                readings.state(machine, row, &mut state);
                let frames = Frames::at(machine, rtest, &state, turning);
                let components = |read: &[f64]| frames.view(rtest, &orientation, read);
                let scalars = 3 * row..3 * row + 3;
                DirectionComponents {
                    reading: components(&readings.observed[scalars.clone()]),
                    residual: components(&fit.residuals[number][scalars]),
                }
            })
            .collect();
        all.push(viewed);
    }
    Ok(all)
}

/// The single rotary axis that turns in a test.
fn turning(machine: &Machine, readings: &Readings) -> Option<usize> {
    let mut turning = (0..machine.axes.len()).filter(|&axis| {
        let positions = &readings.positions[axis];
        let first = positions.first().copied().unwrap_or(0.0);
        machine.axes[axis].kind == AxisKind::Rotary && positions.iter().any(|q| (q - first).abs() > 1e-9)
    });
    turning.next().filter(|_| turning.next().is_none())
}

/// The directions of a reading in R, from the nominal machine.
struct Frames {
    /// From the frame that carries the sensors to R.
    carrier: Matrix3<f64>,
    /// Radial, tangential, axial, row by row.
    turning: Option<Matrix3<f64>>,
}

impl Frames {
    fn at(machine: &Machine, rtest: &RTest<f64>, state: &[AxisPosition<f64>], turning: Option<usize>) -> Frames {
        let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
        let in_r = |point: [f64; 3]| Vector3::from(machine.in_r(rtest.nest().frame, state, &none, Point(point)).0);
        let origin = in_r([0.0; 3]);
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|unit| in_r(unit) - origin);
        let turning = turning.and_then(|axis| {
            let at: Vec<f64> = state.iter().map(|position| position.value).collect();
            let (on_axis, along) = placing::axis_line(machine, &at, axis);
            let ball = rtest.workpiece_ball.nominal_mm(machine, state);
            let along = Vector3::from(along);
            let from = Vector3::from(ball) - Vector3::from(on_axis);
            let outward = from - along * from.dot(&along);
            let radial = (outward.norm() > ON_THE_AXIS_MM).then(|| outward.normalize())?;
            let tangential = Vector3::from(cross(along.into(), Point(radial.into())).0);
            Some(Matrix3::from_rows(&[radial.transpose(), tangential.transpose(), along.transpose()]))
        });
        Frames { carrier: Matrix3::from_columns(&columns), turning }
    }

    fn view(&self, rtest: &RTest<f64>, orientation: &Orientation<f64>, read: &[f64]) -> DirectionFrame {
        let read = Vector3::from_row_slice(read);
        let nominal = match rtest.sensors {
            None => read,
            // Reading the session rejects sensor directions that lie in a plane.
            Some(rows) => {
                let directions = Matrix3::from_fn(|i, j| rows[i][j]);
                directions.lu().solve(&read).unwrap_or(read)
            }
        };
        let sensors = orientation.to_machine(Point(nominal.into())).0;
        let wise = self.carrier * Vector3::from(sensors);
        DirectionFrame { sensors, wise: wise.into(), turning: self.turning.map(|rows| (rows * wise).into()) }
    }
}
