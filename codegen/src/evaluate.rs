//! Evaluation of expressions over numbers: `f64`, dual numbers, a counting scalar, or other symbols.

use abbe_model::scalar::{Nominal, Scalar};

use crate::error::CodegenError;
use crate::symbol::{Arena, Binary, Node, Operand, Unary};
use crate::variable::Variable;

/// The value of a variable: nominal, or an error by which derivatives are taken.
#[derive(Clone, Copy, Debug)]
pub enum Value<S: Scalar> {
    /// Never differentiated.
    Nominal(S::Nominal),
    /// An error.
    Error(S),
}

impl<S: Scalar> Value<S> {
    /// The value as a scalar, nominal or not.
    pub fn scalar(self) -> S {
        match self {
            Value::Nominal(value) => S::nominal(value),
            Value::Error(value) => value,
        }
    }

    fn unary(self, op: Unary) -> Option<Self> {
        Some(match self {
            Value::Nominal(a) => Value::Nominal(op.of(a)),
            Value::Error(a) => Value::Error(match op {
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
            (Value::Nominal(a), Value::Nominal(b)) => Value::Nominal(op.of(a, b)),
            (a, b) => {
                let (a, b) = (a.scalar(), b.scalar());
                Value::Error(match op {
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
/// If the expression takes an exponential, a sign, a step or a rounding of an error; the chain never does.
pub fn evaluate<S: Scalar>(
    arena: &Arena,
    outputs: &[Operand],
    variable: impl Fn(&Variable) -> Value<S>,
) -> Result<Vec<S>, CodegenError> {
    let mut values: Vec<Option<Value<S>>> = vec![None; arena.node_count()];
    let constant = |value: f64| Value::<S>::Nominal(S::Nominal::constant(value));
    let normal_form_of = |values: &[Option<Value<S>>], operand: Operand| match operand {
        Operand::Constant(value) => constant(value.value()),
        Operand::Node(id) => values[id.index()].unwrap_or_else(|| constant(f64::NAN)),
    };
    for id in arena.reachable(outputs) {
        let value = match arena.node(id) {
            Node::Variable(place) => variable(&arena.variable_at(place)),
            Node::Unary(op, a) => normal_form_of(&values, a)
                .unary(op)
                .ok_or(CodegenError::FunctionOfError { function: op })?,
            Node::Binary(op, a, b) => normal_form_of(&values, a).binary(op, normal_form_of(&values, b)),
        };
        values[id.index()] = Some(value);
    }
    Ok(outputs
        .iter()
        .map(|output| normal_form_of(&values, *output).scalar())
        .collect())
}

/// Evaluates `outputs` over plain numbers.
///
/// # Errors
/// None for plain numbers.
pub fn evaluate_f64(
    arena: &Arena,
    outputs: &[Operand],
    variable: impl Fn(&Variable) -> f64,
) -> Result<Vec<f64>, CodegenError> {
    evaluate(arena, outputs, |v| Value::Nominal(variable(v)))
}
