//! Sessions: a machine, a plan of tests, and the readings of the tests that were run.
//!
//! A session is validated and in mm, rad and s. The crate `abbe-files` reads it, from files or memory,
//! and writes it.

pub mod expression;
pub mod limits;
pub mod motion;
pub mod placing;
pub mod planned;
pub mod readings;
pub mod tolerance;
pub mod trajectory;

use std::sync::Arc;

use expression::Constant;
use readings::Readings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tolerance::Tolerance;

use crate::body::ClearanceSizes;
use crate::chain::Machine;
use crate::component::ErrorName;
use crate::document::node::Node;
use crate::document::value::NotNegative;
use crate::driver::Reference;
use crate::effect::Effect;
use crate::instrument::{Entry, InstrumentKind, InstrumentParameter, SharedBy, Station};
use crate::unit::{ARCSEC_PER_RAD, MM_PER_UM, Unit};

/// The lever at which one arcsecond is one micrometre, mm.
pub const NATURAL_LEVER_MM: f64 = MM_PER_UM * ARCSEC_PER_RAD;

/// A validated session. Lengths in mm, angles in rad.
#[derive(Clone, Debug)]
pub struct Session {
    /// The machine.
    pub machine: Arc<Machine>,
    /// Named lengths in the order of the file.
    pub constants: Vec<Constant>,
    /// The instrument of tests that name no other.
    pub instrument: InstrumentKind,
    /// Standard deviation of one length, mm; `None` if it is to be estimated.
    pub noise_mm: Option<f64>,
    /// Standard deviation of one angle, rad; `None` if it is to be estimated.
    pub noise_rad: Option<f64>,
    /// The length at which an angle of one radian has the noise of a length, mm. By default
    /// [`NATURAL_LEVER_MM`].
    pub lever_mm: f64,
    /// Resolution of a length, mm.
    pub resolution_mm: Option<f64>,
    /// Resolution of an angle, rad.
    pub resolution_rad: Option<f64>,
    /// The errors to be estimated.
    pub unknowns: Vec<ErrorName>,
    /// The effects that the user declares.
    pub effects: Vec<Effect>,
    /// The tests.
    pub tests: Vec<Test>,
    /// Known distances between sockets.
    pub socket_distances: Vec<SocketDistance>,
    /// Limits of the results, for a decision of conformity.
    pub tolerance: Option<Tolerance>,
    /// Sizes of the instrument for checks of clearance.
    pub clearance: Option<ClearanceSizes>,
    /// Warnings about a usable session.
    pub warnings: Vec<String>,
    /// Notes of `[about]` on the measurement, by name in the order of the file: `serial_number`, `operator`, `date`,
    /// `comment` and others. No calculation uses them; reports and results repeat them.
    pub about: Vec<(String, String)>,
    /// The targets of a composed measurement: keys of the set-up of every test that does not state them.
    pub targets: Node,
}

impl Session {
    /// A session without tests. The errors to be estimated are the defaults of the instrument; the noise is estimated.
    pub fn new(machine: Machine, instrument: InstrumentKind) -> Session {
        Session {
            unknowns: instrument.default_errors(&machine),
            machine: Arc::new(machine),
            constants: Vec::new(),
            instrument,
            noise_mm: None,
            noise_rad: None,
            lever_mm: NATURAL_LEVER_MM,
            resolution_mm: None,
            resolution_rad: None,
            effects: Vec::new(),
            tests: Vec::new(),
            socket_distances: Vec::new(),
            tolerance: None,
            clearance: None,
            warnings: Vec::new(),
            about: Vec::new(),
            targets: Node::default(),
        }
    }

    /// The kinds of instruments of the tests, each once; that of the session without tests.
    pub fn instruments(&self) -> Vec<InstrumentKind> {
        instruments(self.instrument, &self.tests)
    }

    /// The parameters of the instruments of the tests, each once.
    pub fn instrument_parameters(&self) -> Vec<InstrumentParameter> {
        instrument_parameters(self.instrument, &self.tests)
    }

    /// Whether a channel of a test is a length, and whether one is an angle.
    pub fn units(&self) -> ChannelUnits {
        let channels = || self.tests.iter().flat_map(|test| test.station.channels());
        ChannelUnits {
            lengths: channels().any(|channel| !channel.is_angle()),
            angles: channels().any(|channel| channel.is_angle()),
        }
    }

    /// The unit of the figures of readings (noise, residuals, held-out errors): arcsec if all channels are angles, else
    /// µm. Keys of results end in it.
    pub fn reading_unit(&self) -> Unit {
        if self.units().only_angles() { Unit::Arcsecond } else { Unit::Micrometre }
    }

    /// Whether the lever is not to be estimated: it is stated or estimated, or there are no lengths beside angles.
    pub fn is_lever_known(&self) -> bool {
        let units = self.units();
        !(units.lengths && units.angles) || self.stated_lever_mm().is_some() || self.lever_mm != NATURAL_LEVER_MM
    }

    /// The lever that the stated noise of lengths and of angles requires; `None` if there are not both.
    pub fn stated_lever_mm(&self) -> Option<f64> {
        let units = self.units();
        let positive = |noise: Option<f64>| noise.filter(|sigma| *sigma > 0.0);
        (units.lengths && units.angles).then_some(())?;
        Some(positive(self.noise_mm)? / positive(self.noise_rad)?)
    }

    /// The keys of noise that the session does not state, of the units in which its channels read.
    pub fn keys_of_noise(&self) -> &'static str {
        let units = self.units();
        match (units.lengths && self.noise_mm.is_none(), units.angles && self.noise_rad.is_none()) {
            (true, true) => "`noise_um` and `noise_arcsec`",
            (false, true) => "`noise_arcsec`",
            _ => "`noise_um`",
        }
    }

    /// The stated standard deviation of a channel, mm; of an angle at [`Session::lever_mm`].
    pub fn stated_noise_mm(&self) -> Option<f64> {
        let lengths = self.noise_mm.filter(|_| !self.units().only_angles());
        let angles = || Some(self.noise_rad? * self.lever_mm);
        lengths.or_else(angles).filter(|sigma| *sigma > 0.0)
    }

    /// The standard deviation that the resolution of the channels causes, mm; of an angle at [`Session::lever_mm`].
    pub fn resolution_noise_mm(&self) -> f64 {
        let units = self.units();
        let lengths = self.resolution_mm.filter(|_| units.lengths).unwrap_or(0.0);
        let angles = self.resolution_rad.filter(|_| units.angles).unwrap_or(0.0) * self.lever_mm;
        lengths.max(angles) / 12.0_f64.sqrt()
    }

    /// Reference time and temperature, from which the drivers of effects count.
    pub fn reference(&self) -> Reference {
        Reference::of(self.tests.iter().filter_map(|test| test.readings.as_deref()))
    }

    /// The session with these readings, in the order of its tests.
    pub fn with_readings(mut self, readings: impl IntoIterator<Item = Readings>) -> Session {
        for (test, readings) in self.tests.iter_mut().zip(readings) {
            test.readings = Some(Arc::new(readings));
        }
        self
    }
}

/// The kinds of instruments of tests, each once; `other` without tests.
fn instruments(other: InstrumentKind, tests: &[Test]) -> Vec<InstrumentKind> {
    let mut kinds: Vec<InstrumentKind> = Vec::new();
    for kind in tests.iter().map(|test| test.station.kind()) {
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    if kinds.is_empty() { vec![other] } else { kinds }
}

/// The parameters of the instruments of tests, each once; those of `other` without tests.
pub fn instrument_parameters(other: InstrumentKind, tests: &[Test]) -> Vec<InstrumentParameter> {
    parameters_of(&instruments(other, tests))
}

/// The parameters of instruments, each once.
pub fn parameters_of(kinds: &[InstrumentKind]) -> Vec<InstrumentParameter> {
    let mut parameters: Vec<InstrumentParameter> = Vec::new();
    for parameter in kinds.iter().flat_map(|kind| kind.unknowns()) {
        let is_same =
            |other: &InstrumentParameter| other.thing == parameter.thing && other.coordinate == parameter.coordinate;
        if !parameters.iter().any(is_same) {
            parameters.push(*parameter);
        }
    }
    parameters
}

/// The units of the channels of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChannelUnits {
    /// Whether a channel is a length.
    pub lengths: bool,
    /// Whether a channel is an angle.
    pub angles: bool,
}

impl ChannelUnits {
    /// Whether all channels are angles.
    pub fn only_angles(self) -> bool {
        self.angles && !self.lengths
    }
}

/// One test.
#[derive(Clone, Debug)]
pub struct Test {
    /// Its name, unique in the session.
    pub name: String,
    /// The nominal set-up of the instrument.
    pub station: Station<f64>,
    /// The same as expressions in the session's constants.
    pub geometry: Station<expression::Length>,
    /// The prior of each parameter of the instrument, in their order.
    pub priors: Vec<Prior>,
    /// Name shared by tests with the same mounted workpiece ball (or tracker).
    pub setup: String,
    /// Name shared by tests with the same mounted spindle ball (or target).
    pub spindle_setup: String,
    /// Name shared by tests with the same assembled bar.
    pub bar_setup: String,
    /// The socket, for a socket instrument.
    pub socket: Option<String>,
    /// The motion of the axes, for a plan.
    pub motion: Option<motion::Motion>,
    /// Positions of axes that neither the data nor the motion contain, by axis of the machine, mm or rad.
    pub at: Vec<f64>,
    /// The same as expressions, for linear axes stated in mm; equations keep them as symbols.
    pub at_written: Vec<Option<expression::Length>>,
    /// Contributors to the measurement uncertainty of positioning figures.
    pub contributors: Option<Contributors>,
    /// The measured readings.
    pub readings: Option<Arc<Readings>>,
}

impl Test {
    /// A test without readings in which all axes stand at zero. Its set-up is exactly known, and no other test has it.
    pub fn new(name: &str, station: Station<f64>, axes: usize) -> Test {
        Test {
            name: name.to_string(),
            geometry: station.map(|length| expression::Length::Number(*length)),
            priors: vec![Prior::Known; station.kind().unknowns().len()],
            station,
            setup: name.to_string(),
            spindle_setup: name.to_string(),
            bar_setup: name.to_string(),
            socket: None,
            motion: None,
            at: vec![0.0; axes],
            at_written: vec![None; axes],
            contributors: None,
            readings: None,
        }
    }

    /// The name of the group of tests that shares a parameter: the `setup`, the `bar_setup`, …; empty for the whole
    /// session.
    pub fn group(&self, by: SharedBy) -> &str {
        match by {
            SharedBy::Setup => &self.setup,
            SharedBy::SpindleSetup => &self.spindle_setup,
            SharedBy::BarSetup => &self.bar_setup,
            SharedBy::Sensors => self.group(self.station.sensors()),
            SharedBy::Socket => self.socket.as_deref().unwrap_or(""),
            SharedBy::Session => "",
        }
    }

    /// The group of tests that share the object whose place no session knows: a tracker, a socket.
    pub fn free_place(&self) -> Option<&str> {
        let Entry { parameters, free, .. } = self.station.kind().entry();
        let parameter = parameters.iter().find(|parameter| *free == Some(parameter.thing))?;
        Some(self.group(parameter.shared_by))
    }
}

/// Prior of a set-up quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Prior {
    /// Known exactly: the nominal value.
    Known,
    /// Gaussian about the nominal value with this standard uncertainty, mm or rad.
    Gaussian(f64),
    /// No prior.
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

/// What is between the balls of a ball bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mounted {
    /// The bar.
    Bar,
    /// Nothing.
    Nothing,
    /// The cup of the spindle holds the workpiece ball, or is about to: the two holders meet.
    BallInCup,
}

/// Moves that follow each other: the axes go straight from state to state.
#[derive(Clone, Debug, PartialEq)]
pub struct Moves {
    /// The test.
    pub test: String,
    /// What the moves are for: `approach`, `centring`, `feed-in`, `overshoot`, `retreat`.
    pub stage: &'static str,
    /// Positions of all axes, mm or rad.
    pub states: Vec<Vec<f64>>,
    /// What is mounted.
    pub mounted: Mounted,
}

/// Contributors to the measurement uncertainty of the positioning figures of a laser or a sensor of angles. What is absent
/// is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "contributors", deny_unknown_fields)]
pub struct Contributors {
    /// Standard uncertainty of the calibrated laser, the part that no length changes.
    pub device_u_um: Option<NotNegative>,
    /// Standard uncertainty of the calibrated laser in proportion to the length, µm/m.
    pub device_u_um_m: Option<NotNegative>,
    /// Standard uncertainty of the calibrated sensor of angles.
    pub device_u_arcsec: Option<NotNegative>,
    /// Lateral deviation of the beam over the measured length, mm.
    pub misalignment_mm: Option<NotNegative>,
    /// Coefficient of thermal expansion by which readings refer to 20 °C, µm/(m·K).
    pub expansion_um_m_k: Option<NotNegative>,
    /// Its standard uncertainty.
    pub expansion_u_um_m_k: Option<NotNegative>,
    /// Deviation of the temperature from 20 °C, K.
    pub temperature_difference_k: Option<NotNegative>,
    /// Standard uncertainty of the measured temperature, K.
    pub temperature_u_k: Option<NotNegative>,
    /// Environmental variation: the range of the readings of a drift test as long as the test.
    pub environment_um: Option<NotNegative>,
    /// The same of a sensor of angles.
    pub environment_arcsec: Option<NotNegative>,
    /// Standard uncertainty of the repeated set-up.
    pub setup_u_um: Option<NotNegative>,
    /// The same of a sensor of angles.
    pub setup_u_arcsec: Option<NotNegative>,
}
