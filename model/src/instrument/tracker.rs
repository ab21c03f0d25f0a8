//! The laser tracker: a target's three coordinates in the tracker's own frame, wherever that stands.
//!
//! `m = B · E · P`, with `P` the target in R through the chain, `E` a small motion (the pose's unknowns) and `B` a fixed rigid
//! motion, so that the unknown angles stay small however the tracker is turned.

use super::{InsideUnit, InstrumentUnknown, SharedBy, displaced};
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::frames::{Point, Rotation, SmallMotion};
use crate::scalar::{Nominal, Scalar};

const fn unknown(
    thing: &'static str,
    coordinate: &'static str,
    unit: InsideUnit,
    shared_by: SharedBy,
) -> InstrumentUnknown {
    InstrumentUnknown {
        thing,
        coordinate,
        unit,
        shared_by,
    }
}

/// The pose, then the target in the tool frame.
pub const UNKNOWNS: [InstrumentUnknown; 9] = [
    unknown("tracker", "x", InsideUnit::Millimetre, SharedBy::Setup),
    unknown("tracker", "y", InsideUnit::Millimetre, SharedBy::Setup),
    unknown("tracker", "z", InsideUnit::Millimetre, SharedBy::Setup),
    unknown("tracker", "a", InsideUnit::Radian, SharedBy::Setup),
    unknown("tracker", "b", InsideUnit::Radian, SharedBy::Setup),
    unknown("tracker", "c", InsideUnit::Radian, SharedBy::Setup),
    unknown("target", "x", InsideUnit::Millimetre, SharedBy::SpindleSetup),
    unknown("target", "y", InsideUnit::Millimetre, SharedBy::SpindleSetup),
    unknown("target", "z", InsideUnit::Millimetre, SharedBy::SpindleSetup),
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
        if (0..6).any(|i| unknown(i).is_some()) {
            let six = std::array::from_fn(|i| unknown(i).unwrap_or_else(|| S::constant(0.0)));
            point = SmallMotion::new(six, Rotation::Exact).push(point);
        }
        let [x, y, z] = point.0;
        Point(std::array::from_fn(|i| {
            let [a, b, c] = self.rotation[i];
            x * a + y * b + z * c + self.origin[i]
        }))
    }
}
