//! The laser tracker: three coordinates of a target in the tracker's own frame.
//!
//! `m = B · E · P`: `P` is the target in R through the chain, `E` a small motion (the pose parameters) and `B` a fixed
//! rigid motion. `B` keeps the estimated angles small for any orientation of the tracker.

use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::set_up::{self, SetUp, Written};
use super::{
    Entry, Fault, Geometry, Instrument, InstrumentKind, InstrumentParameter, Reading, SharedBy, Station,
    default_errors, displaced, point, pose_error,
};
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::session::expression::Constant;

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

pub(super) const ENTRY: Entry = Entry {
    kind: InstrumentKind::Tracker,
    word: "tracker",
    parameters: &PARAMETERS,
    free: Some("tracker"),
    is_two_sided: false,
    reads_poses: true,
    rows_can_lack_channels: false,
    has_readings: true,
    needs_every_axis: true,
    default_errors: default_errors::all_locations,
    spindle_setup: None,
    keys: schema::properties::<Keys>,
    read,
};

/// The channels.
const CHANNELS: [Channel; 3] = Channel::vector(["x", "y", "z"]);

/// The columns of a tracker.
const COLUMNS: [Column; 3] = Column::vector(["px", "py", "pz"], "mm");

/// The keys of a test.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Target in the tool frame.
    target_mm: document::Point,
    #[serde(default)]
    target_u_um: document::Uncertainties,
}

fn read(set_up: &Node, constants: &[Constant]) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up::keys(set_up)?;
    let target = set_up::point("target_mm", &keys.target_mm, constants)?;
    let priors = [Prior::Free; 6].into_iter().chain(set_up::lengths(&keys.target_u_um)).collect();
    let rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|row| row.map(Written::number));
    let origin = [0.0; 3].map(Written::number);
    Ok(SetUp::new(Station::Tracker(Tracker { target, rotation, origin }), priors))
}

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

impl<N> Geometry<N> for Tracker<N> {
    type Over<M> = Tracker<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Tracker<M> {
        Tracker {
            target: point(&self.target, to),
            rotation: self.rotation.each_ref().map(|row| point(row, to)),
            origin: point(&self.origin, to),
        }
    }
    /// The reading: three coordinates in the tracker's frame, mm.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let mut point = machine.tool_point(state, errors, displaced(self.target, 6, &unknown));
        if let Some(pose) = pose_error(&unknown) {
            point = pose.push(point);
        }
        let [x, y, z] = point.0;
        Reading::of((0..3).map(|i| {
            let [a, b, c] = self.rotation[i];
            x * a + y * b + z * c + self.origin[i]
        }))
    }
    fn table_point_mm(&self) -> Option<&[N; 3]> {
        None
    }
    fn tool_point_mm(&self) -> &[N; 3] {
        &self.target
    }
}

impl Instrument for Tracker<f64> {
    fn points_mut(&mut self) -> [Option<&mut [f64; 3]>; 2] {
        [None, Some(&mut self.target)]
    }
    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }
    fn columns(&self) -> &'static [Column] {
        &COLUMNS
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let column = COLUMNS.iter().find(|column| !has(column.quantity))?;
        Some((format!("`{}`", column.name(column.unit)), "a tracker needs px_mm, py_mm and pz_mm".into()))
    }
    fn placed(&self, points: &[Vector3<f64>], observed: &[Vector3<f64>]) -> Option<Station<f64>> {
        let (rotation, origin) = rigid_motion(points, observed);
        Some(Station::Tracker(Tracker {
            target: self.target,
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)])),
            origin: [origin.x, origin.y, origin.z],
        }))
    }
}

/// The rotation and translation that map `from` onto `to` with the least sum of squares (Kabsch, Acta Cryst. A32 (1976)
/// 922).
fn rigid_motion(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> (Matrix3<f64>, Vector3<f64>) {
    if from.is_empty() {
        return (Matrix3::identity(), Vector3::zeros());
    }
    let count = from.len() as f64;
    let centre_from = from.iter().sum::<Vector3<f64>>() / count;
    let centre_to = to.iter().sum::<Vector3<f64>>() / count;
    let covariance: Matrix3<f64> =
        from.iter().zip(to).map(|(a, b)| (b - centre_to) * (a - centre_from).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return (Matrix3::identity(), centre_to - centre_from);
    };
    // The sign on the smallest singular value makes the result a rotation, not a reflection.
    let mut signs = Matrix3::identity();
    let least = svd.singular_values.imin();
    signs[(least, least)] = (u * v_t).determinant().signum();
    let rotation = u * signs * v_t;
    (rotation, centre_to - rotation * centre_from)
}
