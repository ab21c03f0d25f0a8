//! The laser tracker: three coordinates of a target in the tracker's own frame.
//!
//! `m = B · E · P`: `P` is the target in R through the chain, `E` a small motion (the pose parameters) and `B` a fixed
//! rigid motion. `B` keeps the estimated angles small for any orientation of the tracker.

use super::{InstrumentParameter, SharedBy, displaced, pose_error};
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::frames::Point;
use crate::scalar::{Nominal, Scalar};

/// The pose, then the target in the tool frame.
pub const PARAMETERS: [InstrumentParameter; 9] = [
    InstrumentParameter::length("tracker", "x", SharedBy::Setup),
    InstrumentParameter::length("tracker", "y", SharedBy::Setup),
    InstrumentParameter::length("tracker", "z", SharedBy::Setup),
    InstrumentParameter::angle("tracker", "a", SharedBy::Setup),
    InstrumentParameter::angle("tracker", "b", SharedBy::Setup),
    InstrumentParameter::angle("tracker", "c", SharedBy::Setup),
    InstrumentParameter::length("target", "x", SharedBy::SpindleSetup),
    InstrumentParameter::length("target", "y", SharedBy::SpindleSetup),
    InstrumentParameter::length("target", "z", SharedBy::SpindleSetup),
];

/// A tracker as set up for one test, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracker<N> {
    /// The target in the tool frame.
    pub target: [N; 3],
    /// `B`: rotation from R to the tracker's frame, row by row.
    pub rotation: [[N; 3]; 3],
    /// `B`: R's origin in the tracker's frame.
    pub origin: [N; 3],
}

impl<N: Nominal> Tracker<N> {
    /// The target in R.
    pub fn target_point<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: &impl Fn(usize) -> Option<S>,
    ) -> Point<S> {
        machine.tool_point(state, errors, displaced(self.target, 6, unknown))
    }

    /// The reading: three coordinates in the tracker's frame, mm.
    pub fn read<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Point<S> {
        let mut point = self.target_point(machine, state, errors, &unknown);
        if let Some(pose) = pose_error(&unknown) {
            point = pose.push(point);
        }
        let [x, y, z] = point.0;
        Point(std::array::from_fn(|i| {
            let [a, b, c] = self.rotation[i];
            x * a + y * b + z * c + self.origin[i]
        }))
    }
}
