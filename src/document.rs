//! Results as JSON documents: the result of a command with its inputs and options, so that a program can repeat the
//! command and check what it reads.

use abbe_apply::compare::ComparisonStatement;
use abbe_apply::compare::results::{Comparison, Difference};
use abbe_files::SourceMap;
use abbe_files::stamp::FileStamp;
use abbe_identify::fit::FitResult;
use abbe_identify::model_file::{InputFile, Provenance};
use abbe_identify::results::Statements;
use abbe_plan::PlanStatement;
use abbe_plan::results::{Contribution, PlanAnalysis};
use abbe_trace::result::TraceResult;
use abbe_trace::validate::{MovedParameter, ValidationResult, ValidationStatement};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Version of the schemas of all documents.
pub const SCHEMA_VERSION: u32 = 3;

/// An input file with the checksum of the bytes that were read.
fn input_file(stamp: &FileStamp) -> InputFile {
    InputFile { file: stamp.file.display().to_string(), sha256: stamp.sha256() }
}

/// What was called: the command and its options.
#[derive(Clone, Debug, Default)]
pub struct Call {
    /// The command: `fit`, `trace`, `plan`, …
    pub command: String,
    /// The options, by their long names with `_`: `true` for a flag, a number, a string, or an array of them for a
    /// repeated option.
    pub options: Map<String, Value>,
}

/// The session file and the files that it names.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SessionFile {
    /// Path of the session file.
    file: String,
    /// SHA-256 of the session file as it was read, in hexadecimal.
    sha256: Option<String>,
    /// All files that were read: session, machine and data files, also of further sessions.
    inputs: Vec<InputFile>,
}

/// The files from which a result follows.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Origin {
    session: Option<SessionFile>,
    inputs: Vec<InputFile>,
}

impl Origin {
    /// The files of a session.
    pub fn of_session(sources: &SourceMap) -> Origin {
        let inputs: Vec<InputFile> = sources.files.iter().map(input_file).collect();
        let file = sources.file.display().to_string();
        let own = inputs.iter().find(|input| input.file == file);
        let sha256 = own.and_then(|input| input.sha256.clone());
        Origin { session: Some(SessionFile { sha256, file, inputs }), inputs: Vec::new() }
    }

    /// Files that belong to no session.
    pub fn of_files<'s>(files: impl IntoIterator<Item = &'s FileStamp>) -> Origin {
        Origin { session: None, inputs: files.into_iter().map(input_file).collect() }
    }

    /// Adds the files of a further session.
    pub fn add(&mut self, other: Origin) {
        match (&mut self.session, other.session) {
            (Some(session), Some(other)) => session.inputs.extend(other.inputs),
            (session @ None, Some(other)) => *session = Some(other),
            (_, None) => self.inputs.extend(other.inputs),
        }
    }

    /// Where a model comes from: a call and these files.
    pub fn provenance(&self, call: Call, seed: u64) -> Provenance {
        Provenance {
            tool_version: env!("CARGO_PKG_VERSION").to_string(),
            command: call.command,
            options: call.options,
            seed,
            inputs: self.session.iter().flat_map(|session| session.inputs.clone()).collect(),
            session: self.session.as_ref().map_or(String::new(), |session| session.file.clone()),
        }
    }
}

/// A result with its three statements: is it good, what to correct, what to measure next.
#[derive(Serialize, JsonSchema)]
pub struct Stated<'r, T, S> {
    /// The statements.
    pub statements: S,
    /// The result.
    #[serde(flatten)]
    pub result: &'r T,
}

/// A fit with its statements.
pub type StatedFit<'r> = Stated<'r, FitResult, Statements>;
/// A trace with its statements.
pub type StatedTrace<'r> = Stated<'r, TraceResult, Statements>;
/// A plan with its statements.
pub type StatedPlan<'r> = Stated<'r, PlanAnalysis, Statements<PlanStatement, Contribution>>;
/// A validation with its statements.
pub type StatedValidation<'r> = Stated<'r, ValidationResult, Statements<ValidationStatement, MovedParameter>>;
/// A comparison with its statements.
pub type StatedComparison<'r> = Stated<'r, Comparison, Statements<ComparisonStatement, Difference>>;
/// A history with its statements.
#[cfg(feature = "fleet")]
pub type StatedHistory<'r> =
    Stated<'r, crate::fleet::history::FleetHistory, crate::fleet::history::statements::HistoryStatements>;

#[cfg(feature = "fleet")]
impl<'r> StatedHistory<'r> {
    /// Of a history.
    pub fn of_history(result: &'r crate::fleet::history::FleetHistory) -> Self {
        Stated { statements: crate::fleet::history::statements::statements(&result.machines), result }
    }
}

/// The document of a command: what it was, and its result.
#[derive(Serialize, JsonSchema)]
pub struct Document<T> {
    /// Version of this schema.
    #[schemars(extend("const" = SCHEMA_VERSION))]
    schema_version: u32,
    /// Version of the program.
    tool_version: String,
    /// The command: `fit`, `trace`, `plan`, …
    command: String,
    /// The session, with checksums of all files that were read.
    #[serde(skip_serializing_if = "Option::is_none")]
    session: Option<SessionFile>,
    /// The input files beside those of a session.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    inputs: Vec<InputFile>,
    /// Seed of all random numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed: Option<u64>,
    /// The options by their long names on the command line: `true`, a number, a string, or an array of them.
    options: Map<String, Value>,
    /// The result.
    #[serde(flatten)]
    result: T,
}

impl Document<Value> {
    /// The document of a call with its result, as text.
    ///
    /// # Errors
    /// If the result is no JSON, in words.
    pub fn text(
        call: Call,
        origin: Origin,
        seed: Option<u64>,
        result: serde_json::Result<Value>,
    ) -> Result<String, String> {
        let document = |result| Document {
            schema_version: SCHEMA_VERSION,
            tool_version: env!("CARGO_PKG_VERSION").to_string(),
            command: call.command,
            session: origin.session,
            inputs: origin.inputs,
            seed,
            options: call.options,
            result,
        };
        let text = result.and_then(|result| serde_json::to_string_pretty(&document(result)));
        text.map(|text| text + "\n").map_err(|error| format!("the result cannot be written as JSON: {error}"))
    }
}

/// A result as JSON. Figures of readings end in the unit of the readings: where a result states `reading_unit`, its keys and
/// those within it that end in `_um` and are of readings end in that unit instead.
///
/// # Errors
/// If it is no JSON.
pub fn json(result: &impl Serialize) -> serde_json::Result<Value> {
    let mut value = serde_json::to_value(result)?;
    rename(&mut value, None);
    Ok(value)
}

/// Whether a key is a figure of readings in µm: noise, residuals, held-out errors, what an effect gains.
fn is_of_readings(key: &str) -> bool {
    let words = ["noise", "rms", "residual", "heldout", "prediction_change", "second_order"];
    key.ends_with("_um") && words.iter().any(|word| key.split('_').any(|part| part == *word) || key.starts_with(word))
}

fn rename(value: &mut Value, unit: Option<&str>) {
    match value {
        Value::Object(entries) => {
            let own = entries.get("reading_unit").and_then(Value::as_str).map(str::to_string);
            let unit = own.as_deref().or(unit);
            entries.values_mut().for_each(|value| rename(value, unit));
            if let Some(unit) = unit {
                let renamed = std::mem::take(entries).into_iter().map(|(key, value)| {
                    let key = match key.strip_suffix("um") {
                        Some(stem) if is_of_readings(&key) => format!("{stem}{unit}"),
                        _ => key,
                    };
                    (key, value)
                });
                *entries = renamed.collect();
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|value| rename(value, unit)),
        _ => {}
    }
}

/// The schema of a type.
pub(crate) fn open<T: JsonSchema>() -> Value {
    let generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    generator.into_root_schema_for::<T>().to_value()
}

/// The schema of a command's document.
pub fn of<T: JsonSchema + 'static>() -> Value {
    let (mut schema, result) = (open::<Document<T>>(), open::<T>());
    for key in ["title", "description"] {
        schema[key] = result[key].clone();
    }
    close(&mut schema);
    schema
}

/// A result has the fields that are described and no others, so that a program may rely on both.
pub(crate) fn close(schema: &mut Value) {
    match schema {
        Value::Object(entries) => {
            if entries.get("properties").is_some_and(Value::is_object)
                && entries.get("type") == Some(&Value::from("object"))
            {
                entries.entry("additionalProperties").or_insert(Value::Bool(false));
            }
            entries.values_mut().for_each(close);
        }
        Value::Array(items) => items.iter_mut().for_each(close),
        _ => {}
    }
}
