//! Numbers for readers: `√2/2` in place of 0.707106781187, `1/3` in place of 0.333333333333.

use std::f64::consts::{PI, TAU};

use num_traits::ToPrimitive;

use crate::constant::{Exact, ROUNDING, fraction};
use crate::symbol::{Binary, Unary};
use crate::tree::{Tree, binary, negative, product};

/// Largest denominator that is shorter than the decimals.
const DENOMINATOR: u32 = 12;
/// Largest numerator of a multiple of π.
const NUMERATOR: f64 = 12.0;

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
        && numerator <= NUMERATOR
    {
        return Some(over(numerator, Some(Tree::Number(PI)), denominator));
    }
    let Exact { factor, root } = Exact::of(value)?;
    let (numerator, denominator) = (factor.numer().to_f64()?, factor.denom().to_u32()?);
    if root != 1 {
        let root = Tree::Unary(Unary::Sqrt, Box::new(Tree::Number(f64::from(root))));
        return Some(over(numerator, Some(root), denominator));
    }
    // Decimals are shorter than 5/16, and 12.5 mm is no 25/2 mm.
    let is_short = matches!(denominator, 2 | 4) && value < 1.0;
    let is_endless = [2, 5].iter().fold(denominator, |rest, prime| without(rest, *prime)) != 1;
    (is_short || is_endless && denominator <= DENOMINATOR).then(|| over(numerator, None, denominator))
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
