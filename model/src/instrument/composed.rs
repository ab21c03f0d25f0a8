//! A measurement that the session composes: `[[target]]` and `[[channel]]` ([`measured`](super::measured)).
//!
//! A stylus that touches a sphere is the channel `distance(stylus, centre) − R` that reads zero; the positions of the axes are
//! all that is measured. What the targets and channels are is kept once for the process, so that a kind of instrument stays a
//! word: where they are belongs to each test.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::{Mutex, PoisonError};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::measured::{Form, Layout, Object, Place, Sum, Term, axes, parameters};
use super::set_up::{self, FRAME, SetUp, Stated};
use super::{
    Aligned, Checked, Contact, Entry, Fault, Geometry, Instrument, InstrumentKind, InstrumentPoint, MAX_CHANNELS,
    Reading, SharedBy, Station, Target, Travel, default_errors, target,
};
use crate::chain::{Frame, Machine, MachineState};
use crate::document::composed as document;
use crate::document::fault::{Fault as KeyFault, Within};
use crate::document::measurement::Test;
use crate::document::node::Node;
use crate::document::print::node_of;
use crate::document::value::{Direction, Length, Point, Uncertainties, Uncertainty};
use crate::document::{schema, session};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::session::expression::Constant;
use crate::unit::{InternalUnit, Unit};
use crate::words::listed;

/// Least distance of two points whose distance is read, mm: nearer, its direction is not defined.
const MIN_MM: f64 = 1e-6;

/// The coordinates of parameters that no other instrument has. Any name may stand before them.
const COORDINATES: [&str; 8] = ["x", "y", "z", "across", "up", LENGTH, ZERO, ZERO_ANGLE];
const LENGTH: &str = "length";
const ZERO: &str = "zero";
const ZERO_ANGLE: &str = "zero_angle";

/// Columns of every file of readings.
const OF_FILES: [&str; 4] = ["time", "run", "polar", "temperature"];

pub(super) const ENTRY: Entry = Entry {
    reads_poses: true,
    rows_can_lack_channels: true,
    default_errors: default_errors::all_locations,
    // The stylus stays mounted while the objects on the table change.
    spindle_setup: Some("tool"),
    ..Entry::new(["composed", "a composed measurement"], &[], serde_json::Map::new, &[], |_| Err(no_channel()))
};

/// No target and no channel: the word alone.
pub(super) const NONE: Composition =
    Composition(&Layout { objects: &[], sums: &[], channels: &[], columns: &[], sides: [None; 2], entry: ENTRY });

fn no_channel() -> KeyFault {
    let help = "add [[target]] and [[channel]] to a session whose [instrument] has `kind = \"composed\"`";
    KeyFault::of_table("is composed, but the session has no channel", help)
}

/// The targets and channels of a session, without their places.
#[derive(Clone, Copy)]
pub struct Composition(&'static Layout);

impl Composition {
    /// The composition of these targets and channels: each once for the process.
    fn of(
        objects: Vec<Object>,
        sums: Vec<Sum>,
        channels: Vec<Channel>,
        columns: Vec<Column>,
        sides: [Option<usize>; 2],
    ) -> Composition {
        static KNOWN: Mutex<Vec<Composition>> = Mutex::new(Vec::new());
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |other: &&Composition| {
            let Layout { objects: own, sums: of, channels: all, columns: read, .. } = other.0;
            (*own, *of, *all, *read) == (&objects[..], &sums[..], &channels[..], &columns[..])
        };
        if let Some(found) = known.iter().find(is_same) {
            return *found;
        }
        let side = |side: Option<usize>| side.map(|object| (objects[object].name, objects[object].frame));
        let points: Vec<_> = sides.into_iter().filter_map(side).collect();
        let entry = Entry {
            parameters: parameters(&objects).leak(),
            points: points.leak(),
            is_two_sided: sides.iter().all(Option::is_some),
            has_readings: channels.iter().all(|channel| !channel.is_contact),
            ..ENTRY
        };
        let (objects, sums) = (objects.leak(), sums.leak());
        let layout = Layout { objects, sums, channels: channels.leak(), columns: columns.leak(), sides, entry };
        let composition = Composition(Box::leak(Box::new(layout)));
        known.push(composition);
        composition
    }

    /// What is known without a set-up.
    pub(super) fn entry(self) -> &'static Entry {
        &self.0.entry
    }

    /// The set-up of a test.
    pub(super) fn set_up(self, keys: &Node, constants: &[Constant], machine: &Machine) -> Result<SetUp, KeyFault> {
        let is_placed = |object: &&Object| !matches!(object.form, Form::Number(..));
        let placed: Vec<_> =
            self.0.objects.iter().filter(is_placed).map(|object| (object.name, object.frame)).collect();
        let stated = Stated::new(&placed, keys, constants, machine)?;
        let (mut places, mut priors, mut known) = (Vec::new(), Vec::new(), Vec::new());
        for object in self.0.objects {
            let [value, u] = keys_of(object);
            match object.form {
                Form::Point => {
                    let mm: Point = stated.value(&value)?.ok_or_else(|| KeyFault::missing(&value, "the point"))?;
                    places.push(Place::Point(stated.point(object.name, &mm)?));
                    priors.extend(set_up::lengths(&stated.value::<Uncertainties>(&u)?.unwrap_or_default()));
                }
                Form::Direction => {
                    let direction: Direction =
                        stated.value(&value)?.ok_or_else(|| KeyFault::missing(&value, "the direction"))?;
                    let axes = axes(direction.0).map(|axis| axis.map(set_up::Written::number));
                    places.push(Place::Direction(stated.frame(object.name), axes));
                    priors.extend([set_up::angle(stated.value(&u)?.unwrap_or_default()); 2]);
                }
                Form::Number(LENGTH, _) => {
                    let length: Length =
                        stated.value(&value)?.ok_or_else(|| KeyFault::missing(&value, "the length"))?;
                    places.push(Place::Number(stated.length(&value, &length)?));
                    priors.push(set_up::length(stated.value(&u)?.unwrap_or_default()));
                }
                Form::Number(_, unit) => {
                    let u: Uncertainty = stated.value(&u)?.unwrap_or_default();
                    places.push(Place::Number(set_up::Written::number(0.0)));
                    priors.push(if unit == InternalUnit::Radian { set_up::angle(u) } else { set_up::length(u) });
                }
            }
            known.extend([value, u]);
        }
        stated.only(known)?;
        if self.0.sums.is_empty() {
            return Err(no_channel());
        }
        Ok(SetUp::new(Station::Composed(Composed { composition: self, places }), priors))
    }
}

/// The keys of a target in a test: its value, and its uncertainty.
fn keys_of(object: &Object) -> [String; 2] {
    let name = object.name;
    match object.form {
        Form::Point | Form::Number(LENGTH, _) => [format!("{name}_mm"), format!("{name}_u_um")],
        Form::Direction => [name.to_string(), format!("{name}_u_arcsec")],
        Form::Number(_, InternalUnit::Radian) => [format!("{name}_zero"), format!("{name}_zero_u_arcsec")],
        Form::Number(..) => [format!("{name}_zero"), format!("{name}_zero_u_um")],
    }
}

impl PartialEq for Composition {
    fn eq(&self, other: &Composition) -> bool {
        std::ptr::eq(self.0, other.0) || (self.0.objects, self.0.sums) == (other.0.objects, other.0.sums)
    }
}

impl Eq for Composition {}

impl Hash for Composition {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.objects.hash(state);
    }
}

impl fmt::Debug for Composition {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_list().entries(self.0.objects.iter().map(|object| object.name)).finish()
    }
}

/// Whether a parameter may be one of a composed measurement.
pub(crate) fn is_parameter(thing: &str, coordinate: &str) -> bool {
    COORDINATES.contains(&coordinate) && is_name(thing)
}

fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    letters.next().is_some_and(|letter| letter.is_ascii_alphabetic())
        && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
        && text.len() <= MAX_NAME
}

/// Longest name of a target, and the largest number of targets.
const MAX_NAME: usize = 40;
const MAX_TARGETS: usize = 20;

/// A text, kept once for the process.
fn kept(text: &str) -> &'static str {
    static KNOWN: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = known.iter().find(|known| **known == text) {
        return found;
    }
    let text: &'static str = Box::leak(text.into());
    known.push(text);
    text
}

/// The kind of a session with these parts, and the keys of its targets for tests that do not state them.
///
/// # Errors
/// What is wrong with a target or a channel.
pub fn composed(
    kind: InstrumentKind,
    parts: &session::Parts,
    machine: &Machine,
) -> Result<(InstrumentKind, Node), KeyFault> {
    let (targets, channels) = (&parts.target, &parts.channel);
    if !matches!(kind, InstrumentKind::Composed(_)) {
        let Some((key, _)) = [("target", targets.len()), ("channel", channels.len())].into_iter().find(|of| of.1 > 0)
        else {
            return Ok((kind, Node::default()));
        };
        let message = format!("[[{key}]] in a session of {}", kind.entry().phrase);
        return Err(KeyFault::new(message, "they are those of `kind = \"composed\"`").on_key().at(key));
    }
    for (key, count, most) in [("target", targets.len(), MAX_TARGETS), ("channel", channels.len(), MAX_CHANNELS)] {
        if count > most {
            return Err(KeyFault::of_key(format!("stands {count} times; the most are {most}"), None).on_key().at(key));
        }
    }
    let (mut objects, mut common) = (Vec::new(), Node::table::<Node>([]));
    for (item, target) in targets.iter().enumerate() {
        let object = object(target, &objects, machine).within_item(item).within("target")?;
        let keys = node_of(target).unwrap_or_default();
        let own = [["point_mm", "direction", "length_mm"], ["point_u_um", "direction_u_arcsec", "length_u_um"]];
        for (name, key) in keys_of(&object).iter().zip(own).flat_map(|(name, own)| own.map(|key| (name, key))) {
            keys.get(key).into_iter().for_each(|node| common.set(name, node.clone()));
        }
        objects.push(object);
    }
    let mut composed = Channels { machine, objects, sums: Vec::new(), channels: Vec::new(), columns: Vec::new() };
    for (item, channel) in channels.iter().enumerate() {
        composed.add(channel, &mut common).within_item(item).within("channel")?;
    }
    let Channels { objects, sums, channels, columns, .. } = composed;
    // The points of which a distance is read, or the first ones.
    let of_distance = sums.iter().find_map(|sum| match sum.term {
        Term::Distance(points) | Term::Along(points, _) => Some(points.to_vec()),
        Term::Rotation(..) => None,
    });
    let order: Vec<usize> = of_distance.into_iter().flatten().chain(0..objects.len()).collect();
    let on = |shared: SharedBy| {
        let is_on = |object: &usize| {
            let Object { form, shared_by, frame, .. } = objects[*object];
            form == Form::Point && shared_by == shared && frame != Frame::Bed
        };
        order.iter().copied().find(is_on)
    };
    let sides = [on(SharedBy::Setup), on(SharedBy::SpindleSetup)];
    Ok((InstrumentKind::Composed(Composition::of(objects, sums, channels, columns, sides)), common))
}

/// A target, without its place.
fn object(target: &document::Target, others: &[Object], machine: &Machine) -> Result<Object, KeyFault> {
    name(&target.name, others).within("name")?;
    let frame = target.frame.as_deref().map(|word| target::frame(&word.into(), machine).within("frame")).transpose()?;
    let form = match (&target.point_mm, &target.direction, &target.length_mm) {
        (Some(_), None, None) => Form::Point,
        (None, Some(_), None) => Form::Direction,
        (None, None, Some(_)) => Form::Number(LENGTH, InternalUnit::Millimetre),
        _ => {
            let help = "state one of `point_mm`, `direction` and `length_mm`";
            return Err(KeyFault::of_table(
                "is neither a point nor a direction nor a length, or several of them",
                help,
            ));
        }
    };
    let others = [
        ("point_u_um", target.point_u_um.is_some() && form != Form::Point),
        ("direction_u_arcsec", target.direction_u_arcsec.is_some() && form != Form::Direction),
        ("length_u_um", target.length_u_um.is_some() && target.length_mm.is_none()),
    ];
    if let Some((key, _)) = others.iter().find(|(_, is_other)| *is_other) {
        return Err(KeyFault::of_key("is of another target than this", None).on_key().at(key));
    }
    if form == Form::Direction && schema::fields::<Test>().contains(&target.name) {
        return Err(KeyFault::of_key("is a key of every test; a direction needs another name", None).at("name"));
    }
    let is_on_tool = |frame: Frame| match frame {
        Frame::Tool => true,
        Frame::Axis(axis) => axis >= machine.workpiece_side,
        Frame::Table | Frame::Bed => false,
    };
    let shared_by = match frame {
        None if target.length_mm.is_some() => SharedBy::Session,
        Some(frame) if is_on_tool(frame) => SharedBy::SpindleSetup,
        _ => SharedBy::Setup,
    };
    let frame = match frame {
        None if target.length_mm.is_none() => {
            return Err(KeyFault::missing("frame", "the body on which the target is fixed, such as \"table\""));
        }
        frame => frame.unwrap_or(Frame::Bed),
    };
    Ok(Object { name: kept(&target.name), form, frame, shared_by })
}

/// Checks a name.
fn name(name: &str, others: &[Object]) -> Result<(), KeyFault> {
    if !is_name(name) {
        return Err(KeyFault::is(format!("\"{name}\"; a name has at most {MAX_NAME} letters, digits and `_`")));
    }
    let is_known = others.iter().any(|other| other.name == name);
    if is_known { Err(KeyFault::of_key(format!("= \"{name}\" stands twice"), None)) } else { Ok(()) }
}

/// The channels of a session while they are read.
struct Channels<'a> {
    machine: &'a Machine,
    objects: Vec<Object>,
    sums: Vec<Sum>,
    channels: Vec<Channel>,
    columns: Vec<Column>,
}

impl Channels<'_> {
    /// Adds a channel, and its zero to the targets.
    fn add(&mut self, document: &document::Channel, common: &mut Node) -> Result<(), KeyFault> {
        name(&document.name, &self.objects).within("name")?;
        if self.channels.iter().any(|other| other.name == document.name) {
            return Err(KeyFault::of_key(format!("= \"{}\" stands twice", document.name), None).at("name"));
        }
        let term = match (&document.distance, &document.along, &document.rotation) {
            (Some(names), None, None) => {
                let [p, q] = self.named(names, [Form::Point; 2]).within("distance")?;
                Term::Distance([p, q])
            }
            (None, Some(names), None) => {
                let [p, q, d] = self.named(names, [Form::Point, Form::Point, Form::Direction]).within("along")?;
                Term::Along([p, q], d)
            }
            (None, None, Some(names)) => self.rotation(names).within("rotation")?,
            _ => {
                let help = "state one of `distance`, `along` and `rotation`";
                return Err(KeyFault::of_table("reads nothing, or several scalars", help));
            }
        };
        let is_angle = matches!(term, Term::Rotation(..));
        let unit = if is_angle { InternalUnit::Radian } else { InternalUnit::Millimetre };
        if is_angle && !document.less.is_empty() {
            return Err(KeyFault::of_key("subtracts a length from an angle", None).on_key().at("less"));
        }
        let length = Form::Number(LENGTH, InternalUnit::Millimetre);
        let less = document.less.iter().enumerate().map(|(item, name)| self.target(name, length).within_item(item));
        let less = less.collect::<Result<Vec<_>, _>>().within("less")?;
        let name = kept(&document.name);
        let is_contact = match (document.reading, document.column.as_deref()) {
            (Some(0.0), None) => true,
            (Some(_), None) => {
                let help = "`reading = 0` is a contact: state a length as a target, and subtract it with `less`";
                return Err(KeyFault::of_key("is another constant than 0", help).at("reading"));
            }
            (None, Some(column)) => {
                let column = self.column(column, is_angle).within("column")?;
                self.columns.push(column);
                false
            }
            _ => {
                let help = "add `reading = 0` for a contact, else `column = \"length_mm\"`, the column of its readings";
                return Err(KeyFault::of_table("has no reading, or two", help));
            }
        };
        let zeros = [("zero_u_um", document.zero_u_um, false), ("zero_u_arcsec", document.zero_u_arcsec, true)];
        let mut zero = None;
        for (key, u, of_angle) in zeros {
            let Some(Uncertainty(u)) = u else { continue };
            if of_angle != is_angle {
                let is = if is_angle { "an angle" } else { "a length" };
                return Err(KeyFault::of_key(format!("is of another unit: the channel is {is}"), None)
                    .on_key()
                    .at(key));
            }
            common.set(&format!("{name}_{key}"), u);
            zero = Some(self.objects.len());
            let form = Form::Number(if is_angle { ZERO_ANGLE } else { ZERO }, unit);
            self.objects.push(Object { name, form, frame: Frame::Bed, shared_by: SharedBy::SpindleSetup });
        }
        self.sums.push(Sum { term, zero, less });
        self.channels.push(Channel { name, unit, is_coordinate: false, is_contact });
        Ok(())
    }

    /// The target of a name.
    fn target(&self, name: &str, form: Form) -> Result<usize, KeyFault> {
        let of_form = || self.objects.iter().enumerate().filter(|(_, object)| object.form == form);
        of_form().find(|(_, object)| object.name == name).map(|(place, _)| place).ok_or_else(|| {
            let what = match form {
                Form::Point => "point",
                Form::Direction => "direction",
                Form::Number(..) => "length",
            };
            let known: Vec<&str> = of_form().map(|(_, object)| object.name).collect();
            let help =
                if known.is_empty() { format!("there is no target that is a {what}") } else { listed(&known, "or") };
            KeyFault::new(format!("\"{name}\" is no target that is a {what}"), help)
        })
    }

    /// The targets of names.
    fn named<const COUNT: usize>(&self, names: &[String], forms: [Form; COUNT]) -> Result<[usize; COUNT], KeyFault> {
        let names: &[String; COUNT] =
            names.try_into().map_err(|_| KeyFault::of_key(format!("needs {COUNT} targets"), None))?;
        let mut places = [0; COUNT];
        for (item, ((name, form), place)) in names.iter().zip(forms).zip(&mut places).enumerate() {
            *place = self.target(name, form).within_item(item)?;
        }
        if places[0] == places[1] {
            return Err(KeyFault::of_key("needs two different points", None));
        }
        Ok(places)
    }

    /// Two bodies and a direction.
    fn rotation(&self, names: &[String]) -> Result<Term, KeyFault> {
        let [body, against, direction] = names else {
            return Err(KeyFault::of_key("needs two bodies and a direction", None));
        };
        let frame = |item: usize, name: &str| target::frame(&name.into(), self.machine).within_item(item);
        let frames = [frame(0, body)?, frame(1, against)?];
        Ok(Term::Rotation(frames, self.target(direction, Form::Direction).within_item(2)?))
    }

    /// The column of the next channel.
    fn column(&self, column: &str, is_angle: bool) -> Result<Column, KeyFault> {
        let parts = column.rsplit_once('_').filter(|(stem, _)| is_name(stem));
        let Some((stem, unit)) = parts.and_then(|(stem, unit)| Some((stem, Unit::of_column(unit, is_angle)?))) else {
            let example = if is_angle { "angle_arcsec" } else { "length_mm" };
            return Err(KeyFault::of_key(
                format!("= \"{column}\" has no unit of the channel"),
                format!("such as \"{example}\""),
            ));
        };
        let is_of_axis = self.machine.axes.iter().any(|axis| axis.name.eq_ignore_ascii_case(stem));
        let is_of_other = self.columns.iter().any(|other| other.stem == stem);
        if is_of_axis || is_of_other || OF_FILES.contains(&stem) {
            return Err(KeyFault::of_key(format!("= \"{column}\" is the column of something else"), None));
        }
        Ok(Column::new(kept(stem), unit, Quantity::Channel(self.channels.len())))
    }
}

/// A composed measurement as set up for one test.
#[derive(Clone, Debug, PartialEq)]
pub struct Composed<N> {
    /// Its targets and channels.
    pub composition: Composition,
    /// Where the targets are.
    pub places: Vec<Place<N>>,
}

impl<N> Composed<N> {
    fn layout(&self) -> &'static Layout {
        self.composition.0
    }
}

impl<N> Geometry<N> for Composed<N> {
    type Over<M> = Composed<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Composed<M> {
        Composed { composition: self.composition, places: self.places.iter().map(|place| place.map(to)).collect() }
    }
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        self.layout().reading(&self.places, at, unknown)
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        self.layout().sides.map(|object| match &self.places[object?] {
            Place::Point(target) => {
                InstrumentPoint::of(self.layout().objects[object?].name, target, self.layout().first(object?))
            }
            _ => None,
        })
    }
}

impl Composed<f64> {
    /// The lengths that a channel subtracts, mm.
    fn less_mm(&self, sum: &Sum) -> f64 {
        let length = |length: &usize| if let Place::Number(mm) = self.places[*length] { mm } else { 0.0 };
        sum.less.iter().map(length).sum()
    }

    /// The bodies of targets that are on others than by default.
    pub(super) fn frames(&self) -> Vec<(String, Frame)> {
        let frame = |(object, place): (&Object, &Place<f64>)| match place {
            Place::Point(Target { frame, .. }) | Place::Direction(frame, _) if *frame != object.frame => {
                Some((format!("{}{FRAME}", object.name), *frame))
            }
            _ => None,
        };
        self.layout().objects.iter().zip(&self.places).filter_map(frame).collect()
    }
}

impl Instrument for Composed<f64> {
    fn channels(&self) -> &[Channel] {
        self.layout().channels
    }
    fn columns(&self) -> &'static [Column] {
        self.layout().columns
    }
    fn aligned(&self, _: &Travel<'_>) -> Vec<Aligned> {
        let is_free = matches!(self.contact(), Contact::None);
        if is_free { Aligned::as_it_stands(self.clone()) } else { Vec::new() }
    }
    /// The points of a contact of two points are at the distance of its lengths.
    fn contact(&self) -> Contact {
        let layout = self.layout();
        let is_contact = |(channel, sum): &(&Channel, &Sum)| {
            let mut sides = layout.sides.into_iter().flatten();
            channel.is_contact && matches!(sum.term, Term::Distance(points) if sides.all(|side| points.contains(&side)))
        };
        let contact = layout.channels.iter().zip(layout.sums).find(is_contact);
        contact.map_or(Contact::None, |(_, sum)| Contact::AtDistance(self.less_mm(sum)))
    }
    /// With every uncertainty: what is left out is that of the session.
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let layout = self.layout();
        let mut keys = Node::table::<Node>([]);
        let (mut values, mut known) = (Vec::new(), Vec::new());
        for (index, (object, place)) in layout.objects.iter().zip(&self.places).enumerate() {
            let ([value, u], first) = (keys_of(object), layout.first(index));
            let unit = if u.ends_with("_arcsec") { Unit::Arcsecond } else { Unit::Micrometre };
            match place {
                Place::Point(target) => {
                    values.push((value, node_of(&set_up::written_point(target.mm))?));
                    known.push((u, node_of(&set_up::written_lengths(priors, first))?));
                    continue;
                }
                Place::Direction(_, [direction, ..]) => {
                    values.push((value, node_of(&set_up::written_direction(*direction))?));
                }
                Place::Number(mm) if object.form == Form::Number(LENGTH, InternalUnit::Millimetre) => {
                    values.push((value, set_up::rounded(*mm).into()));
                }
                Place::Number(_) => {}
            }
            known.push((u, set_up::written_u(priors.get(first), unit).0.into()));
        }
        values.into_iter().chain(known).for_each(|(key, node): (String, Node)| keys.set(&key, node));
        Some(keys)
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        let [table, tool] = self.layout().sides;
        let [mut on_table, mut on_tool] = [None, None];
        for (index, place) in self.places.iter_mut().enumerate() {
            let Place::Point(target) = place else { continue };
            if Some(index) == table {
                on_table = Some(target);
            } else if Some(index) == tool {
                on_tool = Some(target);
            }
        }
        [on_table, on_tool]
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let column = self.columns().iter().find(|column| !has(column.quantity))?;
        Some((format!("`{}`", column.name(column.unit)), "every [[channel]] with a `column` needs it".into()))
    }
    /// Points whose distance is read nominally do not coincide.
    fn check_set_up(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let layout = self.layout();
        let nominal = checked.nominal(Station::Composed(self.clone()));
        for (row, reading) in nominal.chunks(layout.channels.len()).enumerate() {
            for ((sum, channel), value) in layout.sums.iter().zip(layout.channels).zip(reading) {
                if matches!(sum.term, Term::Distance(_)) && value + self.less_mm(sum) < MIN_MM {
                    let (test, number, name) = (checked.test, row + 1, channel.name);
                    return Err((
                        format!(
                            "test \"{test}\", reading {number}: the two points of the channel \"{name}\" nominally coincide, \
                             where their distance has no direction"
                        ),
                        "check the targets and the positions of the axes".into(),
                    ));
                }
            }
        }
        Ok(())
    }
}
