//! Simplification of expressions while they are built, limited to changes that do not alter the floating-point result.
//!
//! Constants are computed; 0, 1 and −1 are eliminated; a minus sign moves outwards until it becomes part of a
//! difference. Signs and powers of two move without rounding. A folded expression therefore evaluates to the same bits
//! as the unfolded one, except for the sign of zero.

use super::{Arena, Binary, Node, Operand, Unary};

/// A function of an operand.
pub(crate) fn unary<V: Clone + PartialEq>(arena: &Arena<V>, op: Unary, a: Operand) -> Operand {
    if let Some(value) = a.known() {
        return Operand::constant(op.of(value));
    }
    let node = arena.node_of(a);
    match (op, node) {
        (Unary::Neg, Some(Node::Unary(Unary::Neg, x))) => x,
        (Unary::Neg, Some(Node::Binary(Binary::Mul, x, y))) if x.known().is_some() => {
            binary(arena, Binary::Mul, unary(arena, Unary::Neg, x), y)
        }
        (Unary::Sin | Unary::Signum, Some(Node::Unary(Unary::Neg, x))) => unary(arena, Unary::Neg, unary(arena, op, x)),
        (Unary::Cos, Some(Node::Unary(Unary::Neg, x))) => unary(arena, Unary::Cos, x),
        _ => arena.intern(Node::Unary(op, a)),
    }
}

/// An operation on two operands.
pub(crate) fn binary<V: Clone + PartialEq>(arena: &Arena<V>, op: Binary, a: Operand, b: Operand) -> Operand {
    if let (Some(a), Some(b)) = (a.known(), b.known()) {
        return Operand::constant(op.of(a, b));
    }
    match op {
        Binary::Add => add(arena, a, b),
        Binary::Sub => sub(arena, a, b),
        Binary::Mul => mul(arena, a, b),
        Binary::Div => div(arena, a, b),
    }
}

fn add<V: Clone + PartialEq>(arena: &Arena<V>, a: Operand, b: Operand) -> Operand {
    if a.known() == Some(0.0) {
        return b;
    }
    if b.known() == Some(0.0) {
        return a;
    }
    if let Some(b) = without_minus(arena, b) {
        return sub(arena, a, b);
    }
    if let Some(a) = without_minus(arena, a) {
        return sub(arena, b, a);
    }
    arena.intern(Node::Binary(Binary::Add, a, b))
}

fn sub<V: Clone + PartialEq>(arena: &Arena<V>, a: Operand, b: Operand) -> Operand {
    if b.known() == Some(0.0) {
        return a;
    }
    if a == b {
        return Operand::constant(0.0);
    }
    if a.known() == Some(0.0) {
        return unary(arena, Unary::Neg, b);
    }
    if let Some(b) = without_minus(arena, b) {
        return binary(arena, Binary::Add, a, b);
    }
    if let Some(a) = without_minus(arena, a) {
        let sum = binary(arena, Binary::Add, a, b);
        return unary(arena, Unary::Neg, sum);
    }
    arena.intern(Node::Binary(Binary::Sub, a, b))
}

fn mul<V: Clone + PartialEq>(arena: &Arena<V>, a: Operand, b: Operand) -> Operand {
    let (a, b) = if b.known().is_some() { (b, a) } else { (a, b) };
    match a.known() {
        Some(0.0) => return Operand::constant(0.0),
        Some(1.0) => return b,
        Some(-1.0) => return unary(arena, Unary::Neg, b),
        Some(outer) => {
            // c₁·(c₂·x) and c₁·(c₂/x), if the product of the constants is exact.
            if let Some(Node::Binary(op @ (Binary::Mul | Binary::Div), inner, x)) = arena.node_of(b)
                && let Some(inner) = inner.known()
                && (is_power_of_two(outer) || is_power_of_two(inner))
            {
                return binary(arena, op, Operand::constant(outer * inner), x);
            }
            // c₁·(x·(c₂/y)), which results from the square root of a sum of squares.
            if let Some(Node::Binary(Binary::Mul, x, y)) = arena.node_of(b)
                && let Some(Node::Binary(Binary::Div, inner, _)) = arena.node_of(y)
                && inner.known().is_some()
                && x.known().is_none()
                && is_power_of_two(outer)
            {
                let y = binary(arena, Binary::Mul, a, y);
                return binary(arena, Binary::Mul, x, y);
            }
        }
        None => {}
    }
    if a.known().is_none()
        && let Some(a) = without_minus(arena, a)
    {
        let product = binary(arena, Binary::Mul, a, b);
        return unary(arena, Unary::Neg, product);
    }
    if let Some(b) = without_minus(arena, b) {
        let product = binary(arena, Binary::Mul, a, b);
        return unary(arena, Unary::Neg, product);
    }
    arena.intern(Node::Binary(Binary::Mul, a, b))
}

fn div<V: Clone + PartialEq>(arena: &Arena<V>, a: Operand, b: Operand) -> Operand {
    if a.known() == Some(0.0) {
        return a;
    }
    if let Some(b) = b.known()
        && is_power_of_two(b)
    {
        return binary(arena, Binary::Mul, Operand::constant(1.0 / b), a);
    }
    if a == b {
        return Operand::constant(1.0);
    }
    if let Some(a) = without_minus(arena, a) {
        let quotient = binary(arena, Binary::Div, a, b);
        return unary(arena, Unary::Neg, quotient);
    }
    if let Some(b) = without_minus(arena, b) {
        let quotient = binary(arena, Binary::Div, a, b);
        return unary(arena, Unary::Neg, quotient);
    }
    arena.intern(Node::Binary(Binary::Div, a, b))
}

/// `x` if the operand is explicitly `−x`: a negation, a negative constant, a product with one.
fn without_minus<V: Clone + PartialEq>(arena: &Arena<V>, operand: Operand) -> Option<Operand> {
    if let Some(value) = operand.known() {
        return (value < 0.0).then(|| Operand::constant(-value));
    }
    match arena.node_of(operand)? {
        Node::Unary(Unary::Neg, x) => Some(x),
        Node::Binary(Binary::Mul, c, x) => {
            let c = c.known().filter(|c| *c < 0.0)?;
            Some(binary(arena, Binary::Mul, Operand::constant(-c), x))
        }
        _ => None,
    }
}

/// Whether a product with `value` changes only the exponent (±2ⁿ, within the normal range).
fn is_power_of_two(value: f64) -> bool {
    let fraction = value.to_bits() & ((1 << 52) - 1);
    value.is_normal() && fraction == 0
}
