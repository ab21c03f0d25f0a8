//! A measurement as data: targets on bodies, and channels between them.
//!
//! ```text
//! distance(P, Q) = ‖P − Q‖      along(P, Q, d) = d · (P − Q)      rotation(F, G, d) = d · (θ·n)
//! ```
//!
//! with the rotation vector `θ·n` of the body F against G in addition to the commanded one ([`crate::rotation_error`]).
//! Lengths and zeros are added to a channel or subtracted from it. A contact is a channel that reads zero.

use super::column::Column;
use super::pointing::about;
use super::{Entry, InstrumentParameter, Reading, SharedBy, Target, channel::Channel, point};
use crate::chain::{Frame, MachineState};
use crate::frames::{Point, dot};
use crate::scalar::{Nominal, Scalar};
use crate::unit::InternalUnit;

/// What a target is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Form {
    /// A point: three coordinates.
    Point,
    /// A direction: two angles across it.
    Direction,
    /// A length, or the zero of a channel: its coordinate in identifiers, and its unit.
    Number(&'static str, InternalUnit),
}

impl Form {
    /// The coordinates of its parameters, with their units.
    fn coordinates(self) -> Vec<(&'static str, InternalUnit)> {
        match self {
            Form::Point => ["x", "y", "z"].map(|name| (name, InternalUnit::Millimetre)).to_vec(),
            Form::Direction => ["across", "up"].map(|name| (name, InternalUnit::Radian)).to_vec(),
            Form::Number(name, unit) => vec![(name, unit)],
        }
    }

    /// The number of its parameters.
    fn count(self) -> usize {
        match self {
            Form::Point => 3,
            Form::Direction => 2,
            Form::Number(..) => 1,
        }
    }
}

/// A target without its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Object {
    /// Its name in keys and identifiers.
    pub name: &'static str,
    /// What it is.
    pub form: Form,
    /// The body on which it is fixed by default.
    pub frame: Frame,
    /// The tests that share it.
    pub shared_by: SharedBy,
}

/// A scalar of targets, each by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Term {
    /// The distance of two points.
    Distance([usize; 2]),
    /// The first point less the second along a direction.
    Along([usize; 2], usize),
    /// The rotation of a body against another about a direction.
    Rotation([Frame; 2], usize),
}

/// A channel as a sum.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Sum {
    /// Its scalar.
    pub term: Term,
    /// The number that is added: its zero.
    pub zero: Option<usize>,
    /// The lengths that are subtracted.
    pub less: Vec<usize>,
}

/// A measurement without the places of its targets.
pub struct Layout {
    /// The targets, in the order of their parameters.
    pub objects: &'static [Object],
    /// What each channel reads.
    pub sums: &'static [Sum],
    /// The channels.
    pub channels: &'static [Channel],
    /// The columns of the channels that have one.
    pub columns: &'static [Column],
    /// The points that an instrument has on table and tool, by target.
    pub sides: [Option<usize>; 2],
    /// What is known of it without a set-up.
    pub entry: Entry,
}

impl Layout {
    /// The index of the first parameter of a target.
    pub fn first(&self, object: usize) -> usize {
        self.objects[..object].iter().map(|object| object.form.count()).sum()
    }
}

/// The parameters of targets, in their order.
pub(super) fn parameters(objects: &[Object]) -> Vec<InstrumentParameter> {
    let of = |object: &Object| {
        let coordinates = object.form.coordinates().into_iter();
        let Object { name, shared_by, .. } = *object;
        coordinates.map(move |(coordinate, unit)| InstrumentParameter::new(name, coordinate, unit, shared_by))
    };
    objects.iter().flat_map(of).collect()
}

/// Where a target is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place<N> {
    /// A point of a body.
    Point(Target<N>),
    /// A direction of a body, with two directions across it, all of unit length.
    Direction(Frame, [[N; 3]; 3]),
    /// A length, mm, or an angle, rad.
    Number(N),
}

impl<N> Place<N> {
    /// Converts every nominal number.
    pub(super) fn map<M>(&self, to: &impl Fn(&N) -> M) -> Place<M> {
        match self {
            Place::Point(target) => Place::Point(target.map(to)),
            Place::Direction(frame, axes) => Place::Direction(*frame, axes.each_ref().map(|axis| point(axis, to))),
            Place::Number(number) => Place::Number(to(number)),
        }
    }
}

/// A direction with two across it.
pub(super) fn axes(direction: [f64; 3]) -> [[f64; 3]; 3] {
    about(Point(direction)).map(|axis| axis.0)
}

/// The targets of a layout at their places, and the parameters that move them.
struct Moved<'a, S: Scalar, U> {
    layout: &'a Layout,
    places: &'a [Place<S::Nominal>],
    at: MachineState<'a, S>,
    unknown: U,
}

impl<S: Scalar, U: Fn(usize) -> Option<S>> Moved<'_, S, U> {
    /// A point in R.
    fn point(&self, object: usize) -> Point<S> {
        match &self.places[object] {
            Place::Point(target) => target.in_r(self.at, self.layout.first(object), &self.unknown),
            _ => Point([S::constant(0.0); 3]),
        }
    }

    /// A direction in R.
    fn direction(&self, object: usize) -> Point<S> {
        let Place::Direction(frame, [nominal, across @ ..]) = &self.places[object] else {
            return Point([S::constant(0.0); 3]);
        };
        let (first, mut direction, mut is_turned) = (self.layout.first(object), Point::nominal(*nominal), false);
        for (angle, across) in across.iter().enumerate() {
            if let Some(angle) = (self.unknown)(first + angle) {
                direction = direction.plus(Point(across.map(|x| angle * x)));
                is_turned = true;
            }
        }
        if is_turned {
            let length = direction.norm();
            direction = Point(direction.0.map(|x| x / length));
        }
        self.at.machine.direction_in_r(*frame, self.at.state, self.at.errors, direction)
    }

    /// A length or a zero.
    fn number(&self, object: usize) -> S {
        let Place::Number(nominal) = self.places[object] else { return S::constant(0.0) };
        let number = S::nominal(nominal);
        (self.unknown)(self.layout.first(object)).map_or(number, |longer| number + longer)
    }

    /// The value of a channel.
    fn value(&self, sum: &Sum) -> S {
        let value = match sum.term {
            Term::Distance([p, q]) => self.point(p).minus(self.point(q)).norm(),
            Term::Along([p, q], d) => dot(self.direction(d), self.point(p).minus(self.point(q))),
            Term::Rotation(frames, d) => {
                dot(self.direction(d), self.at.machine.rotation_error(self.at.state, self.at.errors, frames))
            }
        };
        let value = sum.zero.map_or(value, |zero| value + self.number(zero));
        sum.less.iter().fold(value, |value, length| value - self.number(*length))
    }
}

impl Layout {
    /// The reading of targets at these places, mm and rad.
    pub(super) fn reading<S: Scalar>(
        &self,
        places: &[Place<S::Nominal>],
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        S::Nominal: Nominal,
    {
        let moved = Moved { layout: self, places, at, unknown };
        Reading::of(self.sums.iter().map(|sum| moved.value(sum)))
    }
}
