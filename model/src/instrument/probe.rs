//! The touch probe: the signed distance from the stylus to the artefact's surface along the probing direction.
//!
//! `P_s` is the stylus in R and `n` the probing direction. The artefact is a cylinder of radius ρ about the line
//! through `c` along `e`. Both are transformed to the table frame through the inverse chain: `v = p − c`, `u` the
//! probing direction there and `⊥` the component perpendicular to `e`,
//!
//! ```text
//! d = −(B + √(B² − A·C)) / A,    A = u⊥·u⊥,   B = v⊥·u⊥,   C = v⊥·v⊥ − (ρ + δρ + w)²
//! ```
//!
//! This is the nearer of the two intersections of the line with the surface. The distance is positive if the surface
//! lies ahead. A form deviation of `w` outwards reduces the distance by `w`. The "measured radius less the target" of
//! the literature is `−d`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::check::MAX_MM;
use super::set_up::{self, SetUp, Stated, Written};
use super::stand::pose_error;
use super::{Contact, 
    Checked, Entry, Fault, Geometry, Handling, Instrument, InstrumentParameter, InstrumentPoint, Reading, SharedBy, Station, Target,
    default_errors, point,
};
use crate::chain::{AxisPosition, Frame, Machine, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::frames::{Point, cross, dot};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::unit::Unit;

/// The pose of the artefact on the table, its radius, its form deviation; the stylus in the tool frame.
pub const PARAMETERS: [InstrumentParameter; 11] = InstrumentParameter::all(&[
    &InstrumentParameter::point("artefact", SharedBy::Setup),
    &InstrumentParameter::rotation("artefact", SharedBy::Setup),
    &[InstrumentParameter::length("radius", "", SharedBy::Setup)],
    &[InstrumentParameter::length("form", "", SharedBy::Setup)],
    &InstrumentParameter::point("stylus", SharedBy::SpindleSetup),
]);

/// Index of the radius of the artefact in [`PARAMETERS`].
pub const RADIUS: usize = 6;
/// Index of the form deviation in [`PARAMETERS`].
pub const FORM: usize = 7;
/// Index of the first stylus coordinate in [`PARAMETERS`].
pub const STYLUS: usize = 8;

/// The points on bodies, that of the table first.
const POINTS: &[(&str, Frame)] = &[("artefact", Frame::Table), ("stylus", Frame::Tool)];

pub(super) const ENTRY: Entry = Entry {
    is_two_sided: true,
    default_errors: default_errors::positions_and_orientations,
    ..Entry::new(["probe", "a touch probe"], &PARAMETERS, schema::properties::<Keys>, POINTS, read)
};

/// The channels.
const CHANNELS: [Channel; 1] = [Channel::length("distance")];

/// The columns of a probe.
const COLUMNS: [Column; 2] =
    [Column::new("distance", Unit::Millimetre, Quantity::Length), Column::new("deviation", Unit::Micrometre, Quantity::Outward)];

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// A point of the cylinder's axis in the table frame.
    artefact_mm: document::Point,
    #[serde(default)]
    artefact_u_um: document::Uncertainties,
    /// Standard uncertainty of the cylinder's direction, arcsec.
    #[serde(default)]
    artefact_u_arcsec: document::Uncertainties,
    /// Direction of the cylinder in the table frame; default [0, 0, 1].
    artefact_axis: Option<document::Direction>,
    /// Radius of the cylinder plus that of the stylus.
    radius_mm: document::Length,
    #[serde(default)]
    radius_u_um: document::Uncertainty,
    /// Centre of the stylus in the tool frame.
    stylus_mm: document::Point,
    #[serde(default)]
    stylus_u_um: document::Uncertainties,
    /// Probing direction in R; default: straight towards the axis.
    direction: Option<document::Direction>,
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let artefact = set_up.point("artefact", &keys.artefact_mm)?;
    let radius = set_up.positive("radius_mm", &keys.radius_mm)?;
    let stylus = set_up.point("stylus", &keys.stylus_mm)?;
    let axis = keys.artefact_axis.map_or([0.0, 0.0, 1.0], |axis| axis.0).map(Written::number);
    let direction = keys.direction.map(|direction| direction.0.map(Written::number));
    let artefact_priors = set_up::lengths(&keys.artefact_u_um).chain(set_up::angles(&keys.artefact_u_arcsec));
    // The radius, and the deviation of form.
    let priors = artefact_priors.chain([set_up::length(keys.radius_u_um), Prior::Known]);
    let priors = priors.chain(set_up::lengths(&keys.stylus_u_um)).collect();
    Ok(SetUp::new(Station::Probe(Probe { artefact, axis, radius, stylus, direction }), priors))
}

/// A probe and a cylindrical artefact as set up for one test, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe<N> {
    /// A point of the cylinder's axis.
    pub artefact: Target<N>,
    /// Direction of the cylinder's axis in the frame of that point, of unit length.
    pub axis: [N; 3],
    /// Radius of the surface on which the stylus centre moves: the sum of the radii of artefact and stylus.
    pub radius: N,
    /// Centre of the stylus.
    pub stylus: Target<N>,
    /// Probing direction in R, of unit length; `None` for straight towards the cylinder's nominal axis.
    pub direction: Option<[N; 3]>,
}

/// The quantities of a reading, relative to the artefact's axis and perpendicular to it.
#[derive(Clone, Copy, Debug)]
pub struct ProbeGeometry<S> {
    /// The stylus, mm: `v⊥`.
    pub stylus: Point<S>,
    /// A step of the probe towards the surface, mm: `u⊥` times the length of the step.
    pub step: Point<S>,
    /// Distance of the stylus centre from the axis at contact, mm: `ρ + δρ + w`.
    pub radius: S,
    /// Length of the step in R, mm; `None` for 1 mm.
    pub step_length: Option<S>,
}

impl<S: Scalar> ProbeGeometry<S> {
    /// `A`, `B` and `C`, for a step of any length.
    pub fn quadratic(&self) -> [S; 3] {
        let (v, u) = (self.stylus, self.step);
        [dot(u, u), dot(v, u), dot(v, v) - self.radius * self.radius]
    }

    /// The reading: the number of steps to the surface times their length. NaN if the line misses the artefact.
    pub fn distance(&self) -> S {
        let [a, b, c] = self.quadratic();
        let steps = -(b + (b * b - a * c).sqrt()) / a;
        match self.step_length {
            Some(length) => length * steps,
            None => steps,
        }
    }
}

impl<N: Nominal> Probe<N> {
    /// A step in the probing direction in R at a state of the axes, and its length: the stated direction, or the whole
    /// distance to the artefact's nominal axis.
    pub fn step_at<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
    ) -> (Point<S>, Option<S>) {
        if let Some(direction) = self.direction {
            return (Point::nominal(direction), None);
        }
        let stylus = self.stylus.nominal_in_r::<S>(machine, state);
        let foot = self.artefact.nominal_in_r(machine, state);
        let tip = Target { mm: std::array::from_fn(|i| self.artefact.mm[i] + self.axis[i]), ..self.artefact };
        let along = tip.nominal_in_r(machine, state).minus(foot);
        let inward = perpendicular(foot.minus(stylus), along);
        (inward, Some(inward.norm()))
    }

    /// The probing direction at a state of the axes, in R.
    pub fn direction_at<S: Scalar<Nominal = N>>(&self, machine: &Machine, state: &[AxisPosition<N>]) -> Point<S> {
        match self.step_at(machine, state) {
            (step, Some(length)) => Point(step.0.map(|x| x / length)),
            (direction, None) => direction,
        }
    }

    /// Stylus and probing direction in the frame of the artefact.
    pub fn geometry<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> ProbeGeometry<S> {
        let stylus = self.stylus.in_r(at, STYLUS, &unknown);
        let (step, step_length) = self.step_at(at.machine, at.state);
        let ahead = at.in_frame(self.artefact.frame, stylus.plus(step));
        let stylus = at.in_frame(self.artefact.frame, stylus);
        let mut from_artefact = stylus.minus(Point::nominal(self.artefact.mm));
        let mut direction = ahead.minus(stylus);
        if let Some(pose) = pose_error(&unknown) {
            from_artefact = pose.pull(from_artefact);
            direction = pose.rotate_back(direction);
        }
        let axis = Point::nominal(self.axis);
        let mut radius = S::nominal(self.radius);
        for index in [RADIUS, FORM] {
            if let Some(larger) = unknown(index) {
                radius = radius + larger;
            }
        }
        ProbeGeometry {
            stylus: perpendicular(from_artefact, axis),
            step: perpendicular(direction, axis),
            radius,
            step_length,
        }
    }
}

impl<N> Geometry<N> for Probe<N> {
    type Over<M> = Probe<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Probe<M> {
        Probe {
            artefact: self.artefact.map(to),
            axis: point(&self.axis, to),
            radius: to(&self.radius),
            stylus: self.stylus.map(to),
            direction: self.direction.as_ref().map(|direction| point(direction, to)),
        }
    }
    /// The reading: the signed distance to the surface, mm. NaN if the line misses the artefact.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        Reading::scalar(self.geometry(at, unknown).distance())
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        [InstrumentPoint::of("artefact", &self.artefact, 0), InstrumentPoint::of("stylus", &self.stylus, STYLUS)]
    }
}

impl Instrument for Probe<f64> {
    /// From four sides of the cylinder; from the one that a stated direction leaves.
    fn approaches(&self) -> Vec<[f64; 3]> {
        if let Some(direction) = self.direction {
            return vec![direction.map(|x| -x * self.radius)];
        }
        let (first, second) = across(self.axis);
        [first, first.map(|x| -x), second, second.map(|x| -x)].map(|side| side.map(|x| x * self.radius)).to_vec()
    }
    fn circled(&self) -> Option<(f64, [f64; 3])> {
        self.direction.is_none().then_some((self.radius, self.axis))
    }
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let keys = Keys {
            artefact_mm: set_up::written_point(self.artefact.mm),
            artefact_u_um: set_up::written_lengths(priors, 0),
            artefact_u_arcsec: set_up::written_angles(priors, 3),
            artefact_axis: (self.axis != [0.0, 0.0, 1.0]).then(|| set_up::written_direction(self.axis)),
            radius_mm: set_up::rounded(self.radius).into(),
            radius_u_um: set_up::written_u(priors.get(RADIUS), Unit::Micrometre),
            stylus_mm: set_up::written_point(self.stylus.mm),
            stylus_u_um: set_up::written_lengths(priors, STYLUS),
            direction: self.direction.map(set_up::written_direction),
        };
        set_up::written(&keys, &[])
    }
    fn handling(&self) -> Handling {
        Handling {
            probed: Some("artefact"),
            taken_off: Some("the stylus"),
            begins: Some("Bring the stylus to the surface"),
            ..Handling::default()
        }
    }
    fn contact(&self) -> Contact {
        Contact::Touching
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [Some(&mut self.artefact), Some(&mut self.stylus)]
    }
    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }
    fn columns(&self) -> &'static [Column] {
        &COLUMNS
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let missing = !has(Quantity::Length) && !has(Quantity::Outward);
        let help = "a probe needs `distance_mm` to the surface, or `deviation_um`, the deviation outwards";
        missing.then(|| ("with the probe readings".into(), help.into()))
    }
    /// The stylus is in front of the artefact and near it at every reading.
    fn check_set_up(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        for (row, distance) in checked.nominal(Station::Probe(self.clone())).into_iter().enumerate() {
            if distance.abs() <= MAX_MM {
                continue;
            }
            let found = if distance.is_finite() {
                format!("is {distance:.3} mm from the artefact's nominal surface; the limit is {MAX_MM} mm")
            } else {
                "misses the artefact, or is on its axis without a `direction`".into()
            };
            return Err((
                format!("test \"{}\", reading {}: the stylus {found}", checked.test, row + 1),
                "check `radius_mm` (including the stylus radius), `artefact_mm`, `stylus_mm`, `direction` and the \
                 axis positions in `at` and the data"
                    .into(),
            ));
        }
        Ok(())
    }
}

/// Two directions across a cylinder, perpendicular to each other.
fn across(axis: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let start = if axis[0].abs() < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let first = perpendicular(Point(start), Point(axis));
    let first = first.0.map(|x| x / first.norm());
    (first, cross(axis, Point(first)).0)
}

/// The component of `v` perpendicular to the unit vector `along`.
fn perpendicular<S: Scalar>(v: Point<S>, along: Point<S>) -> Point<S> {
    let part = dot(v, along);
    v.minus(Point(along.0.map(|x| x * part)))
}
