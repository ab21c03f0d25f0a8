//! Instruments: readings as functions of chain and state, over the open scalar. Each file holds one; the registry below
//! lists them.

mod bearing;
pub mod channel;
mod check;
pub mod column;
mod default_errors;
mod kind;
pub mod measured;
mod operation;
mod parameter;
pub mod set_up;
pub mod stand;
mod target;

pub use kind::{Checked, Entry, Fault, Geometry, Group, Instrument, InstrumentPoint, Misreading, MisreadingKind};
pub use operation::{Aligned, Contact, Following, Handling, Travel};
pub use parameter::{InstrumentParameter, SharedBy};
pub use target::Target;

use std::ops::{Deref, DerefMut};
use std::str::FromStr;

use column::Quantity;
use set_up::SetUp;

use crate::Diagnostic;
use crate::chain::{AxisPosition, BodyErrors, Frame, Machine, MachineState};
use crate::component::ErrorName;
use crate::document::Fault as KeyFault;
use crate::document::node::Node;
use crate::scalar::{Nominal, Scalar};
use crate::session::expression::Constant;
use crate::words::listed;

/// Declares the modules, the enumerations and the list of all instruments.
macro_rules! instruments {
    ($($(#[$doc:meta])* $module:ident: $kind:ident $(($of:ty = $none:expr))?,)+) => {
        $(pub mod $module;)+

        /// The kind of instrument of a session.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum InstrumentKind {
            $($(#[$doc])* $kind $(($of))?,)+
        }

        /// An instrument as set up for one test: its nominal geometry.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Station<N> {
            $($(#[$doc])* $kind($module::$kind<N>),)+
        }

        impl InstrumentKind {
            /// All kinds.
            pub const ALL: &[InstrumentKind] = &[$(InstrumentKind::$kind $(($none))?,)+];

            /// Its entry in the registry.
            pub fn entry(self) -> &'static Entry {
                if let InstrumentKind::Composed(composition) = self {
                    return composition.entry();
                }
                match self {
                    $(InstrumentKind::$kind { .. } => &$module::ENTRY,)+
                }
            }
        }

        impl<N> Station<N> {
            /// The kind of the instrument.
            pub fn kind(&self) -> InstrumentKind {
                if let Station::Composed(own) = self {
                    return InstrumentKind::Composed(own.composition);
                }
                match self {
                    $(Station::$kind(_) => InstrumentKind::$kind $(($none))?,)+
                }
            }

            /// Converts every nominal coordinate of the set-up: expressions to numbers or symbols.
            pub fn map<M>(&self, to: impl Fn(&N) -> M) -> Station<M> {
                match self {
                    $(Station::$kind(geometry) => Station::$kind(geometry.map(&to)),)+
                }
            }

            /// Computes the reading from the state of the axes, the errors of the machine and the parameters of the
            /// instrument (mm, rad, in the order of [`InstrumentKind::unknowns`]; `None` is an exact zero).
            pub fn read<S: Scalar<Nominal = N>>(
                &self,
                machine: &Machine,
                state: &[AxisPosition<N>],
                errors: &[BodyErrors<S>],
                unknown: impl Fn(usize) -> Option<S>,
            ) -> Reading<S>
            where
                N: Nominal,
            {
                let at = MachineState { machine, state, errors };
                match self {
                    $(Station::$kind(geometry) => geometry.reading(at, unknown),)+
                }
            }

            /// The instrument's point on the table and its point on the tool, if it has them.
            pub fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
                match self {
                    $(Station::$kind(geometry) => geometry.points(),)+
                }
            }

            /// Keeps the channels for which data have a column; see [`Geometry::keep_channels`].
            pub fn keep_channels(&mut self, has: &dyn Fn(Quantity) -> bool) {
                match self {
                    $(Station::$kind(geometry) => geometry.keep_channels(has),)+
                }
            }
        }

        $(impl<N> From<$module::$kind<N>> for Station<N> {
            fn from(geometry: $module::$kind<N>) -> Station<N> {
                Station::$kind(geometry)
            }
        })+

        impl Deref for Station<f64> {
            type Target = dyn Instrument;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Station::$kind(geometry) => geometry,)+
                }
            }
        }

        impl DerefMut for Station<f64> {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match self {
                    $(Station::$kind(geometry) => geometry,)+
                }
            }
        }
    };
}

instruments! {
    /// A double ball bar.
    ballbar: BallBar,
    /// An R-test: three displacement sensors about a ball.
    rtest: RTest,
    /// A touch probe.
    probe: Probe,
    /// A laser tracker.
    tracker: Tracker,
    /// Position and orientation of a body at the tool: motion capture, hand-eye, portable arm.
    pose: Pose,
    /// A ball in fixed sockets.
    socket: Socket,
    /// A laser interferometer: displacement, straightness, angles.
    laser: Laser,
    /// A sensor of angles: autocollimator, level, encoder.
    angle: Angle,
    /// A distance from an unknown place.
    distance: Distance,
    /// The pointing of a mount.
    pointing: Pointing,
    /// Channels between targets that a session composes.
    composed: Composed(composed::Composition = composed::NONE),
}

/// All kinds of instruments.
pub fn kinds() -> &'static [InstrumentKind] {
    InstrumentKind::ALL
}

/// The kind of a word in files.
impl FromStr for InstrumentKind {
    type Err = Diagnostic;

    fn from_str(word: &str) -> Result<InstrumentKind, Diagnostic> {
        kinds().iter().copied().find(|kind| kind.word() == word).ok_or_else(|| {
            Diagnostic::session(
                format!("no instrument is called `{word}`"),
                listed(&kinds().iter().map(|kind| kind.word()).collect::<Vec<_>>(), "or"),
            )
        })
    }
}

impl<N> Station<N> {
    /// The bar, if one is read.
    pub fn bar(&self) -> Option<&ballbar::BallBar<N>> {
        if let Station::BallBar(bar) = self { Some(bar) } else { None }
    }

    /// The same, to be changed.
    pub fn bar_mut(&mut self) -> Option<&mut ballbar::BallBar<N>> {
        if let Station::BallBar(bar) = self { Some(bar) } else { None }
    }

    /// The probe, if one touches.
    pub fn probe(&self) -> Option<&probe::Probe<N>> {
        if let Station::Probe(probe) = self { Some(probe) } else { None }
    }

    /// The sensors and the balls of an R-test, if it is one.
    pub fn rtest(&self) -> Option<&rtest::RTest<N>> {
        if let Station::RTest(rtest) = self { Some(rtest) } else { None }
    }

    /// A reading that all errors of the machine affect, from a point of the table to a point of the tool, mm: for what is
    /// computed without an instrument.
    pub fn between(table_mm: [N; 3], tool_mm: [N; 3], apart_mm: N) -> Station<N> {
        let (workpiece_ball, spindle_ball) = (Target::on_table(table_mm), Target::on_tool(tool_mm));
        Station::BallBar(ballbar::BallBar { workpiece_ball, spindle_ball, bar: apart_mm })
    }
}

impl<N: Nominal> Station<N> {
    /// The instrument's point on the side of the table, if it has one.
    pub fn table_point(&self) -> Option<Target<N>> {
        self.points()[0].map(|point| *point.target)
    }

    /// The instrument's point on the side of the tool; the origin of the tool frame without one.
    pub fn tool_point(&self) -> Target<N> {
        self.points()[1].map_or(Target::on_tool([N::constant(0.0); 3]), |point| *point.target)
    }
}

impl InstrumentKind {
    /// The identifier in session files.
    pub fn word(self) -> &'static str {
        self.entry().word
    }

    /// Whether a reading connects a point of the table and a point of the tool, so that errors of both sides affect it.
    pub fn is_two_sided(self) -> bool {
        self.entry().is_two_sided
    }

    /// The instrument's parameters in the order of its slots.
    pub fn unknowns(self) -> &'static [InstrumentParameter] {
        self.entry().parameters
    }

    /// Whether one of its parameters is shared by such a group of tests.
    pub fn shares(self, by: SharedBy) -> bool {
        self.unknowns().iter().any(|parameter| parameter.shared_by == by)
    }

    /// The set-up of a test, whose lengths may be expressions in the constants.
    ///
    /// # Errors
    /// What is wrong with a key.
    pub fn set_up(self, keys: &Node, constants: &[Constant], machine: &Machine) -> Result<SetUp, KeyFault> {
        match self {
            InstrumentKind::Composed(composition) => composition.set_up(keys, constants, machine),
            _ => self.entry().set_up(keys, constants, machine),
        }
    }

    /// The errors to be estimated if a session states none.
    pub fn default_errors(self, machine: &Machine) -> Vec<ErrorName> {
        (self.entry().default_errors)(machine)
    }

    /// The name shared by tests with the same mounted object in the tool frame if `test` states none.
    pub fn spindle_setup(self, test: &str) -> &str {
        self.entry().spindle_setup.unwrap_or(test)
    }
}

impl Station<f64> {
    /// The same, counting from where another counts.
    pub fn counted_as(&self, other: &Station<f64>) -> Station<f64> {
        match (self, other) {
            (Station::Laser(own), Station::Laser(other)) => {
                Station::Laser(laser::Laser { datum: other.datum, ..own.clone() })
            }
            _ => self.clone(),
        }
    }

    /// The object that a group of tests shares, where it nominally is; a bar by its length.
    pub fn shared(&self, group: SharedBy) -> Target<f64> {
        match group {
            SharedBy::Setup => self.table_point().unwrap_or(Target::on_table([0.0; 3])),
            SharedBy::BarSetup => Target::on_table([self.reference_mm(), 0.0, 0.0]),
            _ => self.tool_point(),
        }
    }

    /// The points of table and tool as the ends of a bar; `None` without a point of the table.
    pub fn between_points(&self) -> Option<ballbar::BallBar<f64>> {
        let (workpiece_ball, spindle_ball) = (self.table_point()?, self.tool_point());
        Some(ballbar::BallBar { workpiece_ball, spindle_ball, bar: self.reference_mm() })
    }

    /// The points that are not fixed on their default bodies: the key of each, and its frame.
    pub fn frames(&self) -> Vec<(String, Frame)> {
        if let Station::Composed(own) = self {
            return own.frames();
        }
        let (defaults, mut own) = (self.kind().entry().points.iter(), self.clone());
        let frames: Vec<Frame> = own.points_mut().into_iter().flatten().map(|target| target.frame).collect();
        let others = defaults.zip(frames).filter(|((_, default), frame)| default != frame);
        others.map(|((name, _), frame)| (format!("{name}{}", set_up::FRAME), frame)).collect()
    }
}

/// Largest number of channels of an instrument.
pub const MAX_CHANNELS: usize = 6;

/// The values of the channels of one reading, mm or rad.
#[derive(Clone, Copy, Debug)]
pub struct Reading<S> {
    values: [S; MAX_CHANNELS],
    count: usize,
}

impl<S: Scalar> Reading<S> {
    /// A reading of one channel.
    pub fn scalar(value: S) -> Self {
        Reading::of([value])
    }

    /// The values of at most [`MAX_CHANNELS`] channels.
    pub fn of(values: impl IntoIterator<Item = S>) -> Self {
        let mut reading = Reading { values: [S::constant(0.0); MAX_CHANNELS], count: 0 };
        for (place, value) in reading.values.iter_mut().zip(values) {
            *place = value;
            reading.count += 1;
        }
        reading
    }

    /// The values, one for each channel.
    pub fn channels(&self) -> &[S] {
        &self.values[..self.count]
    }
}

/// Converts the coordinates of a nominal point.
fn point<N, M>(point: &[N; 3], to: &impl Fn(&N) -> M) -> [M; 3] {
    point.each_ref().map(to)
}
