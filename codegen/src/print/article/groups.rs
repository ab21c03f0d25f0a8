//! Bilinear form for readers: the coordinate groups, and the reading as a function of them.

use std::collections::HashMap;

use crate::equation::Equation;
use crate::form::{Arrangement, Kind};
use crate::print::article::line::{LeftSide, Section, naming, quantity_heading, row, section, truncated};
use crate::program::{Label, Naming, Program};
use crate::symbol::{Binary, Operand, Unary};
use crate::tree::{Tree, binary, product, sum, terms_of};

/// `√(x² + y² + z²)` of three steps, without those that are zero.
pub(crate) fn norm_of_steps(start: usize, zero: [bool; 3]) -> Tree {
    let square = |index| (false, binary(Binary::Mul, Tree::Step(index), Tree::Step(index)));
    let present = (0..3).filter(|coordinate| !zero[*coordinate]);
    Tree::Unary(Unary::Sqrt, Box::new(sum(present.map(|coordinate| square(start + coordinate)).collect())))
}

/// The sum, or its negative if most of its terms are negative: its square is the same.
fn mostly_positive(tree: &Tree) -> Tree {
    let terms = terms_of(tree);
    let minus = 2 * terms.iter().filter(|(minus, _)| *minus).count() > terms.len();
    sum(terms.into_iter().map(|(own, term)| (own != minus, term)).collect())
}

/// The coordinate groups, and the length as a function of them.
pub(crate) fn sections(equation: &Equation, trees: &[Tree], complete: bool) -> (Program, Vec<Section>) {
    if equation.kind != Kind::Length {
        let trees = trees.iter().enumerate();
        let rows = trees.map(|(index, tree)| truncated(LeftSide::Output(index), tree.clone(), complete));
        let section = section(quantity_heading(equation), rows);
        return (naming(equation, Vec::new()), vec![section]);
    }
    if equation.options.arrangement == Arrangement::Single {
        let program = naming(equation, Vec::new());
        let squares = trees.iter().filter(|tree| **tree != Tree::Number(0.0)).map(|tree| {
            let tree = mostly_positive(tree);
            (false, binary(Binary::Mul, tree.clone(), tree))
        });
        let norm = Tree::Unary(Unary::Sqrt, Box::new(sum(squares.collect())));
        let length = truncated(LeftSide::Output(0), with_bar_parameters(equation, &program, norm), complete);
        return (program, vec![section(quantity_heading(equation), [length])]);
    }
    let bar = &equation.vectors[equation.vectors.len() - 1];
    let labels: Vec<Label> = (0..3).map(|coordinate| bar.label(coordinate)).collect();
    let program = naming(equation, labels.clone());
    let rows = labels.into_iter().zip(trees).map(|(label, tree)| row(LeftSide::Named(label), tree.clone()));
    let length = with_bar_parameters(
        equation,
        &program,
        norm_of_steps(0, std::array::from_fn(|i| trees[i] == Tree::Number(0.0))),
    );
    let length = truncated(LeftSide::Output(0), length, complete);
    let sections = [section(&bar.meaning, rows), section(quantity_heading(equation), [length])];
    (program, sections.into())
}

/// `d − δ_bar + δ_gain·(d − bar)`, with the parameters that are included.
pub(crate) fn with_bar_parameters(equation: &Equation, program: &Program, distance: Tree) -> Tree {
    let tree = |operand: Operand| named_or_expanded(equation, program, operand);
    let [bar, gain] = equation.bar_parameters;
    let mut terms = vec![(false, distance.clone())];
    if let Some(bar) = bar {
        terms.push((true, tree(bar)));
    }
    if let (Some(gain), Some(stated)) = (gain, equation.stated_length) {
        let difference = sum(vec![(false, distance), (true, tree(stated))]);
        terms.push((false, product(vec![tree(gain), difference])));
    }
    sum(terms)
}

/// An operand under the name of a driven error, or as its own expression.
pub(crate) fn named_or_expanded(equation: &Equation, program: &Program, operand: Operand) -> Tree {
    let follower = equation.driven_errors.iter().find(|(_, value)| *value == operand);
    let named = follower.and_then(|(variable, _)| {
        let label = Label::Quantity(variable.clone());
        program.steps.iter().position(|step| step.label == label)
    });
    let none = HashMap::new();
    let own = || {
        let inputs = equation.inputs();
        Program::of(&equation.arena, inputs, &[operand], &none, Naming::Labelled)
    };
    named.map_or_else(|| own().outputs[0].clone(), Tree::Step)
}
