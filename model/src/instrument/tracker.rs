//! The laser tracker: a target seen in the tracker's own frame, as three coordinates or as range and two angles.
//!
//! The target in that frame is `m = B · E · P` (`stand.rs`), with `P` in R through the chain. Azimuth turns about the
//! tracker's Z from X towards Y, elevation rises from its XY plane:
//!
//! ```text
//! m = range · (cos elevation · cos azimuth, cos elevation · sin azimuth, sin elevation)
//! ```
//!
//! The angles are read as bearings (`bearing.rs`) about the nominal line of sight.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bearing::{Sight, bearings, direction, observed_bearings};
use super::channel::Channel;
use super::column::{Column, Quantity};
use super::set_up::{self, SetUp, Stated, Written};
use super::stand::{Stand, pose_error};
use super::{Aligned, Travel, 
    Checked, Entry, Fault, Geometry, Group, Handling, Instrument, InstrumentParameter, InstrumentPoint, Reading, SharedBy,
    Station, Target, default_errors,
};
use crate::chain::{AxisPosition, Frame, Machine, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::frames::{Point, cross};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::unit::Unit;

/// The pose, then the target in the tool frame.
pub const PARAMETERS: [InstrumentParameter; 9] = InstrumentParameter::all(&[
    &InstrumentParameter::point("tracker", SharedBy::Setup),
    &InstrumentParameter::rotation("tracker", SharedBy::Setup),
    &InstrumentParameter::point("target", SharedBy::SpindleSetup),
]);

/// The first parameter of the target.
const TARGET: usize = 6;

/// The points on bodies, that of the table first.
const POINTS: &[(&str, Frame)] = &[("target", Frame::Tool)];

pub(super) const ENTRY: Entry = Entry {
    free: Some("tracker"),
    reads_poses: true,
    default_errors: default_errors::all_locations,
    ..Entry::new(["tracker", "a laser tracker"], &PARAMETERS, schema::properties::<Keys>, POINTS, read)
};

/// The channels of coordinates.
const CARTESIAN: [Channel; 3] = Channel::vector(["x", "y", "z"]);

/// The channels of range and angles.
const POLAR: [Channel; 3] = [Channel::length("range"), Channel::angle("across"), Channel::angle("up")];

/// The columns of range and angles.
const OF_POLAR: [Column; 3] = [
    Column::new("range", Unit::Millimetre, Quantity::Polar(0)),
    Column::new("azimuth", Unit::Degree, Quantity::Polar(1)),
    Column::new("elevation", Unit::Degree, Quantity::Polar(2)),
];

/// The columns of coordinates.
const OF_CARTESIAN: [Column; 3] = Column::vector(["px", "py", "pz"], Unit::Millimetre);

/// The columns, those of a tracker with coordinates first.
const CARTESIAN_FIRST: [Column; 6] =
    [OF_CARTESIAN[0], OF_CARTESIAN[1], OF_CARTESIAN[2], OF_POLAR[0], OF_POLAR[1], OF_POLAR[2]];

/// The columns, those of a tracker with range and angles first.
const POLAR_FIRST: [Column; 6] =
    [OF_POLAR[0], OF_POLAR[1], OF_POLAR[2], OF_CARTESIAN[0], OF_CARTESIAN[1], OF_CARTESIAN[2]];

/// Least distance of the line of sight from the tracker's vertical axis at the target: nearer, the azimuth is not
/// defined, mm.
const MIN_MM: f64 = 1.0;

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Target in the tool frame.
    target_mm: document::Point,
    #[serde(default)]
    target_u_um: document::Uncertainties,
    /// Where the tracker stands in R, upright, for a plan that reads range and angles. Data have columns for them.
    tracker_mm: Option<document::Point>,
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let target = set_up.point("target", &keys.target_mm)?;
    let priors = [Prior::Free; 6].into_iter().chain(set_up::lengths(&keys.target_u_um)).collect();
    let mut stand = Stand::at_origin();
    if let Some(place) = &keys.tracker_mm {
        let place = set_up.coordinates("tracker_mm", place)?;
        stand.origin = place.map(|coordinate| Written::number(-coordinate.mm));
    }
    let is_polar = keys.tracker_mm.is_some();
    Ok(SetUp::new(Station::Tracker(Tracker { target, stand, is_polar }), priors))
}

/// A tracker as set up for one test, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracker<N> {
    /// The target.
    pub target: Target<N>,
    /// Where the tracker stands.
    pub stand: Stand<N>,
    /// Whether range and angles are read, not coordinates.
    pub is_polar: bool,
}

impl<N: Nominal> Tracker<N> {
    /// The nominal line of sight in the tracker's frame, with across towards increasing azimuth.
    fn sight<S: Scalar<Nominal = N>>(&self, machine: &Machine, state: &[AxisPosition<N>]) -> Sight<S> {
        let seen = self.stand.point(self.target.nominal_in_r::<S>(machine, state));
        let [x, y, _] = seen.0;
        let (range, level) = (seen.norm(), (x * x + y * y).sqrt());
        let ahead = Point(seen.0.map(|x| x / range));
        let across = Point([-y / level, x / level, S::constant(0.0)]);
        [ahead, across, cross(ahead.0, across)]
    }
}

impl<N> Geometry<N> for Tracker<N> {
    type Over<M> = Tracker<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Tracker<M> {
        Tracker { target: self.target.map(to), stand: self.stand.map(to), is_polar: self.is_polar }
    }
    fn keep_channels(&mut self, has: &dyn Fn(Quantity) -> bool) {
        if has(Quantity::Polar(0)) || has(Quantity::Channel(0)) {
            self.is_polar = has(Quantity::Polar(0));
        }
    }
    /// The coordinates in the tracker's frame, mm, or range and bearings, mm and rad.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let target = self.target.in_r(at, TARGET, &unknown);
        let seen = self.stand.point(pose_error(&unknown).map_or(target, |pose| pose.push(target)));
        if !self.is_polar {
            return Reading::of(seen.0);
        }
        let [across, up] = bearings(self.sight(at.machine, at.state), seen);
        Reading::of([seen.norm(), across, up])
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        [None, InstrumentPoint::of("target", &self.target, TARGET)]
    }
}

impl Instrument for Tracker<f64> {
    /// It sees the target wherever the axes are.
    fn aligned(&self, _: &Travel<'_>) -> Vec<Aligned> {
        Aligned::as_it_stands(self.clone())
    }
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let keys = Keys {
            target_mm: set_up::written_point(self.target.mm),
            target_u_um: set_up::written_lengths(priors, TARGET),
            tracker_mm: self.is_polar.then(|| set_up::written_point(self.stand.place_mm())),
        };
        set_up::written(&keys, &[])
    }
    fn handling(&self) -> Handling {
        let beside = "Laser tracker, where it sees the target at every position: its place is estimated";
        Handling { beside: Some(beside.into()), ..Handling::default() }
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [None, Some(&mut self.target)]
    }
    fn channels(&self) -> &[Channel] {
        if self.is_polar { &POLAR } else { &CARTESIAN }
    }
    fn columns(&self) -> &'static [Column] {
        if self.is_polar { &POLAR_FIRST } else { &CARTESIAN_FIRST }
    }
    fn refers_to_nominal(&self) -> bool {
        self.is_polar
    }
    fn channels_of_columns(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        if let (true, Some(seen)) = (self.is_polar, self.measured_mm(values)) {
            let [across, up] = observed_bearings(self.sight::<f64>(machine, state), Point(seen.into()));
            values[1..].copy_from_slice(&[across, up]);
        }
    }
    fn columns_of_channels(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        if let (true, [_, first, second]) = (self.is_polar, values) {
            let [x, y, z] = direction(self.sight::<f64>(machine, state), [*first, *second]).0;
            *first = y.atan2(x).rem_euclid(std::f64::consts::TAU);
            *second = z.atan2(x.hypot(y));
        }
    }
    fn measured_mm(&self, values: &[f64]) -> Option<Vector3<f64>> {
        let [first, azimuth, elevation] = *values else { return None };
        if !self.is_polar {
            return Some(Vector3::new(first, azimuth, elevation));
        }
        let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth.sin_cos(), elevation.sin_cos());
        Some(first * Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e))
    }
    /// The first coordinate, or the azimuth, has the opposite sign.
    fn mirror(&self, values: &mut [f64]) {
        let place = usize::from(self.is_polar);
        values[place] = -values[place];
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let needed = if OF_POLAR.iter().any(|column| has(column.quantity)) { OF_POLAR } else { OF_CARTESIAN };
        let column = needed.iter().find(|column| !has(column.quantity))?;
        let help = "a tracker needs px_mm, py_mm and pz_mm, or range_mm, azimuth_deg and elevation_deg";
        Some((format!("`{}`", column.name(column.unit)), help.into()))
    }
    fn placed(&self, group: &Group<'_>) -> Option<Station<f64>> {
        let pairs = group.positions();
        (!pairs.is_empty()).then(|| Station::Tracker(Tracker { stand: self.stand.best(&pairs), ..self.clone() }))
    }
    /// A planned line of sight has an azimuth.
    fn check_set_up(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        if !self.is_polar || !checked.readings.observed.is_empty() {
            return Ok(());
        }
        let points = checked.readings.nominal_points(checked.machine, &self.target);
        let level = points.into_iter().map(|point| {
            let [x, y, _] = self.stand.point::<f64>(Point(point.into())).0;
            x.hypot(y)
        });
        match level.enumerate().find(|(_, level)| *level < MIN_MM) {
            Some((row, level)) => Err((
                format!(
                    "test \"{}\", reading {}: the target nominally lies {level:.3} mm from the tracker's vertical axis, \
                     where no azimuth is defined",
                    checked.test,
                    row + 1
                ),
                "check `tracker_mm`, `target_mm` and the axis positions".into(),
            )),
            None => Ok(()),
        }
    }
    /// A range is positive, and an elevation within a right angle.
    fn check_observed(&self, test: &str, observed: &[f64]) -> Result<(), Fault> {
        if !self.is_polar {
            return Ok(());
        }
        for (row, values) in observed.chunks_exact(POLAR.len()).enumerate() {
            let place = format!("test \"{test}\", reading {}", row + 1);
            if values[0] <= 0.0 {
                let message = format!("{place}: the range is {:.3} mm", values[0]);
                return Err((message, "a range is positive".into()));
            }
            if values[2].abs() > std::f64::consts::FRAC_PI_2 {
                let message = format!("{place}: the elevation is {:.3}°", values[2].to_degrees());
                let help = "an elevation is within ±90° of the horizon: are these angles from the vertical, or in another \
                            unit than the name of the column says?";
                return Err((message, help.into()));
            }
        }
        Ok(())
    }
}
