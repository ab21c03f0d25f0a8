//! The tree of values of a text: of TOML, and of JSON. Every value has its place in the text.

use std::ops::Range;

use abbe_model::document::node::{Entry, Named, Node, Value};
use serde_json::value::RawValue;
use toml::de::{DeTable, DeValue};

/// A table of a TOML text.
pub(crate) fn of_toml(table: DeTable<'_>, span: Range<usize>) -> Node {
    let mut entries: Vec<Entry> = table
        .into_iter()
        .map(|(key, value)| Entry {
            key_span: key.span(),
            key: key.into_inner().into_owned(),
            node: of_value(value.span(), value.into_inner()),
        })
        .collect();
    entries.sort_by_key(|entry| entry.key_span.start);
    Node { value: Value::Table(entries), span }
}

/// A value of a JSON text that is a part of the whole text.
pub(crate) fn of_json(raw: &RawValue, whole: &str) -> serde_json::Result<Node> {
    let text = raw.get();
    let start = text.as_ptr() as usize - whole.as_ptr() as usize;
    let value = match text.as_bytes().first() {
        Some(b'{') => {
            let pairs: Named<&RawValue> = serde_json::from_str(text)?;
            let entries = pairs.0.into_iter().map(|(key, raw)| {
                let node = of_json(raw, whole)?;
                Ok(Entry { key, key_span: node.span.clone(), node })
            });
            Value::Table(entries.collect::<serde_json::Result<_>>()?)
        }
        Some(b'[') => {
            let items: Vec<&RawValue> = serde_json::from_str(text)?;
            Value::List(items.into_iter().map(|raw| of_json(raw, whole)).collect::<serde_json::Result<_>>()?)
        }
        _ => Node::from(serde_json::from_str::<serde_json::Value>(text)?).value,
    };
    Ok(Node { value, span: start..start + text.len() })
}

fn of_value(span: Range<usize>, value: DeValue<'_>) -> Node {
    let value = match value {
        DeValue::String(text) => Value::Text(text.into_owned()),
        DeValue::Integer(integer) => {
            let digits = integer.as_str().replace('_', "");
            let number = i64::from_str_radix(&digits, integer.radix()).map(|integer| integer as f64);
            // A value that is too large for an integer is still a number.
            let number = number.or_else(|_| digits.parse()).unwrap_or(f64::NAN);
            Value::Number(number, integer.as_str().to_string())
        }
        DeValue::Float(float) => {
            Value::Number(float.as_str().replace('_', "").parse().unwrap_or(f64::NAN), float.as_str().to_string())
        }
        DeValue::Boolean(truth) => Value::Truth(truth),
        DeValue::Datetime(date) => Value::Date(date.to_string()),
        DeValue::Array(items) => {
            Value::List(items.into_iter().map(|item| of_value(item.span(), item.into_inner())).collect())
        }
        DeValue::Table(table) => return of_toml(table, span),
    };
    Node { value, span }
}
