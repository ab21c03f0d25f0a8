//! The symbolic scalar: hash-consed and `Copy`; expressions are owned by an arena of the caller.
//!
//! A [`Symbol`] takes the place of a number in the chain. The calculation is recorded as a graph in an [`Arena`]. Equal
//! expressions are one node, so a common subexpression is found when it is built. A symbol contains constants directly,
//! and 0, 1 and −1 are eliminated. The caller defines the meaning of a variable: a printed name (`abbe-codegen`), or a
//! column of numbers ([`crate::sensitivity`]).

mod arena;
mod derivative;
mod fold;
mod node;
mod symbol;

pub use arena::Arena;
pub use derivative::Adjoints;
pub use node::{Binary, Constant, Node, NodeId, Operand, Unary, VariableId, operands};
pub use symbol::Symbol;
