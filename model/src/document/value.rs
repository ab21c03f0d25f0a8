//! Values of documents that have more than one form: a length is a number or an expression, an uncertainty one number or
//! three.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, IgnoredAny, MapAccess, SeqAccess, Visitor, value};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::fault::Fault;
use crate::session::expression::{self, Constant};
use crate::session::limits;
use crate::words;

/// A value that may have several forms, in the one that it has.
pub(super) enum Form<T, M = IgnoredAny> {
    Number(f64),
    Text(String),
    List(Vec<T>),
    Table(M),
}

impl<'de, T: Deserialize<'de>, M: Deserialize<'de>> Form<T, M> {
    /// The form of a value. Messages about any other say that one of the `expected` forms is expected.
    pub(super) fn of<D: Deserializer<'de>>(deserializer: D, expected: &str) -> Result<Form<T, M>, D::Error> {
        struct Any<'e, T, M>(&'e str, PhantomData<(T, M)>);
        impl<'de, T: Deserialize<'de>, M: Deserialize<'de>> Visitor<'de> for Any<'_, T, M> {
            type Value = Form<T, M>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(self.0)
            }

            fn visit_f64<E>(self, number: f64) -> Result<Form<T, M>, E> {
                Ok(Form::Number(number))
            }

            fn visit_str<E>(self, text: &str) -> Result<Form<T, M>, E> {
                Ok(Form::Text(text.to_string()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Form<T, M>, A::Error> {
                Vec::deserialize(value::SeqAccessDeserializer::new(items)).map(Form::List)
            }

            fn visit_map<A: MapAccess<'de>>(self, keys: A) -> Result<Form<T, M>, A::Error> {
                M::deserialize(value::MapAccessDeserializer::new(keys)).map(Form::Table)
            }
        }
        deserializer.deserialize_any(Any(expected, PhantomData))
    }
}

/// The fault of another form than those that are expected.
pub(super) fn unexpected<E: de::Error>(expected: &str) -> E {
    E::invalid_type(de::Unexpected::Other("another form"), &expected)
}

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
    /// The length with its expression resolved, and its value, in the unit of its key: mm but for a position in `at`.
    ///
    /// # Errors
    /// If it is no expression in the constants, infinite or too large for its key.
    pub fn evaluated(&self, key: &str, constants: &[Constant]) -> Result<(expression::Length, f64), Fault> {
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
        if let Some(fault) = limits::too_large_for(key, number) {
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
        let expected = "a number or an expression in quotes";
        match Form::<IgnoredAny>::of(deserializer, expected)? {
            Form::Number(number) => Ok(Length::Number(number)),
            Form::Text(text) => Ok(Length::Expression(text)),
            _ => Err(unexpected(expected)),
        }
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

impl Coordinate for Direction {
    const THREE: &'static str = "a list of three directions";
}

/// Three values, one for each of X, Y and Z.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Three<T>(pub [T; 3]);

/// Three numbers.
pub type Vector = Three<f64>;
/// Three lengths, mm.
pub type Point = Three<Length>;

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

/// A whole number in these limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "f64")]
pub struct Count<const LEAST: usize, const MOST: usize>(pub usize);

impl<const LEAST: usize, const MOST: usize> TryFrom<f64> for Count<LEAST, MOST> {
    type Error = String;

    fn try_from(number: f64) -> Result<Self, String> {
        limits::count(number, LEAST, MOST).map(Count)
    }
}

impl<const LEAST: usize, const MOST: usize> JsonSchema for Count<LEAST, MOST> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "count".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "integer", "minimum": LEAST, "maximum": MOST})
    }
}

/// A direction of length 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Vector")]
#[schemars(inline)]
pub struct Direction(pub [f64; 3]);

impl TryFrom<Vector> for Direction {
    type Error = String;

    fn try_from(Three(vector): Vector) -> Result<Direction, String> {
        let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length < 1e-9 { Err("zero".into()) } else { Ok(Direction(vector.map(|x| x / length))) }
    }
}

/// One direction of length 1, or a list of them.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(inline)]
pub struct Directions(#[schemars(with = "OneOrMoreDirections")] pub Vec<[f64; 3]>);

impl Serialize for Directions {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0[..] {
            [one] => one.serialize(serializer),
            several => several.serialize(serializer),
        }
    }
}

/// The forms of directions in the schema.
#[derive(JsonSchema)]
#[schemars(inline, untagged)]
#[allow(dead_code, reason = "the schema alone uses it")]
enum OneOrMoreDirections {
    One(Direction),
    More(Vec<Direction>),
}

impl<'de> Deserialize<'de> for Directions {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// A number of one direction, or a direction of a list.
        struct Item(Form<f64>);
        impl<'de> Deserialize<'de> for Item {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                Form::of(deserializer, "a number or a direction").map(Item)
            }
        }
        let (mut numbers, mut vectors) = (Vec::new(), Vec::new());
        for Item(item) in Vec::deserialize(deserializer)? {
            match item {
                Form::Number(number) => numbers.push(number),
                Form::List(vector) => vectors.push(vector),
                _ => return Err(unexpected("a number or a direction")),
            }
        }
        if numbers.is_empty() != vectors.is_empty() {
            vectors.extend(Some(numbers).filter(|numbers| !numbers.is_empty()));
            let directions = vectors.into_iter().map(|vector| {
                let vector = vector.try_into().map_err(|_| unexpected(f64::THREE))?;
                Direction::try_from(Three(vector)).map(|direction| direction.0).map_err(de::Error::custom)
            });
            return directions.collect::<Result<_, D::Error>>().map(Directions);
        }
        Err(de::Error::custom("neither a direction, such as [0, 0, 1], nor a list of directions"))
    }
}

/// Any number, also `inf`.
#[derive(Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Unlimited(f64);

/// Standard uncertainty, µm; 0 or absent: exactly known; inf: no prior.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Unlimited")]
#[schemars(inline, extend("minimum" = 0))]
pub struct Uncertainty(pub f64);

impl Uncertainty {
    /// No prior.
    pub fn unknown() -> Uncertainty {
        Uncertainty(f64::INFINITY)
    }
}

impl Uncertainties {
    /// No prior.
    pub fn unknown() -> Uncertainties {
        Uncertainties([Uncertainty::unknown(); 3])
    }
}

impl TryFrom<Unlimited> for Uncertainty {
    type Error = String;

    fn try_from(Unlimited(u): Unlimited) -> Result<Uncertainty, String> {
        if u < 0.0 {
            let u = words::number(u);
            return Err(format!("{u}; an uncertainty cannot be negative: 0 means exactly known, `inf` means unknown"));
        }
        limits::too_small_um(u).map_or(Ok(Uncertainty(u)), |fault| Err(format!("{fault}; 0 means exactly known")))
    }
}

/// Standard uncertainty of each coordinate, µm: a number for all or three; 0 or absent: exactly known; inf: no prior.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Uncertainties(#[schemars(with = "OneOrThree")] pub [Uncertainty; 3]);

/// The forms of uncertainties in the schema.
#[derive(JsonSchema)]
#[schemars(inline, untagged)]
#[allow(dead_code, reason = "the schema alone uses it")]
enum OneOrThree {
    One(Uncertainty),
    Three(Three<Uncertainty>),
}

impl<'de> Deserialize<'de> for Uncertainties {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let expected = "a number or a list of three";
        match Form::of(deserializer, expected)? {
            Form::Number(u) => {
                Uncertainty::try_from(Unlimited(u)).map(|u| Uncertainties([u; 3])).map_err(de::Error::custom)
            }
            Form::List(u) => Vec::try_into(u).map(Uncertainties).map_err(|_| unexpected(expected)),
            Form::Text(_) | Form::Table(IgnoredAny) => Err(unexpected(expected)),
        }
    }
}

/// A list or a table of names of any length: the size of its file is the limit. Others have at most 1000 items.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Long<T>(pub T);

/// Any JSON: numbers keep the digits with which they are written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Json(pub serde_json::Value);

impl<'de> Deserialize<'de> for Json {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// The type by whose name the deserialiser knows such a text.
        #[derive(Deserialize)]
        #[serde(rename = "Json")]
        struct Text(String);
        let Text(text) = Text::deserialize(deserializer)?;
        serde_json::from_str(&text).map(Json).map_err(de::Error::custom)
    }
}

/// A note: a text, a number or a date, as it is written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline, extend("type" = ["string", "number", "boolean"]))]
pub struct Note(pub String);
