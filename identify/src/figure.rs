//! The figures that standards define: what each is, and its value in a test.
//!
//! A figure is one line of a table here and one value in the module of its standard. Results, their schema, the tables of
//! reports and the files of figures loop over the tables.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Serialize;

/// What a figure is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Definition {
    /// Identifier.
    #[schemars(with = "FigureId")]
    pub id: &'static str,
    /// Symbol; absent if it has none. An arrow is the direction of the approach.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub symbol: &'static str,
    /// Short name.
    pub name: &'static str,
    /// The standard, with the edition where the definition depends on it.
    pub standard: &'static str,
}

/// A figure of a test.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Figure {
    /// What it is.
    #[serde(flatten)]
    pub definition: &'static Definition,
    /// Value, in `unit`.
    pub value: f64,
    /// Standard uncertainty of the value, in `unit`; absent if the test states no contributors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub u: Option<f64>,
    /// `um` or `arcsec`.
    pub unit: String,
    /// Standard uncertainty by the positions of the balls of a ball bar, in `unit`.
    #[serde(skip)]
    pub(crate) set_up_u: f64,
}

/// The figure with an identifier, if the test has it.
pub fn find<'f>(figures: &'f [Figure], id: &str) -> Option<&'f Figure> {
    figures.iter().find(|figure| figure.definition.id == id)
}

impl Definition {
    /// A figure without uncertainty.
    pub(crate) fn with_value(&'static self, value: f64, unit: &str) -> Figure {
        Figure { definition: self, value, u: None, unit: unit.to_string(), set_up_u: 0.0 }
    }
}

/// A figure of ISO 230-4, by its name in the edition of 2022 and its symbol in that of 2005.
const fn iso_230_4(id: &'static str, symbol: &'static str, name: &'static str) -> Definition {
    Definition { id, symbol, name, standard: "ISO 230-4:2022" }
}

const fn iso_230_7(id: &'static str, name: &'static str) -> Definition {
    Definition { id, symbol: "", name, standard: "ISO 230-7" }
}

const fn iso_230_2(id: &'static str, symbol: &'static str, name: &'static str) -> Definition {
    Definition { id, symbol, name, standard: "ISO 230-2:2014" }
}

const fn iso_230_1(id: &'static str, name: &'static str) -> Definition {
    Definition { id, symbol: "", name, standard: "ISO 230-1:2012" }
}

/// Of a ball bar whose path is a circle, or of a rotary axis that turns: of one direction of travel.
pub static IN_ONE_DIRECTION: [Definition; 5] = [
    iso_230_4("circular_deviation", "G", "circular error"),
    iso_230_4("radial_deviation_max", "F max", "maximum radial error"),
    iso_230_4("radial_deviation_min", "F min", "minimum radial error"),
    iso_230_7("synchronous_error_motion", "synchronous error motion"),
    iso_230_7("asynchronous_error_motion", "asynchronous error motion"),
];

/// Of both directions of travel.
pub static IN_BOTH_DIRECTIONS: [Definition; 3] = [
    iso_230_4("bidirectional_circular_deviation", "G(b)", "bidirectional circular error"),
    iso_230_4("mean_bidirectional_radial_deviation", "D", "mean bidirectional radial error"),
    Definition { standard: "ISO 230-4:1996", ..iso_230_4("hysteresis", "H", "circular hysteresis") },
];

/// Of positions along an axis, or along a diagonal (ISO 230-6), that are approached in both directions. Figures of one name
/// follow each other: of both directions, of the positive one, of the negative one.
pub static POSITIONING: [Definition; 12] = [
    iso_230_2("accuracy", "A", "accuracy"),
    iso_230_2("accuracy_forward", "A↑", "accuracy"),
    iso_230_2("accuracy_backward", "A↓", "accuracy"),
    iso_230_2("repeatability", "R", "repeatability"),
    iso_230_2("repeatability_forward", "R↑", "repeatability"),
    iso_230_2("repeatability_backward", "R↓", "repeatability"),
    iso_230_2("systematic", "E", "systematic deviation"),
    iso_230_2("systematic_forward", "E↑", "systematic deviation"),
    iso_230_2("systematic_backward", "E↓", "systematic deviation"),
    iso_230_2("mean_range", "M", "mean bidirectional deviation"),
    iso_230_2("reversal", "B", "reversal value"),
    iso_230_2("mean_reversal", "", "mean reversal value"),
];

/// Of these the largest over several diagonals is a figure too (ISO 230-6:2002).
pub const OF_DIAGONALS: [&str; 4] = ["systematic", "repeatability", "reversal", "mean_range"];

/// Of straightness, about either line.
pub static STRAIGHTNESS: [Definition; 2] =
    [iso_230_1("least_squares", "least squares"), iso_230_1("end_points", "end points")];

/// The identifiers, for the schema of results.
struct FigureId;

impl JsonSchema for FigureId {
    fn schema_name() -> Cow<'static, str> {
        "FigureId".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let tables: [&[Definition]; 4] = [&IN_ONE_DIRECTION, &IN_BOTH_DIRECTIONS, &POSITIONING, &STRAIGHTNESS];
        let choice = |Definition { id, symbol, name, standard }: &Definition| {
            let words = format!("{name} {symbol}");
            serde_json::json!({"const": id, "description": format!("{} ({standard}).", words.trim_end())})
        };
        let choices: Vec<serde_json::Value> = tables.concat().iter().map(choice).collect();
        json_schema!({"description": "A figure of a standard.", "oneOf": choices})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readers find a figure by its identifier; tables of positioning put figures of one name side by side.
    #[test]
    fn identifiers_are_unique_and_directions_follow_both() {
        let schema = FigureId::json_schema(&mut SchemaGenerator::default()).to_value();
        let ids: Vec<&str> =
            schema["oneOf"].as_array().unwrap().iter().map(|choice| choice["const"].as_str().unwrap()).collect();
        let distinct: std::collections::BTreeSet<&str> = ids.iter().copied().collect();
        assert_eq!((ids.len(), distinct.len()), (22, 22));
        for group in POSITIONING.chunk_by(|a, b| a.name == b.name) {
            let ends: Vec<&str> = group.iter().map(|one| one.id.trim_start_matches(group[0].id)).collect();
            assert!(ends == [""] || ends == ["", "_forward", "_backward"], "{ends:?}");
        }
        assert!(OF_DIAGONALS.iter().all(|id| POSITIONING.iter().any(|definition| definition.id == *id)));
    }
}
