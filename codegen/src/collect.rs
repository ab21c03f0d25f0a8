//! Arranges polynomials for printing: grouped by error, then by sines and cosines of the axes, with lengths in
//! parentheses.

use std::collections::{BTreeSet, HashMap};

use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive};

use crate::normal_form::Ring;
use crate::polynomial::{Atom, Monomial, Polynomial};
use crate::program::{Input, Naming, Program};
use crate::symbol::{Binary, Operand, Unary};
use crate::tree::{Term, Tree, binary, product, sum};

/// Writes polynomials of a ring as expressions in the inputs of a program.
pub(crate) struct Collector<'r, 'a> {
    pub(crate) ring: &'r Ring<'a>,
    pub(crate) inputs: &'r [Input],
}

impl Collector<'_, '_> {
    /// Arranges a polynomial: the terms without errors first, then error by error, then products of errors.
    pub(crate) fn group(&self, polynomial: &Polynomial) -> Tree {
        sum(self.group_terms(polynomial))
    }

    /// Arranges the square of a length: `R² + (H − Z)²` in place of `R² + H² − 2·H·Z + Z²`.
    pub(crate) fn squares(&self, polynomial: &Polynomial) -> Tree {
        let (mut rest, mut squares) = (polynomial.clone(), Vec::new());
        let atoms = polynomial.terms().flat_map(|(monomial, _)| monomial.powers());
        let lengths: BTreeSet<Atom> = atoms.filter(|(_, power)| *power == 2).map(|(atom, _)| *atom).collect();
        for length in lengths {
            if let Some((base, without)) = self.completed(&rest, length) {
                squares.push(base);
                rest = without;
            }
        }
        let square = |base: &Polynomial| {
            let base = self.group(base);
            (false, binary(Binary::Mul, base.clone(), base))
        };
        let mut terms = self.group_terms(&rest);
        terms.extend(squares.iter().map(square));
        sum(terms)
    }

    /// `x + b/2` and what remains beside its square, if `x² + b·x` has no sine in `b` and the remainder is shorter.
    fn completed(&self, polynomial: &Polynomial, length: Atom) -> Option<(Polynomial, Polynomial)> {
        let by_power = polynomial.collect(|atom| atom == length);
        let power = |power| by_power.get(&Monomial(vec![(length, power)]));
        let (square, linear) = (power(2)?, power(1)?);
        if !square.is_about(1.0) || linear.contains(is_sin_cos) {
            return None;
        }
        let half = BigRational::new(1.into(), 2.into());
        let base = &Polynomial::atom(length) + &linear.scaled(&half);
        let rest = polynomial - &self.ring.product(&base, &base);
        (rest.len() + base.len() < polynomial.len()).then_some((base, rest))
    }

    fn group_terms(&self, polynomial: &Polynomial) -> Vec<Term> {
        let collected = polynomial.collect(|atom| self.ring.is_small(atom));
        let mut keys: Vec<&Monomial> = collected.keys().collect();
        keys.sort_by_key(|key| (key.degree(|_| true), (*key).clone()));
        let mut terms = Vec::new();
        for key in keys {
            let coefficient = &collected[key];
            if key.powers().is_empty() {
                terms.extend(self.coefficient_terms(coefficient));
                continue;
            }
            let turns = coefficient.contains(is_sin_cos);
            let (minus, mut factors) = if turns {
                let (minus, factor) = as_factor(self.coefficient_terms(coefficient));
                (minus, factor.into_iter().collect())
            } else {
                self.length_factors(coefficient)
            };
            factors.extend(self.powers(key));
            terms.push((minus, product(factors)));
        }
        terms
    }

    /// Terms of a polynomial in lengths, sines and cosines, grouped by sine and cosine.
    fn coefficient_terms(&self, polynomial: &Polynomial) -> Vec<Term> {
        let turns = polynomial.collect(is_sin_cos);
        let mut terms = Vec::new();
        for (turn, lengths) in &turns {
            if turn.powers().is_empty() {
                terms.extend(self.length_terms(lengths));
                continue;
            }
            let (minus, mut factors) = self.length_factors(lengths);
            factors.extend(self.powers(turn));
            terms.push((minus, product(factors)));
        }
        positive_first(terms)
    }

    /// Lengths as terms. Terms with a common factor become one term, with the factor in front of the parentheses.
    fn length_terms(&self, polynomial: &Polynomial) -> Vec<Term> {
        if polynomial.len() > 1 && !common(polynomial).powers().is_empty() {
            let (minus, factors) = self.length_factors(polynomial);
            return vec![(minus, product(factors))];
        }
        positive_first(polynomial.terms().map(|term| self.length_term(term)).collect())
    }

    /// Lengths as factors of a product: `R`, or `D` and `(H − Z_CA)`. The first term of a sum is positive and the sign
    /// is returned separately. Empty for 1.
    fn length_factors(&self, polynomial: &Polynomial) -> (bool, Vec<Tree>) {
        let shared = common(polynomial);
        let rest =
            polynomial.terms().filter_map(|(monomial, coefficient)| Some((monomial.divided_by(&shared)?, coefficient)));
        let terms: Vec<Term> = rest.map(|(m, c)| self.length_term((&m, c))).collect();
        let (minus, inner) = as_factor(terms);
        let mut factors = Vec::new();
        // The number comes first.
        if let Some(number @ Tree::Number(_)) = &inner {
            factors.push(number.clone());
        }
        factors.extend(self.powers(&shared));
        factors.extend(inner.filter(|inner| !matches!(inner, Tree::Number(_))));
        (minus, factors)
    }

    fn length_term(&self, (monomial, coefficient): (&Monomial, &BigRational)) -> Term {
        let size = coefficient.abs();
        let mut factors = Vec::new();
        if !size.is_one() || monomial.powers().is_empty() {
            factors.push(Tree::Number(size.to_f64().unwrap_or(f64::NAN)));
        }
        factors.extend(self.powers(monomial));
        (coefficient.is_negative(), product(factors))
    }

    /// The sort key of a length: numbers first, then by name.
    pub(crate) fn name(&self, monomial: &Monomial) -> String {
        let name = |(atom, _): &(Atom, u32)| match atom {
            Atom::Variable(id) | Atom::Sin(id) | Atom::Cos(id) => self.ring.variable(*id).name(),
            Atom::Root(_) | Atom::Function(_) => "√".to_string(),
        };
        monomial.powers().iter().map(name).collect()
    }

    pub(crate) fn powers(&self, monomial: &Monomial) -> Vec<Tree> {
        let power = |(atom, power): &(Atom, u32)| {
            let atom = self.atom(*atom);
            let rest = std::iter::repeat_n(atom.clone(), *power as usize - 1);
            rest.fold(atom, |square, again| binary(Binary::Mul, square, again))
        };
        monomial.powers().iter().map(power).collect()
    }

    fn atom(&self, atom: Atom) -> Tree {
        let index = |input: Input| self.inputs.iter().position(|known| *known == input);
        match atom {
            Atom::Variable(id) => {
                let variable = self.ring.variable(id).clone();
                index(Input::Plain(variable)).map_or(Tree::Number(f64::NAN), Tree::Input)
            }
            Atom::Sin(id) | Atom::Cos(id) => {
                let variable = self.ring.variable(id).clone();
                let (turn, function) = match atom {
                    Atom::Sin(_) => (Input::Sine(variable), Unary::Sin),
                    _ => (Input::Cosine(variable), Unary::Cos),
                };
                match index(turn) {
                    Some(index) => Tree::Input(index),
                    None => Tree::Unary(function, Box::new(self.atom(Atom::Variable(id)))),
                }
            }
            Atom::Function(id) => {
                let arena = self.ring.arena();
                let function = [Operand::Node(id)];
                let inputs = self.inputs.to_vec();
                let program = Program::of(arena, inputs, &function, &HashMap::new(), Naming::Labelled);
                program.outputs.into_iter().next().unwrap_or(Tree::Number(f64::NAN))
            }
            Atom::Root(root) => Tree::Unary(Unary::Sqrt, Box::new(self.squares(self.ring.radicand(root)))),
        }
    }
}

/// Whether coefficients are grouped by this atom before their lengths.
fn is_sin_cos(atom: Atom) -> bool {
    matches!(atom, Atom::Sin(_) | Atom::Cos(_) | Atom::Function(_))
}

/// The largest common factor of all terms.
fn common(polynomial: &Polynomial) -> Monomial {
    let mut monomials = polynomial.terms().map(|(monomial, _)| monomial.clone());
    let first = monomials.next().unwrap_or_default();
    monomials.fold(first, |shared, monomial| shared.shared_with(&monomial))
}

/// Moves a positive term to the front if there is one.
fn positive_first(mut terms: Vec<Term>) -> Vec<Term> {
    if let Some(first) = terms.iter().position(|(minus, _)| !minus) {
        let first = terms.remove(first);
        terms.insert(0, first);
    }
    terms
}

/// A sum as a factor: its sign if all terms or the first one are negative, and the factor unless it is 1.
fn as_factor(terms: Vec<Term>) -> (bool, Option<Tree>) {
    let minus = terms.first().is_some_and(|(minus, _)| *minus);
    let terms: Vec<Term> = terms.into_iter().map(|(m, tree)| (m != minus, tree)).collect();
    match sum(terms) {
        Tree::Number(1.0) => (minus, None),
        factor => (minus, Some(factor)),
    }
}
