//! `[[test]]`: the set-up, the motion of the axes, and the data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::layout::{Columns, Format};
use super::movement::{Path, Sweep};
use super::node::{Named, Node};
use super::value::Length;
use crate::instrument::InstrumentKind;
use crate::session::Contributors;

/// A test.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "test")]
#[schemars(deny_unknown_fields)]
pub struct Test {
    /// A name that no other test has.
    pub name: String,
    /// The instrument of this test, if it is another than the session's.
    pub kind: Option<InstrumentKind>,
    /// The data file, relative to the session file or to the data folder.
    pub data: Option<String>,
    /// The keys of the set-up, which depend on the instrument.
    #[serde(rename = "$rest", default)]
    #[schemars(skip)]
    pub set_up: Node,
    /// Tests with the same name share the workpiece ball (nest, tracker, artefact).
    pub setup: Option<String>,
    /// Tests with the same name share the spindle ball (target, stylus).
    pub spindle_setup: Option<String>,
    /// Positions of axes that the data do not contain: x_mm, a_deg.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub at: Named<Length>,
    /// Layout of the data file.
    pub format: Option<Format>,
    /// Own name = foreign name or number; the own name contains the unit.
    pub columns: Option<Columns>,
    /// Contributors to the measurement uncertainty of positioning figures.
    pub contributors: Option<Contributors>,
    /// One axis moves.
    pub sweep: Option<Sweep>,
    /// Several axes move together.
    pub path: Option<Path>,
}
