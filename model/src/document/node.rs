//! The tree of values that every document is read from and written to: of a TOML file, of JSON, of a Python dict.

use std::fmt;
use std::ops::Range;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::fault::Step;
use crate::session::limits;

/// A value with its place in the text, if it is from one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// The value.
    pub value: Value,
    /// The bytes of the text.
    pub span: Range<usize>,
}

/// A value.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Value {
    /// `null` of JSON, `None` of Python.
    #[default]
    Null,
    /// A text.
    Text(String),
    /// A number, and how it is written.
    Number(f64, String),
    /// True or false.
    Truth(bool),
    /// A date.
    Date(String),
    /// A list.
    List(Vec<Node>),
    /// A table, in the order of the file.
    Table(Vec<Entry>),
}

/// A key with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// The bytes of the key in the text.
    pub key_span: Range<usize>,
    /// The value.
    pub node: Node,
}

impl From<Value> for Node {
    fn from(value: Value) -> Node {
        Node { value, span: 0..0 }
    }
}

impl From<f64> for Node {
    fn from(number: f64) -> Node {
        Value::Number(number, number.to_string()).into()
    }
}

impl From<usize> for Node {
    fn from(number: usize) -> Node {
        Value::Number(number as f64, number.to_string()).into()
    }
}

impl From<&str> for Node {
    fn from(text: &str) -> Node {
        Value::Text(text.to_string()).into()
    }
}

impl From<bool> for Node {
    fn from(truth: bool) -> Node {
        Value::Truth(truth).into()
    }
}

impl<T: Into<Node>> FromIterator<T> for Node {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Node {
        Value::List(items.into_iter().map(Into::into).collect()).into()
    }
}

impl From<serde_json::Value> for Node {
    fn from(value: serde_json::Value) -> Node {
        match value {
            serde_json::Value::Null => Value::Null.into(),
            serde_json::Value::Bool(truth) => truth.into(),
            serde_json::Value::Number(number) => {
                Value::Number(number.as_f64().unwrap_or(f64::NAN), number.to_string()).into()
            }
            serde_json::Value::String(text) => Value::Text(text).into(),
            serde_json::Value::Array(items) => items.into_iter().collect(),
            serde_json::Value::Object(entries) => Node::table(entries),
        }
    }
}

impl From<&Node> for serde_json::Value {
    fn from(node: &Node) -> serde_json::Value {
        match &node.value {
            Value::Null => serde_json::Value::Null,
            Value::Text(text) | Value::Date(text) => text.as_str().into(),
            // As written: a whole number keeps all its digits.
            Value::Number(number, written) => {
                written.parse::<serde_json::Number>().map_or_else(|_| (*number).into(), serde_json::Value::Number)
            }
            Value::Truth(truth) => (*truth).into(),
            Value::List(items) => items.iter().map(serde_json::Value::from).collect(),
            Value::Table(entries) => {
                entries.iter().map(|entry| (entry.key.clone(), serde_json::Value::from(&entry.node))).collect()
            }
        }
    }
}

impl Node {
    /// A table of these entries.
    pub fn table<N: Into<Node>>(entries: impl IntoIterator<Item = (String, N)>) -> Node {
        let entry = |(key, node): (String, N)| Entry { key, key_span: 0..0, node: node.into() };
        Value::Table(entries.into_iter().map(entry).collect()).into()
    }

    /// The entries of a table; none of any other value.
    pub fn entries(&self) -> &[Entry] {
        match &self.value {
            Value::Table(entries) => entries,
            _ => &[],
        }
    }

    /// The entry of a key.
    pub fn entry(&self, key: &str) -> Option<&Entry> {
        self.entries().iter().find(|entry| entry.key == key)
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entry(key).map(|entry| &entry.node)
    }

    /// Sets the value of a key of a table.
    pub fn set(&mut self, key: &str, node: impl Into<Node>) {
        let Value::Table(entries) = &mut self.value else { return };
        let node = node.into();
        match entries.iter_mut().find(|entry| entry.key == key) {
            Some(entry) => entry.node = node,
            None => entries.push(Entry { key: key.to_string(), key_span: 0..0, node }),
        }
    }

    /// The items of a list; none of any other value.
    pub fn items(&self) -> &[Node] {
        match &self.value {
            Value::List(items) => items,
            _ => &[],
        }
    }

    /// The number, if it is one.
    pub fn as_number(&self) -> Option<f64> {
        match &self.value {
            Value::Number(number, _) => Some(*number),
            _ => None,
        }
    }

    /// The text, if it is one.
    pub fn as_text(&self) -> Option<&str> {
        match &self.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// What a path leads to, and the entry of the last key on it; as far as it goes.
    pub fn follow<'n>(&'n self, path: impl Iterator<Item = &'n Step>) -> (&'n Node, Option<&'n Entry>) {
        let (mut node, mut entry) = (self, None);
        for step in path {
            let next = match step {
                Step::Key(key) => node.entry(key).map(|found| (&found.node, Some(found))),
                Step::Item(item) => node.items().get(*item).map(|found| (found, entry)),
            };
            let Some(next) = next else { break };
            (node, entry) = next;
        }
        (node, entry)
    }

    /// What was found, for messages.
    pub fn found(&self) -> String {
        match &self.value {
            Value::Null => "nothing".to_string(),
            Value::Text(text) => format!("the text \"{text}\""),
            Value::Number(number, _) if number.is_nan() => "NaN".to_string(),
            Value::Number(..) => "a number".to_string(),
            Value::Truth(truth) => truth.to_string(),
            Value::Date(_) => "a date".to_string(),
            Value::List(items) => format!("a list of {}", items.len()),
            Value::Table(_) => "a table".to_string(),
        }
    }
}

/// Checks a number of a document: it is no NaN and not too large, but may be infinite.
pub(super) fn checked(number: f64) -> Result<f64, String> {
    limits::too_large(number).map_or(Ok(number), Err)
}

/// A table whose keys are names, in the order of the file.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(inline)]
pub struct Named<T>(#[schemars(with = "std::collections::BTreeMap<String, T>")] pub Vec<(String, T)>);

impl<T> Default for Named<T> {
    fn default() -> Self {
        Named(Vec::new())
    }
}

impl<T> Named<T> {
    /// Whether it has no entry.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// The keys of a table that its registry determines: those of a shape, or of an instrument.
pub type Entries = Named<Node>;

impl Entries {
    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.0.iter().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// Adds a key at the end.
    pub fn push(&mut self, key: impl Into<String>, value: impl Into<Node>) {
        self.0.push((key.into(), value.into()));
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Of<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Of<T> {
            type Value = Named<T>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Named<T>, A::Error> {
                let mut named = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    named.push(entry);
                }
                Ok(Named(named))
            }
        }
        deserializer.deserialize_map(Of(std::marker::PhantomData))
    }
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Node;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a number, a text, a list or a table")
            }

            fn visit_unit<E>(self) -> Result<Node, E> {
                Ok(Node::default())
            }

            fn visit_bool<E>(self, truth: bool) -> Result<Node, E> {
                Ok(truth.into())
            }

            fn visit_f64<E>(self, number: f64) -> Result<Node, E> {
                Ok(number.into())
            }

            fn visit_str<E>(self, text: &str) -> Result<Node, E> {
                Ok(text.into())
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Node, A::Error> {
                let mut list: Vec<Node> = Vec::new();
                while let Some(item) = items.next_element()? {
                    list.push(item);
                }
                Ok(Value::List(list).into())
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Node, A::Error> {
                let mut entries: Vec<(String, Node)> = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Node::table(entries))
            }
        }
        deserializer.deserialize_any(Any)
    }
}

impl Serialize for Node {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.value {
            Value::Null => serializer.serialize_unit(),
            Value::Text(text) | Value::Date(text) => serializer.serialize_str(text),
            Value::Number(number, _) => serializer.serialize_f64(*number),
            Value::Truth(truth) => serializer.serialize_bool(*truth),
            Value::List(items) => serializer.collect_seq(items),
            Value::Table(entries) => serializer.collect_map(entries.iter().map(|entry| (&entry.key, &entry.node))),
        }
    }
}

impl JsonSchema for Node {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "value".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({})
    }
}
