//! Symbols with names: what the model's [expressions](abbe_model::expression) stand for when they are printed.

pub use abbe_model::expression::{
    Adjoints, Binary, Constant, Node, NodeId, Operand, Unary, VariableId, operands,
};

use crate::variable::Variable;

/// Where named symbols live.
pub type Arena = abbe_model::expression::Arena<Variable>;
/// A named symbol, or an expression of some.
pub type Symbol<'arena> = abbe_model::expression::Symbol<'arena, Variable>;

/// The symbol of a named length in mm.
pub fn length<'arena>(arena: &'arena Arena, name: &str) -> Symbol<'arena> {
    arena.variable(Variable::Length(name.to_string()))
}
