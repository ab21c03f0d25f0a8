//! The touch probe: the signed distance from the stylus to the artefact's surface along the probing direction.
//!
//! With `P_s` the stylus in R, `n` the probing direction and the artefact a cylinder of radius ρ about the line through `c` along `e`, both
//! seen from the table through the inverse chain, `v = p − c`, `u` the probing direction there and `⊥` what is left across `e`,
//!
//! ```text
//! d = −(B + √(B² − A·C)) / A,    A = u⊥·u⊥,   B = v⊥·u⊥,   C = v⊥·v⊥ − (ρ + δρ + w)²
//! ```
//!
//! the nearer of the two points in which the line meets the surface. The distance is positive while the surface is still ahead. A surface that
//! stands out by `w` is met `w` earlier: what the literature calls the measured radius less the target is `−d`.

use super::{InstrumentUnknown, SharedBy, displaced, moved};
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::frames::Point;
use crate::scalar::{Nominal, Scalar};

/// The artefact's pose on the table, its radius, what its surface stands out by; the stylus in the tool frame.
pub const UNKNOWNS: [InstrumentUnknown; 11] = [
    InstrumentUnknown::length("artefact", "x", SharedBy::Setup),
    InstrumentUnknown::length("artefact", "y", SharedBy::Setup),
    InstrumentUnknown::length("artefact", "z", SharedBy::Setup),
    InstrumentUnknown::angle("artefact", "a", SharedBy::Setup),
    InstrumentUnknown::angle("artefact", "b", SharedBy::Setup),
    InstrumentUnknown::angle("artefact", "c", SharedBy::Setup),
    InstrumentUnknown::length("radius", "", SharedBy::Setup),
    InstrumentUnknown::length("form", "", SharedBy::Setup),
    InstrumentUnknown::length("stylus", "x", SharedBy::SpindleSetup),
    InstrumentUnknown::length("stylus", "y", SharedBy::SpindleSetup),
    InstrumentUnknown::length("stylus", "z", SharedBy::SpindleSetup),
];

/// Place of the artefact's radius among [`UNKNOWNS`].
pub const RADIUS: usize = 6;
/// Place of what the surface stands out by among [`UNKNOWNS`].
pub const FORM: usize = 7;
/// Place of the stylus' first coordinate among [`UNKNOWNS`].
pub const STYLUS: usize = 8;

/// A probe and a cylindrical artefact as set up for one test, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe<N> {
    /// A point of the cylinder's axis in the table frame.
    pub artefact: [N; 3],
    /// Direction of the cylinder's axis in the table frame, of unit length.
    pub axis: [N; 3],
    /// Radius of the surface that the stylus' centre moves on: the artefact's and the stylus' together.
    pub radius: N,
    /// Centre of the stylus in the tool frame.
    pub stylus: [N; 3],
    /// Probing direction in R, of unit length; `None` is straight towards the cylinder's nominal axis.
    pub direction: Option<[N; 3]>,
}

impl<N: Nominal> Probe<N> {
    /// The probing direction at a state of the axes, in R.
    pub fn direction_at<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
    ) -> Point<S> {
        if let Some(direction) = self.direction {
            return Point::nominal(direction);
        }
        let none = vec![BodyErrors::<S>::NONE; machine.axes.len()];
        let stylus = machine.tool_point(state, &none, Point::nominal(self.stylus));
        let foot = machine.workpiece_point(state, &none, Point::nominal(self.artefact));
        let tip: [N; 3] = std::array::from_fn(|i| self.artefact[i] + self.axis[i]);
        let along = machine
            .workpiece_point(state, &none, Point::nominal(tip))
            .minus(foot);
        let inward = across(foot.minus(stylus), along);
        let length = inward.norm();
        Point(inward.0.map(|x| x / length))
    }

    /// The reading: the signed distance to the surface, mm. Not a number where the line misses the artefact.
    pub fn read<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> S {
        let stylus = machine.tool_point(state, errors, displaced(self.stylus, STYLUS, &unknown));
        let ahead = stylus.plus(self.direction_at(machine, state));
        let stylus = machine.table_point(state, errors, stylus);
        let ahead = machine.table_point(state, errors, ahead);
        let mut from_artefact = stylus.minus(Point::nominal(self.artefact));
        let mut direction = ahead.minus(stylus);
        if let Some(pose) = moved(&unknown) {
            from_artefact = pose.pull(from_artefact);
            direction = pose.rotate_back(direction);
        }
        let axis = Point::nominal(self.axis);
        let (v, u) = (across(from_artefact, axis), across(direction, axis));
        let mut radius = S::nominal(self.radius);
        for place in [RADIUS, FORM] {
            if let Some(larger) = unknown(place) {
                radius = radius + larger;
            }
        }
        let (a, b, c) = (dot(u, u), dot(v, u), dot(v, v) - radius * radius);
        -(b + (b * b - a * c).sqrt()) / a
    }
}

fn dot<S: Scalar>(a: Point<S>, b: Point<S>) -> S {
    let ([a, b, c], [x, y, z]) = (a.0, b.0);
    a * x + b * y + c * z
}

/// What of `v` lies across the unit vector `along`.
fn across<S: Scalar>(v: Point<S>, along: Point<S>) -> Point<S> {
    let part = dot(v, along);
    v.minus(Point(along.0.map(|x| x * part)))
}
