//! Sessions: a machine, a plan of tests, and the readings if the tests have been run.
//!
//! A session file is read by [`read::session`]; what comes out has been checked, is in mm, rad and s, and names no unit again.

mod document;
pub mod expression;
pub mod limits;
pub mod motion;
pub mod placing;
mod plan;
mod reach;
pub mod read;
pub mod readings;
pub mod rewrite;
mod runs;
pub mod schema;
mod spelling;
pub mod stamp;
mod table;
pub mod write;

use std::path::PathBuf;

use crate::chain::Machine;
use crate::component::ErrorName;
use crate::effect::Effect;
use crate::instrument::rtest::Setting;
use crate::instrument::{InstrumentKind, SharedBy, Station};
use readings::Readings;
use stamp::FileStamp;

/// A session, checked. Lengths in mm, angles in rad.
#[derive(Clone, Debug)]
pub struct Session {
    /// The session file.
    pub file: PathBuf,
    /// What stands in it, as it was read.
    pub text: String,
    /// What stands in the machine's file, where the session names one.
    pub machine_text: Option<String>,
    /// Every file that was read: the session, its machine, its data.
    pub files: Vec<FileStamp>,
    /// The machine.
    pub machine: Machine,
    /// Named lengths in the order of the file, mm.
    pub constants: Vec<(String, f64)>,
    /// What reads.
    pub instrument: InstrumentKind,
    /// Standard deviation of one scalar reading, mm; `None` where it is to be estimated.
    pub noise_mm: Option<f64>,
    /// Least step of a reading, mm.
    pub resolution_mm: Option<f64>,
    /// The errors to be identified.
    pub unknowns: Vec<ErrorName>,
    /// The effects that the user declares.
    pub effects: Vec<Effect>,
    /// The tests.
    pub tests: Vec<Test>,
    /// Known distances between sockets.
    pub socket_distances: Vec<SocketDistance>,
    /// What a user should know although the session can be used.
    pub warnings: Vec<String>,
    /// What `[about]` says of the measurement, by name in the order of the file: `serial_number`, `operator`, `date`, `comment` and others.
    /// No calculation uses it; reports and results repeat it.
    pub about: Vec<(String, String)>,
}

/// One test.
#[derive(Clone, Debug)]
pub struct Test {
    /// Its name, unique in the session.
    pub name: String,
    /// The instrument as set up, nominal.
    pub station: Station<f64>,
    /// The same over the session's constants, as written.
    pub geometry: Station<expression::Length>,
    /// What is known of each of the instrument's unknowns, in their order.
    pub priors: Vec<Prior>,
    /// Which tests share the mounted workpiece ball (or tracker).
    pub setup: String,
    /// Which tests share the mounted spindle ball (or target).
    pub spindle_setup: String,
    /// Which tests share the assembled bar.
    pub bar_setup: String,
    /// The socket, for that instrument.
    pub socket: Option<String>,
    /// How the axes move, for a plan.
    pub motion: Option<motion::Motion>,
    /// Axis positions that neither the data nor the motion list, by axis of the machine, mm or rad.
    pub at: Vec<f64>,
    /// The same as written, for linear axes that the file states in mm: what an equation keeps in symbols.
    pub at_written: Vec<Option<expression::Length>>,
    /// What was read.
    pub readings: Option<Readings>,
}

impl Test {
    /// The name of the group of tests that shares an unknown: the `setup`, the `bar_setup`, …; empty for the whole session.
    pub fn group(&self, by: SharedBy) -> &str {
        match by {
            SharedBy::Setup => &self.setup,
            SharedBy::SpindleSetup => &self.spindle_setup,
            SharedBy::BarSetup => &self.bar_setup,
            SharedBy::Sensors => match &self.station {
                Station::RTest(rtest) if rtest.setting == Setting::Spindle => &self.spindle_setup,
                _ => &self.setup,
            },
            SharedBy::Socket => self.socket.as_deref().unwrap_or(""),
            SharedBy::Session => "",
        }
    }
}

/// What is known of a set-up quantity before the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Prior {
    /// Exactly the nominal value.
    Known,
    /// Gaussian about the nominal value with this standard uncertainty, mm or rad.
    Gaussian(f64),
    /// Nothing.
    Free,
}

/// A known distance between two sockets.
#[derive(Clone, Debug, PartialEq)]
pub struct SocketDistance {
    /// The two sockets.
    pub between: [String; 2],
    /// The distance, mm.
    pub distance_mm: f64,
    /// Its standard uncertainty, mm.
    pub u_mm: f64,
}
