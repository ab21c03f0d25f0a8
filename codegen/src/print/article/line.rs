//! The lines of an article: an equation with its two sides, and sections of them.

use crate::equation::Equation;
use crate::form::Kind;
use crate::program::{Label, Program, Step};
use crate::tree::Tree;
use crate::variable::Variable;

/// The left-hand side of an equation line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LeftSide {
    /// A named quantity.
    Named(Label),
    /// Its square.
    Square(Label),
    /// A coordinate of the reading, or the length.
    Output(usize),
    /// The derivative of an output by a parameter.
    Slope(usize, Variable),
}

/// One printed equation.
#[derive(Clone, Debug)]
pub(crate) struct EquationLine {
    pub(crate) left: LeftSide,
    /// `≈` instead of `=`.
    pub(crate) approximate: bool,
    pub(crate) right: Tree,
    /// A remark on the coefficient.
    pub(crate) remark: Option<NoteKind>,
}

/// A remark on a coefficient.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum NoteKind {
    /// Identically zero: the parameter is not observable.
    NotObservable,
    /// A constant multiple of another parameter's coefficient.
    MultipleOf(Variable),
}

/// A group of related equations.
#[derive(Clone, Debug)]
pub(crate) struct Section {
    pub(crate) heading: String,
    pub(crate) rows: Vec<EquationLine>,
}

/// A line without a remark.
pub(crate) fn row(left: LeftSide, right: Tree) -> EquationLine {
    EquationLine { left, approximate: false, right, remark: None }
}

/// A line that omits terms unless it is complete.
pub(crate) fn truncated(left: LeftSide, right: Tree, complete: bool) -> EquationLine {
    EquationLine { approximate: !complete, ..row(left, right) }
}

/// Equations under a heading.
pub(crate) fn section(heading: &str, rows: impl IntoIterator<Item = EquationLine>) -> Section {
    Section { heading: heading.to_string(), rows: rows.into_iter().collect() }
}

/// The heading of the section of the reading.
pub(crate) fn quantity_heading(equation: &Equation) -> &'static str {
    match equation.kind {
        Kind::Length => "length of the bar",
        Kind::Distance => "distance read",
        Kind::Coordinates => "coordinates read",
        Kind::Volumetric => "error vector of the tool in the table frame",
    }
}

/// A program that only assigns names to steps.
pub(crate) fn naming(equation: &Equation, labels: Vec<Label>) -> Program {
    let step = |label| Step { label, value: Tree::Number(0.0) };
    Program { inputs: equation.inputs(), steps: labels.into_iter().map(step).collect(), outputs: Vec::new() }
}

/// The meaning and the unit of a named scalar.
pub(crate) fn scalar(name: &str) -> (&'static str, &'static str) {
    match name {
        "L_0" => ("distance without errors", "mm"),
        "S" => ("sum of the errors with their coefficients, times the distance without errors", "mm²"),
        "d" => ("distance between the balls", "mm"),
        "a" => ("square of the step perpendicular to the axis of the artefact", "mm²"),
        "b" => ("product of position and step perpendicular to the axis", "mm²"),
        "c" => ("square of the position perpendicular to the axis, less that of the radius", "mm²"),
        "l_n" => ("length of the step of the probe", "mm"),
        _ => ("reading", "mm"),
    }
}
