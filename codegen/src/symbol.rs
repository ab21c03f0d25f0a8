//! Named symbols: the model's [expressions](abbe_model::expression) over printable variables.

pub use abbe_model::expression::{Adjoints, Binary, Constant, Node, NodeId, Operand, Unary, VariableId, operands};

use crate::variable::Variable;

/// The arena of named symbols.
///
/// ```
/// use abbe_codegen::evaluate::evaluate_f64;
/// use abbe_codegen::symbol::length;
/// use abbe_codegen::{Arena, Variable};
///
/// let arena = Arena::new();
/// let [a, b] = ["a", "b"].map(|name| length(&arena, name));
/// let hypotenuse = (a * a + b * b).sqrt().operand();
/// let at = |variable: &Variable| if *variable == Variable::Length("a".into()) { 3.0 } else { 4.0 };
/// assert_eq!(evaluate_f64(&arena, &[hypotenuse], at)?, [5.0]);
/// // The same expression is the same node.
/// assert_eq!(hypotenuse, (a * a + b * b).sqrt().operand());
/// # Ok::<(), abbe_model::Diagnostic>(())
/// ```
pub type Arena = abbe_model::expression::Arena<Variable>;
/// A named symbol, or an expression of named symbols.
pub type Symbol<'arena> = abbe_model::expression::Symbol<'arena, Variable>;

/// The symbol of a named length in mm.
pub fn length<'arena>(arena: &'arena Arena, name: &str) -> Symbol<'arena> {
    arena.variable(Variable::Length(name.to_string()))
}
