//! The tables of a session: `session.toml`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use super::composed::{Channel, Target};
use super::effect::Effect;
use super::layout::{Columns, Format};
use super::machine::Machine;
use super::measurement::Test;
use super::node::{Entries, Named, Node};
use super::tolerance::Tolerance;
use super::value::{NotNegative, Note, Positive};
use crate::body::ClearanceSizes;
use crate::instrument::InstrumentKind;

/// session.toml: a machine, a plan of tests, and the readings of the tests that were run. The name of a number contains
/// its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "session")]
#[schemars(deny_unknown_fields)]
pub struct Session {
    /// The machine file, or the tables of the machine: [machine] with `file = "machine.toml"`, or the machine's tables in
    /// it.
    pub machine: SessionMachine,
    /// Notes on the measurement: serial_number, operator, date, comment. Reports and results repeat them; no calculation
    /// uses them.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    #[schemars(extend("properties" = {
        "serial_number": {"type": ["string", "number"], "description": "Serial number of the machine."},
        "operator": {"type": "string", "description": "Name of the operator."},
        "date": {"type": "string", "description": "Date of the measurement; a TOML date or a text."},
        "comment": {"type": "string", "description": "Further remarks for the report."}
    }))]
    pub about: Named<Note>,
    /// Named lengths, mm, that tests may use and equations keep as symbols: R = 100.0, or R = { mm = 100.0, means =
    /// "radius" }.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    #[schemars(with = "Named<ConstantForms>")]
    pub constants: Entries,
    /// The instrument: [instrument] with `kind = "ballbar"`.
    pub instrument: Instrument,
    /// The errors to estimate.
    #[serde(default, skip_serializing_if = "Unknowns::is_default")]
    pub unknowns: Unknowns,
    /// The other tables.
    #[serde(rename = "$rest", default)]
    #[schemars(flatten)]
    pub parts: Parts,
}

/// What a session states beside its machine, its instrument and the errors to estimate. A program adds it part by part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Parts {
    /// Layout of the data files.
    pub format: Option<Format>,
    /// Own name = foreign name or number; the own name contains the unit.
    pub columns: Option<Columns>,
    /// The effects that the user declares.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effect: Vec<Effect>,
    /// The targets of a composed measurement.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub target: Vec<Target>,
    /// The channels of a composed measurement.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub channel: Vec<Channel>,
    /// The tests.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(min = 1))]
    pub test: Vec<Test>,
    /// Sockets at known distances.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<SocketDistance>")]
    pub socket_distance: Vec<Node>,
    /// Limits for decisions of conformity by the rule of ISO 14253-1.
    pub tolerance: Option<Tolerance>,
    /// Sizes of the ball bar for checks of clearance against the bodies of the machine.
    pub clearance: Option<ClearanceSizes>,
}

/// The machine of a session.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline, untagged)]
pub enum SessionMachine {
    /// A file of its own.
    File(MachineFile),
    /// The tables of the machine.
    Other(Machine),
}

impl Serialize for SessionMachine {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            SessionMachine::File(file) => file.serialize(serializer),
            SessionMachine::Other(machine) => machine.serialize(serializer),
        }
    }
}

/// A machine file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "machine_file", deny_unknown_fields)]
#[schemars(inline)]
pub struct MachineFile {
    /// machine.toml, relative to the session file.
    pub file: String,
}

/// A constant.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename = "constant", deny_unknown_fields)]
pub struct Constant {
    /// Its value, for example `mm = 100.0`.
    pub mm: f64,
    /// The meaning in words, for tables of symbols. Default: the comment behind the value.
    pub means: Option<String>,
}

/// The forms of a constant in the schema.
#[derive(JsonSchema)]
#[schemars(inline, untagged)]
#[allow(dead_code, reason = "the schema alone uses it")]
enum ConstantForms {
    Number(f64),
    Table(Constant),
}

/// The instrument of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "instrument", deny_unknown_fields)]
pub struct Instrument {
    /// The kind of the instrument.
    pub kind: InstrumentKind,
    /// Noise standard deviation of one length, µm; estimated if absent.
    pub noise_um: Option<NotNegative>,
    /// Noise standard deviation of one angle, arcsec; estimated if absent.
    pub noise_arcsec: Option<NotNegative>,
    /// Resolution of a length, µm.
    pub resolution_um: Option<NotNegative>,
    /// Resolution of an angle, arcsec.
    pub resolution_arcsec: Option<NotNegative>,
}

impl Instrument {
    /// An instrument whose noise is to be estimated.
    pub fn new(kind: InstrumentKind) -> Instrument {
        Instrument { kind, noise_um: None, noise_arcsec: None, resolution_um: None, resolution_arcsec: None }
    }
}

/// The errors to estimate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "unknowns", deny_unknown_fields)]
#[schemars(inline)]
pub struct Unknowns {
    /// Errors to estimate: EY0A (location), EYA (motion), e_y0a, θ_z0c; patterns such as E?0C and E?0J*, where ? is one
    /// character and * any number. Default: the position and orientation errors of the rotary axes; for a tracker and for
    /// sockets all location errors of all axes.
    pub errors: Option<Vec<String>>,
}

impl Unknowns {
    fn is_default(&self) -> bool {
        self.errors.is_none()
    }
}

/// The distance of two sockets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "socket_distance", deny_unknown_fields)]
pub struct SocketDistance {
    /// The two sockets, such as ["0", "1"].
    #[schemars(length(equal = 2))]
    pub between: Vec<String>,
    /// The distance in mm.
    pub mm: Positive,
    /// Its standard uncertainty; absent: exact.
    pub u_um: Option<NotNegative>,
}
