//! Content of an equation for readers, independent of the language: named vectors, coordinate groups or coefficients, symbols, notes.

use std::collections::HashMap;

use crate::collect::{product, sum};
use crate::equation::{Equation, Form, Kind, Order, PrintedFirstOrder};
use crate::first_order::{Column, FirstOrder};
use crate::print::{exact, notes, touch};
use crate::program::{Input, Label, Naming, Program, Step, Tree};
use crate::symbol::{Binary, Operand, Unary};
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

/// The complete content.
pub(crate) struct Article {
    /// The inputs and names to which the expressions refer.
    pub(crate) program: Program,
    pub(crate) sections: Vec<Section>,
    /// Inputs with unit and meaning. A rotary axis is listed once, by its angle, with the symbols of its sine and cosine.
    pub(crate) symbols: Vec<(Input, String, &'static str)>,
}

impl Article {
    pub(crate) fn new(equation: &Equation) -> Self {
        let (program, sections) = match &equation.form {
            Form::Exact => exact::sections(equation),
            Form::Groups {
                printed, complete, ..
            } => groups(equation, printed, *complete),
            Form::First(first, printed) => first_order(equation, first, printed),
        };
        let is_listed = |index: usize, input: &Input| match input {
            // Omit a length or position that the form does not contain.
            Input::Plain(variable) if variable.is_small() => true,
            Input::Plain(_) => uses(&sections, index),
            Input::Sine(_) => uses(&sections, index) || uses(&sections, index + 1),
            Input::Cosine(_) => false,
        };
        let inputs = program.inputs.iter().enumerate();
        let symbols = inputs
            .filter(|(index, input)| is_listed(*index, input))
            .map(|(_, input)| match input {
                Input::Plain(variable) => {
                    (input.clone(), notes::meaning(equation, variable), variable.unit())
                }
                Input::Sine(variable) | Input::Cosine(variable) => (
                    input.clone(),
                    format!("sine and cosine of the {}", variable.meaning()),
                    "1",
                ),
            })
            .collect();
        Article {
            program,
            sections,
            symbols,
        }
    }
}

/// Whether any of the equations uses an input.
fn uses(sections: &[Section], index: usize) -> bool {
    let rows = sections.iter().flat_map(|section| &section.rows);
    rows.into_iter().any(|row| row.right.holds(index))
}

pub(crate) fn row(left: LeftSide, right: Tree) -> EquationLine {
    EquationLine {
        left,
        approximate: false,
        right,
        remark: None,
    }
}

pub(crate) fn quantity_heading(equation: &Equation) -> &'static str {
    match equation.kind {
        Kind::Length => "length of the bar",
        Kind::Distance => "distance read",
        Kind::Coordinates => "coordinates read",
        Kind::Volumetric => "error vector of the tool in the table frame",
    }
}

/// A program that only assigns names: its steps are the coordinates of the bar vector, or none.
pub(crate) fn naming(equation: &Equation, labels: Vec<Label>) -> Program {
    let step = |label| Step {
        label,
        value: Tree::Number(0.0),
    };
    Program {
        inputs: equation.inputs(),
        steps: labels.into_iter().map(step).collect(),
        outputs: Vec::new(),
    }
}

pub(crate) fn binary(op: Binary, a: Tree, b: Tree) -> Tree {
    Tree::Binary(op, Box::new(a), Box::new(b))
}

/// `√(x² + y² + z²)` of three steps.
pub(crate) fn norm_of_steps(start: usize) -> Tree {
    let square = |index| (false, binary(Binary::Mul, Tree::Step(index), Tree::Step(index)));
    Tree::Unary(
        Unary::Sqrt,
        Box::new(sum((start..start + 3).map(square).collect())),
    )
}

/// The coordinate groups, and the length as a function of them.
fn groups(equation: &Equation, trees: &[Tree], complete: bool) -> (Program, Vec<Section>) {
    if let (Kind::Distance, Some(touch)) = (equation.kind, &equation.touch) {
        return touch::groups(equation, touch, trees, complete);
    }
    if equation.kind != Kind::Length {
        let rows = trees.iter().enumerate().map(|(index, tree)| EquationLine {
            approximate: !complete,
            ..row(LeftSide::Output(index), tree.clone())
        });
        let section = Section {
            heading: quantity_heading(equation).to_string(),
            rows: rows.collect(),
        };
        return (naming(equation, Vec::new()), vec![section]);
    }
    let bar = &equation.vectors[0];
    let labels: Vec<Label> = (0..3).map(|coordinate| bar.label(coordinate)).collect();
    let program = naming(equation, labels.clone());
    let rows = labels
        .into_iter()
        .zip(trees)
        .map(|(label, tree)| row(LeftSide::Named(label), tree.clone()));
    let length = with_bar_parameters(equation, &program, norm_of_steps(0));
    let sections = vec![
        Section {
            heading: bar.meaning.clone(),
            rows: rows.collect(),
        },
        Section {
            heading: quantity_heading(equation).to_string(),
            rows: vec![EquationLine {
                approximate: !complete,
                ..row(LeftSide::Output(0), length)
            }],
        },
    ];
    (program, sections)
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

const L_0: Label = Label::Scalar("L_0");
const S: Label = Label::Scalar("S");

/// The value without errors, the sum, and the table of coefficients.
fn first_order(
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
        sum_rows.push(row(
            LeftSide::Named(S),
            sum(terms(equation, first, printed, 0, true)),
        ));
        let slope = binary(Binary::Div, s, l_0.clone());
        let mut all = terms_of(&printed.without_errors(l_0.clone()));
        all.push((false, slope));
        all.extend(terms(equation, first, printed, 0, false));
        sum_rows.push(EquationLine {
            approximate: true,
            ..row(LeftSide::Output(0), sum(all))
        });
    } else {
        for (index, nominal) in printed.nominal.iter().enumerate() {
            let mut all = Vec::new();
            if *nominal != Tree::Number(0.0) {
                all.push((false, nominal.clone()));
            }
            all.extend(terms(equation, first, printed, index, false));
            sum_rows.push(EquationLine {
                approximate: true,
                ..row(LeftSide::Output(index), sum(all))
            });
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
    let sections = vec![
        Section {
            heading: format!("{}, {}", quantity_heading(equation), order_words(Order::First)),
            rows: sum_rows,
        },
        Section {
            heading: "coefficients by parameter".to_string(),
            rows: table,
        },
    ];
    (program, sections)
}

/// `a/b`, or `(1/b)·a` if the numerator is too long for one line.
fn over(numerator: Tree, denominator: Tree) -> Tree {
    if terms_of(&numerator).len() > 4 || numerator.leaves() > 20 {
        product(vec![
            binary(Binary::Div, Tree::Number(1.0), denominator),
            numerator,
        ])
    } else {
        match without_minus(&numerator) {
            (true, numerator) => {
                Tree::Unary(Unary::Neg, Box::new(binary(Binary::Div, numerator, denominator)))
            }
            (false, numerator) => binary(Binary::Div, numerator, denominator),
        }
    }
}

fn order_words(order: Order) -> &'static str {
    match order {
        Order::Exact => "exact",
        Order::Bilinear => "up to products of two errors",
        Order::First => "first order",
    }
}

/// `Σ cᵢ·(eᵢ + Σ fₖ·eₖ)` over the linearly independent columns, with their constant multiples in the parentheses.
fn terms(
    equation: &Equation,
    first: &FirstOrder,
    printed: &PrintedFirstOrder,
    coordinate: usize,
    over_length: bool,
) -> Vec<(bool, Tree)> {
    let inputs = equation.inputs();
    let input = |parameter: &Variable| {
        let requested = Input::Plain(parameter.clone());
        inputs
            .iter()
            .position(|input| *input == requested)
            .map(Tree::Input)
    };
    let mut terms = Vec::new();
    for (index, sensitivity) in first.sensitivities.iter().enumerate() {
        let coefficient = &printed.coefficients[index][coordinate];
        // A multiple stays a separate term if only one of the two columns is divided by L₀, or if its factor is a fraction, which is not
        // shorter.
        let is_separate = match &sensitivity.column {
            Column::Distinct => true,
            Column::Zero => false,
            Column::Multiple { of, .. } => {
                let mut bases = first.sensitivities.iter();
                is_fraction(&printed.factors[index])
                    || bases.any(|base| base.parameter == *of && base.over_length != sensitivity.over_length)
            }
        };
        let shown =
            is_separate && sensitivity.over_length == over_length && *coefficient != Tree::Number(0.0);
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
            let (minus, scale) = without_minus(numerator);
            let term = if scale == Tree::Number(1.0) {
                error
            } else {
                product(vec![scale, error])
            };
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

/// The terms of a sum with their signs; true means minus.
pub(crate) fn terms_of(tree: &Tree) -> Vec<(bool, Tree)> {
    fn flatten(tree: &Tree, minus: bool, terms: &mut Vec<(bool, Tree)>) {
        match tree {
            Tree::Binary(op @ (Binary::Add | Binary::Sub), a, b) => {
                flatten(a, minus, terms);
                flatten(b, minus != (*op == Binary::Sub), terms);
            }
            Tree::Unary(Unary::Neg, a) => flatten(a, !minus, terms),
            Tree::Number(value) if *value < 0.0 => terms.push((!minus, Tree::Number(-value))),
            other => terms.push((minus, other.clone())),
        }
    }
    let mut terms = Vec::new();
    flatten(tree, false, &mut terms);
    terms
}
