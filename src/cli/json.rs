//! The command line of this process as the call of its JSON documents.

use std::any::TypeId;

use abbe::document::Call;
use clap::{Arg, ArgAction, ArgMatches};
use serde_json::{Map, Value};

use super::parser;

/// The name of the command, and the options on the command line of this process.
pub fn command_line() -> Call {
    let mut parser = parser();
    // The command line has been parsed before.
    let Ok(mut matches) = parser.clone().try_get_matches_from(std::env::args_os()) else {
        return Call::default();
    };
    let mut name = String::new();
    // Of `fleet run` the command is `run`.
    while let Some((inner, own)) = matches.remove_subcommand() {
        parser = parser.find_subcommand(&inner).cloned().unwrap_or_default();
        (name, matches) = (inner, own);
    }
    Call { command: name, options: options(&parser, &matches) }
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
        let parser = super::parser();
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
