//! What an instrument consists of: each file of this folder holds one and implements these traits.

use nalgebra::Vector3;

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::default_errors;
use super::operation::{Aligned, Contact, Following, Handling, Travel};
use super::set_up::{self, SetUp, Stated};
use super::target::Target;
use super::{InstrumentParameter, Reading, SharedBy, Station};
use crate::chain::{AxisPosition, Frame, Machine, MachineState};
use crate::component::ErrorName;
use crate::document::Fault as KeyFault;
use crate::document::node::Node;
use crate::rotation_error::Body;
use crate::scalar::{Nominal, Scalar};
use crate::sensitivity::{SlotValues, TestModel};
use crate::session::Prior;
use crate::session::expression::Constant;
use crate::session::readings::Readings;
use crate::words::number;

/// An instrument in the registry: what is known of it without a set-up.
pub struct Entry {
    /// The word in files.
    pub word: &'static str,
    /// What it is in a sentence, with its article.
    pub phrase: &'static str,
    /// Its parameters in the order of its slots.
    pub parameters: &'static [InstrumentParameter],
    /// The object that stands at a place that no session knows: its parameters have no prior by default. All others are
    /// known exactly.
    pub free: Option<&'static str>,
    /// Whether a reading connects a point of the table and a point of the tool, so that errors of both sides affect it.
    pub is_two_sided: bool,
    /// Whether readings without runs are independent poses.
    pub reads_poses: bool,
    /// Whether a row may lack the value of a channel.
    pub rows_can_lack_channels: bool,
    /// Whether it has readings of its own; otherwise the positions of the axes are all that is read.
    pub has_readings: bool,
    /// Whether data must give the position of every axis. Otherwise the axes that move are enough.
    pub needs_every_axis: bool,
    /// The errors to be estimated if a session states none.
    pub default_errors: fn(&Machine) -> Vec<ErrorName>,
    /// The name that all tests share for the mounted object in the tool frame if a session states none; `None`: it is
    /// mounted for each test.
    pub spindle_setup: Option<&'static str>,
    /// The schemas of these keys, without the frames of points.
    pub(super) keys: fn() -> serde_json::Map<String, serde_json::Value>,
    /// Its points on bodies, each with its default frame. Each has a key with the suffix `_frame`.
    pub points: &'static [(&'static str, Frame)],
    /// Reads the set-up of a test.
    pub(super) read: fn(&Stated<'_>) -> Result<SetUp, KeyFault>,
}

impl Entry {
    /// An instrument that is mounted for each test, has readings in every row, and reads one side of the machine. What
    /// differs is stated with `..Entry::new(…)`.
    pub(super) const fn new(
        [word, phrase]: [&'static str; 2],
        parameters: &'static [InstrumentParameter],
        keys: fn() -> serde_json::Map<String, serde_json::Value>,
        points: &'static [(&'static str, Frame)],
        read: fn(&Stated<'_>) -> Result<SetUp, KeyFault>,
    ) -> Entry {
        Entry {
            word,
            phrase,
            parameters,
            free: None,
            is_two_sided: false,
            reads_poses: false,
            rows_can_lack_channels: false,
            has_readings: true,
            needs_every_axis: true,
            default_errors: default_errors::none,
            spindle_setup: None,
            keys,
            points,
            read,
        }
    }

    /// The schemas of the keys of a test that only some instruments have.
    pub fn keys(&self) -> serde_json::Map<String, serde_json::Value> {
        let frames = self.points.iter().map(|(name, _)| (format!("{name}{}", set_up::FRAME), set_up::frame_schema()));
        (self.keys)().into_iter().chain(frames).collect()
    }

    /// See [`InstrumentKind::set_up`](super::InstrumentKind::set_up).
    pub(super) fn set_up(&self, keys: &Node, constants: &[Constant], machine: &Machine) -> Result<SetUp, KeyFault> {
        (self.read)(&Stated::new(self.points, keys, constants, machine)?)
    }
}

/// The nominal geometry of an instrument over an open number.
pub trait Geometry<N> {
    /// The same over another number.
    type Over<M>;
    /// Converts every nominal coordinate: expressions to numbers or symbols.
    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Self::Over<M>;
    /// The reading; see [`Station::read`].
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal;
    /// Keeps the channels for which data have a column, for an instrument whose channels the data determine.
    fn keep_channels(&mut self, has: &dyn Fn(Quantity) -> bool) {
        let _ = has;
    }
    /// Its point on the table and its point on the tool, if it has them.
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        [None, None]
    }
}

/// A point of an instrument as set up.
#[derive(Clone, Copy, Debug)]
pub struct InstrumentPoint<'a, N> {
    /// What is there, in words.
    pub name: &'static str,
    /// Where it is.
    pub target: &'a Target<N>,
    /// The first of its three parameters among those of the instrument.
    pub first: usize,
}

impl<'a, N> InstrumentPoint<'a, N> {
    pub(super) const fn of(name: &'static str, target: &'a Target<N>, first: usize) -> Option<Self> {
        Some(InstrumentPoint { name, target, first })
    }
}

/// A message and what to do.
pub type Fault = (String, String);

/// Tests that share an object, with their readings.
pub struct Group<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Set-up and readings of each test.
    pub tests: Vec<(&'a Station<f64>, &'a Readings)>,
}

impl Group<'_> {
    /// The nominal position of the instrument's tool-frame point in R, at every row of all tests.
    pub(super) fn tool_points(&self) -> Vec<Vector3<f64>> {
        let of = |(station, readings): &(&Station<f64>, &Readings)| {
            readings.nominal_points(self.machine, &station.tool_point())
        };
        self.tests.iter().flat_map(of).collect()
    }

    /// The nominal position in R and the measured position of every row that has one.
    pub(super) fn positions(&self) -> Vec<[Vector3<f64>; 2]> {
        let measured = |(station, readings): &(&Station<f64>, &Readings)| -> Vec<Option<Vector3<f64>>> {
            readings.observed.chunks_exact(readings.channels).map(|values| station.measured_mm(values)).collect()
        };
        let measured = self.tests.iter().flat_map(measured);
        let pairs = self.tool_points().into_iter().zip(measured).filter_map(|(point, seen)| Some([point, seen?]));
        pairs.filter(|[_, seen]| seen.iter().all(|value| value.is_finite())).collect()
    }
}

/// The readings of a test, for the check of a set-up.
#[derive(Clone, Copy)]
pub struct Checked<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The name of the test.
    pub test: &'a str,
    /// Its readings.
    pub readings: &'a Readings,
}

impl Checked<'_> {
    /// The nominal values of the channels of every row, mm or rad, row after row.
    pub(super) fn nominal(&self, station: Station<f64>) -> Vec<f64> {
        let model = TestModel::new(self.machine.clone(), station, self.readings);
        model.readings(&SlotValues::zero(model.slots()))
    }

    /// Where the axes are at a row that move during the test, or all if none does: `c_deg = 30`.
    pub(super) fn place(&self, row: usize) -> String {
        let moves = |column: &[f64]| column.iter().any(|q| *q != column[0]);
        let any = self.readings.positions.iter().any(|column| moves(column));
        let axes = self.machine.axes.iter().zip(&self.readings.positions);
        let named = axes.filter(|(_, column)| !any || moves(column)).map(|(axis, column)| {
            format!("{} = {}", axis.column(""), number((axis.kind.to_display(column[row]) * 1e3).round() / 1e3))
        });
        named.collect::<Vec<_>>().join(", ")
    }
}

/// In what respect columns are misread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MisreadingKind {
    /// A column has the opposite sign.
    Sign,
    /// Columns have another unit.
    Unit,
    /// Columns have another order, or follow another convention.
    Order,
}

/// A way in which files of an instrument are misread.
pub struct Misreading {
    /// In what respect.
    pub kind: MisreadingKind,
    /// The columns.
    pub columns: &'static str,
    /// What would explain the readings, after "if": a clause.
    pub words: &'static str,
    /// The values of the columns of a reading as they would be.
    pub reread: fn(&mut [f64]),
}

/// Everything that is particular to one instrument as set up for a test, except its reading: see [`Geometry`].
pub trait Instrument {
    /// The channels of a reading, in order.
    fn channels(&self) -> &[Channel];
    /// The place among the channels of one of all that the instrument can have; `None` if the data have no column of
    /// it.
    fn kept_channel(&self, of_all: usize) -> Option<usize> {
        Some(of_all)
    }
    /// Sets the priors of parameters that only absent channels have to known.
    fn absent_channels_known(&self, priors: &mut [Prior]) {
        let _ = priors;
    }
    /// The columns of its readings in data files.
    fn columns(&self) -> &'static [Column];
    /// Whether a channel refers to the nominal reading at the state of the axes, so that its value is another than that
    /// of its column.
    fn refers_to_nominal(&self) -> bool {
        false
    }
    /// The values of the channels at a state of the axes, from those of the columns, if they differ.
    fn channels_of_columns(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        let _ = (machine, state, values);
    }
    /// The inverse of [`Instrument::channels_of_columns`].
    fn columns_of_channels(&self, machine: &Machine, state: &[AxisPosition<f64>], values: &mut [f64]) {
        let _ = (machine, state, values);
    }
    /// The keys of a test that describe this set-up with these priors, as they stand in a file; `None` if it cannot be
    /// written.
    fn written(&self, priors: &[Prior]) -> Option<Node>;
    /// What data lack: the columns and what to do. `has` says whether there is a column of a quantity.
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault>;

    /// What to do with a column of this name, without its unit, that the instrument has in another set-up.
    fn help_on_column(&self, stem: &str) -> Option<&'static str> {
        let _ = stem;
        None
    }
    /// What a pose that it measures has to meet.
    fn contact(&self) -> Contact {
        Contact::None
    }
    /// Whether the place of its object is known: stated, or found from readings.
    fn is_located(&self) -> bool {
        true
    }
    /// What an operator does with it.
    fn handling(&self) -> Handling {
        Handling::default()
    }
    /// The set-ups that read a move of one axis while the others stand. None of an instrument whose points have to stay in
    /// contact ([`Instrument::approaches`]), or that does not read this move.
    fn aligned(&self, travel: &Travel<'_>) -> Vec<Aligned> {
        let _ = travel;
        Vec::new()
    }
    /// Where its point of the tool is beside its point of the table when they are in contact, in the table frame, mm: one
    /// vector for each side of approach. None without a contact, or at the length of a bar.
    fn approaches(&self) -> Vec<[f64; 3]> {
        Vec::new()
    }
    /// The radius of the circle on which the tool stays in contact about its point of the table, and the axis of that circle
    /// in the table frame, if there is one.
    fn circled(&self) -> Option<(f64, [f64; 3])> {
        None
    }
    /// The length to which deviations refer, mm; 0 without one.
    fn reference_mm(&self) -> f64 {
        0.0
    }
    /// The mount of the sensors.
    fn sensors(&self) -> SharedBy {
        SharedBy::Setup
    }
    /// How its points move on a path of kind `follow`.
    fn following(&self) -> Following {
        Following::Apart
    }
    /// The same at the place that agrees best with the readings of a group of tests, for an object whose place no session
    /// knows.
    fn placed(&self, group: &Group<'_>) -> Option<Station<f64>> {
        let _ = group;
        None
    }
    /// The same with its object in the tool frame mounted as agrees best with the readings of the tests that share it,
    /// after all are placed.
    fn mounted(&self, group: &Group<'_>) -> Option<Station<f64>> {
        let _ = group;
        None
    }
    /// The measured position in the instrument's frame, from the values of the columns, if it measures positions.
    fn measured_mm(&self, values: &[f64]) -> Option<Vector3<f64>> {
        let _ = values;
        None
    }
    /// The direction in R to which it nominally points at a state of the axes, of unit length, if it reads directions of
    /// the sky.
    fn sight(&self, machine: &Machine, state: &[AxisPosition<f64>]) -> Option<[f64; 3]> {
        let _ = (machine, state);
        None
    }
    /// Mirrors a measured position or pose in the instrument's frame.
    fn mirror(&self, values: &mut [f64]) {
        let _ = values;
    }
    /// Ways in which its columns are misread, beside the unit of lengths and a mirrored frame.
    fn misreadings(&self) -> &'static [Misreading] {
        &[]
    }
    /// The same with the point from which its readings count, if that is another than the nominal one.
    fn with_datum(&self, machine: &Machine, readings: &Readings) -> Option<Station<f64>> {
        let _ = (machine, readings);
        None
    }
    /// The direction in R along which, or about which, its first channel reads the positioning of an axis, and the body
    /// that it reads, if it does.
    fn positioning(&self) -> Option<([f64; 3], Body)> {
        None
    }
    /// Whether one of its channels reads straightness: across the beam, as a deviation.
    fn is_straightness(&self, channel: usize) -> bool {
        let _ = channel;
        false
    }
    /// Its point on the table and its point on the tool, if they are its own.
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [None, None]
    }
    /// Checks that the instrument nominally fits at the positions of the readings.
    ///
    /// # Errors
    /// If it does not.
    fn check_set_up(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let _ = checked;
        Ok(())
    }
    /// Checks that the instrument nominally fits at every position of a planned motion.
    ///
    /// # Errors
    /// If it does not.
    fn check_planned(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let _ = checked;
        Ok(())
    }
    /// Checks the readings against the nominal set-up.
    ///
    /// # Errors
    /// If they cannot be readings of it.
    fn check_readings(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let _ = checked;
        Ok(())
    }
    /// What is doubtful about usable readings.
    fn doubt(&self, checked: &Checked<'_>) -> Option<String> {
        let _ = checked;
        None
    }
    /// Checks that the observed values are in the range of the instrument.
    ///
    /// # Errors
    /// If they are not.
    fn check_observed(&self, test: &str, observed: &[f64]) -> Result<(), Fault> {
        let _ = (test, observed);
        Ok(())
    }
}
