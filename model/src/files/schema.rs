//! JSON Schema of machine and session files, for editors and other programs.
//!
//! The readers take keys one by one, so that a message can point at each; a schema cannot be derived from their types.
//! A test compares the schema with the keys that every reader knows. The keys of shapes and of instruments come from
//! their registries.

use crate::driver::{Driver, unit_suffixes};
use crate::effect::keys::{Key, KeyForm};
use crate::effect::shape::SHAPES;
use crate::instrument::InstrumentKind;
use crate::instrument::set_up::{SetUpForm, SetUpKey};

/// Schema of `machine.toml` (JSON Schema, draft 2020-12).
pub const MACHINE: &str = include_str!("schema/machine.json");

/// Schema of `session.toml`. The caller inserts [`MACHINE`] at `#/$defs/machine`, and [`registered_properties`] into
/// the properties of their definitions.
pub const SESSION: &str = include_str!("schema/session.json");

/// The properties that registries determine: the name of a definition in `#/$defs`, and the text of a JSON object.
pub fn registered_properties() -> [(&'static str, String); 3] {
    let words: Vec<String> = InstrumentKind::ALL.iter().map(|kind| format!("\"{}\"", kind.word())).collect();
    let kind = format!("{{\"kind\": {{\"enum\": [{}]}}}}", words.join(", "));
    [("effect", effect_properties()), ("instrument", kind), ("test", test_properties())]
}

/// The keys of a test that only some instruments have. A key of several instruments has the meanings of each.
fn test_properties() -> String {
    let all = || InstrumentKind::ALL.iter().flat_map(|kind| kind.entry().keys);
    let mut properties = Vec::new();
    let mut known: Vec<&str> = Vec::new();
    for key in all() {
        if known.contains(&key.name) {
            continue;
        }
        known.push(key.name);
        let meanings: Vec<&str> = all().filter(|other| other.name == key.name).map(|other| other.meaning).collect();
        let meaning = match meanings.join("; ") {
            meanings if meanings.starts_with(|first: char| first.is_alphabetic()) => {
                format!(", \"description\": \"{meanings}.\"")
            }
            _ => String::new(),
        };
        properties.push(format!("\"{}\": {{{}{meaning}}}", key.name, set_up_schema(key)));
    }
    format!("{{{}}}", properties.join(", "))
}

fn set_up_schema(key: &SetUpKey) -> String {
    const VECTOR: &str = "\"type\": \"array\", \"items\": {\"type\": \"number\"}, \"minItems\": 3, \"maxItems\": 3";
    match key.form {
        SetUpForm::Length => "\"$ref\": \"#/$defs/length\"".to_string(),
        SetUpForm::Point => "\"$ref\": \"#/$defs/point\"".to_string(),
        SetUpForm::Vector => VECTOR.to_string(),
        SetUpForm::Vectors => {
            format!("\"type\": \"array\", \"items\": {{{VECTOR}}}, \"minItems\": 3, \"maxItems\": 3")
        }
        SetUpForm::Uncertainty => "\"type\": \"number\", \"minimum\": 0, \"description\": \"Standard uncertainty, µm; \
                                   0 or absent: exactly known; inf: no prior.\""
            .to_string(),
        SetUpForm::Uncertainties => "\"$ref\": \"#/$defs/u3\"".to_string(),
        SetUpForm::Text => "\"type\": \"string\"".to_string(),
        SetUpForm::Words(words) => format!("\"enum\": [\"{}\"]", words.join("\", \"")),
    }
}

/// The properties of an effect that drivers and shapes determine: their words, and the keys of shapes.
fn effect_properties() -> String {
    let words: Vec<String> = SHAPES.iter().map(|entry| format!("\"{}\"", entry.word)).collect();
    let mut properties = vec![format!("\"shape\": {{\"enum\": [{}]}}", words.join(", "))];
    properties.push(format!(
        "\"driver\": {{\"type\": \"string\", \"description\": \"The driver: an axis, {}, or a column of the data as NAME_unit.\"}}",
        Driver::words().join(", ")
    ));
    let mut known: Vec<&str> = Vec::new();
    for key in SHAPES.iter().flat_map(|entry| entry.keys) {
        if known.contains(&key.name) {
            continue;
        }
        known.push(key.name);
        let (names, schema) = (names(key), schema(key.form));
        let meaning = meaning(key);
        for name in names {
            properties.push(format!("\"{name}\": {{{schema}, \"description\": \"{meaning}\"}}"));
        }
    }
    format!("{{{}}}", properties.join(", "))
}

/// The keys with the suffix of every unit, if the key has one.
fn names(key: &Key) -> Vec<String> {
    match key.form {
        KeyForm::Quantity | KeyForm::Quantities => {
            let suffixes = unit_suffixes().into_iter();
            suffixes.map(|suffix| format!("{}_{suffix}", key.name)).collect()
        }
        KeyForm::Positive | KeyForm::Count(..) | KeyForm::Flag => vec![key.name.to_string()],
    }
}

fn schema(form: KeyForm) -> String {
    match form {
        KeyForm::Quantity => "\"type\": \"number\"".to_string(),
        KeyForm::Quantities => "\"type\": \"array\", \"items\": {\"type\": \"number\"}".to_string(),
        KeyForm::Positive => "\"type\": \"number\", \"exclusiveMinimum\": 0".to_string(),
        KeyForm::Count(least, most) => {
            format!("\"type\": \"integer\", \"minimum\": {least}, \"maximum\": {most}")
        }
        KeyForm::Flag => "\"type\": \"boolean\"".to_string(),
    }
}

/// What the key means to the shapes that have it, each meaning once.
fn meaning(key: &Key) -> String {
    let mut meanings: Vec<&str> = Vec::new();
    for other in SHAPES.iter().flat_map(|entry| entry.keys).filter(|other| other.name == key.name) {
        if !meanings.contains(&other.meaning) {
            meanings.push(other.meaning);
        }
    }
    let phrase = meanings.join(", ");
    let capital: String = phrase.chars().take(1).flat_map(char::to_uppercase).chain(phrase.chars().skip(1)).collect();
    match key.form {
        KeyForm::Quantity | KeyForm::Quantities => format!("{capital}. In the unit of the driver."),
        KeyForm::Positive | KeyForm::Count(..) | KeyForm::Flag => format!("{capital}."),
    }
}
