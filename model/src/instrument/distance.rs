//! A distance from a station at a place that no one knows: LaserTRACER, wire, absolute distance meter.
//!
//! `D = ‖P − S‖ + D₀`: the reflector `P` of the tool, the station `S` on the table or on the bed, and the dead path `D₀`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::set_up::{self, SetUp};
use super::{Aligned, Travel, 
    Checked, Entry, Fault, Geometry, Handling, Instrument, InstrumentKind, InstrumentParameter, InstrumentPoint, Reading, SharedBy, Station,
    default_errors, displaced, point,
};
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::session::expression::Constant;
use crate::unit::Unit;

/// The station, the reflector in the tool frame, the dead path.
pub const PARAMETERS: [InstrumentParameter; 7] = [
    InstrumentParameter::length("station", "x", SharedBy::Setup),
    InstrumentParameter::length("station", "y", SharedBy::Setup),
    InstrumentParameter::length("station", "z", SharedBy::Setup),
    InstrumentParameter::length("reflector", "x", SharedBy::SpindleSetup),
    InstrumentParameter::length("reflector", "y", SharedBy::SpindleSetup),
    InstrumentParameter::length("reflector", "z", SharedBy::SpindleSetup),
    InstrumentParameter::length("zero", "", SharedBy::Setup),
];

/// Index of the dead path in [`PARAMETERS`].
const ZERO: usize = 6;

pub(super) const ENTRY: Entry = Entry {
    is_two_sided: true,
    reads_poses: true,
    default_errors: default_errors::all_locations,
    // The reflector stays mounted while the station moves.
    spindle_setup: Some("tool"),
    ..Entry::new(InstrumentKind::Distance, ["distance", "distances from a station"], &PARAMETERS, schema::properties::<Keys>, read)
};

/// The channels.
const CHANNELS: [Channel; 1] = [Channel::length("distance")];

/// The columns.
const COLUMNS: [Column; 1] = [Column::new("distance", Unit::Millimetre, Quantity::Length)];

/// Least distance: nearer, the direction of the beam is not defined, mm.
const MIN_MM: f64 = 1.0;

/// The body that carries the station.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
pub enum StationFrame {
    /// The table frame.
    #[default]
    Table,
    /// The bed: R.
    Bed,
}

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Reflector in the tool frame.
    reflector_mm: document::Point,
    #[serde(default)]
    reflector_u_um: document::Uncertainties,
    /// Station, in the frame that `station_frame` names.
    station_mm: document::Point,
    /// Standard uncertainty of each coordinate, µm; default: inf, no prior.
    #[serde(default = "document::Uncertainties::unknown")]
    station_u_um: document::Uncertainties,
    /// The frame that carries the station: "table" (default) or "bed".
    #[serde(default)]
    station_frame: StationFrame,
    /// Standard uncertainty of the dead path, µm; default: inf, no prior.
    #[serde(default = "document::Uncertainty::unknown")]
    zero_u_um: document::Uncertainty,
}

fn read(set_up: &Node, constants: &[Constant]) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up::keys(set_up)?;
    let reflector = set_up::point("reflector_mm", &keys.reflector_mm, constants)?;
    let station = set_up::point("station_mm", &keys.station_mm, constants)?;
    let points = set_up::lengths(&keys.station_u_um).chain(set_up::lengths(&keys.reflector_u_um));
    let priors = points.chain([set_up::length(keys.zero_u_um)]).collect();
    Ok(SetUp::new(Station::Distance(Distance { station, reflector, frame: keys.station_frame }), priors))
}

/// A station and its reflector, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Distance<N> {
    /// The station in its frame.
    pub station: [N; 3],
    /// The reflector in the tool frame.
    pub reflector: [N; 3],
    /// The frame that carries the station.
    pub frame: StationFrame,
}

impl<N> Geometry<N> for Distance<N> {
    type Over<M> = Distance<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Distance<M> {
        Distance {
            station: point(&self.station, to),
            reflector: point(&self.reflector, to),
            frame: self.frame,
        }
    }
    /// The distance, mm.
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
        let station = displaced(self.station, 0, &unknown);
        let station = match self.frame {
            StationFrame::Table => machine.workpiece_point(state, errors, station),
            StationFrame::Bed => station,
        };
        let reflector = machine.tool_point(state, errors, displaced(self.reflector, 3, &unknown));
        let distance = reflector.minus(station).norm();
        Reading::scalar(unknown(ZERO).map_or(distance, |zero| distance + zero))
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        let on_table = self.frame == StationFrame::Table;
        let station = InstrumentPoint::of("station", &self.station, 0).filter(|_| on_table);
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
            reflector_mm: set_up::written_point(self.reflector),
            reflector_u_um: set_up::written_lengths(priors, 3),
            station_mm: set_up::written_point(self.station),
            station_u_um: set_up::written_lengths(priors, 0),
            station_frame: self.frame,
            zero_u_um: set_up::written_u(priors.get(ZERO), Unit::Micrometre),
        };
        set_up::written(&keys, &["station_u_um", "zero_u_um"])
    }
    fn handling(&self) -> Handling {
        let beside = (self.frame == StationFrame::Bed).then(|| "Station, fixed to the bed: its place is estimated".into());
        Handling {
            beside,
            taken_off: Some("the reflector"),
            begins: Some("Mount the reflector, and let the beam find it"),
            reads_at_rest: true,
            ..Handling::default()
        }
    }
    fn points_mut(&mut self) -> [Option<&mut [f64; 3]>; 2] {
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
        for (row, reading) in checked.nominal(self).enumerate() {
            let distance = reading.channels()[0];
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
