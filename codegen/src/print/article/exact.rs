//! Exact form for readers: the named vectors, the outputs in terms of them and, if requested, the derivatives of a
//! length:
//!
//! ```text
//! u = b/L, transformed back through the chain frame by frame
//! ∂L/∂e = a product with the vectors of the frame that e is an error of
//! ```

use crate::equation::Equation;
use crate::form::Kind;
use crate::print::article::groups::{norm_of_steps, with_bar_parameters};
use crate::print::article::line::{EquationLine, LeftSide, Section, quantity_heading, row, section};
use crate::program::{Label, Naming, Program, Step};
use crate::symbol::{Binary, Operand, Symbol};
use crate::touch::{self, ProbeTerms};
use crate::tree::{Tree, binary};
use crate::vectors::{self, NamedVector};

/// The program and the sections: the intermediate vectors of the outputs, and the adjoint vectors.
pub(crate) fn sections(equation: &Equation) -> (Program, Vec<Section>) {
    let forward = &equation.vectors;
    let mut labels = vectors::labels(forward);
    labels.extend(equation.driven_labels());
    labels.extend(equation.touch.iter().flat_map(ProbeTerms::labels));
    let mut adjoint: Vec<NamedVector> = Vec::new();
    let mut slopes: Vec<Operand> = Vec::new();
    if let (Kind::Length, true, Some(Operand::Node(distance))) =
        (equation.kind, equation.options.gradient, distance(equation))
    {
        let name = if Operand::Node(distance) == equation.outputs[0] { "L" } else { "d" };
        labels.insert(distance, Label::Scalar(name));
        let parameters = equation.parameter_operands();
        let adjoints = equation.arena.adjoints(equation.outputs[0], &parameters);
        let unit = adjoints.of(Operand::Node(distance)) == Operand::constant(1.0);
        for mut vector in vectors::adjoint_vectors(forward, &adjoints) {
            if vector.frame.is_empty() && !unit {
                vector.meaning =
                    "derivatives by the bar vector: its unit vector times the gain of the sensor".to_string();
            }
            // A pure translation leaves the adjoint vector and its name unchanged.
            let new = |component: &Operand| matches!(component, Operand::Node(id) if !labels.contains_key(id));
            if vector.components.iter().any(new) {
                for (node, label) in vectors::labels(std::slice::from_ref(&vector)) {
                    labels.entry(node).or_insert(label);
                }
                adjoint.push(vector);
            }
        }
        slopes = parameters.iter().map(|parameter| adjoints.of(*parameter)).collect();
    }
    let mut requested: Vec<Operand> = equation.outputs.clone();
    requested.extend(forward.iter().chain(&adjoint).flat_map(|vector| vector.components));
    requested.extend(&slopes);
    requested.extend(equation.driven_errors.iter().map(|(_, value)| *value));
    let mut program = Program::of(&equation.arena, equation.inputs(), &requested, &labels, Naming::Labelled);
    let (outputs, rest) = program.outputs.split_at(equation.outputs.len());
    let (rest, driven_errors) = rest.split_at(rest.len() - equation.driven_errors.len());
    let (vectors, slopes) = rest.split_at(rest.len() - slopes.len());
    let driven_errors = equation.driven_errors.iter().zip(driven_errors);
    let driven_errors = driven_errors.map(|((variable, _), tree)| {
        let label = Label::Quantity(variable.clone());
        row(LeftSide::Named(label.clone()), value_of(&program, &label, tree))
    });
    let driven_errors: Vec<EquationLine> = driven_errors.collect();
    let mut vectors = forward.iter().chain(&adjoint).zip(vectors.chunks(3)).map(|(vector, trees)| {
        let rows = (0..3).map(|coordinate| component(&program, vector, trees, coordinate));
        section(&vector.meaning, rows)
    });
    let mut sections: Vec<Section> = vectors.by_ref().take(forward.len()).collect();
    if !driven_errors.is_empty() {
        sections.insert(0, section("errors as functions of drivers", driven_errors));
    }
    let outputs = outputs.iter().enumerate();
    let rows = outputs.map(|(index, tree)| row(LeftSide::Output(index), tree.clone()));
    let mut read = section(quantity_heading(equation), rows);
    if equation.kind == Kind::Distance {
        let between = touch::QUADRATIC.into_iter().chain([touch::STEP_LENGTH]);
        let between = between.filter_map(|label| {
            let own = program.steps.iter().find(|step| step.label == label)?;
            Some(row(LeftSide::Named(label), own.value.clone()))
        });
        read.rows.splice(0..0, between.collect::<Vec<EquationLine>>());
    }
    let adjoint: Vec<Section> = vectors.collect();
    let slopes = equation.parameters.iter().zip(slopes);
    let slopes: Vec<EquationLine> =
        slopes.map(|(parameter, tree)| row(LeftSide::Slope(0, parameter.clone()), tree.clone())).collect();
    if let (Kind::Length, Some(bar)) = (equation.kind, forward.last()) {
        // The norm of the bar in terms of its own coordinates, even if some of them are aliases.
        let start = program.steps.len();
        let aliases = (0..3).map(|coordinate| Step { label: bar.label(coordinate), value: Tree::Number(0.0) });
        program.steps.extend(aliases);
        let zero = bar.components.map(|component| component == Operand::constant(0.0));
        let norm = norm_of_steps(start, zero);
        let named = program.steps.iter().position(|step| step.label == Label::Scalar("d"));
        read.rows = match named {
            Some(index) => vec![
                row(LeftSide::Named(Label::Scalar("d")), norm),
                row(LeftSide::Output(0), with_bar_parameters(equation, &program, Tree::Step(index))),
            ],
            None => vec![row(LeftSide::Output(0), with_bar_parameters(equation, &program, norm))],
        };
    }
    sections.push(read);
    sections.extend(adjoint);
    if !slopes.is_empty() {
        sections.push(section("derivatives", slopes));
    }
    (program, sections)
}

/// A coordinate of a named vector. An input, a constant or another name is written as such.
fn component(program: &Program, vector: &NamedVector, trees: &[Tree], coordinate: usize) -> EquationLine {
    let label = vector.label(coordinate);
    let right = value_of(program, &label, &trees[coordinate]);
    row(LeftSide::Named(label), as_quotient(right))
}

/// The expression of a name: that of its own step or, without one, the given expression.
fn value_of(program: &Program, label: &Label, own_expression: &Tree) -> Tree {
    let own = program.steps.iter().find(|step| step.label == *label);
    own.map_or_else(|| own_expression.clone(), |step| step.value.clone())
}

/// `x/y` for `(1/y)·x`; code uses the second form to share the reciprocal.
fn as_quotient(tree: Tree) -> Tree {
    let over = |x: &Tree, y: &Tree| binary(Binary::Div, x.clone(), y.clone());
    let one_over = |tree: &Tree| match tree {
        Tree::Binary(Binary::Div, one, y) if **one == Tree::Number(1.0) => Some((**y).clone()),
        _ => None,
    };
    let Tree::Binary(Binary::Mul, a, b) = &tree else {
        return tree;
    };
    match (one_over(a), one_over(b), &**a) {
        (Some(y), _, _) => over(b, &y),
        (None, Some(y), _) => over(a, &y),
        // (a·(1/y))·x
        (None, None, Tree::Binary(Binary::Mul, factor, a)) => match one_over(a) {
            Some(y) => over(&Tree::Binary(Binary::Mul, factor.clone(), b.clone()), &y),
            None => tree,
        },
        (None, None, _) => tree,
    }
}

/// The distance between the balls, before the parameters of the bar are applied.
fn distance(equation: &Equation) -> Option<Operand> {
    let bar = equation.vectors.last()?;
    let [x, y, z] = bar.components.map(|component| equation.arena.symbol(component));
    Some(Symbol::sqrt(x * x + y * y + z * z).operand())
}
