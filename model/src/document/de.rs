//! A document from its tree of values. Every fault has the path that leads to it, and says what was found and what is
//! expected.
//!
//! The deserialisers of `toml` and `serde_json` speak of types of Rust and lose the key; this one does not.

use std::collections::VecDeque;

use serde::de::value::{F64Deserializer, StrDeserializer, StringDeserializer};
use serde::de::{self, DeserializeSeed, Deserializer, Expected, IntoDeserializer, MapAccess, SeqAccess, Visitor};

use serde::{Deserialize, forward_to_deserialize_any};

use super::fault::{Fault, Within};
use super::node::{Entry, Node, Value, checked};
use crate::session::limits;
use crate::words;

/// Largest number of items in a list or a table of names. It exceeds every practical measurement and allows pairwise
/// comparison.
const MAX_ITEMS: usize = 1000;

/// What is expected in place of a value that is no list.
pub const LIST: &str = "a list in square brackets";

/// The field that takes the keys that a struct does not name.
pub(super) const REST: &str = "$rest";

/// The type whose value is the text of any scalar, as written.
pub(super) const NOTE: &str = "Note";

/// The type of a list or a table of names whose length only the size of its file limits.
pub(super) const LONG: &str = "Long";

/// The type whose value may be a text of several lines.
pub(super) const LINES: &str = "Lines";

/// The type whose value is any JSON.
pub(super) const JSON: &str = "Json";

/// The type whose value is a number that may be infinite.
pub(super) const UNLIMITED: &str = "Unlimited";

/// A document, or a part of one, from a tree of values.
///
/// # Errors
/// What is wrong, with the path from the tree.
pub fn from_node<'de, T: Deserialize<'de>>(node: &'de Node) -> Result<T, Fault> {
    T::deserialize(De(node, MAX_ITEMS))
}

/// A value, and the largest number of items if it is a list or a table of names.
#[derive(Clone, Copy)]
struct De<'de>(&'de Node, usize);

impl<'de> De<'de> {
    /// A value of another type than the expected one.
    fn unexpected(self, expected: &dyn Expected) -> Fault {
        let expected = match expected.to_string().as_str() {
            "a boolean" => "true or false".to_string(),
            "a string" => "a text in quotes".to_string(),
            "a sequence" => LIST.to_string(),
            other => other.to_string(),
        };
        Fault::unexpected(expected)
    }

    fn number_or_inf(self, expected: &str) -> Result<f64, Fault> {
        match &self.0.value {
            Value::Number(number, _) if !number.is_nan() => checked(*number).map_err(Fault::is),
            _ => Err(Fault::unexpected(expected)),
        }
    }

    fn number(self) -> Result<f64, Fault> {
        let number = self.number_or_inf("a number")?;
        if number.is_finite() { Ok(number) } else { Err(Fault::is("infinite; a number is expected")) }
    }

    fn text(self) -> Result<&'de str, Fault> {
        let Value::Text(text) = &self.0.value else {
            return Err(Fault::unexpected("a text in quotes"));
        };
        plain(text, |c| c != '\t')
    }

    fn items(self, expected: &dyn Expected) -> Result<&'de [Node], Fault> {
        match &self.0.value {
            Value::List(items) if items.len() > self.1 => {
                Err(Fault::is(format!("a list of {}; the limit is {}", items.len(), self.1)))
            }
            Value::List(items) => Ok(items),
            _ => Err(self.unexpected(expected)),
        }
    }

    fn entries(self) -> Result<&'de [Entry], Fault> {
        match &self.0.value {
            Value::Table(entries) => Ok(entries),
            _ => Err(Fault::unexpected("a table")),
        }
    }
}

/// The text, if none of its characters controls a terminal.
fn plain(text: &str, refused: impl Fn(char) -> bool) -> Result<&str, Fault> {
    match text.chars().find(|c| c.is_control() && refused(*c)) {
        None => Ok(text),
        Some(control) => {
            let what = format!("contains the control character U+{:04X}", control as u32);
            Err(Fault::of_key(what, "remove it"))
        }
    }
}

impl<'de> Deserializer<'de> for De<'de> {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match &self.0.value {
            Value::Null => visitor.visit_unit(),
            Value::Text(_) => visitor.visit_borrowed_str(self.text()?),
            Value::Number(number, _) if number.is_nan() => Err(Fault::unexpected("a number")),
            Value::Number(number, _) => visitor.visit_f64(checked(*number).map_err(Fault::is)?),
            Value::Truth(truth) => visitor.visit_bool(*truth),
            Value::Date(_) => Err(self.unexpected(&visitor)),
            Value::List(_) => self.deserialize_seq(visitor),
            Value::Table(entries) => visitor.visit_map(Map::all(entries)),
        }
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_f64(self.number()?)
    }

    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        // With all its digits, which a float does not hold above 2⁵³.
        if let Value::Number(_, written) = &self.0.value
            && let Ok(number) = written.parse()
        {
            return visitor.visit_u64(number);
        }
        let number = self.number()?;
        if number.fract() == 0.0 && number >= 0.0 {
            visitor.visit_u64(number as u64)
        } else {
            Err(Fault::is(format!("{}; a whole number that is not negative is expected", words::number(number))))
        }
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.deserialize_u64(visitor)
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match &self.0.value {
            Value::Truth(truth) => visitor.visit_bool(*truth),
            _ => Err(self.unexpected(&visitor)),
        }
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_borrowed_str(self.text()?)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.deserialize_str(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match &self.0.value {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Result<V::Value, Fault> {
        match name {
            UNLIMITED => {
                let number = self.number_or_inf("a number or `inf`")?;
                visitor.visit_newtype_struct(F64Deserializer::<Fault>::new(number))
            }
            NOTE => {
                let text = match &self.0.value {
                    Value::Number(_, written) => written.clone(),
                    Value::Truth(truth) => truth.to_string(),
                    Value::Date(date) => date.clone(),
                    // A comment may have several lines.
                    Value::Text(text) => plain(text, |c| !matches!(c, '\t' | '\n'))?.trim().to_string(),
                    _ => return Err(Fault::unexpected("a text in quotes, a number or a date")),
                };
                visitor.visit_newtype_struct(StringDeserializer::<Fault>::new(text))
            }
            LINES => match &self.0.value {
                Value::Text(text) => {
                    let text = plain(text, |c| !matches!(c, '\t' | '\n' | '\r'))?;
                    visitor.visit_newtype_struct(StrDeserializer::<Fault>::new(text))
                }
                _ => visitor.visit_newtype_struct(self),
            },
            JSON => {
                let text = serde_json::Value::from(self.0).to_string();
                visitor.visit_newtype_struct(StringDeserializer::<Fault>::new(text))
            }
            LONG => visitor.visit_newtype_struct(De(self.0, usize::MAX)),
            _ => visitor.visit_newtype_struct(self),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        let items = self.items(&visitor)?;
        visitor.visit_seq(Items { items, next: 0 })
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, Fault> {
        let items = self.items(&visitor)?;
        if items.len() != length {
            return Err(self.unexpected(&visitor));
        }
        visitor.visit_seq(Items { items, next: 0 })
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        let entries = self.entries()?;
        not_too_many(entries.len(), self.1)?;
        visitor.visit_map(Map::all(entries))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        Map::all(self.entries()?).deserialize_struct(name, fields, visitor)
    }

    /// A word, or a table whose key `kind` is the word. A table that has a variant's name as a key is that variant; the
    /// variant `other` takes any table.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        let known = |word: &str| variants.iter().copied().find(|variant| *variant == word);
        let expected = || {
            let words: Vec<String> = variants.iter().map(|word| format!("\"{word}\"")).collect();
            words::listed(&words, "or")
        };
        let Value::Table(entries) = &self.0.value else {
            if variants.contains(&"other") {
                return Err(Fault::unexpected("a table"));
            }
            let variant = self.text().ok().and_then(known).ok_or_else(|| Fault::unexpected(expected()))?;
            return visitor.visit_enum(Word(variant));
        };
        let of_key = entries.iter().find_map(|entry| known(&entry.key)).or_else(|| known("other"));
        if let Some(variant) = of_key {
            return visitor.visit_enum(Variant { variant, map: Map::all(entries) });
        }
        let Some(kind) = self.0.get("kind") else {
            return Err(Fault::missing("kind", &expected()));
        };
        let word = De(kind, MAX_ITEMS).text().ok().and_then(known);
        let variant = word.ok_or_else(|| Fault::unexpected(expected()).at("kind"))?;
        let mut map = Map::all(entries);
        map.entries.retain(|entry| entry.key != "kind");
        map.also.push("kind");
        visitor.visit_enum(Variant { variant, map })
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.deserialize_str(visitor)
    }

    forward_to_deserialize_any! { f32 i8 i16 i32 i64 i128 u8 u16 u128 char bytes byte_buf tuple_struct unit unit_struct ignored_any }
}

/// Checks the number of entries of a table of names.
fn not_too_many(entries: usize, limit: usize) -> Result<(), Fault> {
    if entries <= limit {
        return Ok(());
    }
    Err(Fault::of_table(format!("has {entries} entries; the limit is {limit}"), None))
}

/// Checks the numbers of a key against its limits, which depend on its unit.
fn within_limits(key: &str, node: &Node) -> Result<(), Fault> {
    match &node.value {
        // A number whose key has no unit is checked by its type.
        Value::Number(number, _) if key.contains('_') => {
            limits::too_large_for(key, *number).map_or(Ok(()), |fault| Err(Fault::is(fault)))
        }
        Value::List(items) => {
            items.iter().enumerate().try_for_each(|(item, node)| within_limits(key, node).within_item(item))
        }
        _ => Ok(()),
    }
}

struct Items<'de> {
    items: &'de [Node],
    next: usize,
}

impl<'de> SeqAccess<'de> for Items<'de> {
    type Error = Fault;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Fault> {
        let Some(item) = self.items.get(self.next) else {
            return Ok(None);
        };
        self.next += 1;
        seed.deserialize(De(item, MAX_ITEMS)).map(Some).within_item(self.next - 1)
    }
}

struct Map<'de> {
    /// The entries still to be visited, in the order of the file.
    entries: VecDeque<&'de Entry>,
    value: Option<&'de Entry>,
    /// The keys that the struct does not name.
    rest: Option<Box<Map<'de>>>,
    /// Keys of the table that are read elsewhere.
    also: Vec<&'static str>,
}

impl<'de> Map<'de> {
    fn all(entries: &'de [Entry]) -> Map<'de> {
        Map { entries: entries.iter().collect(), value: None, rest: None, also: Vec::new() }
    }
}

impl<'de> Deserializer<'de> for Map<'de> {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_map(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        mut self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        if fields.contains(&REST) {
            let (own, rest) = self.entries.iter().partition(|entry| fields.contains(&entry.key.as_str()));
            let also = self.also.iter().chain(fields).copied().collect();
            self.rest = Some(Box::new(Map { entries: rest, value: None, rest: None, also }));
            self.entries = own;
        }
        visitor.visit_map(self)
    }

    forward_to_deserialize_any! { bool f32 f64 i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 char str string bytes byte_buf option unit unit_struct newtype_struct seq tuple tuple_struct map enum identifier ignored_any }
}

impl<'de> MapAccess<'de> for Map<'de> {
    type Error = Fault;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Fault> {
        self.value = self.entries.pop_front();
        let key = match self.value {
            Some(entry) => entry.key.as_str(),
            None if self.rest.is_some() => REST,
            None => return Ok(None),
        };
        let key: StrDeserializer<'_, Fault> = key.into_deserializer();
        seed.deserialize(key).map(Some).map_err(|fault| fault.also_known(self.also.iter().map(ToString::to_string)))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Fault> {
        match (self.value.take(), self.rest.take()) {
            (Some(entry), rest) => {
                self.rest = rest;
                within_limits(&entry.key, &entry.node)
                    .and_then(|()| seed.deserialize(De(&entry.node, MAX_ITEMS)))
                    .within(&entry.key)
            }
            (None, Some(rest)) => {
                not_too_many(rest.entries.len(), MAX_ITEMS)?;
                seed.deserialize(*rest)
            }
            (None, None) => Err(Fault::unexpected("a key")),
        }
    }
}

struct Variant<'de> {
    variant: &'static str,
    map: Map<'de>,
}

impl<'de> de::EnumAccess<'de> for Variant<'de> {
    type Error = Fault;
    type Variant = Map<'de>;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Map<'de>), Fault> {
        let variant: StrDeserializer<'_, Fault> = self.variant.into_deserializer();
        Ok((seed.deserialize(variant)?, self.map))
    }
}

/// A word in place of a table of an enum.
struct Word(&'static str);

impl<'de> de::EnumAccess<'de> for Word {
    type Error = Fault;
    type Variant = Word;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Word), Fault> {
        let variant: StrDeserializer<'_, Fault> = self.0.into_deserializer();
        Ok((seed.deserialize(variant)?, self))
    }
}

impl Word {
    fn fault(&self) -> Fault {
        Fault::unexpected(format!("a table such as {{ kind = \"{}\" }}", self.0))
    }
}

impl<'de> de::VariantAccess<'de> for Word {
    type Error = Fault;

    fn unit_variant(self) -> Result<(), Fault> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, _: T) -> Result<T::Value, Fault> {
        Err(self.fault())
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, Fault> {
        Err(self.fault())
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], _: V) -> Result<V::Value, Fault> {
        Err(self.fault())
    }
}

impl<'de> de::VariantAccess<'de> for Map<'de> {
    type Error = Fault;

    fn unit_variant(self) -> Result<(), Fault> {
        Err(Fault::unexpected("a word in quotes"))
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Fault> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, Fault> {
        Err(Fault::unexpected("a table"))
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_map(self)
    }
}
