//! The equations of all tests of a session, and their sensitivities as a matrix: a row for each parameter, a column for
//! each reading.

use crate::check::Checked;
use crate::form::Kind;
use crate::print::article::Article;
use crate::print::article::line::LeftSide;
use crate::print::dialect;
use crate::print::notation::{Notation, Spelling};
use crate::tree::{Tree, terms_of};
use crate::variable::Variable;

/// The equation of one test, and its first order, whose coefficients are its derivatives without errors.
#[derive(Clone, Copy, Debug)]
pub struct TestEquations<'c> {
    /// The equation in the requested form.
    pub equation: &'c Checked<'c>,
    /// The equation in first order.
    pub first: &'c Checked<'c>,
}

/// Columns of the matrix that fit a line.
pub(crate) struct Block {
    /// The readings.
    pub(crate) headers: Vec<String>,
    /// Each parameter with the lines of its cells.
    pub(crate) rows: Vec<(String, Vec<Vec<String>>)>,
}

/// Width of the gap between two columns, in parts of the width of a line.
const GAP: usize = 40;

/// The matrix in blocks of at most `width`, as `measure` gives the width of a piece.
pub(crate) fn blocks<N: Notation>(
    tests: &[TestEquations<'_>],
    notation: &N,
    width: usize,
    measure: impl Fn(&str) -> usize,
) -> Vec<Block> {
    let mut parameters: Vec<Variable> = Vec::new();
    for test in tests {
        for parameter in &test.first.equation.parameters {
            if !parameters.contains(parameter) {
                parameters.push(parameter.clone());
            }
        }
    }
    let symbols = tests.first().map(|test| test.first.equation.options.symbols).unwrap_or_default();
    let names: Vec<String> = parameters.iter().map(|parameter| notation.variable(parameter, symbols)).collect();
    let first = names.iter().map(|name| measure(name)).max().unwrap_or(0) + width / GAP;
    let mut blocks: Vec<Block> = Vec::new();
    let mut left = 0;
    for test in tests {
        let equation = test.first.equation;
        let article = Article::new(equation);
        let spelling = Spelling::new(notation, &article.program, equation);
        let rows = article.sections.iter().flat_map(|section| &section.rows);
        let coefficients: Vec<(usize, &Variable, &Tree)> = rows
            .filter_map(|row| match &row.left {
                LeftSide::Slope(coordinate, parameter) => Some((*coordinate, parameter, &row.right)),
                _ => None,
            })
            .collect();
        for coordinate in 0..equation.outputs.len() {
            let cell = |parameter: &Variable| {
                let own = coefficients.iter().find(|(c, p, _)| *c == coordinate && *p == parameter);
                let zero = Tree::Number(0.0);
                let tree = own.map_or(&zero, |(_, _, tree)| *tree);
                dialect::lines(&terms_of(tree), &spelling, [width.saturating_sub(first); 2], &measure)
            };
            let cells: Vec<Vec<String>> = parameters.iter().map(cell).collect();
            let name = equation.name.clone().unwrap_or_default();
            let header = match equation.kind {
                Kind::Length | Kind::Distance => name,
                Kind::Coordinates | Kind::Volumetric => format!("{name} {}", equation.names[coordinate]),
            };
            let widest = cells.iter().flatten().map(|line| measure(line)).chain([measure(&header)]).max();
            let taken = widest.unwrap_or(0) + width / GAP;
            if blocks.is_empty() || taken > left {
                let rows = names.iter().map(|name| (name.clone(), Vec::new())).collect();
                blocks.push(Block { headers: Vec::new(), rows });
                left = width.saturating_sub(first);
            }
            left = left.saturating_sub(taken);
            if let Some(block) = blocks.last_mut() {
                block.headers.push(header);
                for (row, cell) in block.rows.iter_mut().zip(cells) {
                    row.1.push(cell);
                }
            }
        }
    }
    blocks
}
