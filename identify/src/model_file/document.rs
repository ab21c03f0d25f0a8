//! The JSON form of a model. Keys of machine and effects are those of machine and session files.

use std::collections::BTreeMap;

use abbe_model::chain::Machine;
use abbe_model::document::value::{Json, Long, Positive};
use abbe_model::document::{effect, machine, print};
use abbe_model::driver::column::TEMPERATURE;
use abbe_model::driver::{self, Driver};
use abbe_model::effect::Effect;
use abbe_model::instrument::InstrumentKind;
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::Prior;
use abbe_model::unit::{Unit, reading};
use faer::Mat;
use schemars::JsonSchema;
use serde::ser::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};

use crate::fit::frames::SetUpFrame;
use crate::noise::Noise;
use crate::results::ModelFit;

/// The word that marks a model file.
pub const SCHEMA: &str = "abbe-model";
/// Version of the form. A reader refuses newer ones.
pub const SCHEMA_VERSION: u32 = 1;

/// An identified model.
pub type IdentifiedModel = Model<Machine, Effect, Mat<f64>>;
/// A model as its file states it: machine and effects with the keys of their documents, the covariance as a triangle.
pub type Document = Model<machine::Machine, effect::Effect, Rows>;
/// Rows of numbers.
pub type Rows = Long<Vec<Long<Vec<f64>>>>;

/// A model file: `abbe fit|trace --save`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(bound(
    serialize = "M: Serialize, E: Serialize, C: Serialize",
    deserialize = "M: Deserialize<'de>, E: Deserialize<'de>, C: Deserialize<'de>"
))]
#[schemars(rename = "Document")]
pub struct Model<M, E, C> {
    /// `abbe-model`.
    pub schema: String,
    /// Version of this form.
    pub schema_version: u32,
    /// SHA-256 of the other keys as compact JSON, in hexadecimal.
    pub sha256: String,
    /// Where the model comes from.
    pub provenance: Provenance,
    /// The machine, with the keys of a machine file.
    #[serde(serialize_with = "sorted")]
    pub machine: M,
    /// The instrument of the readings: `ballbar`, `tracker`, …
    pub instrument: InstrumentKind,
    /// The effects, with the keys of `[[effect]]`.
    #[serde(serialize_with = "sorted", deserialize_with = "long")]
    #[schemars(with = "Long<Vec<E>>")]
    pub effects: Vec<E>,
    /// All parameters in the order of `covariance`.
    #[serde(deserialize_with = "long")]
    #[schemars(with = "Long<Vec<ModelParameter>>")]
    pub parameters: Vec<ModelParameter>,
    /// Lower triangle of the covariance of the parameters, row by row, internal units (mm, rad, s).
    pub covariance: C,
    /// Directions that the readings do not determine, internal units.
    #[serde(deserialize_with = "rows")]
    #[schemars(with = "Rows")]
    pub null_directions: Vec<Vec<f64>>,
    /// Location errors as estimated without any effect.
    #[serde(deserialize_with = "long")]
    #[schemars(with = "Long<Vec<Location>>")]
    pub locations: Vec<Location>,
    /// The unit of the figures of readings, noise and residuals: absent for µm, `arcsec` of a session of angles, whose
    /// figures stand under the same keys.
    #[serde(
        rename = "reading_unit",
        default,
        skip_serializing_if = "Unit::is_micrometre",
        deserialize_with = "reading::deserialize"
    )]
    #[schemars(schema_with = "reading::schema")]
    pub unit: Unit,
    /// The noise of a reading.
    pub noise: Noise,
    /// How well the model describes its own readings.
    pub fit: ModelFit,
    /// The range of every axis and driver that the readings covered.
    pub ranges: Vec<DriverRange>,
    /// The ranges of each error motion over its own axis.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub motion_ranges: Vec<MotionRange>,
    /// The instrument's point in the tool frame at the first test.
    pub tool_mm: [f64; 3],
    /// The instrument's point in the table frame there; 0 for instruments without one.
    pub table_mm: [f64; 3],
    /// Where the instruments stand and how their targets are mounted.
    #[serde(skip_serializing_if = "Vec::is_empty", default, deserialize_with = "long")]
    #[schemars(with = "Long<Vec<SetUpFrame>>")]
    pub frames: Vec<SetUpFrame>,
    /// Reference values from which drivers count.
    #[serde(serialize_with = "Reference::serialized", deserialize_with = "Reference::deserialized")]
    #[schemars(with = "Reference")]
    pub reference: driver::Reference,
}

impl<M, E, C> Model<M, E, C> {
    /// The same model over another form of its machine, its effects and its covariance.
    pub(super) fn over<N, F, D>(self, machine: N, effects: Vec<F>, covariance: D) -> Model<N, F, D> {
        Model {
            schema: self.schema,
            schema_version: self.schema_version,
            sha256: self.sha256,
            provenance: self.provenance,
            machine,
            instrument: self.instrument,
            effects,
            parameters: self.parameters,
            covariance,
            null_directions: self.null_directions,
            locations: self.locations,
            unit: self.unit,
            noise: self.noise,
            fit: self.fit,
            ranges: self.ranges,
            motion_ranges: self.motion_ranges,
            tool_mm: self.tool_mm,
            table_mm: self.table_mm,
            frames: self.frames,
            reference: self.reference,
        }
    }
}

/// A document of a session, with the keys of each table in alphabetical order.
fn sorted<S: Serializer>(document: &impl Serialize, serializer: S) -> Result<S::Ok, S::Error> {
    let mut value = print::json_of(document).map_err(S::Error::custom)?;
    value.sort_all_objects();
    value.serialize(serializer)
}

/// The command and the files from which a model follows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Version of the program.
    pub tool_version: String,
    /// `fit` or `trace`.
    pub command: String,
    /// The options on the command line.
    #[serde(deserialize_with = "options")]
    pub options: Map<String, Value>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// The session file.
    pub session: String,
    /// All files that were read.
    #[serde(deserialize_with = "long")]
    pub inputs: Vec<InputFile>,
}

/// The options with all digits of their numbers.
fn options<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Map<String, Value>, D::Error> {
    match Json::deserialize(deserializer)? {
        Json(Value::Object(options)) => Ok(options),
        Json(_) => Err(serde::de::Error::invalid_type(serde::de::Unexpected::Other("value"), &"a table")),
    }
}

/// Rows of any length.
fn rows<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<f64>>, D::Error> {
    let Long(rows) = Rows::deserialize(deserializer)?;
    Ok(rows.into_iter().map(|Long(row)| row).collect())
}

/// A number above 0.
fn positive<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Positive::deserialize(deserializer).map(|Positive(number)| number)
}

/// The driver of a word.
fn driver<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Driver, D::Error> {
    String::deserialize(deserializer).map(|word| Driver::parse(&word))
}

/// The word of a driver.
fn driver_word<S: Serializer>(driver: &Driver, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(driver)
}

/// A list of any length.
fn long<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<T, D::Error> {
    Long::deserialize(deserializer).map(|Long(list)| list)
}

/// An input file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InputFile {
    /// Path as the command or the session names it.
    pub file: String,
    /// SHA-256 of the contents as they were read, in hexadecimal; `null` in models of earlier versions that came from a pipe.
    pub sha256: Option<String>,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelParameter {
    /// Identifier, as in the results of a fit.
    pub id: ParameterId,
    /// What it is.
    pub role: Role,
    /// Index of the effect of a coefficient or of a number.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub effect: Option<usize>,
    /// Index of a coefficient among those of its effect, or of a number among those of its shape.
    #[serde(rename = "coefficient", skip_serializing_if = "Option::is_none", default)]
    pub index: Option<usize>,
    /// Value, in `unit`; 0 if it is held.
    #[serde(rename = "value")]
    pub displayed: f64,
    /// Standard uncertainty, in `unit`; `null` if it is held.
    #[serde(rename = "u")]
    pub displayed_u: Option<f64>,
    /// Unit of `value` and `u`.
    pub unit: String,
    /// Number of display units per internal unit.
    #[serde(deserialize_with = "positive")]
    #[schemars(with = "Positive")]
    pub display_per_internal: f64,
    /// Value in the internal unit, from which predictions follow; of a number of a shape its change from that of the
    /// effect.
    #[serde(rename = "internal")]
    pub value: f64,
    /// Whether it is held at nominal, since it is not separable from other parameters.
    pub held: bool,
    /// Whether the readings determine it by itself, not only in combination with others.
    #[serde(default = "by_itself")]
    pub identifiable: bool,
    /// Standard uncertainty of its Gaussian prior about 0, internal unit; `null` without a prior.
    pub prior_u: Option<Positive>,
    /// Physical size, internal unit.
    #[serde(deserialize_with = "positive")]
    #[schemars(with = "Positive")]
    pub size: f64,
}

impl ModelParameter {
    /// The prior of the fit.
    pub fn prior(&self) -> Prior {
        self.prior_u.map_or(Prior::Free, |Positive(u)| Prior::Gaussian(u))
    }
}

/// Models of earlier versions do not state it: what is not held counts.
fn by_itself() -> bool {
    true
}

/// What a parameter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "ModelRole")]
pub enum Role {
    /// A location error.
    Location,
    /// A quantity of the set-up.
    SetUp,
    /// A coefficient of an effect.
    Coefficient,
    /// A number of the shape of an effect that was estimated.
    Number,
}

impl Role {
    /// Of a parameter of a model.
    pub fn of(id: &ParameterId) -> Role {
        match id {
            ParameterId::Error(_) => Role::Location,
            ParameterId::Setup { .. } => Role::SetUp,
            ParameterId::Effect(..) if id.is_number() => Role::Number,
            ParameterId::Effect(..) => Role::Coefficient,
        }
    }
}

/// A location error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ModelLocation")]
pub struct Location {
    /// `EX0C`, …
    pub id: String,
    /// Value, µm or ″.
    #[serde(rename = "value")]
    pub displayed: f64,
    /// `um` or `arcsec`.
    pub unit: String,
    /// Value in the internal unit.
    #[serde(rename = "internal")]
    pub value: f64,
}

/// The range of an axis or a driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ModelRange")]
pub struct DriverRange {
    /// An axis, `time`, `temperature`, `gravity`, …
    #[serde(serialize_with = "driver_word", deserialize_with = "driver")]
    #[schemars(with = "String")]
    pub driver: Driver,
    /// The axis that the driver is about, for drivers that differ from axis to axis.
    #[serde(rename = "axis", skip_serializing_if = "Option::is_none", default)]
    pub component_axis: Option<String>,
    /// Least and greatest value, in `unit`.
    #[serde(rename = "range")]
    pub displayed: [f64; 2],
    /// `mm`, `deg`, `s`, `K`, `m`.
    pub unit: String,
    /// Least and greatest value, internal unit.
    #[serde(rename = "internal")]
    pub range: [f64; 2],
}

/// The positions through which the axis of an error motion moved while readings observed the error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionRange {
    /// `EXX`, …
    pub error: String,
    /// Least and greatest position of each unconnected range, mm or rad, the longest first.
    pub internal: Vec<[f64; 2]>,
}

/// Reference values from which drivers count.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ModelReference")]
pub struct Reference {
    /// Time of the first reading, s.
    pub time_s: f64,
    /// Mean of the temperatures, °C; 0 without.
    pub temperature_c: f64,
    /// The mean of each other driver column, by `NAME_unit`, in its unit.
    #[serde(skip_serializing_if = "BTreeMap::is_empty", default)]
    pub drivers: BTreeMap<String, f64>,
}

impl Reference {
    fn serialized<S: Serializer>(of: &driver::Reference, serializer: S) -> Result<S::Ok, S::Error> {
        let mut drivers = of.means.clone();
        let temperature_c = drivers.remove(TEMPERATURE).unwrap_or(0.0);
        Reference { time_s: of.time_s, temperature_c, drivers }.serialize(serializer)
    }

    fn deserialized<'de, D: Deserializer<'de>>(deserializer: D) -> Result<driver::Reference, D::Error> {
        let Reference { time_s, temperature_c, mut drivers } = Reference::deserialize(deserializer)?;
        drivers.insert(TEMPERATURE.to_string(), temperature_c);
        Ok(driver::Reference::without_history(time_s, drivers))
    }
}
