//! Numbers for readers: `√2/2` in place of 0.707106781187, `1/3` in place of 0.333333333333.

use std::f64::consts::{PI, TAU};

use num_traits::ToPrimitive;

use crate::constant::{Exact, ROUNDING, fraction};
use crate::symbol::{Binary, Unary};
use crate::tree::{Tree, binary, negative, product};

/// Largest denominator that is shorter than the decimals.
const DENOMINATOR: u32 = 12;
/// Largest numerator of a multiple of π, and of a fraction with a larger denominator.
const NUMERATOR: u32 = 12;
/// Largest denominator of a fraction with such a numerator: a polynomial over ±300 mm has the coefficient 1/300.
const LARGEST_DENOMINATOR: f64 = 1e6;

/// The expression with fractions, multiples of roots and multiples of π where its numbers are such.
pub(crate) fn exact(tree: &Tree) -> Tree {
    tree.mapped(&|leaf| match leaf {
        Tree::Number(value) if *value < 0.0 => of(-value).map(negative),
        Tree::Number(value) => of(*value),
        _ => None,
    })
}

/// The expression of a positive number that is not best written in decimals.
fn of(value: f64) -> Option<Tree> {
    if value == PI || value == TAU || value.fract() == 0.0 {
        return None;
    }
    if let Some((numerator, denominator)) = fraction(value / PI, 180, ROUNDING)
        && numerator <= f64::from(NUMERATOR)
    {
        return Some(over(numerator, Some(Tree::Number(PI)), denominator));
    }
    if let Some((numerator, denominator)) = few_over_many(value) {
        return Some(over(numerator, None, denominator));
    }
    let Exact { factor, root } = Exact::of(value)?;
    let (numerator, denominator) = (factor.numer().to_f64()?, factor.denom().to_u32()?);
    if root != 1 {
        let root = Tree::Unary(Unary::Sqrt, Box::new(Tree::Number(f64::from(root))));
        return Some(over(numerator, Some(root), denominator));
    }
    // Decimals are shorter than 5/16, and 12.5 mm is no 25/2 mm.
    let is_short = matches!(denominator, 2 | 4) && value < 1.0;
    (is_short || is_endless(denominator) && denominator <= DENOMINATOR).then(|| over(numerator, None, denominator))
}

/// The fraction with a small numerator that a value is, if its decimals have no end.
fn few_over_many(value: f64) -> Option<(f64, u32)> {
    let in_lowest_terms = (1..=NUMERATOR).map(f64::from).find_map(|numerator| {
        let exact = numerator / value;
        let denominator = exact.round();
        let is_whole = (exact - denominator).abs() <= ROUNDING * exact && denominator <= LARGEST_DENOMINATOR;
        is_whole.then_some((numerator, denominator as u32))
    });
    in_lowest_terms.filter(|(_, denominator)| is_endless(*denominator))
}

/// Whether the decimals of a fraction with this denominator, in lowest terms, have no end.
fn is_endless(denominator: u32) -> bool {
    [2, 5].iter().fold(denominator, |rest, prime| without(rest, *prime)) > 1
}

/// The rest of a number after division by all powers of a prime.
fn without(mut number: u32, prime: u32) -> u32 {
    while number.is_multiple_of(prime) {
        number /= prime;
    }
    number
}

/// `numerator·factor/denominator`.
fn over(numerator: f64, factor: Option<Tree>, denominator: u32) -> Tree {
    let number = (numerator != 1.0 || factor.is_none()).then_some(Tree::Number(numerator));
    let whole = product(number.into_iter().chain(factor).collect());
    if denominator == 1 { whole } else { binary(Binary::Div, whole, Tree::Number(f64::from(denominator))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(tree: &Tree) -> String {
        match tree {
            Tree::Number(value) if *value == PI => "π".into(),
            Tree::Number(value) => format!("{value}"),
            Tree::Unary(Unary::Sqrt, of) => format!("√{}", text(of)),
            Tree::Unary(Unary::Neg, of) => format!("−{}", text(of)),
            Tree::Binary(Binary::Mul, a, b) => format!("{}·{}", text(a), text(b)),
            Tree::Binary(Binary::Div, a, b) => format!("{}/{}", text(a), text(b)),
            other => format!("{other:?}"),
        }
    }

    /// A root, a fraction or a multiple of π where it is shorter than the decimals; whole numbers and short decimals as
    /// they are.
    #[test]
    fn numbers_have_their_shortest_exact_form() {
        for (value, wanted) in [
            (0.5, "1/2"),
            (0.75, "3/4"),
            (0.25, "1/4"),
            (1.5, "1.5"),
            (2.25, "2.25"),
            (0.2, "0.2"),
            (0.3125, "0.3125"),
            (0.125, "0.125"),
            (1.0 / 3.0, "1/3"),
            (7.0 / 3.0, "7/3"),
            (5.0 / 12.0, "5/12"),
            (1.0 / 13.0, "1/13"),
            (1.0 / 300.0, "1/300"),
            (6.0 / 7.0 / 300.0, "1/350"),
            (11.0 / 2100.0, "11/2100"),
            (1.0 / 90000.0, "1/90000"),
            (1.0 / 320.0, "0.003125"),
            (13.0 / 1700.0, "0.007647058823529412"),
            (2.0, "2"),
            (12.5, "12.5"),
            (0.5_f64.sqrt(), "√2/2"),
            (0.75_f64.sqrt(), "√3/2"),
            (2.0_f64.sqrt(), "√2"),
            (1.5 * 3.0_f64.sqrt(), "3·√3/2"),
            (3.0 * 2.0_f64.sqrt(), "3·√2"),
            (6.0_f64.sqrt() / 4.0, "√6/4"),
            (PI, "π"),
            (PI / 2.0, "π/2"),
            (3.0 * PI / 4.0, "3·π/4"),
            (12.0 * PI, "12·π"),
            (PI / 180.0, "π/180"),
            (-0.5, "−1/2"),
            (-0.75_f64.sqrt(), "−√3/2"),
            (-1.5, "-1.5"),
        ] {
            assert_eq!(text(&exact(&Tree::Number(value))), wanted, "{value}");
        }
    }
}
