//! `[format]` and `[columns]`: the layout of data files.

use schemars::JsonSchema;
use serde::de::{self, IgnoredAny};
use serde::{Deserialize, Deserializer, Serialize};

use super::node::{Named, Node};
use super::value::{Count, Form, unexpected};

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
        let expected = "the name of a column in quotes, its number from 1, or a list of them";
        match Form::<ForeignColumn>::of(deserializer, expected)? {
            Form::Number(number) => number_of_column(number).map(|column| Several(vec![column])),
            Form::Text(name) => Ok(Several(vec![ForeignColumn::Name(name.trim().to_string())])),
            Form::List(columns) => Ok(Several(columns)),
            Form::Table(_) => Err(unexpected(expected)),
        }
    }
}

fn number_of_column<E: de::Error>(number: f64) -> Result<ForeignColumn, E> {
    Count::try_from(number).map(ForeignColumn::Number).map_err(E::custom)
}

impl<'de> Deserialize<'de> for ForeignColumn {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// A name may have several lines.
        struct Lines(Form<IgnoredAny, Traversals>);
        const EXPECTED: &str = "the name of a column in quotes, or its number from 1,";
        impl<'de> Deserialize<'de> for Lines {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                Form::of(deserializer, EXPECTED).map(Lines)
            }
        }
        /// The type by whose name the deserialiser knows such a text.
        #[derive(Deserialize)]
        #[serde(rename = "Lines")]
        struct OfLines(Lines);
        let OfLines(Lines(column)) = OfLines::deserialize(deserializer)?;
        match column {
            Form::Number(number) => number_of_column(number),
            Form::Text(name) => Ok(ForeignColumn::Name(name.trim().to_string())),
            Form::Table(traversals) => Ok(ForeignColumn::Traversals(traversals)),
            Form::List(_) => Err(unexpected(EXPECTED)),
        }
    }
}
