//! Bilinear form of a probe's reading for readers: the groups of stylus and step, and the distance in terms of them.

use crate::equation::Equation;
use crate::print::article::groups::named_or_expanded;
use crate::print::article::line::{EquationLine, LeftSide, Section, naming, quantity_heading, row, section, truncated};
use crate::program::{Label, Program};
use crate::symbol::{Binary, Unary};
use crate::touch::{self, ProbeTerms};
use crate::tree::{Tree, binary, negative, sum, terms_of};
use crate::vectors::NamedVector;

/// Index of the first coordinate of the step in R among the names: after two vectors, `a`, `b`, `c` and `l_n`.
const STEP: usize = 10;

/// The groups of stylus and step, and the distance in terms of them.
pub(crate) fn sections(
    equation: &Equation,
    touch: &ProbeTerms,
    trees: &[Tree],
    complete: bool,
) -> (Program, Vec<Section>) {
    let vectors = &equation.vectors;
    let coordinates = |vector: &NamedVector| (0..3).map(|i| vector.label(i)).collect::<Vec<Label>>();
    let mut labels: Vec<Label> = vectors.iter().flat_map(coordinates).collect();
    labels.extend(touch::QUADRATIC);
    let way = touch.step.as_ref().filter(|_| touch.step_length.is_some());
    if let Some(step) = way {
        labels.push(touch::STEP_LENGTH);
        labels.extend(coordinates(step));
    }
    let program = naming(equation, labels);
    let step_trees: Vec<Tree> = way
        .map_or_else(Vec::new, |step| step.components.map(|part| named_or_expanded(equation, &program, part)).to_vec());
    let dot = |a: usize, b: usize| {
        let there = |i: &usize| trees[a + i] != Tree::Number(0.0) && trees[b + i] != Tree::Number(0.0);
        let parts = (0..3).filter(there);
        sum(parts.map(|i| (false, binary(Binary::Mul, Tree::Step(a + i), Tree::Step(b + i)))).collect())
    };
    let mut sections: Vec<Section> = Vec::new();
    for (vector, trees) in vectors.iter().zip(trees.chunks(3)) {
        let rows = coordinates(vector).into_iter().zip(trees);
        let rows = rows.map(|(label, tree)| row(LeftSide::Named(label), tree.clone()));
        sections.push(section(&vector.meaning, rows));
    }
    let radius = named_or_expanded(equation, &program, touch.radius);
    let radius = (true, binary(Binary::Mul, radius.clone(), radius));
    let mut beyond = terms_of(&dot(0, 0));
    beyond.push(radius);
    let quadratic = [dot(3, 3), dot(0, 3), sum(beyond)];
    let mut rows: Vec<EquationLine> =
        touch::QUADRATIC.into_iter().zip(quadratic).map(|(label, tree)| row(LeftSide::Named(label), tree)).collect();
    if let Some(step) = way {
        let squares = (0..3)
            .filter(|i| step_trees[*i] != Tree::Number(0.0))
            .map(|i| Tree::Step(STEP + i))
            .map(|part| (false, binary(Binary::Mul, part.clone(), part)));
        let length = Tree::Unary(Unary::Sqrt, Box::new(sum(squares.collect())));
        rows.push(row(LeftSide::Named(touch::STEP_LENGTH), length));
        let named = coordinates(step).into_iter().zip(step_trees);
        let named = named.map(|(label, tree)| row(LeftSide::Named(label), tree));
        sections.insert(0, section(&step.meaning, named));
    }
    let distance = distance_of_steps(6, way.is_some());
    rows.push(truncated(LeftSide::Output(0), distance, complete));
    sections.push(section(quantity_heading(equation), rows));
    (program, sections)
}

/// `−l_n·(b + √(b² − a·c))/a`, where the steps from `start` are `a`, `b`, `c` and `l_n` in this order.
fn distance_of_steps(start: usize, with_length: bool) -> Tree {
    let [a, b, c, length] = [0, 1, 2, 3].map(|index| Tree::Step(start + index));
    let product_of = |x: &Tree, y: &Tree| binary(Binary::Mul, x.clone(), y.clone());
    let under = binary(Binary::Sub, product_of(&b, &b), product_of(&a, &c));
    let way = binary(Binary::Add, b, Tree::Unary(Unary::Sqrt, Box::new(under)));
    let way = if with_length { product_of(&length, &way) } else { way };
    negative(binary(Binary::Div, way, a))
}
