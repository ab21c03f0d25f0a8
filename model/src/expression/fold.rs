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

#[cfg(test)]
mod tests {
    use super::*;

    fn text(arena: &Arena<char>, operand: Operand) -> String {
        let own = |operand: Operand| text(arena, operand);
        match arena.node_of(operand) {
            None => format!("{}", operand.known().unwrap()),
            Some(Node::Variable(id)) => arena.variable_at(id).to_string(),
            Some(Node::Unary(op, a)) => format!("{op:?}({})", own(a)),
            Some(Node::Binary(op, a, b)) => {
                let sign = ['+', '-', '*', '/'][[Binary::Add, Binary::Sub, Binary::Mul, Binary::Div]
                    .iter()
                    .position(|known| *known == op)
                    .unwrap()];
                format!("({}{sign}{})", own(a), own(b))
            }
        }
    }

    /// An expression in reverse Polish notation: letters, digits, `n`egation, `s`ine, `c`osine, `g` the sign, four operations,
    /// and `h` for one half.
    fn built(arena: &Arena<char>, words: &str) -> Operand {
        let mut stack = Vec::new();
        for word in words.chars() {
            let operand = match word {
                'x' | 'y' => arena.intern_variable(word),
                'h' => Operand::constant(0.5),
                digit if digit.is_ascii_digit() => Operand::constant(f64::from(digit.to_digit(10).unwrap())),
                'n' | 's' | 'c' | 'g' => {
                    let a = stack.pop().unwrap();
                    let ops = [('n', Unary::Neg), ('s', Unary::Sin), ('c', Unary::Cos), ('g', Unary::Signum)];
                    unary(arena, ops.into_iter().find(|(own, _)| *own == word).unwrap().1, a)
                }
                sign => {
                    let (b, a) = (stack.pop().unwrap(), stack.pop().unwrap());
                    let ops = [('+', Binary::Add), ('-', Binary::Sub), ('*', Binary::Mul), ('/', Binary::Div)];
                    binary(arena, ops.into_iter().find(|(own, _)| *own == sign).unwrap().1, a, b)
                }
            };
            stack.push(operand);
        }
        stack.pop().unwrap()
    }

    /// The value of an expression without any simplification.
    fn plain(words: &str, x: f64, y: f64) -> f64 {
        let mut stack: Vec<f64> = Vec::new();
        for word in words.chars() {
            let mut pop = || stack.pop().unwrap();
            let value: f64 = match word {
                'x' => x,
                'y' => y,
                'h' => 0.5,
                digit if digit.is_ascii_digit() => f64::from(digit.to_digit(10).unwrap()),
                'n' => -pop(),
                's' => pop().sin(),
                'c' => pop().cos(),
                'g' => pop().signum(),
                sign => {
                    let (b, a) = (pop(), pop());
                    match sign {
                        '+' => a + b,
                        '-' => a - b,
                        '*' => a * b,
                        _ => a / b,
                    }
                }
            };
            stack.push(value);
        }
        stack.pop().unwrap()
    }

    fn value(arena: &Arena<char>, operand: Operand, x: f64, y: f64) -> f64 {
        match arena.node_of(operand) {
            None => operand.known().unwrap(),
            Some(Node::Variable(id)) => {
                if arena.variable_at(id) == 'x' {
                    x
                } else {
                    y
                }
            }
            Some(Node::Unary(op, a)) => op.of(value(arena, a, x, y)),
            Some(Node::Binary(op, a, b)) => op.of(value(arena, a, x, y), value(arena, b, x, y)),
        }
    }

    /// Each rule of the simplification, with its neighbour to which it does not apply.
    #[test]
    fn what_is_simplified_keeps_its_bits() {
        for (words, wanted) in [
            ("23+", "5"),
            ("xnn", "x"),
            ("x3*n", "(-3*x)"),
            ("xns", "Neg(Sin(x))"),
            ("xng", "Neg(Signum(x))"),
            ("xnc", "Cos(x)"),
            ("x0+", "x"),
            ("0x+", "x"),
            ("xy+", "(x+y)"),
            ("xyn+", "(x-y)"),
            ("xny+", "(y-x)"),
            ("xnyn+", "Neg((x+y))"),
            ("x0-", "x"),
            ("0x-", "Neg(x)"),
            ("xx-", "0"),
            ("xyn-", "(x+y)"),
            ("xny-", "Neg((x+y))"),
            ("x0*", "0"),
            ("x1*", "x"),
            ("1x*", "x"),
            ("x1n*", "Neg(x)"),
            ("xny*", "Neg((x*y))"),
            ("xyn*", "Neg((x*y))"),
            ("x3*2*", "(6*x)"),
            ("x3*3*", "(3*(3*x))"),
            ("3x/2*", "(6/x)"),
            ("yx3/*2*", "(2*(y*(x/3)))"),
            ("y3x/*2*", "(y*(6/x))"),
            ("y3x/*3*", "(3*(y*(3/x)))"),
            ("0x/", "0"),
            ("x2/", "(0.5*x)"),
            ("x3/", "(x/3)"),
            ("xx/", "1"),
            ("xny/", "Neg((x/y))"),
            ("xyn/", "Neg((x/y))"),
            ("xh/", "(2*x)"),
            ("xy3n*+", "(x-(3*y))"),
            ("x3n+", "(x-3)"),
        ] {
            let arena = Arena::new();
            let found = built(&arena, words);
            assert_eq!(text(&arena, found), wanted, "{words}");
            for (x, y) in [(0.7, -1.3), (1e3, 0.1), (-2.0 / 3.0, 1.0 / 7.0)] {
                let (found, wanted) = (value(&arena, found, x, y), plain(words, x, y));
                assert!(found == wanted, "{words} at {x}, {y}: {found} instead of {wanted}");
            }
        }
    }
}
