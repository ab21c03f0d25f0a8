//! Exact normal form: polynomials in errors, lengths, sines and cosines, with rational coefficients.
//!
//! Two rules make the form unique: `sin² = 1 − cos²` for every angle, and `r² = a` for the root `r = √a` of an
//! expression without errors. A monomial therefore contains each sine and each root at most once. Two expressions are
//! equal exactly if they have the same terms; no sampling is involved. Coefficients are ratios of integers, and every
//! finite `f64` is one.

use std::collections::BTreeMap;
use std::ops::{Add, Mul, Neg, Sub};

use num_rational::BigRational;
use num_traits::ToPrimitive;

use crate::symbol::{NodeId, VariableId};

/// The indeterminates of a polynomial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Atom {
    /// A length, a position, an error.
    Variable(VariableId),
    /// A root, by its index in the [`crate::normal_form::Ring`].
    Root(usize),
    /// The sine of a variable.
    Sin(VariableId),
    /// The cosine of a variable.
    Cos(VariableId),
    /// A function of nominal quantities that the form does not expand.
    Function(NodeId),
}

/// A product of powers of atoms, sorted by atom.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Monomial(pub(crate) Vec<(Atom, u32)>);

impl Monomial {
    /// The empty product.
    pub fn one() -> Self {
        Monomial::default()
    }

    /// The atoms and their powers.
    pub fn powers(&self) -> &[(Atom, u32)] {
        &self.0
    }

    /// The sum of the powers of the atoms for which `counts` holds.
    pub fn degree(&self, counts: impl Fn(Atom) -> bool) -> u32 {
        let counted = self.0.iter().filter(|(atom, _)| counts(*atom));
        counted.map(|(_, power)| power).sum()
    }

    /// Splits the monomial into the atoms for which `keep` holds and the rest.
    pub fn split(&self, keep: impl Fn(Atom) -> bool) -> (Monomial, Monomial) {
        let (kept, rest) = self.0.iter().partition(|(atom, _)| keep(*atom));
        (Monomial(kept), Monomial(rest))
    }

    /// The quotient, if every power of `other` is contained.
    pub fn divided_by(&self, other: &Monomial) -> Option<Monomial> {
        let mut quotient = self.clone();
        for (atom, power) in &other.0 {
            let index = quotient.0.iter().position(|(own, n)| own == atom && n >= power)?;
            quotient.0[index].1 -= power;
        }
        quotient.0.retain(|(_, power)| *power > 0);
        Some(quotient)
    }

    /// The greatest common divisor.
    pub fn shared_with(&self, other: &Monomial) -> Monomial {
        let power = |atom: Atom| other.0.iter().find(|(own, _)| *own == atom).map_or(0, |(_, n)| *n);
        let shared = self.0.iter().map(|(atom, n)| (*atom, power(*atom).min(*n)));
        Monomial(shared.filter(|(_, n)| *n > 0).collect())
    }

    /// The product, without applying the rules.
    pub(crate) fn times(&self, other: &Monomial) -> Monomial {
        let mut product = Vec::with_capacity(self.0.len() + other.0.len());
        let (mut a, mut b) = (self.0.as_slice(), other.0.as_slice());
        while let (Some(&(x, n)), Some(&(y, m))) = (a.first(), b.first()) {
            if x <= y {
                a = &a[1..];
            }
            if y <= x {
                b = &b[1..];
            }
            product.push(match x.cmp(&y) {
                std::cmp::Ordering::Less => (x, n),
                std::cmp::Ordering::Greater => (y, m),
                std::cmp::Ordering::Equal => (x, n + m),
            });
        }
        product.extend_from_slice(a);
        product.extend_from_slice(b);
        Monomial(product)
    }
}

/// A polynomial, in normal form or in an intermediate state: nonzero terms, each monomial once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Polynomial(pub(crate) BTreeMap<Monomial, BigRational>);

/// The rational number equal to an `f64`; zero if it is not finite.
fn exactly(value: f64) -> BigRational {
    BigRational::from_float(value).unwrap_or_else(|| BigRational::from_integer(0.into()))
}

impl Polynomial {
    /// A constant.
    pub fn constant(value: f64) -> Self {
        let mut polynomial = Polynomial::default();
        polynomial.insert(Monomial::one(), exactly(value));
        polynomial
    }

    /// An atom.
    pub fn atom(atom: Atom) -> Self {
        let mut polynomial = Polynomial::default();
        polynomial.insert(Monomial(vec![(atom, 1)]), exactly(1.0));
        polynomial
    }

    /// Whether it is zero. This is decidable, because the normal form of zero has no terms.
    pub fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    /// The number that it is, if it has no atoms; `None` for zero, too.
    pub(crate) fn rational(&self) -> Option<&BigRational> {
        let (monomial, coefficient) = self.0.iter().next().filter(|_| self.len() == 1)?;
        monomial.0.is_empty().then_some(coefficient)
    }

    /// Whether it equals this constant to rounding.
    pub fn is_about(&self, value: f64) -> bool {
        let constant = match self.0.iter().next() {
            None => Some(0.0),
            Some((monomial, coefficient)) if self.len() == 1 && monomial.0.is_empty() => coefficient.to_f64(),
            Some(_) => None,
        };
        constant.is_some_and(|constant| (constant - value).abs() <= 1e-12 * value.abs().max(1.0))
    }

    /// The terms: monomials and their coefficients.
    pub fn terms(&self) -> impl Iterator<Item = (&Monomial, &BigRational)> {
        self.0.iter()
    }

    /// Number of terms.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is no term.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether some term contains an atom for which `condition` holds.
    pub fn contains(&self, condition: impl Fn(Atom) -> bool) -> bool {
        let mut atoms = self.0.keys().flat_map(|monomial| monomial.0.iter());
        atoms.any(|(atom, _)| condition(*atom))
    }

    /// Groups the terms by their atoms for which `by` holds: each such monomial with its coefficient.
    pub fn collect(&self, by: impl Fn(Atom) -> bool) -> BTreeMap<Monomial, Polynomial> {
        let mut collected: BTreeMap<Monomial, Polynomial> = BTreeMap::new();
        for (monomial, coefficient) in &self.0 {
            let (key, rest) = monomial.split(&by);
            let part = collected.entry(key).or_default();
            part.insert(rest, coefficient.clone());
        }
        collected
    }

    /// The terms whose monomial satisfies `keep`.
    pub fn filtered(&self, keep: impl Fn(&Monomial) -> bool) -> Polynomial {
        let kept = self.0.iter().filter(|(monomial, _)| keep(monomial));
        Polynomial(kept.map(|(m, c)| (m.clone(), c.clone())).collect())
    }

    pub(crate) fn insert(&mut self, monomial: Monomial, coefficient: BigRational) {
        let zero = exactly(0.0);
        let sum = self.0.entry(monomial.clone()).or_insert_with(|| zero.clone());
        *sum += coefficient;
        if *sum == zero {
            self.0.remove(&monomial);
        }
    }

    /// The product before the rules for sines and roots are applied, without terms for which `drop` holds.
    pub(crate) fn product(&self, other: &Polynomial, drop: impl Fn(&Monomial) -> bool) -> Polynomial {
        let mut product = Polynomial::default();
        for (a, c) in &self.0 {
            for (b, d) in &other.0 {
                let monomial = a.times(b);
                if !drop(&monomial) {
                    product.insert(monomial, c * d);
                }
            }
        }
        product
    }

    /// Multiplies each coefficient by `factor`.
    pub fn scaled(&self, factor: &BigRational) -> Polynomial {
        let mut scaled = Polynomial::default();
        for (monomial, coefficient) in &self.0 {
            scaled.insert(monomial.clone(), coefficient * factor);
        }
        scaled
    }
}

impl Add<&Polynomial> for &Polynomial {
    type Output = Polynomial;
    fn add(self, other: &Polynomial) -> Polynomial {
        let mut sum = self.clone();
        for (monomial, coefficient) in &other.0 {
            sum.insert(monomial.clone(), coefficient.clone());
        }
        sum
    }
}

impl Neg for &Polynomial {
    type Output = Polynomial;
    fn neg(self) -> Polynomial {
        Polynomial(self.0.iter().map(|(m, c)| (m.clone(), -c)).collect())
    }
}

impl Sub<&Polynomial> for &Polynomial {
    type Output = Polynomial;
    fn sub(self, other: &Polynomial) -> Polynomial {
        self + &-other
    }
}

impl Mul<&Polynomial> for &Polynomial {
    type Output = Polynomial;
    /// The product of polynomials without sines and roots; [`crate::normal_form::Ring::product`] applies the rules for
    /// those.
    fn mul(self, other: &Polynomial) -> Polynomial {
        self.product(other, |_| false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_constant_is_about_a_number() {
        let two = Polynomial::constant(2.0);
        assert!(two.is_about(2.0) && two.is_about(2.0 + 1e-13) && !two.is_about(2.1) && !two.is_about(0.0));
        assert!(Polynomial::default().is_about(0.0) && !Polynomial::default().is_about(1.0));
        let mut twice = Polynomial::default();
        twice.insert(Monomial(vec![(Atom::Root(0), 1)]), exactly(2.0));
        assert!(!twice.is_about(2.0));
        twice.insert(Monomial::one(), exactly(2.0));
        assert!(!twice.is_about(2.0));
    }
}
