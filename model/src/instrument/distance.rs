//! A distance from a station at a place that no one knows: LaserTRACER, wire, absolute distance meter.
//!
//! `D = ‖P − S‖ + D₀`: the reflector `P` of the tool, the station `S` on the table or on the bed, and the dead path `D₀`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::set_up::{self, SetUp, Stated};
use super::{Aligned, Travel, 
    Checked, Entry, Fault, Geometry, Handling, Instrument, InstrumentParameter, InstrumentPoint, Reading, SharedBy, Station, Target,
    default_errors,
};
use crate::chain::{Frame, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::unit::Unit;

/// The station, the reflector in the tool frame, the dead path.
pub const PARAMETERS: [InstrumentParameter; 7] = InstrumentParameter::all(&[
    &InstrumentParameter::point("station", SharedBy::Setup),
    &InstrumentParameter::point("reflector", SharedBy::SpindleSetup),
    &[InstrumentParameter::length("zero", "", SharedBy::Setup)],
]);

/// Index of the dead path in [`PARAMETERS`].
const ZERO: usize = 6;

/// The points on bodies, that of the table first.
const POINTS: &[(&str, Frame)] = &[("station", Frame::Table), ("reflector", Frame::Tool)];

pub(super) const ENTRY: Entry = Entry {
    is_two_sided: true,
    reads_poses: true,
    default_errors: default_errors::all_locations,
    // The reflector stays mounted while the station moves.
    spindle_setup: Some("tool"),
    ..Entry::new(["distance", "distances from a station"], &PARAMETERS, schema::properties::<Keys>, POINTS, read)
};

/// The channels.
const CHANNELS: [Channel; 1] = [Channel::length("distance")];

/// The columns.
const COLUMNS: [Column; 1] = [Column::new("distance", Unit::Millimetre, Quantity::Length)];

/// Least distance: nearer, the direction of the beam is not defined, mm.
const MIN_MM: f64 = 1.0;

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Reflector in the tool frame.
    reflector_mm: document::Point,
    #[serde(default)]
    reflector_u_um: document::Uncertainties,
    /// Station, in the frame that `station_frame` names: that of the table by default.
    station_mm: document::Point,
    /// Standard uncertainty of each coordinate, µm; default: inf, no prior.
    #[serde(default = "document::Uncertainties::unknown")]
    station_u_um: document::Uncertainties,
    /// Standard uncertainty of the dead path, µm; default: inf, no prior.
    #[serde(default = "document::Uncertainty::unknown")]
    zero_u_um: document::Uncertainty,
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let reflector = set_up.point("reflector", &keys.reflector_mm)?;
    let station = set_up.point("station", &keys.station_mm)?;
    let points = set_up::lengths(&keys.station_u_um).chain(set_up::lengths(&keys.reflector_u_um));
    let priors = points.chain([set_up::length(keys.zero_u_um)]).collect();
    Ok(SetUp::new(Station::Distance(Distance { station, reflector }), priors))
}

/// A station and its reflector, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Distance<N> {
    /// The station.
    pub station: Target<N>,
    /// The reflector.
    pub reflector: Target<N>,
}

impl<N> Geometry<N> for Distance<N> {
    type Over<M> = Distance<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Distance<M> {
        Distance { station: self.station.map(to), reflector: self.reflector.map(to) }
    }
    /// The distance, mm.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let station = self.station.in_r(at, 0, &unknown);
        let reflector = self.reflector.in_r(at, 3, &unknown);
        let distance = reflector.minus(station).norm();
        Reading::scalar(unknown(ZERO).map_or(distance, |zero| distance + zero))
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        // A station on the bed stands beside the machine.
        let is_on_bed = self.station.frame == Frame::Bed;
        let station = InstrumentPoint::of("station", &self.station, 0).filter(|_| !is_on_bed);
        [station, InstrumentPoint::of("reflector", &self.reflector, 3)]
    }
}

impl Instrument for Distance<f64> {
    /// Its beam follows the reflector.
    fn aligned(&self, _: &Travel<'_>) -> Vec<Aligned> {
        Aligned::as_it_stands(self.clone())
    }
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let keys = Keys {
            reflector_mm: set_up::written_point(self.reflector.mm),
            reflector_u_um: set_up::written_lengths(priors, 3),
            station_mm: set_up::written_point(self.station.mm),
            station_u_um: set_up::written_lengths(priors, 0),
            zero_u_um: set_up::written_u(priors.get(ZERO), Unit::Micrometre),
        };
        set_up::written(&keys, &["station_u_um", "zero_u_um"])
    }
    fn handling(&self) -> Handling {
        let beside = (self.station.frame == Frame::Bed).then(|| "Station, fixed to the bed: its place is estimated".into());
        Handling {
            beside,
            taken_off: Some("the reflector"),
            begins: Some("Mount the reflector, and let the beam find it"),
            reads_at_rest: true,
            ..Handling::default()
        }
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [Some(&mut self.station), Some(&mut self.reflector)]
    }
    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }
    fn columns(&self) -> &'static [Column] {
        &COLUMNS
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        (!has(Quantity::Length)).then(|| ("`distance_mm`".into(), "a distance needs its readings".into()))
    }
    /// The reflector is nominally not at the station.
    fn check_set_up(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        for (row, distance) in checked.nominal(Station::Distance(self.clone())).into_iter().enumerate() {
            if distance < MIN_MM {
                return Err((
                    format!(
                        "test \"{}\", reading {}: the reflector nominally lies {distance:.3} mm from the station; the \
                         least distance is {MIN_MM} mm",
                        checked.test,
                        row + 1
                    ),
                    "check `station_mm`, `reflector_mm` and the axis positions".into(),
                ));
            }
        }
        Ok(())
    }
}
