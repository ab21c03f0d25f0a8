//! What the files hold, as JSON Schema: one line of a registry for each, and that of each analysis.

use abbe_apply::correction::stream;
use abbe_apply::geometric::Comparison as GeometricComparison;
use abbe_apply::volumetric::{Summary, functions as error_functions};
use abbe_identify::model_file;
use abbe_identify::patterns::Patterns;
use abbe_identify::repeated::Repeated;
use abbe_identify::self_calibration::SelfCalibration;
use abbe_identify::simulate::SimulationResult;
use abbe_model::document::schema;
use abbe_plan::global::GlobalAnalysis;
use abbe_plan::improve::NextTest;
use abbe_plan::poses::PoseSelection;
use schemars::JsonSchema;
use serde_json::Value;

use crate::analysis::{ANALYSES, Line};
use crate::certificate::Certificate;
use crate::document::{StatedHistory, close, of, open};
use crate::exports::ExportResult;
use crate::fleet::record::Record;
use crate::fleet::run::RunResult;
use crate::import::ImportResult;

/// A file.
pub struct FileSchema {
    /// The word by which its schema is requested.
    pub word: &'static str,
    /// What the file is.
    pub about: String,
    /// Its schema.
    pub schema: fn() -> Value,
}

/// The files.
pub fn schemas() -> Vec<FileSchema> {
    let file = |&(word, about, schema): &Named| FileSchema { word, about: about.to_string(), schema };
    let document = |line: &Line| FileSchema {
        word: line.name,
        about: format!("`abbe {} --json`", line.name),
        schema: line.schema,
    };
    FILES.iter().map(file).chain(ANALYSES.iter().map(document)).collect()
}

/// A word, what the file is, and its schema.
type Named = (&'static str, &'static str, fn() -> Value);

const FILES: &[Named] = &[
    ("session", "session.toml", schema::session),
    ("machine", "machine.toml", schema::machine),
    ("repeat", "`abbe compare --repeated --json`", of::<Repeated>),
    ("geometric", "`abbe fit --method circle|cone|two-plane --json`", of::<GeometricComparison>),
    ("self-calibration", "`abbe fit --method self-calibration --json`", of::<SelfCalibration>),
    ("model", "`abbe fit|trace --save`", plain::<model_file::document::Document>),
    ("next-test", "`abbe plan --improve|--separate|--range --json`", of::<NextTest>),
    ("global", "`abbe plan --global --json`", of::<GlobalAnalysis>),
    ("poses", "`abbe poses --json`", of::<PoseSelection>),
    ("patterns", "`abbe plan --patterns --json`", of::<Patterns>),
    ("simulate", "`abbe simulate --json`", of::<SimulationResult>),
    ("map", "`abbe volumetric --map --json`", of::<Summary>),
    ("import", "`abbe import --json`", of::<ImportResult>),
    ("export", "`abbe export --json`", of::<ExportResult>),
    ("compensate", "`abbe compensate --json`", of::<stream::Summary>),
    ("run", "`abbe fleet run --json`", of::<RunResult>),
    ("history", "`abbe fleet history --json`", of::<StatedHistory>),
    ("functions", "The error functions of `abbe volumetric --functions`, as JSON", || {
        schema::of::<error_functions::File>("Abbe file of error functions")
    }),
    ("certificate", "`certificate.toml` of `abbe fit --dcc`, as JSON", || {
        schema::of::<Certificate>("Abbe file of a certificate")
    }),
    ("record", "The result of a session in the folder of `abbe fleet run`", plain::<Record>),
];

/// The schema of a file that has no head of a command.
fn plain<T: JsonSchema>() -> Value {
    let mut schema = open::<T>();
    close(&mut schema);
    schema::share(&mut schema);
    schema
}
