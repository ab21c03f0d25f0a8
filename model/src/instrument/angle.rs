//! An angle: autocollimator and polygon, rotary encoder, electronic level.
//!
//! The reading is the component about one direction of R, or two, of the rotation of a frame in addition to the commanded
//! one, plus a zero that is not known: `φ = d · (θ·n) + φ₀` ([`crate::rotation_error`]).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::check::check_small;
use super::kind::Checked;
use super::operation::direction_in_words;
use super::set_up::{self, SetUp, Stated, Written};
use super::{Aligned, Travel, 
    Entry, Fault, Geometry, Handling, Instrument, InstrumentParameter, Reading, SharedBy, Station,
    point,
};
use crate::axis::AxisKind;
use crate::chain::MachineState;
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::frames::dot_nominal;
use crate::rotation_error::Body;
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::unit::Unit;

/// The zero of each channel.
pub const PARAMETERS: [InstrumentParameter; 2] = [
    InstrumentParameter::angle("zero", "angle", SharedBy::SpindleSetup),
    InstrumentParameter::angle("zero", "angle2", SharedBy::SpindleSetup),
];

pub(super) const ENTRY: Entry = Entry {
    is_two_sided: true,
    rows_can_lack_channels: true,
    needs_every_axis: false,
    ..Entry::new(["angle", "a sensor of angles"], &PARAMETERS, schema::properties::<Keys>, &[], read)
};

/// A direction is horizontal if its component along gravity is smaller.
const LEVEL: f64 = 1e-6;

/// The channels.
const CHANNELS: [Channel; 2] = [Channel::angle("angle"), Channel::angle("angle2")];

/// The columns.
const COLUMNS: [Column; 2] = [
    Column::new("angle", Unit::Arcsecond, Quantity::Channel(0)),
    Column::new("angle2", Unit::Arcsecond, Quantity::Channel(1)),
];

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Direction in R about which the rotation is read, such as [0, 0, 1]; two for two columns, such as [[1, 0, 0], [0, 1,
    /// 0]].
    about: document::Directions,
    /// What turns: the tool against the table ("relative", the default), or the "tool" or the "table" against the bed,
    /// as a level reads it.
    #[serde(default)]
    body: Body,
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    if keys.about.0.len() > CHANNELS.len() {
        let message = format!("has {} directions; an angle has one or two", keys.about.0.len());
        return Err(KeyFault::of_key(message, None).at("about"));
    }
    let about: Vec<[Written; 3]> = keys.about.0.iter().map(|direction| direction.map(Written::number)).collect();
    let priors = (0..2).map(|channel| if channel < about.len() { Prior::Free } else { Prior::Known }).collect();
    Ok(SetUp::new(Station::Angle(Angle { about, body: keys.body }), priors))
}

/// A sensor of angles as set up for one test.
#[derive(Clone, Debug, PartialEq)]
pub struct Angle<N> {
    /// The direction of each channel in R, of unit length.
    pub about: Vec<[N; 3]>,
    /// The frame that turns.
    pub body: Body,
}

impl<N> Geometry<N> for Angle<N> {
    type Over<M> = Angle<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Angle<M> {
        let about = self.about.iter().map(|direction| point(direction, to)).collect();
        Angle { about, body: self.body }
    }
    /// The rotation about each direction, rad.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let rotation = at.machine.rotation_error(at.state, at.errors, self.body.frames());
        Reading::of(self.about.iter().enumerate().map(|(channel, about)| {
            let angle = dot_nominal(rotation, *about);
            unknown(channel).map_or(angle, |zero| angle + zero)
        }))
    }
}

impl Instrument for Angle<f64> {
    /// About a rotary axis, or across a linear one; a level about horizontal directions only, of a linear axis its roll too.
    fn aligned(&self, travel: &Travel<'_>) -> Vec<Aligned> {
        if !travel.moves(self.body) {
            return Vec::new();
        }
        let directions = match travel.machine.axes[travel.axis].kind {
            AxisKind::Rotary => vec![travel.direction],
            AxisKind::Linear if self.body == Body::Relative => travel.across().to_vec(),
            AxisKind::Linear => travel.across().into_iter().chain([travel.positive()]).collect(),
        };
        let gravity = travel.machine.gravity;
        let is_level = |about: &[f64; 3]| (0..3).map(|i| about[i] * gravity[i]).sum::<f64>().abs() < LEVEL;
        let readable: Vec<[f64; 3]> =
            directions.into_iter().filter(|about| self.body == Body::Relative || is_level(about)).collect();
        // As many directions at a time as it has columns.
        let sets = readable.chunks(self.about.len().max(1));
        let aligned = sets.map(|about| {
            let words: Vec<String> = about.iter().map(|about| direction_in_words(*about)).collect();
            let station = Station::Angle(Angle { about: about.to_vec(), body: self.body });
            Aligned { station, words: format!("read about {}", words.join(" and ")), is_new: true }
        });
        aligned.collect()
    }
    fn written(&self, _: &[Prior]) -> Option<Node> {
        let about = self.about.iter().map(|about| about.map(set_up::rounded)).collect();
        set_up::written(&Keys { about: document::Directions(about), body: self.body }, &[])
    }
    fn handling(&self) -> Handling {
        let about: Vec<String> = self.about.iter().map(|about| direction_in_words(*about)).collect();
        let on = match self.body {
            Body::Relative => "Sensor of angles, between table and tool",
            Body::Tool => "Sensor of angles, on the tool",
            Body::Table => "Sensor of angles, on the table",
        };
        Handling {
            beside: Some(format!("{on}: it reads about {} of R", about.join(" and "))),
            taken_off: Some("the sensor of angles"),
            begins: Some("Mount the sensor of angles, and set the reading to zero"),
            reads_at_rest: true,
            ..Handling::default()
        }
    }
    fn absent_channels_known(&self, priors: &mut [Prior]) {
        let zero = |channel: usize| if channel < self.about.len() { Prior::Free } else { Prior::Known };
        priors.iter_mut().enumerate().for_each(|(channel, prior)| *prior = zero(channel));
    }
    fn channels(&self) -> &[Channel] {
        &CHANNELS[..self.about.len()]
    }
    fn columns(&self) -> &'static [Column] {
        &COLUMNS[..self.about.len()]
    }
    fn positioning(&self) -> Option<([f64; 3], Body)> {
        Some((*self.about.first()?, self.body))
    }
    /// Rotation errors are small.
    fn check_readings(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        check_small(self.channels(), checked, 0)
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let column = self.columns().iter().find(|column| !has(column.quantity))?;
        let help = "an angle needs `angle_arcsec`, the deviation from the commanded rotation, and `angle2_arcsec` for a second direction in `about`";
        Some((format!("`{}`", column.name(column.unit)), help.into()))
    }
    fn help_on_column(&self, stem: &str) -> Option<&'static str> {
        (stem == "angle2").then_some("a second column needs its direction: `about = [[1, 0, 0], [0, 1, 0]]`")
    }
}
