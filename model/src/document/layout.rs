//! `[format]` and `[columns]`: the layout of data files.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::node::Node;
use super::node::{Entries, Named};

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
    #[schemars(range(min = 0, max = 1_000_000))]
    pub skip_lines: Option<u64>,
}

/// Own name = foreign name or number; the own name contains the unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "columns")]
pub struct Columns {
    /// Columns that effects follow: NAME_unit = foreign name or number.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    #[schemars(with = "Named<ForeignColumn>", extend("propertyNames" = {"pattern": "_"}))]
    pub driver: Entries,
    /// The other columns.
    #[serde(rename = "$rest", default)]
    #[schemars(flatten, with = "Named<ForeignColumn>")]
    pub own: Entries,
}

/// The column of another program: its name, or its number from 1.
#[derive(JsonSchema)]
#[schemars(rename = "foreign_column", untagged)]
#[allow(dead_code, reason = "the schema alone uses it")]
enum ForeignColumn {
    /// The name in the header.
    Name(String),
    /// The number from 1.
    Number(std::num::NonZeroU32),
}
