//! The word of an instrument: of a session, or of a test that has another.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::instrument::{InstrumentKind, kinds};
use crate::words::listed;

/// The kind of an instrument, by its word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind(pub InstrumentKind);

impl Kind {
    fn words() -> Vec<&'static str> {
        kinds().iter().map(|kind| kind.word()).collect()
    }
}

impl Serialize for Kind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.word().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Kind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfWord;
        impl Visitor<'_> for OfWord {
            type Value = Kind;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                let words: Vec<String> = Kind::words().iter().map(|word| format!("\"{word}\"")).collect();
                formatter.write_str(&listed(&words, "or"))
            }

            fn visit_str<E: de::Error>(self, word: &str) -> Result<Kind, E> {
                let kind = word.parse().ok().map(Kind);
                kind.ok_or_else(|| E::invalid_value(de::Unexpected::Str(word), &self))
            }
        }
        deserializer.deserialize_any(OfWord)
    }
}

impl JsonSchema for Kind {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "kind".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"enum": Kind::words()})
    }
}
