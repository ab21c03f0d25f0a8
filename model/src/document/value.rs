//! Values of documents that have more than one form: a length is a number or an expression, an uncertainty one number or
//! three.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{SeqAccess, Visitor, value};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::fault::Fault;
use crate::session::expression::{self, Constant};
use crate::session::limits;

/// mm: a number, or an expression in `[constants]` in quotes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Length {
    /// A number, mm.
    Number(f64),
    /// An expression in the constants, with + - * / ^2 sqrt( ).
    Expression(String),
}

impl From<f64> for Length {
    fn from(number: f64) -> Length {
        Length::Number(number)
    }
}

impl Length {
    /// The length with its expression resolved, and its value, mm.
    ///
    /// # Errors
    /// If it is no expression in the constants, infinite or too large.
    pub(crate) fn in_mm(&self, constants: &[Constant]) -> Result<(expression::Length, f64), Fault> {
        let text = match self {
            Length::Number(number) if number.is_finite() => return Ok((expression::Length::Number(*number), *number)),
            Length::Number(_) => return Err(Fault::is("infinite; a length is expected")),
            Length::Expression(text) => text,
        };
        let names: Vec<&str> = constants.iter().map(|constant| constant.name.as_str()).collect();
        let length = expression::Length::parse(text, &names).map_err(|fault| {
            let help = "a length is a number or an expression in [constants] with + - * / ^2 sqrt( )";
            Fault::of_key(format!("= \"{text}\": {fault}"), help)
        })?;
        let number = length.evaluate(&|name: &str| {
            let found = constants.iter().find(|known| known.name == name);
            found.map_or(f64::NAN, |constant| constant.mm)
        });
        if let Some(fault) = limits::too_large_for("_mm", number) {
            return Err(Fault::of_key(format!("= \"{text}\" evaluates to {fault}"), None));
        }
        if !number.is_finite() {
            let what = format!("= \"{text}\" evaluates to {number} with these constants");
            return Err(Fault::of_key(what, "a root of a negative number, or a division by zero?"));
        }
        Ok((length, number))
    }
}

impl<'de> Deserialize<'de> for Length {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfLength;
        impl Visitor<'_> for OfLength {
            type Value = Length;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a number or an expression in quotes")
            }

            fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<Length, E> {
                Ok(Length::Number(number))
            }

            fn visit_str<E>(self, text: &str) -> Result<Length, E> {
                Ok(Length::Expression(text.to_string()))
            }
        }
        deserializer.deserialize_any(OfLength)
    }
}

impl JsonSchema for Length {
    fn schema_name() -> Cow<'static, str> {
        "length".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "mm: a number, or an expression in [constants] in quotes.",
            "type": ["number", "string"]
        })
    }
}

/// What a list of three may contain.
pub trait Coordinate {
    /// The list in messages.
    const THREE: &'static str;
}

impl Coordinate for f64 {
    const THREE: &'static str = "a list of three numbers";
}

impl Coordinate for Length {
    const THREE: &'static str = "a list of three lengths";
}

impl Coordinate for Three<f64> {
    const THREE: &'static str = "a list of three directions";
}

/// Three values, one for each of X, Y and Z.
#[derive(Clone, Debug, PartialEq)]
pub struct Three<T>(pub [T; 3]);

/// Three numbers.
pub type Vector = Three<f64>;
/// Three lengths, mm.
pub type Point = Three<Length>;

impl<T: Serialize> Serialize for Three<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(&self.0)
    }
}

impl<'de, T: Deserialize<'de> + Coordinate> Deserialize<'de> for Three<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Of<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de> + Coordinate> Visitor<'de> for Of<T> {
            type Value = Three<T>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(T::THREE)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Three<T>, A::Error> {
                <[T; 3]>::deserialize(value::SeqAccessDeserializer::new(items)).map(Three)
            }
        }
        deserializer.deserialize_tuple(3, Of(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Three<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("three_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let items = generator.subschema_for::<T>();
        json_schema!({"type": "array", "items": items, "minItems": 3, "maxItems": 3})
    }
}

/// A number above 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
#[schemars(inline, extend("exclusiveMinimum" = 0))]
pub struct Positive(pub f64);

impl TryFrom<f64> for Positive {
    type Error = String;

    fn try_from(number: f64) -> Result<Positive, String> {
        limits::positive(number).map(Positive)
    }
}

/// A number that is not below 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
#[schemars(inline, extend("minimum" = 0))]
pub struct NotNegative(pub f64);

impl TryFrom<f64> for NotNegative {
    type Error = String;

    fn try_from(number: f64) -> Result<NotNegative, String> {
        limits::not_negative(number).map(NotNegative)
    }
}

/// A standard uncertainty; 0: exactly known, inf: no prior.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty(pub f64);

/// A note: a text, a number or a date, as it is written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Note(pub String);

impl JsonSchema for Note {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "note".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": ["string", "number", "boolean"]})
    }
}
