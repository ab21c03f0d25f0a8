//! The word of an instrument: of a session, or of a test that has another.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::value::{Form, unexpected};
use crate::instrument::{InstrumentKind, kinds};
use crate::words::listed;

fn words() -> Vec<&'static str> {
    kinds().iter().map(|kind| kind.word()).collect()
}

impl Serialize for InstrumentKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.word().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for InstrumentKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let words: Vec<String> = words().iter().map(|word| format!("\"{word}\"")).collect();
        let expected = listed(&words, "or");
        match Form::<IgnoredAny>::of(deserializer, &expected)? {
            Form::Text(word) => word.parse().map_err(|_| unexpected(&expected)),
            _ => Err(unexpected(&expected)),
        }
    }
}

impl JsonSchema for InstrumentKind {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "kind".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"enum": words()})
    }
}
