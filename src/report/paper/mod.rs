//! The parts of `abbe paper`: selections of text, tables and figures, from results.

pub mod comparison;
pub mod contents;
pub mod methods;

use super::block::Report;

/// A part of the paper, which can be selected by its word. The title of the report is its heading.
pub struct Part {
    /// Word of `--parts`, and name of its files.
    pub name: &'static str,
    /// Contents.
    pub report: Report,
}
