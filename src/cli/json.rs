//! JSON documents: the result of a command with its inputs and options, so that a program can repeat the command and
//! check what it reads.

use std::any::TypeId;
use std::path::Path;

use abbe::identify::model_file::{InputFile, Provenance};
use abbe::model::files::SourceMap;
use clap::{Arg, ArgAction, ArgMatches, CommandFactory};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

use super::failure::Failure;
use super::{Arguments, output};
use crate::present::report::provenance::{self, Input};

/// Version of the schemas of all documents.
pub const SCHEMA_VERSION: u32 = 2;

impl From<Input> for InputFile {
    fn from(input: Input) -> InputFile {
        InputFile { file: input.path, sha256: Some(input.sha256) }
    }
}

/// The session file and the files that it names.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SessionFile {
    /// Path of the session file.
    file: String,
    /// SHA-256 of the session file, in hexadecimal; `null` for a pipe.
    sha256: Option<String>,
    /// All files that were read: session, machine and data files, also of further sessions.
    inputs: Vec<InputFile>,
}

/// The files from which a result follows.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    session: Option<SessionFile>,
    inputs: Vec<InputFile>,
}

impl Origin {
    /// The files of a session.
    ///
    /// # Errors
    /// If a file has changed since it was read.
    pub fn of_session(sources: &SourceMap) -> Result<Origin, Failure> {
        let mut inputs = Vec::with_capacity(sources.files.len());
        for stamp in &sources.files {
            inputs.push(if stamp.is_regular() {
                provenance::stamped(stamp).map_err(|fault| unreadable(&stamp.file, &fault))?.into()
            } else {
                InputFile { file: stamp.file.display().to_string(), sha256: None }
            });
        }
        let file = sources.file.display().to_string();
        let own = inputs.iter().find(|input| input.file == file);
        Ok(Origin {
            session: Some(SessionFile { sha256: own.and_then(|input| input.sha256.clone()), file, inputs }),
            inputs: Vec::new(),
        })
    }

    /// Files that belong to no session.
    ///
    /// # Errors
    /// If a file cannot be read again.
    pub fn of_files(files: &[&Path]) -> Result<Origin, Failure> {
        let inputs = files.iter().map(|file| {
            provenance::input(file.to_path_buf())
                .map(InputFile::from)
                .map_err(|fault| unreadable(file, &fault.to_string()))
        });
        Ok(Origin { session: None, inputs: inputs.collect::<Result<_, _>>()? })
    }

    /// Adds the files of a further session.
    pub fn add(&mut self, other: Origin) {
        match (&mut self.session, other.session) {
            (Some(session), Some(other)) => session.inputs.extend(other.inputs),
            (session @ None, Some(other)) => *session = Some(other),
            (_, None) => self.inputs.extend(other.inputs),
        }
    }
}

fn unreadable(file: &Path, fault: &str) -> Failure {
    Failure::Other(format!("{}: cannot be read again for its checksum in the JSON document: {fault}", file.display()))
}

/// Where a model comes from: this command and the files of its session.
///
/// # Errors
/// If a file has changed since it was read.
pub fn provenance(sources: &SourceMap, seed: u64) -> Result<Provenance, Failure> {
    let (command, options) = command_line();
    let session = Origin::of_session(sources)?.session;
    let inputs = session.iter().flat_map(|session| session.inputs.clone());
    Ok(Provenance {
        tool_version: env!("CARGO_PKG_VERSION").to_string(),
        command,
        options,
        seed,
        inputs: inputs.collect(),
        session: session.as_ref().map_or(String::new(), |session| session.file.clone()),
    })
}

/// The document of a command: what it was, and its result.
#[derive(Serialize, JsonSchema)]
pub struct Document<'r, T> {
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
    /// The options on the command line, by their long names: `true` for a flag, a number, a string, or an array of them
    /// for a repeated option.
    options: Map<String, Value>,
    /// The result.
    #[serde(flatten)]
    result: &'r T,
}

/// Writes the document of this command.
///
/// # Errors
/// If the result is no JSON, or the file cannot be written.
pub fn write<T: Serialize>(path: &Path, origin: Origin, seed: Option<u64>, result: &T) -> Result<(), Failure> {
    let (command, options) = command_line();
    let document = Document {
        schema_version: SCHEMA_VERSION,
        tool_version: env!("CARGO_PKG_VERSION").to_string(),
        command,
        session: origin.session,
        inputs: origin.inputs,
        seed,
        options,
        result,
    };
    let mut text = serde_json::to_string_pretty(&document)
        .map_err(|error| Failure::Other(format!("the result cannot be written as JSON: {error}")))?;
    text.push('\n');
    output::write_whole(path, text.as_bytes())
}

/// The name of the command, and the options on the command line of this process.
fn command_line() -> (String, Map<String, Value>) {
    let parser = Arguments::command();
    // The command line has been parsed before.
    let Ok(matches) = parser.clone().try_get_matches_from(std::env::args_os()) else {
        return (String::new(), Map::new());
    };
    match matches.subcommand() {
        Some((name, own)) => {
            let options = parser.find_subcommand(name).map_or(Map::new(), |command| options(command, own));
            (name.to_string(), options)
        }
        None => (String::new(), Map::new()),
    }
}

/// Options that have a field of their own, or that change no result.
const LEFT_OUT: [&str; 3] = ["json", "quiet", "seed"];

/// The options of a command line, typed as the program reads them.
fn options(command: &clap::Command, matches: &ArgMatches) -> Map<String, Value> {
    let mut options = Map::new();
    for argument in command.get_arguments() {
        let id = argument.get_id().as_str();
        let Some(long) = argument.get_long().filter(|long| !LEFT_OUT.contains(long)) else {
            continue;
        };
        if matches.value_source(id) != Some(clap::parser::ValueSource::CommandLine) {
            continue;
        }
        let value = if matches!(argument.get_action(), ArgAction::SetTrue) {
            Value::Bool(true)
        } else {
            let raw = matches.get_raw(id).into_iter().flatten();
            let mut values: Vec<Value> = raw.map(|value| typed(argument, &value.to_string_lossy())).collect();
            match values.len() {
                1 if !takes_several(argument) => values.remove(0),
                _ => Value::Array(values),
            }
        };
        options.insert(long.replace('-', "_"), value);
    }
    options
}

fn takes_several(argument: &Arg) -> bool {
    let several = argument.get_num_args().is_some_and(|range| range.max_values() > 1);
    several || argument.get_value_delimiter().is_some() || matches!(argument.get_action(), ArgAction::Append)
}

/// A value as a number where the program reads a number, else as a string.
fn typed(argument: &Arg, text: &str) -> Value {
    let read = argument.get_value_parser().type_id();
    let whole = [TypeId::of::<usize>(), TypeId::of::<u64>(), TypeId::of::<u32>()];
    let number = if whole.iter().any(|kind| read == *kind) {
        text.parse::<u64>().ok().map(Value::from)
    } else if read == TypeId::of::<f64>() {
        text.parse::<f64>().ok().map(Value::from)
    } else {
        None
    };
    number.unwrap_or_else(|| Value::from(text))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn options_have_the_types_that_the_program_reads() {
        let parser = Arguments::command();
        let line = [
            "abbe",
            "trace",
            "s.toml",
            "--max-effects",
            "2",
            "--only",
            "EZC",
            "--only",
            "~time",
            "--json",
            "t.json",
            "--seed",
            "3",
        ];
        let matches = parser.clone().try_get_matches_from(line).unwrap();
        let (name, own) = matches.subcommand().unwrap();
        let found = options(parser.find_subcommand(name).unwrap(), own);
        assert_eq!(Value::Object(found), json!({"max_effects": 2, "only": ["EZC", "~time"]}));
    }
}
