//! Poses: position and orientation of a body at the tool, read in the frame of an instrument. Motion capture, hand-eye,
//! portable arm.
//!
//! The target `P` of the body is read as `m = B · E · P` (`stand.rs`). The body turns with the tool frame: `H` is its
//! orientation there, and the reading is the rotation vector, in the instrument's frame, by which the body is turned in
//! addition to its nominal orientation:
//!
//! ```text
//! φ = log(O · O₀ᵀ)      O = B · E · T · D · H      O₀ = B · T₀ · H
//! ```
//!
//! `T` is the actual and `T₀` the commanded orientation of the tool frame, `D` a small rotation (three parameters). As `B`,
//! `H` is found from the readings before the fit, so that the rotations are small.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::channel::Channel;
use super::column::{Column, OF_ROTATION, Quantity};
use super::set_up::{self, SetUp, Stated};
use super::stand::{self, Stand, pose_error};
use super::{
    Aligned, Entry, Fault, Geometry, Group, Handling, Instrument, InstrumentParameter, InstrumentPoint,
    Misreading, MisreadingKind, Reading, SharedBy, Station, Target, Travel, default_errors,
};
use crate::chain::{AxisPosition, BodyErrors, Frame, Machine, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::frames::{Point, Rotation, SmallMotion};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::session::readings::Readings;
use crate::unit::Unit;

/// The pose of the instrument, then position and orientation of the target in the tool frame.
pub const PARAMETERS: [InstrumentParameter; 12] = InstrumentParameter::all(&[
    &InstrumentParameter::point("station", SharedBy::Setup),
    &InstrumentParameter::rotation("station", SharedBy::Setup),
    &InstrumentParameter::point("target", SharedBy::SpindleSetup),
    &InstrumentParameter::rotation("target", SharedBy::SpindleSetup),
]);

/// The first parameters of position and orientation of the target.
const TARGET: usize = 6;
const ORIENTATION: usize = 9;

/// The points on bodies, that of the table first.
const POINTS: &[(&str, Frame)] = &[("target", Frame::Tool)];

pub(super) const ENTRY: Entry = Entry {
    free: Some("station"),
    reads_poses: true,
    rows_can_lack_channels: true,
    default_errors: default_errors::all_locations,
    ..Entry::new(["pose", "poses of a body at the tool"],
        &PARAMETERS,
        schema::properties::<Keys>,
        POINTS,
        read,
    )
};

const POSITION: [Channel; 3] = Channel::vector(["x", "y", "z"]);

/// The channels.
const CHANNELS: [Channel; 6] =
    [POSITION[0], POSITION[1], POSITION[2], Channel::angle("rx"), Channel::angle("ry"), Channel::angle("rz")];

/// The columns: position, then the rotation vector or the quaternion of the orientation.
const COLUMNS: [Column; 10] = [
    Column::new("px", Unit::Millimetre, Quantity::Channel(0)),
    Column::new("py", Unit::Millimetre, Quantity::Channel(1)),
    Column::new("pz", Unit::Millimetre, Quantity::Channel(2)),
    Column::new("rx", Unit::Degree, Quantity::Channel(3)),
    Column::new("ry", Unit::Degree, Quantity::Channel(4)),
    Column::new("rz", Unit::Degree, Quantity::Channel(5)),
    Column::new("qx", Unit::One, Quantity::Quaternion(0)),
    Column::new("qy", Unit::One, Quantity::Quaternion(1)),
    Column::new("qz", Unit::One, Quantity::Quaternion(2)),
    Column::new("qw", Unit::One, Quantity::Quaternion(3)),
];

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Target in the tool frame.
    target_mm: document::Point,
    #[serde(default)]
    target_u_um: document::Uncertainties,
    /// Standard uncertainty of the target's orientation, which is that of the tool frame, about each axis, arcsec;
    /// default: inf, any orientation.
    #[serde(default = "document::Uncertainties::unknown")]
    target_u_arcsec: document::Uncertainties,
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let target = set_up.point("target", &keys.target_mm)?;
    let orientation: Vec<Prior> = set_up::angles(&keys.target_u_arcsec).collect();
    let is_turned = orientation.iter().all(|prior| *prior == Prior::Free);
    let position = [Prior::Free; 6].into_iter().chain(set_up::lengths(&keys.target_u_um));
    let priors = position.chain(orientation).collect();
    let turn = is_turned.then(UnitQuaternion::identity);
    Ok(SetUp::new(Station::Pose(Pose { target, stand: Stand::at_origin(), turn }), priors))
}

/// A body and the instrument that reads its pose, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose<N> {
    /// The target.
    pub target: Target<N>,
    /// Where the instrument stands.
    pub stand: Stand<N>,
    /// `H`, the orientation of the body in the frame of its target, if no session knows it; `None` for that of the frame.
    pub turn: Option<UnitQuaternion<f64>>,
}

impl<N> Geometry<N> for Pose<N> {
    type Over<M> = Pose<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Pose<M> {
        Pose { target: self.target.map(to), stand: self.stand.map(to), turn: self.turn }
    }
    /// Position, mm, and rotation in addition to the nominal orientation, rad, in the instrument's frame.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let pose = pose_error(&unknown);
        let target = self.target.in_r(at, TARGET, &unknown);
        let target = self.stand.point(pose.map_or(target, |pose| pose.push(target)));
        let turned = |i: usize| unknown(ORIENTATION + i);
        let in_frame = (0..3).any(|i| turned(i).is_some()).then(|| {
            let zero = S::constant(0.0);
            let [a, b, c] = std::array::from_fn(|i| turned(i).unwrap_or(zero));
            SmallMotion::new([zero, zero, zero, a, b, c], Rotation::Exact)
        });
        let rotation = at.machine.rotation_error_of_body(at.state, at.errors, self.target.frame, [in_frame.as_ref(), pose.as_ref()]);
        Reading::of(target.0.into_iter().chain(self.stand.direction(rotation).0))
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        [None, InstrumentPoint::of("target", &self.target, TARGET)]
    }
}

/// The commanded orientation of a frame in R.
fn commanded(machine: &Machine, frame: Frame, state: &[AxisPosition<f64>]) -> Matrix3<f64> {
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let column = |k: usize| {
        let unit = Point(std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 }));
        Vector3::from(machine.direction_in_r::<f64>(frame, state, &none, unit).0)
    };
    Matrix3::from_columns(&[column(0), column(1), column(2)])
}

/// One channel has the opposite sign.
const fn negated<const CHANNEL: usize>(columns: &'static str, words: &'static str) -> Misreading {
    Misreading { kind: MisreadingKind::Sign, columns, words, reread: |values| values[CHANNEL] = -values[CHANNEL] }
}

/// Two channels are exchanged.
const fn exchanged<const ONE: usize, const OTHER: usize>(columns: &'static str, words: &'static str) -> Misreading {
    Misreading { kind: MisreadingKind::Order, columns, words, reread: |values| values.swap(ONE, OTHER) }
}

/// Quaternions are written with the scalar first or last, poses and rotations in either direction, and three angles by many
/// conventions.
const MISREADINGS: [Misreading; 21] = [
    Misreading {
        kind: MisreadingKind::Order,
        columns: "qx, qy, qz, qw",
        words: "the quaternions have the scalar first: their columns are qw, qx, qy, qz in this order",
        reread: |values| reordered(values, [1, 2, 3, 0]),
    },
    Misreading {
        kind: MisreadingKind::Order,
        columns: "qx, qy, qz, qw",
        words: "the quaternions have the scalar last: their columns are qx, qy, qz, qw in this order",
        reread: |values| reordered(values, [3, 0, 1, 2]),
    },
    Misreading {
        kind: MisreadingKind::Order,
        columns: "the pose",
        words: "the poses are the inverse ones: of the instrument in the frame of the body, not of the body in that of the \
                instrument",
        reread: |values| {
            let inverse = observed(values).inverse();
            let place = -(inverse * Vector3::from_column_slice(&values[..3]));
            values[..3].copy_from_slice(place.as_slice());
            values[OF_ROTATION].copy_from_slice(inverse.scaled_axis().as_slice());
        },
    },
    Misreading {
        kind: MisreadingKind::Order,
        columns: "the rotation",
        words: "the rotations are the inverse ones",
        reread: |values| values[OF_ROTATION].iter_mut().for_each(|value| *value = -*value),
    },
    negated::<0>("px", "px has the opposite sign, and the rotations have not"),
    negated::<1>("py", "py has the opposite sign, and the rotations have not"),
    negated::<2>("pz", "pz has the opposite sign, and the rotations have not"),
    negated::<3>("rx, qx", "the component X of the rotation has the opposite sign (column rx or qx)"),
    negated::<4>("ry, qy", "the component Y of the rotation has the opposite sign (column ry or qy)"),
    negated::<5>("rz, qz", "the component Z of the rotation has the opposite sign (column rz or qz)"),
    exchanged::<0, 1>("px, py", "px and py are exchanged, and the rotations are not"),
    exchanged::<1, 2>("py, pz", "py and pz are exchanged, and the rotations are not"),
    exchanged::<0, 2>("px, pz", "px and pz are exchanged, and the rotations are not"),
    exchanged::<3, 4>("rx, ry", "the components X and Y of the rotation are exchanged"),
    exchanged::<4, 5>("ry, rz", "the components Y and Z of the rotation are exchanged"),
    exchanged::<3, 5>("rx, rz", "the components X and Z of the rotation are exchanged"),
    Misreading {
        kind: MisreadingKind::Order,
        columns: "rx, ry, rz",
        words: "rx, ry, rz are roll, pitch and yaw about fixed axes X, Y, Z, not a rotation vector",
        reread: |values| turned(values, |[x, y, z]| [(2, z), (1, y), (0, x)]),
    },
    Misreading {
        kind: MisreadingKind::Order,
        columns: "rx, ry, rz",
        words: "rx, ry, rz are angles about X, Y, Z as they turn, not a rotation vector",
        reread: |values| turned(values, |[x, y, z]| [(0, x), (1, y), (2, z)]),
    },
    Misreading {
        kind: MisreadingKind::Order,
        columns: "rx, ry, rz",
        words: "rx, ry, rz are the angles A, B, C about Z, Y, X as they turn, not a rotation vector",
        reread: |values| turned(values, |[a, b, c]| [(2, a), (1, b), (0, c)]),
    },
    Misreading {
        kind: MisreadingKind::Unit,
        columns: "rx, ry, rz",
        words: "rx, ry, rz are in radians, not in degrees",
        reread: |values| values[OF_ROTATION].iter_mut().for_each(|value| *value = value.to_degrees()),
    },
    Misreading {
        kind: MisreadingKind::Unit,
        columns: "rx, ry, rz",
        words: "rx, ry, rz are in degrees, not in radians",
        reread: |values| values[OF_ROTATION].iter_mut().for_each(|value| *value = value.to_radians()),
    },
];

/// Replaces three values by the rotation vector of a product of turns: each an axis and an angle, the first one leftmost.
fn turned(values: &mut [f64], turns: fn([f64; 3]) -> [(usize, f64); 3]) {
    let [x, y, z] = std::array::from_fn(|k| values[OF_ROTATION.start + k]);
    let about = |(axis, angle): (usize, f64)| UnitQuaternion::from_scaled_axis(Vector3::ith(axis, angle));
    let product =
        turns([x, y, z]).map(about).into_iter().fold(UnitQuaternion::identity(), |product, turn| product * turn);
    values[OF_ROTATION].copy_from_slice(product.scaled_axis().as_slice());
}

/// Replaces an orientation by that of the quaternion whose x, y, z, w are these of the x, y, z, w that were read.
fn reordered(values: &mut [f64], order: [usize; 4]) {
    if values[OF_ROTATION].iter().all(|value| value.is_finite()) {
        let read = observed(values).coords;
        let [x, y, z, w] = order.map(|place| read[place]);
        let vector = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).scaled_axis();
        values[OF_ROTATION].copy_from_slice(vector.as_slice());
    }
}

/// The rotation of a vector in three of the columns.
fn observed(values: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(&values[OF_ROTATION]))
}

fn quaternion(matrix: Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

/// The part of a rotation that changes its sign with it: `sin θ · n`.
fn axial(rotation: &Matrix3<f64>) -> Vector3<f64> {
    let of = |i: usize, j: usize| 0.5 * (rotation[(i, j)] - rotation[(j, i)]);
    Vector3::new(of(2, 1), of(0, 2), of(1, 0))
}

impl Pose<f64> {
    /// The nominal orientation of the body in the instrument's frame.
    fn nominal(&self, machine: &Machine, state: &[AxisPosition<f64>]) -> UnitQuaternion<f64> {
        quaternion(self.stand.matrix() * commanded(machine, self.target.frame, state)) * self.turn.unwrap_or_default()
    }
}

/// The commanded orientation of a frame in R and the measured one of the body, in the rows that have both.
fn orientations(machine: &Machine, frame: Frame, readings: &Readings) -> Vec<[Matrix3<f64>; 2]> {
    let mut state = Vec::new();
    let mut pairs = Vec::with_capacity(readings.rows());
    for (row, values) in readings.observed.chunks_exact(CHANNELS.len()).enumerate() {
        if values[OF_ROTATION].iter().all(|value| value.is_finite()) {
            readings.state(machine, row, &mut state);
            pairs.push([commanded(machine, frame, &state), observed(values).to_rotation_matrix().into_inner()]);
        }
    }
    pairs
}

impl Instrument for Pose<f64> {
    /// It sees the target wherever the axes are.
    fn aligned(&self, _: &Travel<'_>) -> Vec<Aligned> {
        Aligned::as_it_stands(self.clone())
    }
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let keys = Keys {
            target_mm: set_up::written_point(self.target.mm),
            target_u_um: set_up::written_lengths(priors, TARGET),
            target_u_arcsec: set_up::written_angles(priors, ORIENTATION),
        };
        set_up::written(&keys, &["target_u_arcsec"])
    }
    fn handling(&self) -> Handling {
        let beside = "Measuring system, where it sees the target at every position: its place is estimated";
        Handling { beside: Some(beside.into()), ..Handling::default() }
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [None, Some(&mut self.target)]
    }
    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }
    fn columns(&self) -> &'static [Column] {
        &COLUMNS
    }
    fn refers_to_nominal(&self) -> bool {
        true
    }
    /// The orientation becomes the rotation from the nominal one; without one of its columns none is known.
    fn channels_of_columns(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        if values[OF_ROTATION].iter().any(|value| value.is_nan()) {
            values[OF_ROTATION].fill(f64::NAN);
            return;
        }
        let rotation = (observed(values) * self.nominal(machine, state).inverse()).scaled_axis();
        values[OF_ROTATION].copy_from_slice(rotation.as_slice());
    }
    fn columns_of_channels(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        let orientation = (observed(values) * self.nominal(machine, state)).scaled_axis();
        values[OF_ROTATION].copy_from_slice(orientation.as_slice());
    }
    fn measured_mm(&self, values: &[f64]) -> Option<Vector3<f64>> {
        (values.len() == CHANNELS.len()).then(|| Vector3::from_column_slice(&values[..3]))
    }
    /// X has the opposite sign, and with it the rotations about the others.
    fn mirror(&self, values: &mut [f64]) {
        [0, 4, 5].into_iter().for_each(|place| values[place] = -values[place]);
    }
    fn misreadings(&self) -> &'static [Misreading] {
        &MISREADINGS
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let by_quaternion = (0..4).any(|component| has(Quantity::Quaternion(component)));
        let needed = |column: &&Column| match column.quantity {
            Quantity::Quaternion(_) => by_quaternion,
            quantity => !by_quaternion || quantity.channel().is_some_and(|channel| !OF_ROTATION.contains(&channel)),
        };
        let column = COLUMNS.iter().filter(needed).find(|column| !has(column.quantity))?;
        let help = "a pose needs px_mm, py_mm and pz_mm, and qx, qy, qz and qw or rx_deg, ry_deg and rz_deg";
        Some((format!("`{}`", column.name(column.unit)), help.into()))
    }
    /// The rotation from R maps the nominal positions onto the measured ones, and the axis of each turn of the tool onto
    /// the axis of the turn that is measured, which does not depend on the orientation of the body at the tool
    /// (Park and Martin, IEEE Trans. Robot. Autom. 10 (1994) 717).
    fn placed(&self, group: &Group<'_>) -> Option<Station<f64>> {
        let pairs = group.positions();
        let (mut sum, spread) = stand::covariance(&pairs);
        if spread > 0.0 {
            sum /= spread;
        }
        for (station, readings) in &group.tests {
            let turns = orientations(group.machine, self.target.frame, readings);
            let share = 1.0 / turns.len().max(1) as f64;
            let of_tool = matches!(station, Station::Pose(pose) if pose.turn.is_none());
            for [commanded, measured] in &turns {
                let [first_commanded, first_measured] = turns[0];
                let from_first = axial(&(measured * first_measured.transpose()))
                    * axial(&(commanded * first_commanded.transpose())).transpose();
                let known = if of_tool { measured * commanded.transpose() } else { Matrix3::zeros() };
                sum += (from_first + known) * share;
            }
        }
        let stand = Stand::through(stand::best_rotation(sum, &self.stand.matrix()), &pairs);
        (!pairs.is_empty()).then(|| Station::Pose(Pose { stand, ..self.clone() }))
    }
    fn mounted(&self, group: &Group<'_>) -> Option<Station<f64>> {
        let present = self.turn?.to_rotation_matrix().into_inner();
        let mut sum = Matrix3::zeros();
        for (station, readings) in &group.tests {
            if let Station::Pose(Pose { stand, .. }) = station {
                let turns = orientations(group.machine, self.target.frame, readings);
                sum += turns
                    .iter()
                    .map(|[of, measured]| (stand.matrix() * of).transpose() * measured)
                    .sum::<Matrix3<f64>>();
            }
        }
        Some(Station::Pose(Pose { turn: Some(quaternion(stand::best_rotation(sum, &present))), ..self.clone() }))
    }
}
