//! Evaluation of expressions over numbers: `f64`, dual numbers, a counting scalar, or other symbols.

use abbe_model::Diagnostic;
use abbe_model::scalar::{Nominal, Scalar};

use crate::symbol::{Arena, Binary, Node, Operand, Unary};
use crate::variable::Variable;

/// The value of a variable: nominal, or an error by which derivatives are taken.
#[derive(Clone, Copy, Debug)]
pub enum VariableValue<S: Scalar> {
    /// Never differentiated.
    Nominal(S::Nominal),
    /// An error.
    Error(S),
}

impl<S: Scalar> VariableValue<S> {
    /// The value as a scalar, nominal or not.
    pub fn scalar(self) -> S {
        match self {
            VariableValue::Nominal(value) => S::nominal(value),
            VariableValue::Error(value) => value,
        }
    }

    fn unary(self, op: Unary) -> Option<Self> {
        Some(match self {
            VariableValue::Nominal(a) => VariableValue::Nominal(op.of(a)),
            VariableValue::Error(a) => VariableValue::Error(match op {
                Unary::Neg => -a,
                Unary::Sin => Scalar::sin_cos(a).0,
                Unary::Cos => Scalar::sin_cos(a).1,
                Unary::Sqrt => Scalar::sqrt(a),
                Unary::Exp | Unary::Signum | Unary::Step | Unary::Floor | Unary::Round => return None,
            }),
        })
    }

    fn binary(self, op: Binary, other: Self) -> Self {
        match (self, other) {
            (VariableValue::Nominal(a), VariableValue::Nominal(b)) => VariableValue::Nominal(op.of(a, b)),
            (a, b) => {
                let (a, b) = (a.scalar(), b.scalar());
                VariableValue::Error(match op {
                    Binary::Add => a + b,
                    Binary::Sub => a - b,
                    Binary::Mul => a * b,
                    Binary::Div => a / b,
                })
            }
        }
    }
}

/// Evaluates `outputs`; every node is computed once.
///
/// # Errors
/// If the expression takes an exponential, a sign, a step or a rounding of an error. The chain contains no such
/// expression.
pub fn evaluate<S: Scalar>(
    arena: &Arena,
    outputs: &[Operand],
    variable: impl Fn(&Variable) -> VariableValue<S>,
) -> Result<Vec<S>, Diagnostic> {
    let mut values: Vec<Option<VariableValue<S>>> = vec![None; arena.node_count()];
    let constant = |value: f64| VariableValue::<S>::Nominal(S::Nominal::constant(value));
    let normal_form_of = |values: &[Option<VariableValue<S>>], operand: Operand| match operand {
        Operand::Constant(value) => constant(value.value()),
        Operand::Node(id) => values[id.index()].unwrap_or_else(|| constant(f64::NAN)),
    };
    for id in arena.reachable(outputs) {
        let value = match arena.node(id) {
            Node::Variable(index) => variable(&arena.variable_at(index)),
            Node::Unary(op, a) => normal_form_of(&values, a).unary(op).ok_or_else(|| {
                Diagnostic::equation(format!(
                    "the function {op:?} is applied to an error; only nominal quantities are allowed"
                ))
            })?,
            Node::Binary(op, a, b) => normal_form_of(&values, a).binary(op, normal_form_of(&values, b)),
        };
        values[id.index()] = Some(value);
    }
    Ok(outputs.iter().map(|output| normal_form_of(&values, *output).scalar()).collect())
}

/// Evaluates `outputs` over plain numbers.
///
/// # Errors
/// None for plain numbers.
pub fn evaluate_f64(
    arena: &Arena,
    outputs: &[Operand],
    variable: impl Fn(&Variable) -> f64,
) -> Result<Vec<f64>, Diagnostic> {
    evaluate(arena, outputs, |v| VariableValue::Nominal(variable(v)))
}
