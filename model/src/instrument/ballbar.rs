//! The double ball bar: `L = ‖P_w − P_s‖`, the distance between a ball on the table and a ball in the spindle.
//!
//! The reading refers to the stated length of the bar: a bar that is `δ` longer than stated reads `L − δ`. A sensor
//! with the gain error `k` adds `k·(L − L_bar)`.

use super::{InstrumentParameter, InternalUnit, SharedBy, displaced};
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::frames::Point;
use crate::scalar::Scalar;

/// Both balls, the length of the bar, the gain of the sensor.
pub const PARAMETERS: [InstrumentParameter; 8] = [
    InstrumentParameter::length("workpiece_ball", "x", SharedBy::Setup),
    InstrumentParameter::length("workpiece_ball", "y", SharedBy::Setup),
    InstrumentParameter::length("workpiece_ball", "z", SharedBy::Setup),
    InstrumentParameter::length("spindle_ball", "x", SharedBy::SpindleSetup),
    InstrumentParameter::length("spindle_ball", "y", SharedBy::SpindleSetup),
    InstrumentParameter::length("spindle_ball", "z", SharedBy::SpindleSetup),
    InstrumentParameter::length("bar", "", SharedBy::BarSetup),
    InstrumentParameter::new("gain", "", InternalUnit::Ratio, SharedBy::Session),
];

/// Index of the length of the bar in [`PARAMETERS`].
pub const BAR: usize = 6;
/// Index of the gain of the sensor in [`PARAMETERS`].
pub const GAIN: usize = 7;

/// A ball bar as set up for one test, lengths in mm.
///
/// ```
/// use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
/// use abbe_model::instrument::ballbar::{BAR, BallBar};
///
/// let machine = Machine::from_code("wbXYZt")?;
/// let state: Vec<_> = machine.axes.iter().map(|axis| AxisPosition::new(axis.kind, 0.0)).collect();
/// let none = vec![BodyErrors::<f64>::NONE; 3];
/// let bar = BallBar { workpiece_ball: [0.0; 3], spindle_ball: [60.0, 0.0, 80.0], bar: 100.0 };
/// assert_eq!(bar.read(&machine, &state, &none, |_| None), 100.0);
/// // A bar that is 2 µm longer than stated reads 2 µm less.
/// assert_eq!(bar.read(&machine, &state, &none, |unknown| (unknown == BAR).then_some(0.002)), 99.998);
/// # Ok::<(), abbe_model::ModelError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BallBar<N> {
    /// Centre of the workpiece ball in the table frame.
    pub workpiece_ball: [N; 3],
    /// Centre of the spindle ball in the tool frame.
    pub spindle_ball: [N; 3],
    /// Calibrated length of the bar.
    pub bar: N,
}

impl<N: crate::scalar::Nominal> BallBar<N> {
    /// The two ball centres in R: workpiece ball, spindle ball.
    pub fn balls<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: &impl Fn(usize) -> Option<S>,
    ) -> (Point<S>, Point<S>) {
        let workpiece = displaced(self.workpiece_ball, 0, unknown);
        let spindle = displaced(self.spindle_ball, 3, unknown);
        (machine.workpiece_point(state, errors, workpiece), machine.tool_point(state, errors, spindle))
    }

    /// The reading, mm.
    pub fn read<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> S {
        let (workpiece, spindle) = self.balls(machine, state, errors, &unknown);
        let distance = workpiece.minus(spindle).norm();
        let length = match unknown(BAR) {
            Some(bar) => distance - bar,
            None => distance,
        };
        match unknown(GAIN) {
            Some(gain) => length + gain * (distance - self.bar),
            None => length,
        }
    }
}
