//! Pointing: a mount carries a direction, and what it points at is known. Telescope, antenna, gimbal, theodolite.
//!
//! The actual line of sight reads its bearings (`bearing.rs`) about the nominal line of sight, with across and up, three
//! directions that the commanded mount carries. R has X to the north, Y
//! to the west and Z up; azimuth runs from north through east. The columns are the true azimuth and elevation; the axis
//! positions are the encoders.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bearing::{Sight, bearings, direction, observed_bearings};
use super::channel::Channel;
use super::column::{Column, Quantity};
use super::kind::{Checked, Group};
use super::set_up::{self, SetUp, Stated, Written};
use super::{Aligned, Travel, 
    Entry, Fault, Geometry, Instrument, InstrumentParameter, Reading, SharedBy, Station,
    default_errors, point,
};
use crate::median::median;
use crate::axis::AxisKind;
use crate::chain::{AxisPosition, BodyErrors, Frame, Machine, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::frames::{Point, cross, dot};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::session::readings::Readings;
use crate::unit::Unit;

/// The direction of the line of sight: across and up.
pub const PARAMETERS: [InstrumentParameter; 2] = [
    InstrumentParameter::angle("line_of_sight", "across", SharedBy::SpindleSetup),
    InstrumentParameter::angle("line_of_sight", "up", SharedBy::SpindleSetup),
];

pub(super) const ENTRY: Entry = Entry {
    reads_poses: true,
    default_errors: default_errors::orientations,
    // The line of sight stays from night to night.
    spindle_setup: Some("tool"),
    ..Entry::new(["pointing", "observed directions"], &PARAMETERS, schema::properties::<Keys>, &[], read)
};

/// The channels.
const CHANNELS: [Channel; 2] = [Channel::angle("across"), Channel::angle("up")];

/// The columns.
const COLUMNS: [Column; 2] = [
    Column::new("true_azimuth", Unit::Degree, Quantity::Channel(0)),
    Column::new("true_elevation", Unit::Degree, Quantity::Channel(1)),
];

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Line of sight in the tool frame; default [1, 0, 0].
    line_of_sight: Option<document::Direction>,
    /// Standard uncertainty of the line of sight, arcsec. Default: across without prior (the collimation error), up
    /// known, since the index error of the last axis has the same effect.
    line_of_sight_u_arcsec: Option<document::Uncertainty>,
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let sight = Point(keys.line_of_sight.map_or([1.0, 0.0, 0.0], |sight| sight.0));
    let is_free = keys.line_of_sight_u_arcsec.is_none_or(|u| set_up::angle(u) == Prior::Free);
    let priors = match keys.line_of_sight_u_arcsec {
        None => vec![Prior::Free, Prior::Known],
        Some(u) => vec![set_up::angle(u); 2],
    };
    let directions = about(sight).map(|direction| direction.0.map(Written::number));
    Ok(SetUp::new(Station::Pointing(Pointing { directions, is_free }), priors))
}

/// A line of sight with across and up. Across is horizontal; of a vertical line of sight it is −Y, as of one to the north.
pub(super) fn about(sight: Point<f64>) -> [Point<f64>; 3] {
    let horizontal = cross(sight.0, Point([0.0, 0.0, 1.0]));
    let length = horizontal.norm();
    let across = if length > 1e-6 { Point(horizontal.0.map(|x| x / length)) } else { Point([0.0, -1.0, 0.0]) };
    [sight, across, cross(across.0, sight)]
}

/// A line of sight as mounted.
#[derive(Clone, Debug, PartialEq)]
pub struct Pointing<N> {
    /// Line of sight, across and up in the tool frame, of unit length.
    pub directions: [[N; 3]; 3],
    /// Whether the line of sight has no prior, so that it is found where the stated one is far from all readings.
    pub is_free: bool,
}

impl<N: Nominal> Pointing<N> {
    /// Line of sight, across and up of the commanded mount, in R.
    fn nominal<S: Scalar<Nominal = N>>(&self, machine: &Machine, state: &[AxisPosition<N>]) -> Sight<S> {
        let none = vec![BodyErrors::<S>::NONE; machine.axes.len()];
        self.directions.map(|direction| machine.direction_in_r(Frame::Tool, state, &none, Point::nominal(direction)))
    }
}

impl<N> Geometry<N> for Pointing<N> {
    type Over<M> = Pointing<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Pointing<M> {
        Pointing {
            directions: self.directions.each_ref().map(|direction| point(direction, to)),
            is_free: self.is_free,
        }
    }
    /// Across and up, rad.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let MachineState { machine, state, errors } = at;
        let mut sight = Point::nominal(self.directions[0]);
        for (parameter, direction) in self.directions[1..].iter().enumerate() {
            if let Some(angle) = unknown(parameter) {
                sight = sight.plus(Point(direction.map(|x| angle * x)));
            }
        }
        let sight = machine.direction_in_r(Frame::Tool, state, errors, sight);
        Reading::of(bearings(self.nominal::<S>(machine, state), sight))
    }
}

impl Instrument for Pointing<f64> {
    /// Directions are observed wherever the mount points; a linear axis turns nothing.
    fn aligned(&self, travel: &Travel<'_>) -> Vec<Aligned> {
        match travel.machine.axes[travel.axis].kind {
            AxisKind::Rotary => Aligned::as_it_stands(self.clone()),
            AxisKind::Linear => Vec::new(),
        }
    }
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let is_default = matches!(priors, [Prior::Free, Prior::Known]);
        let keys = Keys {
            line_of_sight: Some(set_up::written_direction(self.directions[0])),
            line_of_sight_u_arcsec: None,
        };
        let mut node = set_up::written(&keys, &[])?;
        if !is_default {
            node.set("line_of_sight_u_arcsec", set_up::written_u(priors.first(), Unit::Arcsecond).0);
        }
        Some(node)
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
    fn channels_of_columns(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        if let [azimuth, elevation] = values {
            let observed = observed(*azimuth, *elevation);
            [*azimuth, *elevation] = observed_bearings(self.nominal::<f64>(machine, state), observed);
        }
    }
    fn columns_of_channels(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        if let [first, second] = values {
            let [x, y, z] = direction(self.nominal::<f64>(machine, state), [*first, *second]).0;
            *first = (-y).atan2(x).rem_euclid(std::f64::consts::TAU);
            *second = z.atan2(x.hypot(y));
        }
    }
    fn sight(&self, machine: &Machine, state: &[AxisPosition<f64>]) -> Option<[f64; 3]> {
        Some(self.nominal::<f64>(machine, state)[0].0)
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let column = COLUMNS.iter().find(|column| !has(column.quantity))?;
        let help = "pointing needs true_azimuth_deg and true_elevation_deg";
        Some((format!("`{}`", column.name(column.unit)), help.into()))
    }
    /// The mount points near what was observed, or one line of sight agrees with all of it.
    fn check_readings(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let seen = self.seen(checked.machine, checked.readings);
        let away_deg = self.away_deg(&seen);
        if away_deg <= MAX_AWAY_DEG || self.is_free && common_sight(&seen).is_some() {
            return Ok(());
        }
        Err((
            format!(
                "test \"{}\": the mount nominally points {away_deg:.1}° away from what was observed (median of {} \
                 readings); the limit is {MAX_AWAY_DEG}°",
                checked.test,
                seen.len()
            ),
            common_sight(&seen).map_or_else(
                || {
                    "check the directions of the axes (a mount that turns through east as R is defined has `direction = [0, \
                     0, -1]` for azimuth and `[0, -1, 0]` for elevation), `line_of_sight`, and the units of the columns"
                        .into()
                },
                |(sight, _)| {
                    let sight = shown(sight);
                    format!("most readings agree with `line_of_sight = {sight}`: state it, or leave out `line_of_sight_u_arcsec`")
                },
            ),
        ))
    }
    fn doubt(&self, checked: &Checked<'_>) -> Option<String> {
        let seen = self.seen(checked.machine, checked.readings);
        let away_deg = self.away_deg(&seen);
        let (sight, scatter_deg) = common_sight(&seen).filter(|_| away_deg > MAX_AWAY_DEG)?;
        Some(format!(
            "the mount nominally points {away_deg:.1}° away from what was observed (median). The readings lie {scatter_deg:.2}° \
             (median) from another line of sight, from which the fit starts: state `line_of_sight = {}`, in whole degrees, or \
             correct the zeros of the axes",
            shown(sight)
        ))
    }
    /// A line of sight without prior that is far from all readings is found from them, to a degree, so that sessions of one
    /// mount count from the same one.
    fn mounted(&self, group: &Group<'_>) -> Option<Station<f64>> {
        let seen: Vec<Point<f64>> =
            group.tests.iter().flat_map(|(_, readings)| self.seen(group.machine, readings)).collect();
        let is_found = self.is_free && !seen.is_empty() && self.away_deg(&seen) > MAX_AWAY_DEG;
        let (sight, _) = common_sight(&seen).filter(|_| is_found)?;
        Some(Station::Pointing(Pointing { directions: about(sight).map(|direction| direction.0), ..self.clone() }))
    }
}

impl Pointing<f64> {
    /// What was observed at each reading, in the tool frame.
    fn seen(&self, machine: &Machine, readings: &Readings) -> Vec<Point<f64>> {
        let mut state = Vec::new();
        let in_tool = |(row, values): (usize, &[f64])| {
            readings.state(machine, row, &mut state);
            let (seen, nominal) = (observed(values[0], values[1]), self.nominal::<f64>(machine, &state));
            let parts = nominal.iter().zip(&self.directions).map(|(now, tool)| Point(tool.map(|x| x * dot(seen, *now))));
            parts.fold(Point([0.0; 3]), |sum, part| sum.plus(part))
        };
        readings.observed.chunks_exact(CHANNELS.len()).enumerate().map(in_tool).collect()
    }
    /// The median angle between the line of sight and what was observed, deg.
    fn away_deg(&self, seen: &[Point<f64>]) -> f64 {
        median(&mut seen.iter().map(|seen| angle_deg(*seen, Point(self.directions[0]))).collect::<Vec<_>>())
    }
}

/// The line of sight in the tool frame that agrees with all that was observed, in whole degrees, and the median angle to it,
/// deg. `None` if they do not agree.
fn common_sight(seen: &[Point<f64>]) -> Option<(Point<f64>, f64)> {
    let [x, y, z] = seen.iter().fold(Point([0.0; 3]), |sum, seen| sum.plus(*seen)).0;
    let [across, up] = [y.atan2(x), z.atan2(x.hypot(y))].map(|angle| angle.to_degrees().round().to_radians());
    let sight = Point([up.cos() * across.cos(), up.cos() * across.sin(), up.sin()]);
    let scatter_deg = median(&mut seen.iter().map(|seen| angle_deg(*seen, sight)).collect::<Vec<_>>());
    (scatter_deg <= MAX_SCATTER_DEG).then_some((sight, scatter_deg))
}

/// A direction as a session states it.
fn shown(direction: Point<f64>) -> String {
    let [x, y, z] = direction.0;
    // Adding zero leaves no negative zero.
    format!("[{:.6}, {:.6}, {:.6}]", x + 0.0, y + 0.0, z + 0.0)
}

/// The angle between two directions of unit length, deg.
fn angle_deg(a: Point<f64>, b: Point<f64>) -> f64 {
    dot(a, b).clamp(-1.0, 1.0).acos().to_degrees()
}

/// The direction of an azimuth and an elevation in R.
fn observed(azimuth: f64, elevation: f64) -> Point<f64> {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth.sin_cos(), elevation.sin_cos());
    Point([cos_e * cos_a, -cos_e * sin_a, sin_e])
}

/// Largest typical angle between the nominal line of sight and what was observed, deg: index errors are smaller.
const MAX_AWAY_DEG: f64 = 20.0;
/// Largest scatter of what was observed about one line of sight, deg, at which it is that of the mount.
const MAX_SCATTER_DEG: f64 = 2.0;
