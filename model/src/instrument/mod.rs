//! Instruments: functions from chain and state to readings, over the open scalar.
//!
//! A new instrument is one file here: its nominal geometry, its unknowns in a fixed order, and `read`.

pub mod ballbar;
pub mod probe;
pub mod rtest;
pub mod socket;
pub mod tracker;

use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::frames::{Point, Rotation, SmallMotion};
use crate::scalar::Scalar;

/// The scalar coordinates of one reading: one length, or three coordinates; mm.
#[derive(Clone, Copy, Debug)]
pub struct Reading<S> {
    values: [S; 3],
    count: usize,
}

impl<S: Scalar> Reading<S> {
    /// A reading of one length.
    pub fn length(value: S) -> Self {
        let zero = S::constant(0.0);
        Reading {
            values: [value, zero, zero],
            count: 1,
        }
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

/// What kind of instrument a session uses.
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

    /// Whether a reading lies between a point of the table and one of the tool, so that errors of both sides move it.
    pub fn is_two_sided(self) -> bool {
        match self {
            InstrumentKind::BallBar | InstrumentKind::Probe | InstrumentKind::RTest => true,
            InstrumentKind::Tracker | InstrumentKind::Socket => false,
        }
    }

    /// The word that a session file uses.
    pub fn word(self) -> &'static str {
        match self {
            InstrumentKind::BallBar => "ballbar",
            InstrumentKind::Tracker => "tracker",
            InstrumentKind::Socket => "socket",
            InstrumentKind::Probe => "probe",
            InstrumentKind::RTest => "r-test",
        }
    }

    /// Scalar coordinates of a reading.
    pub fn coordinates(self) -> usize {
        match self {
            InstrumentKind::BallBar | InstrumentKind::Probe => 1,
            InstrumentKind::Tracker | InstrumentKind::Socket | InstrumentKind::RTest => 3,
        }
    }

    /// The instrument's own unknowns in the order of its slots.
    pub fn unknowns(self) -> &'static [InstrumentUnknown] {
        match self {
            InstrumentKind::BallBar => &ballbar::UNKNOWNS,
            InstrumentKind::Tracker => &tracker::UNKNOWNS,
            InstrumentKind::Socket => &socket::UNKNOWNS,
            InstrumentKind::Probe => &probe::UNKNOWNS,
            InstrumentKind::RTest => &rtest::UNKNOWNS,
        }
    }
}

/// What an instrument's unknown belongs to: tests that share the thing share the unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SharedBy {
    /// Tests of one `setup`: the workpiece ball as it is mounted.
    Setup,
    /// Tests of one `spindle_setup`: the spindle ball as it is mounted.
    SpindleSetup,
    /// Tests of one `bar_setup`: the bar as it is assembled.
    BarSetup,
    /// Tests of one mount of an R-test's sensors: of one `setup` where they stand on the table, of one `spindle_setup` where they sit in the spindle.
    Sensors,
    /// Tests of one `socket`.
    Socket,
    /// All tests of the session.
    Session,
}

/// One of an instrument's own unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstrumentUnknown {
    /// The thing: `workpiece_ball`, `spindle_ball`, `bar`, `tracker`, `target`, `socket`, `ball`, `artefact`, `radius`,
    /// `form`, `stylus`, `sensor`, `gain`.
    pub thing: &'static str,
    /// Its coordinate, `x` … `c`, `omega`, `phi`, `theta`, or empty.
    pub coordinate: &'static str,
    /// The unit inside.
    pub unit: InternalUnit,
    /// Which tests share it.
    pub shared_by: SharedBy,
}

impl InstrumentUnknown {
    const fn new(
        thing: &'static str,
        coordinate: &'static str,
        unit: InternalUnit,
        shared_by: SharedBy,
    ) -> InstrumentUnknown {
        InstrumentUnknown {
            thing,
            coordinate,
            unit,
            shared_by,
        }
    }

    const fn length(thing: &'static str, coordinate: &'static str, shared_by: SharedBy) -> InstrumentUnknown {
        InstrumentUnknown::new(thing, coordinate, InternalUnit::Millimetre, shared_by)
    }

    const fn angle(thing: &'static str, coordinate: &'static str, shared_by: SharedBy) -> InstrumentUnknown {
        InstrumentUnknown::new(thing, coordinate, InternalUnit::Radian, shared_by)
    }
}

/// Unit of a quantity inside the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InternalUnit {
    /// mm; printed in µm.
    Millimetre,
    /// rad; printed in arcsec.
    Radian,
    /// Dimensionless; printed in µm/m.
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
    /// The same set-up with every nominal coordinate replaced: expressions by numbers, or by symbols.
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
            Station::Socket(socket) => Station::Socket(socket::Socket {
                ball: point(&socket.ball),
                socket: point(&socket.socket),
            }),
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

    /// What kind it is.
    pub fn kind(&self) -> InstrumentKind {
        match self {
            Station::BallBar(_) => InstrumentKind::BallBar,
            Station::Tracker(_) => InstrumentKind::Tracker,
            Station::Socket(_) => InstrumentKind::Socket,
            Station::Probe(_) => InstrumentKind::Probe,
            Station::RTest(_) => InstrumentKind::RTest,
        }
    }

    /// The reading for a state of the axes, errors of the machine, and values of the instrument's own unknowns (mm, rad, in
    /// the order of [`InstrumentKind::unknowns`]; `None` is an exact zero).
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

    /// The point of the table frame that the instrument holds, mm, if it holds one.
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

    /// The point of the tool frame that the instrument holds, mm.
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

/// A nominal point, displaced by three unknowns where they are carried.
pub fn displaced<S: Scalar>(
    nominal: [S::Nominal; 3],
    first: usize,
    unknown: &impl Fn(usize) -> Option<S>,
) -> Point<S> {
    Point(std::array::from_fn(|i| match unknown(first + i) {
        Some(displacement) => displacement + nominal[i],
        None => S::nominal(nominal[i]),
    }))
}

/// The small motion of what the first six unknowns place and turn, where one of them is carried.
fn moved<S: Scalar>(unknown: &impl Fn(usize) -> Option<S>) -> Option<SmallMotion<S>> {
    let carried = (0..6).any(|i| unknown(i).is_some());
    carried.then(|| {
        let six = std::array::from_fn(|i| unknown(i).unwrap_or_else(|| S::constant(0.0)));
        SmallMotion::new(six, Rotation::Exact)
    })
}
