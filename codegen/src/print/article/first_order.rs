//! First-order form for readers: the value without errors, the sum over the errors, and the table of coefficients.

use crate::collect::positive_first;
use crate::equation::Equation;
use crate::first_order::{Column, FirstOrder};
use crate::form::{Kind, PrintedFirstOrder};
use crate::print::article::line::{
    EquationLine, LeftSide, NoteKind, Section, naming, quantity_heading, row, section, truncated,
};
use crate::program::{Input, Label, Program};
use crate::symbol::{Binary, Unary};
use crate::tree::{Term, Tree, binary, negative, product, sum, terms_of};
use crate::variable::Variable;

const L_0: Label = Label::Scalar("L_0");
const S: Label = Label::Scalar("S");

/// The value without errors, the sum, and the table of coefficients.
pub(crate) fn sections(
    equation: &Equation,
    first: &FirstOrder,
    printed: &PrintedFirstOrder,
) -> (Program, Vec<Section>) {
    let is_length = matches!(equation.kind, Kind::Length | Kind::Distance);
    let program = naming(equation, if is_length { vec![L_0, S] } else { Vec::new() });
    let (l_0, s) = (Tree::Step(0), Tree::Step(1));
    let named = (equation.kind == Kind::Distance).then(|| printed.with_named_length(&l_0));
    let printed = named.as_ref().unwrap_or(printed);
    let mut sum_rows = Vec::new();
    if is_length {
        sum_rows.push(row(LeftSide::Square(L_0), printed.nominal[0].clone()));
        sum_rows.push(row(LeftSide::Named(S), sum(terms(equation, first, printed, 0, true))));
        let slope = binary(Binary::Div, s, l_0.clone());
        let mut all = terms_of(&printed.without_errors(l_0.clone()));
        all.push((false, slope));
        all.extend(terms(equation, first, printed, 0, false));
        sum_rows.push(truncated(LeftSide::Output(0), sum(all), false));
    } else {
        for (index, nominal) in printed.nominal.iter().enumerate() {
            let mut all = Vec::new();
            if *nominal != Tree::Number(0.0) {
                all.push((false, nominal.clone()));
            }
            all.extend(terms(equation, first, printed, index, false));
            sum_rows.push(truncated(LeftSide::Output(index), sum(all), false));
        }
    }
    let mut table = Vec::new();
    for (sensitivity, coefficients) in first.sensitivities.iter().zip(&printed.coefficients) {
        let remark = match &sensitivity.column {
            Column::Distinct => None,
            Column::Zero => Some(NoteKind::NotObservable),
            Column::Multiple { of, .. } => Some(NoteKind::MultipleOf(of.clone())),
        };
        let zero = |tree: &Tree| *tree == Tree::Number(0.0);
        let all_zero = coefficients.iter().all(zero);
        for (index, coefficient) in coefficients.iter().enumerate() {
            // Zero coordinates of a vector are omitted; of an identically zero column, one coordinate remains.
            if zero(coefficient) && !is_length && !(all_zero && index == 0) {
                continue;
            }
            let right = if sensitivity.over_length && !zero(coefficient) {
                over(coefficient.clone(), l_0.clone())
            } else {
                coefficient.clone()
            };
            table.push(EquationLine {
                remark: remark.clone(),
                ..row(LeftSide::Slope(index, sensitivity.parameter.clone()), right)
            });
        }
    }
    let heading = format!("{}, first order", quantity_heading(equation));
    let sections = vec![section(&heading, sum_rows), section("coefficients by parameter", table)];
    (program, sections)
}

/// `a/b`, or `(1/b)·a` if the numerator is too long for one line.
fn over(numerator: Tree, denominator: Tree) -> Tree {
    if terms_of(&numerator).len() > 4 || numerator.leaves() > 20 {
        product(vec![binary(Binary::Div, Tree::Number(1.0), denominator), numerator])
    } else {
        match without_minus(&numerator) {
            (true, numerator) => negative(binary(Binary::Div, numerator, denominator)),
            (false, numerator) => binary(Binary::Div, numerator, denominator),
        }
    }
}

/// `Σ cᵢ·(eᵢ + Σ fₖ·eₖ)` over the linearly independent columns, with their constant multiples in the parentheses.
fn terms(
    equation: &Equation,
    first: &FirstOrder,
    printed: &PrintedFirstOrder,
    coordinate: usize,
    over_length: bool,
) -> Vec<Term> {
    let inputs = equation.inputs();
    let input = |parameter: &Variable| {
        let requested = Input::Plain(parameter.clone());
        inputs.iter().position(|input| *input == requested).map(Tree::Input)
    };
    let mut terms = Vec::new();
    for (index, sensitivity) in first.sensitivities.iter().enumerate() {
        let coefficient = &printed.coefficients[index][coordinate];
        // A multiple stays a separate term if only one of the two columns is divided by L₀, or if its factor is a
        // fraction, which is not shorter.
        let is_separate = match &sensitivity.column {
            Column::Distinct => true,
            Column::Zero => false,
            Column::Multiple { of, .. } => {
                let mut bases = first.sensitivities.iter();
                is_fraction(&printed.factors[index])
                    || bases.any(|base| base.parameter == *of && base.over_length != sensitivity.over_length)
            }
        };
        let shown = is_separate && sensitivity.over_length == over_length && *coefficient != Tree::Number(0.0);
        let (true, Some(own)) = (shown, input(&sensitivity.parameter)) else {
            continue;
        };
        let mut errors = vec![(false, own)];
        for (other, factor) in first.sensitivities.iter().zip(&printed.factors) {
            let Column::Multiple { of, .. } = &other.column else {
                continue;
            };
            let (Some((numerator, _)), Some(error)) = (factor, input(&other.parameter)) else {
                continue;
            };
            if *of != sensitivity.parameter || other.over_length != over_length || is_fraction(factor) {
                continue;
            }
            let (minus, scale) = mostly_positive(numerator);
            let term = if scale == Tree::Number(1.0) { error } else { product(vec![scale, error]) };
            errors.push((minus, term));
        }
        let errors = sum(errors);
        let (minus, coefficient) = without_minus(coefficient);
        terms.push(if coefficient == Tree::Number(1.0) {
            match errors {
                single @ Tree::Input(_) => (minus, single),
                several if !minus => (false, several),
                several => (minus, product(vec![several])),
            }
        } else {
            (minus, product(vec![coefficient, errors]))
        });
    }
    terms
}

/// Whether the factor of a multiple has a denominator other than 1.
fn is_fraction(factor: &Option<(Tree, Tree)>) -> bool {
    matches!(factor, Some((_, denominator)) if *denominator != Tree::Number(1.0))
}

/// Splits a leading minus from a product or a name.
fn without_minus(tree: &Tree) -> (bool, Tree) {
    match tree {
        Tree::Unary(Unary::Neg, inner) => (true, (**inner).clone()),
        Tree::Number(value) if *value < 0.0 => (true, Tree::Number(-value)),
        other => (false, other.clone()),
    }
}

/// As [`without_minus`], also from a sum with more negative terms than others.
fn mostly_positive(tree: &Tree) -> (bool, Tree) {
    let mut terms = terms_of(tree);
    if terms.len() < 2 || 2 * terms.iter().filter(|(minus, _)| *minus).count() <= terms.len() {
        return without_minus(tree);
    }
    terms.iter_mut().for_each(|(minus, _)| *minus = !*minus);
    (true, sum(positive_first(terms)))
}
