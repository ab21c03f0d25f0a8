//! JSON Schema of the documents (draft 2020-12), from the types and their doc comments. The keys of shapes and of
//! instruments come from their registries.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::fault::Step;
use super::machine::Machine;
use super::measurement::Test;
use super::movement::{Circle, Follow, Line, Sweep};
use super::session::Session;
use crate::driver::{Driver, unit_suffixes};
use crate::effect::keys::{Key, KeyForm};
use crate::effect::shape::{Entry, SHAPES};
use crate::instrument::set_up::FRAME;
use crate::instrument::{InstrumentKind, kinds};
use crate::words::listed;

/// Schema of `machine.toml`.
pub fn machine() -> Value {
    schema_of::<Machine>("Abbe machine file")
}

/// Schema of `session.toml`.
pub fn session() -> Value {
    let mut schema = schema_of::<Session>("Abbe session file");
    // A document may lack it, while a program adds its tests one by one; a file may not.
    if let Some(required) = schema["required"].as_array_mut() {
        required.push(json!("test"));
    }
    for (definition, registered) in [("effect", effect_properties()), ("test", test_properties())] {
        if let Some(properties) = schema["$defs"][definition]["properties"].as_object_mut() {
            properties.extend(registered);
        }
    }
    schema
}

/// The keys of a test of an instrument, with their schemas.
pub fn keys_of_test(instrument: InstrumentKind) -> Map<String, Value> {
    let mut keys = properties::<Test>();
    keys.extend(instrument.entry().keys());
    keys
}

/// The keys of the motions of a test.
pub fn keys_of_motions() -> Map<String, Value> {
    let mut keys = properties::<Sweep>();
    keys.extend(properties::<Circle>());
    keys.extend(properties::<Line>());
    keys.extend(properties::<Follow>());
    keys
}

/// The keys of a type's own fields.
pub fn fields<T: JsonSchema>() -> Vec<String> {
    properties::<T>().into_iter().map(|(key, _)| key).collect()
}

/// The keys of a shape, with the suffix of every unit.
pub fn shape_keys(entry: &Entry) -> Vec<String> {
    entry.keys.iter().flat_map(names).collect()
}

/// Schema of another file that contains documents.
pub fn of<T: JsonSchema>(title: &str) -> Value {
    let mut schema = schema_of::<T>(title);
    share(&mut schema);
    schema
}

/// Gives the documents in the schema of another file their keys in sessions.
pub fn share(schema: &mut Value) {
    let known = session();
    for (name, definition) in schema["$defs"].as_object_mut().into_iter().flatten() {
        if let Some(known) = known["$defs"].get(name) {
            definition.clone_from(known);
        }
    }
}

/// What a key of the table at a path is in a schema, as the end of a sentence; or in the schema of its machine.
pub fn meaning(schema: &Value, path: &[Step], key: &str) -> Option<String> {
    let property = [schema, &schema["$defs"]["machine"]].into_iter().find_map(|root| {
        let tables = path.iter().fold(alternatives(schema, root), |tables, step| {
            let inner = tables.into_iter().filter_map(|table| match step {
                Step::Key(key) => table["properties"].get(key).or_else(|| table.get("additionalProperties")),
                Step::Item(_) => table.get("items"),
            });
            inner.flat_map(|inner| alternatives(schema, inner)).collect()
        });
        tables.into_iter().find_map(|table| table["properties"].get(key))
    })?;
    let meaning = property["description"].as_str().map(as_end)?;
    let words: Vec<String> = property["enum"].as_array().into_iter().flatten().map(Value::to_string).collect();
    Some(if words.is_empty() { meaning } else { format!("{meaning}: {}", listed(&words, "or")) })
}

/// A description as the end of a sentence.
fn as_end(text: &str) -> String {
    let text = text.trim_end_matches('.');
    let mut letters = text.chars();
    match letters.next() {
        // An abbreviation keeps its capitals.
        Some(first) if !letters.as_str().starts_with(char::is_uppercase) => {
            first.to_lowercase().chain(letters).collect()
        }
        _ => text.to_string(),
    }
}

/// A schema with those that it refers to or chooses between.
fn alternatives<'s>(root: &'s Value, schema: &'s Value) -> Vec<&'s Value> {
    let reference = schema["$ref"].as_str().and_then(|name| name.strip_prefix("#/$defs/"));
    let others = ["anyOf", "oneOf"].into_iter().filter_map(|list| schema[list].as_array()).flatten();
    let others = others.chain(reference.map(|name| &root["$defs"][name]));
    std::iter::once(schema).chain(others.flat_map(|other| alternatives(root, other))).collect()
}

/// The schema of a document that a file holds.
fn schema_of<T: JsonSchema>(title: &str) -> Value {
    let generator = SchemaSettings::draft2020_12().for_deserialize().into_generator();
    let mut schema = generator.into_root_schema_for::<T>().to_value();
    tidy(&mut schema);
    schema["title"] = json!(title);
    schema
}

/// A key that is absent has no value: neither `null`, nor a default. The widths of numbers are those of Rust.
fn tidy(schema: &mut Value) {
    match schema {
        Value::Object(entries) => {
            entries.values_mut().for_each(tidy);
            if entries.get("format").is_some_and(Value::is_string) {
                entries.shift_remove("format");
            }
            entries.shift_remove("default");
            if let Some(Value::String(text)) = entries.get_mut("description") {
                *text = text.replace('\n', " ");
            }
            let is_null = |of: &Value| *of == json!("null") || of["type"] == json!("null");
            for list in ["type", "anyOf", "enum"] {
                let Some(items) = entries.get_mut(list).and_then(Value::as_array_mut) else { continue };
                items.retain(|item| !is_null(item) && !item.is_null());
                if items.len() == 1 && list == "type" {
                    let only = items.remove(0);
                    entries.insert(list.to_string(), only);
                } else if items.len() == 1
                    && list == "anyOf"
                    && let Value::Object(only) = items.remove(0)
                {
                    entries.shift_remove("anyOf");
                    for (key, value) in only {
                        entries.entry(key).or_insert(value);
                    }
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(tidy),
        _ => {}
    }
}

/// The properties of a type's own fields.
pub(crate) fn properties<T: JsonSchema>() -> Map<String, Value> {
    schema_of::<T>("")["properties"].as_object().cloned().unwrap_or_default()
}

/// What a field of a type is, as the end of a sentence.
pub(crate) fn description<T: JsonSchema>(key: &str) -> Option<String> {
    properties::<T>().get(key)?["description"].as_str().map(as_end)
}

/// The keys of a test that only some instruments have. A key of several instruments has the meanings of each.
fn test_properties() -> Map<String, Value> {
    let mut properties: Map<String, Value> = Map::new();
    for kind in kinds() {
        for (key, mut schema) in kind.entry().keys() {
            let own = schema["description"].as_str().unwrap_or_default();
            // An uncertainty, or a frame, means the same to every instrument.
            if !key.contains("_u_") && !key.ends_with(FRAME) {
                let others = properties.get(&key).and_then(|other| other["description"].as_str());
                let others = others.map_or(String::new(), |others| format!("{}; ", others.trim_end_matches('.')));
                schema["description"] = json!(format!("{others}{}: {}.", kind.word(), as_end(own)));
            }
            properties.insert(key, schema);
        }
    }
    properties
}

/// The properties of an effect that drivers and shapes determine: their words, and the keys of shapes.
fn effect_properties() -> Map<String, Value> {
    let words: Vec<&str> = SHAPES.iter().map(|entry| entry.word).collect();
    let drivers = Driver::words().join(", ");
    let mut properties = Map::from_iter([
        (
            "shape".to_string(),
            json!({"enum": words, "description": "The dependence of the component on the driver, such as \"harmonic\"."}),
        ),
        (
            "driver".to_string(),
            json!({
                "type": "string",
                "description": format!("The driver: an axis, {drivers}, or a column of the data as NAME_unit.")
            }),
        ),
    ]);
    for key in SHAPES.iter().flat_map(|entry| entry.keys) {
        for name in names(key) {
            let mut schema = schema(key.form);
            schema["description"] = json!(shape_meaning(key));
            properties.entry(name).or_insert(schema);
        }
    }
    properties
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

fn schema(form: KeyForm) -> Value {
    match form {
        KeyForm::Quantity => json!({"type": "number"}),
        KeyForm::Quantities => json!({"type": "array", "items": {"type": "number"}}),
        KeyForm::Positive => json!({"type": "number", "exclusiveMinimum": 0}),
        KeyForm::Count(least, most) => json!({"type": "integer", "minimum": least, "maximum": most}),
        KeyForm::Flag => json!({"type": "boolean"}),
    }
}

/// What the key means to the shapes that have it, each meaning once.
fn shape_meaning(key: &Key) -> String {
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
