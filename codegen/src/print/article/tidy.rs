//! Order of factors and cancellation, for readers.
//!
//! A product is written in the order of the literature: number, lengths, sines and cosines, errors. A sum whose normal
//! form is shorter is written in that form, so that equal terms of opposite sign cancel.

use crate::collect::Collector;
use crate::normal_form::Ring;
use crate::program::{Input, Label, Program};
use crate::symbol::{Arena, Binary, Operand, Unary};
use crate::tree::{Tree, product};
use crate::truncation::operands;
use crate::variable::Variable;

/// Largest number of names in an expression whose normal form is tried.
const MAX_NAMES: usize = 60;

/// The expression as a reader expects it.
pub(crate) fn tidied(program: &Program, tree: &Tree) -> Tree {
    let shorter = shorter(program, tree);
    ordered(program, shorter.as_ref().unwrap_or(tree))
}

/// The normal form of a sum, if it has fewer names.
fn shorter(program: &Program, tree: &Tree) -> Option<Tree> {
    let names = tree.leaves();
    if !(4..=MAX_NAMES).contains(&names) || !matches!(tree, Tree::Binary(Binary::Add | Binary::Sub, ..)) {
        return None;
    }
    // Steps become lengths of their own, after the inputs.
    let first = program.inputs.len();
    let placeholder = |step| Input::Plain(Variable::Length(format!("step {step}")));
    let inputs: Vec<Input> = program.inputs.iter().cloned().chain((0..program.steps.len()).map(placeholder)).collect();
    let arena = Arena::new();
    let known: Vec<Operand> = operands(&arena, &inputs);
    let named = tree.mapped(&|leaf| match leaf {
        Tree::Step(step) => Some(Tree::Input(first + step)),
        _ => None,
    });
    let mut ring = Ring::exact(&arena);
    let form = ring.normal_form(named.symbol(&arena, &known).operand()).ok()?;
    let short = Collector { ring: &ring, inputs: &inputs }.group(&form);
    (short.leaves() < names).then(|| {
        short.mapped(&|leaf| match leaf {
            Tree::Input(input) if *input >= first => Some(Tree::Step(input - first)),
            _ => None,
        })
    })
}

/// Sorts the factors of every product.
fn ordered(program: &Program, tree: &Tree) -> Tree {
    match tree {
        Tree::Binary(Binary::Mul, ..) => {
            let mut factors = Vec::new();
            flatten(tree, &mut factors);
            let mut factors: Vec<Tree> = factors.into_iter().map(|factor| ordered(program, factor)).collect();
            factors.sort_by_key(|factor| class(program, factor));
            product(factors)
        }
        Tree::Binary(op, a, b) => Tree::Binary(*op, Box::new(ordered(program, a)), Box::new(ordered(program, b))),
        Tree::Unary(function, a) => Tree::Unary(*function, Box::new(ordered(program, a))),
        leaf => leaf.clone(),
    }
}

fn flatten<'t>(tree: &'t Tree, factors: &mut Vec<&'t Tree>) {
    match tree {
        Tree::Binary(Binary::Mul, a, b) => {
            flatten(a, factors);
            flatten(b, factors);
        }
        other => factors.push(other),
    }
}

/// Place of a factor in a product: number, length, sum of lengths, sine or cosine, sum with them, error, sum of errors.
fn class(program: &Program, tree: &Tree) -> u8 {
    match tree {
        Tree::Number(_) => 0,
        Tree::Input(index) => match &program.inputs[*index] {
            // The coefficient of an effect stands before its function, as in a series.
            Input::Plain(Variable::Length(_) | Variable::Coefficient(_)) => 1,
            input if input.variable().is_small() => 5,
            Input::Plain(variable) if !variable.is_angle() && matches!(variable, Variable::Position { .. }) => 1,
            _ => 3,
        },
        Tree::Step(index) => match program.steps[*index].label {
            Label::Quantity(_) => 5,
            _ => 1,
        },
        Tree::Unary(Unary::Neg, a) => class(program, a),
        Tree::Unary(Unary::Sqrt, a) => sum_class(class(program, a)),
        Tree::Unary(_, a) => class(program, a).max(3),
        Tree::Binary(_, a, b) => sum_class(class(program, a).max(class(program, b))),
    }
}

/// Behind its largest part.
fn sum_class(largest: u8) -> u8 {
    if largest % 2 == 1 { largest + 1 } else { largest.max(2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(op: Binary, a: Tree, b: Tree) -> Tree {
        Tree::Binary(op, Box::new(a), Box::new(b))
    }

    /// `a·b + c·d − a·b` is `c·d`, whether a factor is a length of the session or a step of the program.
    #[test]
    fn equal_terms_of_opposite_sign_cancel() {
        let inputs = ["a", "b", "c", "d"].map(|name| Input::Plain(Variable::Length(name.into()))).to_vec();
        let program = Program { inputs, steps: Vec::new(), outputs: Vec::new() };
        let times = |a, b| sum(Binary::Mul, Tree::Input(a), Tree::Input(b));
        let whole = sum(Binary::Sub, sum(Binary::Add, times(0, 1), times(2, 3)), times(0, 1));
        assert_eq!(tidied(&program, &whole), times(2, 3));
        // A sum without equal terms stays as it is, in its order.
        let other = sum(Binary::Sub, times(2, 3), times(0, 1));
        assert_eq!(tidied(&program, &other), other);
    }
}
