//! The laser interferometer and its kin: displacement, straightness and angles of a reflector against an optic.
//!
//! With the reflector `P` of the tool, the optic `O` of the table, both in R, the beam `b`, a horizontal and a vertical
//! direction `h` and `v`, all perpendicular, and the rotation vector `φ` of the tool against the table
//! ([`crate::rotation_error`]):
//!
//! ```text
//! displacement = b · (P − O)      horizontal = h · (P − O)      vertical = v · (P − O)
//! pitch = h · φ                   yaw = v · φ                   roll = b · φ
//! ```
//!
//! each plus a zero that is not known. The beam deviates from its nominal direction by two angles, towards `h` and `v`: a
//! slope of either straightness, and the cosine error of the displacement. A straightness is read as a deviation from its
//! nominal value; `displacement_mm` counts from any point.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::check::{self, MAX_MM};
use super::kind::Checked;
use super::operation::direction_in_words;
use super::set_up::{self, SetUp, Stated, Written};
use super::{Aligned, Travel, 
    Entry, Fault, Geometry, Handling, Instrument, InstrumentParameter, InstrumentPoint, Reading, SharedBy, Station, Target,
    point,
};
use crate::median::median;
use crate::axis::AxisKind;
use crate::chain::{AxisPosition, BodyErrors, Frame, Machine, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::frames::{Point, cross, dot, dot_nominal};
use crate::rotation_error::Body;
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::session::readings::Readings;
use crate::unit::Unit;

/// Reflector, optic, the beam's deviation, the zero of each channel.
pub const PARAMETERS: [InstrumentParameter; 14] = InstrumentParameter::all(&[
    &InstrumentParameter::point("reflector", SharedBy::SpindleSetup),
    &InstrumentParameter::point("optic", SharedBy::Setup),
    &[
        InstrumentParameter::angle("beam", "horizontal", SharedBy::Setup),
        InstrumentParameter::angle("beam", "vertical", SharedBy::Setup),
        InstrumentParameter::length("zero", "displacement", SharedBy::Setup),
        InstrumentParameter::length("zero", "horizontal", SharedBy::Setup),
        InstrumentParameter::length("zero", "vertical", SharedBy::Setup),
        InstrumentParameter::angle("zero", "pitch", SharedBy::Setup),
        InstrumentParameter::angle("zero", "yaw", SharedBy::Setup),
        InstrumentParameter::angle("zero", "roll", SharedBy::Setup),
    ],
]);

const OPTIC: usize = 3;
const BEAM: usize = 6;
const ZERO: usize = 8;

/// The points on bodies, that of the table first.
const POINTS: &[(&str, Frame)] = &[("optic", Frame::Table), ("reflector", Frame::Tool)];

pub(super) const ENTRY: Entry = Entry {
    is_two_sided: true,
    rows_can_lack_channels: true,
    needs_every_axis: false,
    ..Entry::new(["laser", "a laser interferometer"], &PARAMETERS, schema::properties::<Keys>, POINTS, read)
};

/// The channels in the order of their zeros.
const CHANNELS: [Channel; 6] = [
    Channel::length("displacement"),
    Channel::length("horizontal"),
    Channel::length("vertical"),
    Channel::angle("pitch"),
    Channel::angle("yaw"),
    Channel::angle("roll"),
];

/// The columns.
const COLUMNS: [Column; 7] = [
    Column::new("displacement", Unit::Millimetre, Quantity::Channel(0)),
    Column::new("deviation", Unit::Micrometre, Quantity::FromNominal(0)),
    Column::new("horizontal", Unit::Micrometre, Quantity::Channel(1)),
    Column::new("vertical", Unit::Micrometre, Quantity::Channel(2)),
    Column::new("pitch", Unit::Arcsecond, Quantity::Channel(3)),
    Column::new("yaw", Unit::Arcsecond, Quantity::Channel(4)),
    Column::new("roll", Unit::Arcsecond, Quantity::Channel(5)),
];

/// The channels of straightness.
const STRAIGHTNESS: std::ops::Range<usize> = 1..3;

/// Largest zero of a displacement that is estimated from its nominal value, mm. Beyond it the column counts from another
/// point.
const MAX_ZERO_MM: f64 = 1.0;

/// A direction whose component along Z is larger is vertical.
const VERTICAL: f64 = 0.999;

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Reflector in the tool frame; default [0, 0, 0].
    reflector_mm: Option<document::Point>,
    #[serde(default)]
    reflector_u_um: document::Uncertainties,
    /// The other optic in the table frame; default [0, 0, 0].
    optic_mm: Option<document::Point>,
    #[serde(default)]
    optic_u_um: document::Uncertainties,
    /// Direction of the beam in R, such as [1, 0, 0].
    beam: document::Direction,
    /// Standard uncertainty of the beam's direction, arcsec; default: inf with a straightness, else known.
    beam_u_arcsec: Option<document::Uncertainty>,
    /// What a plan reads: some of "displacement", "horizontal", "vertical", "pitch", "yaw", "roll"; data have a column
    /// for each. Default: displacement.
    channels: Option<Vec<Word>>,
}

/// The word of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
enum Word {
    Displacement,
    Horizontal,
    Vertical,
    Pitch,
    Yaw,
    Roll,
}

impl Word {
    /// In the order of the channels.
    const ALL: [Word; 6] = [Word::Displacement, Word::Horizontal, Word::Vertical, Word::Pitch, Word::Yaw, Word::Roll];
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let reflector = set_up.point("reflector", &keys.reflector_mm)?;
    let optic = set_up.point("optic", &keys.optic_mm)?;
    let frame = frame(keys.beam.0).map(|direction| direction.map(Written::number));
    let mut channels: Vec<usize> = match &keys.channels {
        Some(words) if words.is_empty() => {
            return Err(KeyFault::of_key("is empty; a laser reads at least one", None).at("channels"));
        }
        Some(words) => words.iter().map(|word| *word as usize).collect(),
        None => vec![0],
    };
    channels.sort_unstable();
    channels.dedup();
    let beam = keys.beam_u_arcsec.map(set_up::angle);
    let points = set_up::lengths(&keys.reflector_u_um).chain(set_up::lengths(&keys.optic_u_um));
    let mut priors: Vec<Prior> = points.chain([beam.unwrap_or(Prior::Free); 2]).chain([Prior::Free; 6]).collect();
    hold_absent(&channels, beam.is_some(), &mut priors);
    let channels = of_places(&channels);
    let laser = Laser { reflector, optic, frame, channels, is_beam_stated: beam.is_some(), datum: Written::number(0.0) };
    Ok(SetUp::new(Station::Laser(laser), priors))
}

fn of_places(places: &[usize]) -> Vec<Channel> {
    places.iter().map(|place| CHANNELS[*place]).collect()
}

/// The places of channels among all that a laser can have.
fn places(channels: &[Channel]) -> impl Iterator<Item = usize> {
    channels.iter().filter_map(|channel| CHANNELS.iter().position(|other| other == channel))
}

impl Laser<f64> {
    /// The displacements less their nominal values, mm; `None` if the laser reads none.
    fn displacements(&self, machine: &Machine, readings: &Readings) -> Option<Vec<f64>> {
        if places(&self.channels).next() != Some(0) {
            return None;
        }
        let station = Station::Laser(self.clone());
        let mut nominal = readings.nominal(machine, &station);
        let deviation = |row: usize| {
            let observed = readings.observed.get(row * readings.channels).copied()?;
            Some(observed - nominal(row).channels()[0]).filter(|value| value.is_finite())
        };
        Some((0..readings.rows()).filter_map(deviation).collect())
    }

    /// Adds the nominal reading of each straightness, times a factor.
    fn add_nominal(&self, machine: &Machine, state: &[AxisPosition<f64>], factor: f64, values: &mut [f64]) {
        let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
        let nominal = self.reading::<f64>(MachineState { machine, state, errors: &none }, |_| None);
        let read = places(&self.channels).zip(values).zip(nominal.channels());
        let straightness = read.filter(|((place, _), _)| STRAIGHTNESS.contains(place));
        straightness.for_each(|((_, value), nominal)| *value += factor * nominal);
    }
}

/// Holds the zeros of channels that are not read; the beam, if its direction is not stated, in the directions of which no
/// straightness is read.
fn hold_absent(channels: &[usize], is_beam_stated: bool, priors: &mut [Prior]) {
    for channel in 0..CHANNELS.len() {
        priors[ZERO + channel] = if channels.contains(&channel) { Prior::Free } else { Prior::Known };
    }
    if !is_beam_stated {
        for straightness in 0..2 {
            let is_read = channels.contains(&(1 + straightness));
            priors[BEAM + straightness] = if is_read { Prior::Free } else { Prior::Known };
        }
    }
}

/// Beam, horizontal and vertical: perpendicular directions in R. Their signs are those of R's directions: horizontal is
/// towards +X or +Y, vertical upwards. A vertical beam has X as horizontal and Y as vertical.
fn frame(beam: [f64; 3]) -> [[f64; 3]; 3] {
    let above = if beam[2].abs() > VERTICAL { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let unit = |v: [f64; 3]| {
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let largest = v.iter().copied().fold(0.0_f64, |a, b| if b.abs() > a.abs() + 1e-12 { b } else { a });
        v.map(|x| x * largest.signum() / length)
    };
    let horizontal = unit(cross(above, Point(beam)).0);
    [beam, horizontal, unit(cross(beam, Point(horizontal)).0)]
}

/// A laser as set up for one test, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Laser<N> {
    /// The reflector.
    pub reflector: Target<N>,
    /// The other optic.
    pub optic: Target<N>,
    /// Beam, horizontal and vertical in R, of unit length.
    pub frame: [[N; 3]; 3],
    /// The channels that are read, in the order of their zeros.
    pub channels: Vec<Channel>,
    /// Whether the uncertainty of the beam is stated.
    pub is_beam_stated: bool,
    /// What the displacement counts from, mm: the reading where reflector and optic coincide.
    pub datum: N,
}

impl<N> Geometry<N> for Laser<N> {
    type Over<M> = Laser<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Laser<M> {
        Laser {
            reflector: self.reflector.map(to),
            optic: self.optic.map(to),
            frame: self.frame.each_ref().map(|direction| point(direction, to)),
            channels: self.channels.clone(),
            is_beam_stated: self.is_beam_stated,
            datum: to(&self.datum),
        }
    }
    fn keep_channels(&mut self, has: &dyn Fn(Quantity) -> bool) {
        let is_read = |channel: usize| {
            has(Quantity::Channel(channel)) || has(Quantity::FromNominal(channel))
        };
        let read: Vec<usize> = (0..CHANNELS.len()).filter(|channel| is_read(*channel)).collect();
        if !read.is_empty() {
            self.channels = of_places(&read);
        }
    }
    /// The channels, mm or rad.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let reads = |channels: std::ops::Range<usize>| places(&self.channels).any(|place| channels.contains(&place));
        let from_optic = reads(0..3).then(|| {
            let reflector = self.reflector.in_r(at, 0, &unknown);
            reflector.minus(self.optic.in_r(at, OPTIC, &unknown))
        });
        let frames = [self.reflector.frame, self.optic.frame];
        let rotation = reads(3..6).then(|| at.machine.rotation_error(at.state, at.errors, frames));
        let frame = beam_frame(self.frame, unknown(BEAM), unknown(BEAM + 1));
        Reading::of(places(&self.channels).map(|channel| {
            let value = match (channel, &from_optic, &rotation, &frame) {
                (0..3, Some(from_optic), _, None) => dot_nominal(*from_optic, self.frame[channel]),
                (0..3, Some(from_optic), _, Some(frame)) => dot(*from_optic, frame[channel]),
                // Pitch about the horizontal, yaw about the vertical, roll about the beam.
                (_, _, Some(rotation), _) => dot_nominal(*rotation, self.frame[(channel - 2) % 3]),
                _ => S::constant(0.0),
            };
            let value = if channel == 0 { value + self.datum } else { value };
            unknown(ZERO + channel).map_or(value, |zero| value + zero)
        }))
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        [InstrumentPoint::of("optic", &self.optic, OPTIC), InstrumentPoint::of("reflector", &self.reflector, 0)]
    }
}

/// Beam, horizontal and vertical of a beam that deviates towards horizontal and vertical by angles; `None` for a nominal
/// one. The beam is turned within the plane of its nominal direction and the deviation, and the others are perpendicular
/// to it.
fn beam_frame<S: Scalar>(
    nominal: [[S::Nominal; 3]; 3],
    towards_horizontal: Option<S>,
    towards_vertical: Option<S>,
) -> Option<[Point<S>; 3]> {
    if towards_horizontal.is_none() && towards_vertical.is_none() {
        return None;
    }
    let zero = S::constant(0.0);
    let (alpha, beta) = (towards_horizontal.unwrap_or(zero), towards_vertical.unwrap_or(zero));
    let [beam, horizontal, vertical] = nominal;
    let unit = |v: Point<S>| {
        let length = v.norm();
        Point(v.0.map(|x| x / length))
    };
    let along = |direction: [S::Nominal; 3], angle: S| Point(direction.map(|x| angle * x));
    let turned = unit(Point::nominal(beam).plus(along(horizontal, alpha)).plus(along(vertical, beta)));
    let perpendicular = |direction: [S::Nominal; 3]| {
        let direction = Point::nominal(direction);
        let part = dot(direction, turned);
        unit(direction.minus(Point(turned.0.map(|x| x * part))))
    };
    Some([turned, perpendicular(horizontal), perpendicular(vertical)])
}

impl Instrument for Laser<f64> {
    /// The beam along a linear axis.
    fn aligned(&self, travel: &Travel<'_>) -> Vec<Aligned> {
        if travel.machine.axes[travel.axis].kind != AxisKind::Linear {
            return Vec::new();
        }
        let beam = travel.positive();
        let station = Station::Laser(Laser { frame: frame(beam), datum: 0.0, ..self.clone() });
        vec![Aligned { station, words: format!("beam along {}", direction_in_words(beam)), is_new: true }]
    }
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let point = |point: [f64; 3]| (point != [0.0; 3]).then(|| set_up::written_point(point));
        let words = places(&self.channels).filter_map(|place| Word::ALL.get(place).copied());
        let keys = Keys {
            reflector_mm: point(self.reflector.mm),
            reflector_u_um: set_up::written_lengths(priors, 0),
            optic_mm: point(self.optic.mm),
            optic_u_um: set_up::written_lengths(priors, OPTIC),
            beam: set_up::written_direction(self.frame[0]),
            beam_u_arcsec: None,
            channels: Some(words.collect()),
        };
        let mut node = set_up::written(&keys, &[])?;
        if self.is_beam_stated {
            // Zero is stated too: without it the direction is estimated with a straightness.
            node.set("beam_u_arcsec", set_up::written_u(priors.get(BEAM), Unit::Arcsecond).0);
        }
        Some(node)
    }
    fn handling(&self) -> Handling {
        let beam = direction_in_words(self.frame[0]);
        let beside = format!("Laser, its beam along {beam} of R and aligned over the whole travel");
        Handling {
            beside: Some(beside),
            taken_off: Some("the optics"),
            begins: Some("Mount the optics, align the beam, and set the reading to zero"),
            reads_at_rest: true,
            ..Handling::default()
        }
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [Some(&mut self.optic), Some(&mut self.reflector)]
    }
    fn channels(&self) -> &[Channel] {
        &self.channels
    }
    fn columns(&self) -> &'static [Column] {
        &COLUMNS
    }
    fn positioning(&self) -> Option<([f64; 3], Body)> {
        (places(&self.channels).next() == Some(0)).then_some((self.frame[0], Body::Relative))
    }
    fn is_straightness(&self, channel: usize) -> bool {
        places(&self.channels).nth(channel).is_some_and(|place| STRAIGHTNESS.contains(&place))
    }
    fn kept_channel(&self, of_all: usize) -> Option<usize> {
        places(&self.channels).position(|place| place == of_all)
    }
    fn refers_to_nominal(&self) -> bool {
        places(&self.channels).any(|place| STRAIGHTNESS.contains(&place))
    }
    /// A straightness is read as a deviation.
    fn channels_of_columns(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        self.add_nominal(machine, state, 1.0, values);
    }
    fn columns_of_channels(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        self.add_nominal(machine, state, -1.0, values);
    }
    /// A displacement may count from any point: its zero is then far from the one that iterations can start from.
    fn with_datum(&self, machine: &Machine, readings: &Readings) -> Option<Station<f64>> {
        let from = median(&mut self.displacements(machine, readings)?);
        (from.abs() > MAX_ZERO_MM).then(|| Station::Laser(Laser { datum: self.datum + from, ..self.clone() }))
    }
    /// A displacement is about as long as the travel, and straightness and angles are small.
    fn check_readings(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let readings = checked.readings;
        if let Some(mut deviations) = self.displacements(checked.machine, readings) {
            let away = check::median_absolute_deviation(&mut deviations);
            if away > MAX_MM {
                return Err((
                    format!(
                        "test \"{}\": the displacement differs from the travel along the beam by {away:.3} mm (median \
                         of {} readings); the limit is {MAX_MM} mm",
                        checked.test,
                        deviations.len()
                    ),
                    "is the column in another unit than its name says, or has the beam the opposite direction?".into(),
                ));
            }
        }
        let skipped = usize::from(places(&self.channels).next() == Some(0));
        check::check_small(self.channels(), checked, skipped)
    }
    fn doubt(&self, checked: &Checked<'_>) -> Option<String> {
        check::doubt_on_displacements(&mut self.displacements(checked.machine, checked.readings)?)
    }
    fn absent_channels_known(&self, priors: &mut [Prior]) {
        hold_absent(&places(&self.channels).collect::<Vec<_>>(), self.is_beam_stated, priors);
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let missing = !COLUMNS.iter().any(|column| has(column.quantity));
        let help = "a laser needs at least one of displacement_mm, deviation_um, horizontal_um, vertical_um, \
                    pitch_arcsec, yaw_arcsec, roll_arcsec";
        missing.then(|| ("with the readings of the laser".into(), help.into()))
    }
}
