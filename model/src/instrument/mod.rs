//! Instruments: readings as functions of chain and state, over the open scalar.
//!
//! A new instrument is one file: its nominal geometry, its parameters in a fixed order, and `read`.

pub mod ballbar;
pub mod probe;
pub mod rtest;
pub mod socket;
pub mod tracker;

use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::frames::{Point, Rotation, SmallMotion};
use crate::scalar::Scalar;

/// The scalar coordinates of one reading in mm: one length, or three coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Reading<S> {
    values: [S; 3],
    count: usize,
}

impl<S: Scalar> Reading<S> {
    /// A reading of one length.
    pub fn length(value: S) -> Self {
        let zero = S::constant(0.0);
        Reading { values: [value, zero, zero], count: 1 }
    }

    /// A reading of three coordinates.
    pub fn vector(values: [S; 3]) -> Self {
        Reading { values, count: 3 }
    }

    /// The coordinates.
    pub fn coordinates(&self) -> &[S] {
        &self.values[..self.count]
    }
}

/// The kind of instrument of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InstrumentKind {
    /// A double ball bar.
    BallBar,
    /// A laser tracker.
    Tracker,
    /// A ball in fixed sockets.
    Socket,
    /// A touch probe.
    Probe,
    /// An R-test: three displacement sensors about a ball.
    RTest,
}

impl InstrumentKind {
    /// All kinds.
    pub const ALL: [InstrumentKind; 5] = [
        InstrumentKind::BallBar,
        InstrumentKind::Tracker,
        InstrumentKind::Socket,
        InstrumentKind::Probe,
        InstrumentKind::RTest,
    ];

    /// Whether a reading connects a point of the table and a point of the tool, so that errors of both sides affect it.
    pub fn is_two_sided(self) -> bool {
        match self {
            InstrumentKind::BallBar | InstrumentKind::Probe | InstrumentKind::RTest => true,
            InstrumentKind::Tracker | InstrumentKind::Socket => false,
        }
    }

    /// The identifier in session files.
    pub fn word(self) -> &'static str {
        match self {
            InstrumentKind::BallBar => "ballbar",
            InstrumentKind::Tracker => "tracker",
            InstrumentKind::Socket => "socket",
            InstrumentKind::Probe => "probe",
            InstrumentKind::RTest => "r-test",
        }
    }

    /// Number of scalar coordinates of a reading.
    pub fn coordinates(self) -> usize {
        match self {
            InstrumentKind::BallBar | InstrumentKind::Probe => 1,
            InstrumentKind::Tracker | InstrumentKind::Socket | InstrumentKind::RTest => 3,
        }
    }

    /// The instrument's parameters in the order of its slots.
    pub fn unknowns(self) -> &'static [InstrumentParameter] {
        match self {
            InstrumentKind::BallBar => &ballbar::PARAMETERS,
            InstrumentKind::Tracker => &tracker::PARAMETERS,
            InstrumentKind::Socket => &socket::PARAMETERS,
            InstrumentKind::Probe => &probe::PARAMETERS,
            InstrumentKind::RTest => &rtest::PARAMETERS,
        }
    }
}

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
    const fn new(
        thing: &'static str,
        coordinate: &'static str,
        unit: InternalUnit,
        shared_by: SharedBy,
    ) -> InstrumentParameter {
        InstrumentParameter { thing, coordinate, unit, shared_by }
    }

    const fn length(thing: &'static str, coordinate: &'static str, shared_by: SharedBy) -> InstrumentParameter {
        InstrumentParameter::new(thing, coordinate, InternalUnit::Millimetre, shared_by)
    }

    const fn angle(thing: &'static str, coordinate: &'static str, shared_by: SharedBy) -> InstrumentParameter {
        InstrumentParameter::new(thing, coordinate, InternalUnit::Radian, shared_by)
    }
}

/// Internal unit of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InternalUnit {
    /// mm; displayed in µm.
    Millimetre,
    /// rad; displayed in arcsec.
    Radian,
    /// Dimensionless; displayed in µm/m.
    Ratio,
}

/// An instrument as set up for one test: its nominal geometry.
#[derive(Clone, Debug, PartialEq)]
pub enum Station<N> {
    /// A ball bar.
    BallBar(ballbar::BallBar<N>),
    /// A tracker.
    Tracker(tracker::Tracker<N>),
    /// A socket.
    Socket(socket::Socket<N>),
    /// A touch probe.
    Probe(probe::Probe<N>),
    /// An R-test.
    RTest(rtest::RTest<N>),
}

impl<N> Station<N> {
    /// Converts every nominal coordinate of the set-up: expressions to numbers or symbols.
    pub fn map<M>(&self, to: impl Fn(&N) -> M) -> Station<M> {
        let point = |point: &[N; 3]| point.each_ref().map(&to);
        match self {
            Station::BallBar(bar) => Station::BallBar(ballbar::BallBar {
                workpiece_ball: point(&bar.workpiece_ball),
                spindle_ball: point(&bar.spindle_ball),
                bar: to(&bar.bar),
            }),
            Station::Tracker(tracker) => Station::Tracker(tracker::Tracker {
                target: point(&tracker.target),
                rotation: tracker.rotation.each_ref().map(point),
                origin: point(&tracker.origin),
            }),
            Station::Socket(socket) => {
                Station::Socket(socket::Socket { ball: point(&socket.ball), socket: point(&socket.socket) })
            }
            Station::Probe(probe) => Station::Probe(probe::Probe {
                artefact: point(&probe.artefact),
                axis: point(&probe.axis),
                radius: to(&probe.radius),
                stylus: point(&probe.stylus),
                direction: probe.direction.as_ref().map(point),
            }),
            Station::RTest(rtest) => Station::RTest(rtest::RTest {
                setting: rtest.setting,
                workpiece_ball: point(&rtest.workpiece_ball),
                spindle_ball: point(&rtest.spindle_ball),
                sensors: rtest.sensors.as_ref().map(|rows| rows.each_ref().map(point)),
            }),
        }
    }

    /// The kind of the instrument.
    pub fn kind(&self) -> InstrumentKind {
        match self {
            Station::BallBar(_) => InstrumentKind::BallBar,
            Station::Tracker(_) => InstrumentKind::Tracker,
            Station::Socket(_) => InstrumentKind::Socket,
            Station::Probe(_) => InstrumentKind::Probe,
            Station::RTest(_) => InstrumentKind::RTest,
        }
    }

    /// Computes the reading from the state of the axes, the errors of the machine and the parameters of the instrument
    /// (mm, rad, in the order of [`InstrumentKind::unknowns`]; `None` is an exact zero).
    pub fn read<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: crate::scalar::Nominal,
    {
        match self {
            Station::BallBar(bar) => Reading::length(bar.read(machine, state, errors, unknown)),
            Station::Tracker(tracker) => Reading::vector(tracker.read(machine, state, errors, unknown).0),
            Station::Socket(socket) => Reading::vector(socket.read(machine, state, errors, unknown).0),
            Station::Probe(probe) => Reading::length(probe.read(machine, state, errors, unknown)),
            Station::RTest(rtest) => Reading::vector(rtest.read(machine, state, errors, unknown).0),
        }
    }

    /// The instrument's point in the table frame, mm, if it has one.
    pub fn table_point_mm(&self) -> Option<[N; 3]>
    where
        N: Copy,
    {
        match self {
            Station::BallBar(bar) => Some(bar.workpiece_ball),
            Station::Probe(probe) => Some(probe.artefact),
            Station::RTest(rtest) => Some(rtest.workpiece_ball),
            Station::Tracker(_) | Station::Socket(_) => None,
        }
    }

    /// The instrument's point in the tool frame, mm.
    pub fn tool_point_mm(&self) -> [N; 3]
    where
        N: Copy,
    {
        match self {
            Station::BallBar(bar) => bar.spindle_ball,
            Station::Tracker(tracker) => tracker.target,
            Station::Socket(socket) => socket.ball,
            Station::Probe(probe) => probe.stylus,
            Station::RTest(rtest) => rtest.spindle_ball,
        }
    }
}

/// A nominal point, displaced by three parameters if they are included.
pub fn displaced<S: Scalar>(nominal: [S::Nominal; 3], first: usize, unknown: &impl Fn(usize) -> Option<S>) -> Point<S> {
    Point(std::array::from_fn(|i| match unknown(first + i) {
        Some(displacement) => displacement + nominal[i],
        None => S::nominal(nominal[i]),
    }))
}

/// The small motion given by the first six parameters, if one of them is included.
fn pose_error<S: Scalar>(unknown: &impl Fn(usize) -> Option<S>) -> Option<SmallMotion<S>> {
    let carried = (0..6).any(|i| unknown(i).is_some());
    carried.then(|| {
        let six = std::array::from_fn(|i| unknown(i).unwrap_or_else(|| S::constant(0.0)));
        SmallMotion::new(six, Rotation::Exact)
    })
}
