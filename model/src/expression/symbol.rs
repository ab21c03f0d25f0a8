//! The symbol: a number whose calculation is recorded.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::arena::Arena;
use super::fold;
use super::node::{Binary, NodeId, Operand, Unary};
use crate::scalar::{Nominal, Scalar};

/// A symbolic number: an expression in an [`Arena`], or a constant.
pub struct Symbol<'arena, V>(Repr<'arena, V>);

enum Repr<'arena, V> {
    Constant(f64),
    Node(&'arena Arena<V>, NodeId),
}

impl<V: Clone + PartialEq> Arena<V> {
    /// The symbol of a variable; the same variable is always the same symbol.
    pub fn variable(&self, variable: V) -> Symbol<'_, V> {
        self.symbol(self.intern_variable(variable))
    }

    /// The symbol of an operand of this arena.
    pub fn symbol(&self, operand: Operand) -> Symbol<'_, V> {
        Symbol(match operand {
            Operand::Constant(constant) => Repr::Constant(constant.value()),
            Operand::Node(id) => Repr::Node(self, id),
        })
    }
}

impl<V> Clone for Symbol<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V> Copy for Symbol<'_, V> {}

impl<V> Clone for Repr<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V> Copy for Repr<'_, V> {}

impl<'arena, V: Clone + PartialEq> Symbol<'arena, V> {
    /// The operand, which is independent of the borrow of the arena.
    pub fn operand(self) -> Operand {
        match self.0 {
            Repr::Constant(value) => Operand::constant(value),
            Repr::Node(_, id) => Operand::Node(id),
        }
    }

    fn arena(self) -> Option<&'arena Arena<V>> {
        match self.0 {
            Repr::Constant(_) => None,
            Repr::Node(arena, _) => Some(arena),
        }
    }

    fn unary(self, op: Unary) -> Self {
        match self.0 {
            Repr::Constant(value) => Symbol(Repr::Constant(op.of(value))),
            Repr::Node(arena, id) => arena.symbol(fold::unary(arena, op, Operand::Node(id))),
        }
    }

    fn binary(self, op: Binary, other: Self) -> Self {
        match self.arena().or(other.arena()) {
            Some(arena) => arena.symbol(fold::binary(arena, op, self.operand(), other.operand())),
            None => match (self.0, other.0) {
                (Repr::Constant(a), Repr::Constant(b)) => Symbol(Repr::Constant(op.of(a, b))),
                _ => self,
            },
        }
    }

    /// Sine and cosine.
    pub fn sin_cos(self) -> (Self, Self) {
        (self.unary(Unary::Sin), self.unary(Unary::Cos))
    }

    /// The non-negative square root.
    pub fn sqrt(self) -> Self {
        self.unary(Unary::Sqrt)
    }
}

impl<V> PartialEq for Symbol<'_, V> {
    /// Equality of constants or of nodes of the same arena. Algebraic equality is decided by the normal form of
    /// `abbe-codegen`.
    fn eq(&self, other: &Self) -> bool {
        match (self.0, other.0) {
            (Repr::Constant(a), Repr::Constant(b)) => a == b,
            (Repr::Node(arena, a), Repr::Node(other, b)) => std::ptr::eq(arena, other) && a == b,
            _ => false,
        }
    }
}

impl<V> std::fmt::Debug for Symbol<'_, V> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Repr::Constant(value) => write!(formatter, "{value}"),
            Repr::Node(_, id) => write!(formatter, "node {}", id.0),
        }
    }
}

impl<V: Clone + PartialEq> Add for Symbol<'_, V> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.binary(Binary::Add, other)
    }
}

impl<V: Clone + PartialEq> Sub for Symbol<'_, V> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.binary(Binary::Sub, other)
    }
}

impl<V: Clone + PartialEq> Mul for Symbol<'_, V> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.binary(Binary::Mul, other)
    }
}

impl<V: Clone + PartialEq> Div for Symbol<'_, V> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        self.binary(Binary::Div, other)
    }
}

impl<V: Clone + PartialEq> Neg for Symbol<'_, V> {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary(Unary::Neg)
    }
}

impl<V: Clone + PartialEq> Nominal for Symbol<'_, V> {
    fn constant(value: f64) -> Self {
        Symbol(Repr::Constant(value))
    }
    fn sin_cos(self) -> (Self, Self) {
        Symbol::sin_cos(self)
    }
    fn sqrt(self) -> Self {
        Symbol::sqrt(self)
    }
    fn exp(self) -> Self {
        self.unary(Unary::Exp)
    }
    fn signum(self) -> Self {
        self.unary(Unary::Signum)
    }
    fn step(self) -> Self {
        self.unary(Unary::Step)
    }
    fn floor(self) -> Self {
        self.unary(Unary::Floor)
    }
    fn round(self) -> Self {
        self.unary(Unary::Round)
    }
    fn known(self) -> Option<f64> {
        self.operand().known()
    }
}

impl<V: Clone + PartialEq> Scalar for Symbol<'_, V> {
    type Nominal = Self;
    fn nominal(value: Self) -> Self {
        value
    }
    fn sin_cos(self) -> (Self, Self) {
        Symbol::sin_cos(self)
    }
    fn sqrt(self) -> Self {
        Symbol::sqrt(self)
    }
}
