//! `abbe schema`: what the files hold, as JSON Schema.

use abbe::model::Diagnostic;
use abbe::schemas::schemas;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::{Global, output};

/// Examples of `abbe schema`.
pub const HELP: &str = "Examples:
  abbe schema session
  abbe schema fit

Put `#:schema session.schema.json` in the first line of a session.toml, and an editor that knows TOML schemas (taplo, Even Better TOML)
completes keys and marks what is misspelt.";

fn subjects() -> PossibleValuesParser {
    PossibleValuesParser::new(schemas().into_iter().map(|file| PossibleValue::new(file.word).help(file.about)))
}

/// `abbe schema SUBJECT`
#[derive(Args)]
pub struct SchemaArguments {
    /// Which file.
    #[arg(value_parser = subjects())]
    subject: String,
}

/// Runs `abbe schema`.
pub fn run(arguments: &SchemaArguments, _: Global) -> Result<(), Diagnostic> {
    let file = schemas().into_iter().find(|file| file.word == arguments.subject);
    let schema = file.map(|file| (file.schema)());
    let text = serde_json::to_string_pretty(&schema);
    output::whole(&text.map_err(|error| Diagnostic::other(format!("the schema cannot be written: {error}")))?);
    Ok(())
}
