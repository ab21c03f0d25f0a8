//! `[format]` and `[columns]`: the layout of data files.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::node::{Named, Node};
use super::value::Count;

/// Layout of the data files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "format", deny_unknown_fields)]
pub struct Format {
    /// The separator between cells; default ",".
    #[schemars(extend("enum" = [",", ";", "\t", "|", ":"]))]
    pub separator: Option<String>,
    /// The decimal sign; default ".".
    #[schemars(extend("enum" = [".", ","]))]
    pub decimal: Option<String>,
    /// false: columns are numbered from 1.
    pub header: Option<bool>,
    /// The sheet of a spreadsheet; required if several contain cells.
    pub sheet: Option<String>,
    /// The value of RUN_DIRECTION in a ball-bar file for the direction from the first axis of the plane towards the
    /// second, if its words are ambiguous.
    #[schemars(extend("type" = ["string", "boolean", "integer"]))]
    pub anticlockwise: Option<Node>,
    /// Character encoding of the data files: "latin1", "utf-16le", … (names of the WHATWG Encoding Standard); recognised
    /// where absent.
    pub encoding: Option<String>,
    /// Lines (of a spreadsheet: rows) above the header.
    pub skip_lines: Option<Count<0, MANY>>,
}

/// Own name = foreign name or number; the own name contains the unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "columns")]
pub struct Columns {
    /// Columns that effects follow: NAME_unit = foreign name or number.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    #[schemars(extend("propertyNames" = {"pattern": "_"}))]
    pub driver: Named<ForeignColumn>,
    /// The other columns.
    #[serde(rename = "$rest", default)]
    #[schemars(flatten)]
    pub own: Named<ForeignColumn>,
}

/// Largest number of a column, and of lines above the header.
const MANY: usize = 1_000_000;

/// The column of another program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(rename = "foreign_column")]
pub enum ForeignColumn {
    /// The name in the header, which may have several lines.
    Name(String),
    /// The number from 1.
    Number(Count<1, MANY>),
    /// One column for each traversal: { forward = ["F1", "F2"], backward = ["B1", "B2"] }. The rows are the positions in
    /// the order of a forward traversal.
    Traversals(Traversals),
}

/// The columns of readings that stand side by side, one for each traversal: forward and backward in turn.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Traversals {
    /// Those in the order of the rows: names or numbers.
    #[serde(default)]
    pub forward: Several,
    /// Those against the order of the rows.
    #[serde(default)]
    pub backward: Several,
}

/// One column or several: a name or a number, or a list of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, extend("type" = ["string", "integer", "array"]))]
pub struct Several(pub Vec<ForeignColumn>);

impl<'de> Deserialize<'de> for Several {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Of;
        impl<'de> Visitor<'de> for Of {
            type Value = Several;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("the name of a column in quotes, its number from 1, or a list of them")
            }

            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Several, E> {
                Count::try_from(number).map(|number| Several(vec![ForeignColumn::Number(number)])).map_err(E::custom)
            }

            fn visit_str<E>(self, name: &str) -> Result<Several, E> {
                Ok(Several(vec![ForeignColumn::Name(name.trim().to_string())]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Several, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(items)).map(Several)
            }
        }
        deserializer.deserialize_any(Of)
    }
}

impl<'de> Deserialize<'de> for ForeignColumn {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfColumn;
        impl<'de> Visitor<'de> for OfColumn {
            type Value = ForeignColumn;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("the name of a column in quotes, or its number from 1,")
            }

            fn visit_newtype_struct<D: Deserializer<'de>>(self, column: D) -> Result<ForeignColumn, D::Error> {
                column.deserialize_any(self)
            }

            fn visit_f64<E: de::Error>(self, number: f64) -> Result<ForeignColumn, E> {
                Count::try_from(number).map(ForeignColumn::Number).map_err(E::custom)
            }

            fn visit_str<E>(self, name: &str) -> Result<ForeignColumn, E> {
                Ok(ForeignColumn::Name(name.trim().to_string()))
            }

            fn visit_map<A: MapAccess<'de>>(self, keys: A) -> Result<ForeignColumn, A::Error> {
                Traversals::deserialize(MapAccessDeserializer::new(keys)).map(ForeignColumn::Traversals)
            }
        }
        deserializer.deserialize_newtype_struct(super::de::LINES, OfColumn)
    }
}
