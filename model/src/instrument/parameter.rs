//! Parameters of an instrument: what a fit may estimate of its set-up.

use crate::parameter_id::ParameterId;
use crate::unit::InternalUnit;

/// The tests that share an instrument parameter: those that use the same mounted object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SharedBy {
    /// Tests with the same `setup`: the mounted workpiece ball.
    Setup,
    /// Tests with the same `spindle_setup`: the mounted spindle ball.
    SpindleSetup,
    /// Tests with the same `bar_setup`: the assembled bar.
    BarSetup,
    /// Tests with the same mount of an R-test's sensors: the same `setup` if they are on the table, the same
    /// `spindle_setup` if they are in the spindle.
    Sensors,
    /// Tests with the same `socket`.
    Socket,
    /// All tests of the session.
    Session,
}

/// One parameter of an instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstrumentParameter {
    /// The object: `workpiece_ball`, `spindle_ball`, `bar`, `tracker`, `target`, `socket`, `ball`, `artefact`,
    /// `radius`, `form`, `stylus`, `sensor`, `gain`.
    pub thing: &'static str,
    /// Its coordinate, `x` … `c`, `omega`, `phi`, `theta`, or empty.
    pub coordinate: &'static str,
    /// The internal unit.
    pub unit: InternalUnit,
    /// The tests that share it.
    pub shared_by: SharedBy,
}

impl InstrumentParameter {
    /// Its identifier where the tests of a group share it.
    pub fn id(&self, group: &str) -> ParameterId {
        let (thing, coordinate) = (self.thing.to_string(), self.coordinate.to_string());
        ParameterId::Setup { thing, coordinate, group: group.to_string() }
    }

    pub(super) const fn new(
        thing: &'static str,
        coordinate: &'static str,
        unit: InternalUnit,
        shared_by: SharedBy,
    ) -> InstrumentParameter {
        InstrumentParameter { thing, coordinate, unit, shared_by }
    }

    pub(super) const fn length(
        thing: &'static str,
        coordinate: &'static str,
        shared_by: SharedBy,
    ) -> InstrumentParameter {
        InstrumentParameter::new(thing, coordinate, InternalUnit::Millimetre, shared_by)
    }

    pub(super) const fn angle(
        thing: &'static str,
        coordinate: &'static str,
        shared_by: SharedBy,
    ) -> InstrumentParameter {
        InstrumentParameter::new(thing, coordinate, InternalUnit::Radian, shared_by)
    }

    /// Three coordinates of a point.
    pub(super) const fn point(thing: &'static str, shared_by: SharedBy) -> [InstrumentParameter; 3] {
        [
            InstrumentParameter::length(thing, "x", shared_by),
            InstrumentParameter::length(thing, "y", shared_by),
            InstrumentParameter::length(thing, "z", shared_by),
        ]
    }

    /// Three angles of a small rotation.
    pub(super) const fn rotation(thing: &'static str, shared_by: SharedBy) -> [InstrumentParameter; 3] {
        [
            InstrumentParameter::angle(thing, "a", shared_by),
            InstrumentParameter::angle(thing, "b", shared_by),
            InstrumentParameter::angle(thing, "c", shared_by),
        ]
    }

    /// The parameters of several objects, one after the other.
    pub(super) const fn all<const COUNT: usize>(objects: &[&[InstrumentParameter]]) -> [InstrumentParameter; COUNT] {
        let (mut all, mut count, mut object) = ([objects[0][0]; COUNT], 0, 0);
        while object < objects.len() {
            let mut place = 0;
            while place < objects[object].len() {
                all[count] = objects[object][place];
                (count, place) = (count + 1, place + 1);
            }
            object += 1;
        }
        assert!(count == COUNT);
        all
    }
}
