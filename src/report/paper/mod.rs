//! The sections of `abbe paper`: selections of text, tables and figures, from results.
//!
//! A text may cite: `[@jcgm100]`, or several, `[@jcgm100;@jcgm102]`.

pub mod comparison;
pub mod contents;
pub mod methods;

use super::figure::Figure;
use super::table::Table;

/// A part of the paper, which can be selected by its word.
#[derive(Clone, Debug)]
pub struct Section {
    /// Word of `--parts`, and name of its files.
    pub name: &'static str,
    /// Heading.
    pub heading: &'static str,
    /// Contents, in order.
    pub items: Vec<Item>,
}

/// One piece of a section.
#[derive(Clone, Debug)]
pub enum Item {
    /// A paragraph, with citations.
    Text(String),
    /// A displayed formula: LaTeX, Typst.
    Formula(&'static str, &'static str),
    /// A table, under this name of its files.
    Table(String, Table),
    /// A figure.
    Figure(Figure),
}
