//! A document as TOML: the one printer of files.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::ser::Error;
use serde::{Serialize, Serializer};
use toml_edit::ser::ValueSerializer;
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value};

use super::de::REST;
use super::node::{self, Node};
use crate::Diagnostic;

/// The text of a file that holds a document.
///
/// # Errors
/// If a value has no form in TOML.
pub fn text_of(document: &impl Serialize) -> Result<String, Diagnostic> {
    document_of(document).map(|document| document.to_string())
}

/// The document of a file.
pub(super) fn document_of(document: &impl Serialize) -> Result<DocumentMut, Diagnostic> {
    match value_of(document)? {
        Value::InlineTable(inline) => Ok(DocumentMut::from(with_headers(inline, ""))),
        _ => Ok(DocumentMut::new()),
    }
}

/// A proposed entry of a list of tables, such as `[[test]]`, with a remark above it. In JSON it is its text, which is
/// empty if there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Block<T> {
    /// The list.
    pub list: &'static str,
    /// The entry with the remark, if there is one.
    pub entry: Option<(T, String)>,
}

impl<T: Serialize> Block<T> {
    /// The table of the entry.
    pub(super) fn table(&self) -> Result<Option<Table>, Diagnostic> {
        let Some((entry, remark)) = &self.entry else { return Ok(None) };
        let mut table = table_of(entry)?;
        table.decor_mut().set_prefix(remark.lines().map(|line| format!("# {line}\n")).collect::<String>());
        Ok(Some(table))
    }
}

impl<T: Serialize> Serialize for Block<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut document = DocumentMut::new();
        if let Some(table) = self.table().map_err(S::Error::custom)? {
            document.insert(self.list, Item::ArrayOfTables(std::iter::once(table).collect()));
        }
        serializer.collect_str(&document)
    }
}

impl<T> JsonSchema for Block<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "block".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        String::json_schema(generator)
    }
}

/// A document as JSON: whole numbers are integers.
///
/// # Errors
/// As [`text_of`].
pub fn json_of(document: &impl Serialize) -> Result<serde_json::Value, Diagnostic> {
    value_of(document).map(|value| serde_json::Value::from(&node(value)))
}

/// A document as a tree of values; `None` if a value has no form in TOML.
pub(crate) fn node_of(document: &impl Serialize) -> Option<Node> {
    value_of(document).ok().map(node)
}

/// A value as a tree.
fn node(value: Value) -> Node {
    match value {
        Value::String(text) => text.value().as_str().into(),
        Value::Integer(number) => (*number.value() as f64).into(),
        Value::Float(number) => (*number.value()).into(),
        Value::Boolean(truth) => (*truth.value()).into(),
        Value::Datetime(date) => node::Value::Date(date.to_string()).into(),
        Value::Array(items) => items.into_iter().map(node).collect(),
        Value::InlineTable(table) => Node::table(table.into_iter().map(|(key, value)| (key.to_string(), node(value)))),
    }
}

/// An entry of a list of tables as a table: its tables stand in a line, lists of tables such as `[[effect.alias]]` have
/// headers.
pub(super) fn table_of(entry: &impl Serialize) -> Result<Table, Diagnostic> {
    match value_of(entry)? {
        Value::InlineTable(inline) => Ok(with_headers(inline, "[]")),
        _ => Ok(Table::new()),
    }
}

/// A value whose tables stand in lines.
pub(super) fn value_of(document: &impl Serialize) -> Result<Value, Diagnostic> {
    let value = document.serialize(ValueSerializer::new()).map_err(|cause| {
        Diagnostic::session(
            format!("it cannot be written as TOML: {cause}"),
            "every value is a text, a number, a list or a table",
        )
    })?;
    Ok(tidy(value))
}

/// Whole numbers without a point, and the keys that a registry determines among those of their table.
fn tidy(value: Value) -> Value {
    match value {
        Value::Float(number) => number_of(number.into_value()),
        Value::Array(items) => items.into_iter().map(tidy).collect(),
        Value::InlineTable(table) => {
            let mut tidied = InlineTable::new();
            for (key, value) in table {
                match tidy(value) {
                    Value::InlineTable(rest) if key == REST => tidied.extend(rest),
                    value => _ = tidied.insert(key, value),
                }
            }
            Value::InlineTable(tidied)
        }
        other => other,
    }
}

/// A number as it is written by hand: `125` and `0.0000001`.
pub(super) fn number_of(number: f64) -> Value {
    number.to_string().parse().unwrap_or_else(|_| Value::from(number))
}

/// The table with its tables under headers; `key` is its own key.
fn with_headers(inline: InlineTable, key: &str) -> Table {
    let mut table = Table::new();
    for (own, value) in inline {
        let has_header = key.is_empty() || key == "axis" || matches!(own.as_str(), "axis" | "body" | "alias");
        let item = match value {
            Value::InlineTable(inner) if has_header => Item::Table(with_headers(inner, &own)),
            Value::Array(items) if has_header && !items.is_empty() && items.iter().all(Value::is_inline_table) => {
                let tables = items.into_iter().filter_map(|item| match item {
                    Value::InlineTable(inner) => Some(with_headers(inner, &format!("[{own}]"))),
                    _ => None,
                });
                Item::ArrayOfTables(tables.collect::<ArrayOfTables>())
            }
            value => Item::Value(value),
        };
        table.insert(&own, item);
    }
    // `[axis]` alone says nothing.
    table.set_implicit(key == "axis");
    table
}
