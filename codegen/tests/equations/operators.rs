//! Every operator with compound operands on either side, as the nominal coordinates of a ball: tests the parentheses of
//! the printed code.

use abbe_codegen::{Source, Subject};
use abbe_model::instrument::{Station, Target, socket::Socket};
use abbe_model::scalar::Nominal;

/// Operands: sums, differences, products, quotients, negations, functions.
const OPERANDS: usize = 13;
/// Operators between two operands.
const OPERATORS: usize = 4;
/// Number of expressions per coordinate.
const TERMS: usize = 12;

/// All pairs of operands under all operators.
pub const EXPRESSIONS: usize = OPERANDS * OPERANDS * OPERATORS;

fn operand<N: Nominal>(kind: usize, a: N, b: N) -> N {
    let hundred = N::constant(100.0);
    match kind {
        0 => a + b,
        1 => a - b,
        2 => a * b,
        3 => a / b,
        4 => -a,
        5 => -(a - b),
        6 => (a * a + b * b).sqrt(),
        7 => (a / hundred).sin_cos().0 * (b - a).sin_cos().1,
        8 => -((a - b) / hundred).exp(),
        9 => (a - b).signum() * b,
        10 => (a - b).step() * a + b,
        11 => (a / b).floor() - b,
        _ => (a - b / hundred).round(),
    }
}

fn expression<N: Nominal>(number: usize, [a, b, c, d]: [N; 4]) -> N {
    // Each expression has its own operands: a shared operand would get a name and be a single token.
    let own = |x: N, step: f64| x + N::constant(step * (number + 1) as f64);
    let left = operand(number % OPERANDS, own(a, 0.01), own(b, 0.02));
    let right = operand(number / OPERANDS % OPERANDS, own(c, 0.03), own(d, 0.04));
    match number / OPERANDS / OPERANDS {
        0 => left + right,
        1 => left - right,
        2 => left * right,
        _ => left / right,
    }
}

/// One batch of expressions: three coordinates with this many terms each.
#[derive(Clone, Copy)]
pub struct Batch(pub usize);

impl Batch {
    /// The batches that cover all expressions.
    pub fn all() -> impl Iterator<Item = Batch> {
        (0..EXPRESSIONS.div_ceil(3 * TERMS)).map(Batch)
    }

    /// The three coordinates.
    pub fn coordinates<N: Nominal>(self, lengths: [N; 4]) -> [N; 3] {
        std::array::from_fn(|coordinate| {
            let first = (self.0 * 3 + coordinate) * TERMS;
            let numbers = first..(first + TERMS).min(EXPRESSIONS);
            // Each term has its own factor, so that no two errors cancel.
            let term = |number: usize| expression(number, lengths) * (lengths[number % 4] + N::constant(number as f64));
            numbers.map(term).fold(N::constant(0.25), |sum, term| sum + term)
        })
    }
}

impl Source for Batch {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Station(Station::Socket(Socket {
            ball: Target::on_tool(self.coordinates(["P", "Q", "U", "V"].map(length))),
            socket: [N::constant(0.0); 3],
            is_located: true,
        }))
    }
}
