//! `abbe schema`: what the files hold, as JSON Schema.

use abbe::identify::correction::stream;
use abbe::identify::geometric::Comparison;
use abbe::identify::model_file;
use abbe::identify::plan::global::GlobalAnalysis;
use abbe::identify::plan::poses::PoseSelection;
use abbe::identify::plan::results::PlanAnalysis;
use abbe::identify::repeated::Repeated;
use abbe::identify::results::{FitResult, TraceResult};
use abbe::identify::self_calibration::SelfCalibration;
use abbe::identify::validate::ValidationResult;
use abbe::identify::volumetric::Summary;
use abbe::model::document::schema;
use clap::{Args, ValueEnum};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde_json::{Value, json};

use super::failure::Failure;
use super::json::Document;
use super::{plan, simulate};

/// Examples of `abbe schema`.
pub const HELP: &str = "Examples:
  abbe schema session
  abbe schema fit

Put `#:schema session.schema.json` in the first line of a session.toml, and an editor that knows TOML schemas (taplo, Even Better TOML)
completes keys and marks what is misspelt.";

/// What can be described.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Subject {
    /// session.toml
    Session,
    /// machine.toml
    Machine,
    /// `abbe fit --json`
    Fit,
    /// `abbe fit --repeat --json`
    Repeat,
    /// `abbe fit --method circle|cone|two-plane --json`
    Geometric,
    /// `abbe fit --method self-calibration --json`
    SelfCalibration,
    /// `abbe trace --json`
    Trace,
    /// `abbe validate --json`
    Validate,
    /// `abbe fit|trace --save`
    Model,
    /// `abbe plan --json`
    Plan,
    /// `abbe plan --improve|--separate|--range --json`
    NextTest,
    /// `abbe plan --global --json`
    Global,
    /// `abbe plan --poses --json`
    Poses,
    /// `abbe plan --patterns --json`
    Patterns,
    /// `abbe simulate --json`
    Simulate,
    /// `abbe volumetric --map --json`
    Map,
    /// `abbe export --json`
    Export,
    /// `abbe compare --json`
    Compare,
    /// `abbe compensate --json`
    Compensate,
    /// `abbe run --json`
    Run,
    /// `abbe history --json`
    History,
    /// `abbe study --json`
    Study,
    /// The study file of `abbe study`, as JSON
    StudyFile,
    /// The result of a session in the folder of `abbe run`
    Record,
}

/// `abbe schema SUBJECT`
#[derive(Args)]
pub struct SchemaArguments {
    /// Which file.
    #[arg(value_enum)]
    subject: Subject,
}

/// Runs `abbe schema`.
pub fn run(arguments: &SchemaArguments) -> Result<(), Failure> {
    let schema = match arguments.subject {
        Subject::Session => schema::session(),
        Subject::Machine => schema::machine(),
        Subject::Fit => of::<FitResult>(),
        Subject::Repeat => of::<Repeated>(),
        Subject::Geometric => of::<Comparison>(),
        Subject::SelfCalibration => of::<SelfCalibration>(),
        Subject::Trace => of::<TraceResult>(),
        Subject::Validate => of::<ValidationResult>(),
        Subject::Model => plain::<model_file::document::Document>(),
        Subject::Plan => of::<PlanAnalysis>(),
        Subject::NextTest => of::<plan::NextTest>(),
        Subject::Global => of::<GlobalAnalysis>(),
        Subject::Poses => of::<PoseSelection>(),
        Subject::Patterns => of::<plan::patterns::PatternSizes>(),
        Subject::Simulate => of::<simulate::SimulationResult>(),
        Subject::Map => of::<Summary>(),
        Subject::Compare => of::<abbe::identify::compare::results::Comparison>(),
        Subject::Export => of::<super::export::ExportResult>(),
        Subject::Compensate => of::<stream::Summary>(),
        Subject::Run => of::<super::run::RunResult>(),
        Subject::History => of::<abbe::fleet::history::FleetHistory>(),
        Subject::Study => of::<abbe::fleet::study::summary::StudyResult>(),
        Subject::StudyFile => plain::<abbe::fleet::study::file::StudyFile>(),
        Subject::Record => plain::<abbe::fleet::record::Record>(),
    };
    let text = serde_json::to_string_pretty(&schema)
        .map_err(|error| Failure::Other(format!("the schema cannot be written: {error}")))?;
    super::output::whole(&text);
    Ok(())
}

/// The schema of a file that has no head of a command.
fn plain<T: JsonSchema>() -> Value {
    let generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let mut schema = generator.into_root_schema_for::<T>().to_value();
    close(&mut schema);
    schema
}

/// The schema of a command's document.
fn of<T: JsonSchema + 'static>() -> Value {
    let root = |of: Schema| of.to_value();
    let generator = || SchemaSettings::draft2020_12().for_serialize().into_generator();
    let mut schema = root(generator().into_root_schema_for::<Document<'static, T>>());
    let result = root(generator().into_root_schema_for::<T>());
    for key in ["title", "description"] {
        schema[key] = result[key].clone();
    }
    close(&mut schema);
    schema
}

/// A result has the fields that are described and no others, so that a program may rely on both.
fn close(schema: &mut Value) {
    match schema {
        Value::Object(entries) => {
            if entries.get("properties").is_some_and(Value::is_object) && entries.get("type") == Some(&json!("object"))
            {
                entries.entry("additionalProperties").or_insert(Value::Bool(false));
            }
            entries.values_mut().for_each(close);
        }
        Value::Array(items) => items.iter_mut().for_each(close),
        _ => {}
    }
}
