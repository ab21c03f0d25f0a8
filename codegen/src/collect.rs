//! Arranges polynomials for printing: grouped by error, then by sines and cosines of the axes, with lengths in
//! parentheses.

use std::cmp::Reverse;
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
            if let Some((factor, base, without)) = self.completed(&rest, length) {
                squares.push((factor, base));
                rest = without;
            }
        }
        let square = |(factor, base): &(f64, Polynomial)| {
            let base = self.group(base);
            let square = binary(Binary::Mul, base.clone(), base);
            (false, if *factor == 1.0 { square } else { binary(Binary::Mul, Tree::Number(*factor), square) })
        };
        let mut terms = self.group_terms(&rest);
        terms.extend(squares.iter().map(square));
        sum(terms)
    }

    /// `a`, `x + b/2a` and what remains beside `a` times its square, if `a·x² + b·x` has a positive number `a` and no
    /// sine in `b`, and the remainder is shorter.
    fn completed(&self, polynomial: &Polynomial, length: Atom) -> Option<(f64, Polynomial, Polynomial)> {
        let by_power = polynomial.collect(|atom| atom == length);
        let power = |power| by_power.get(&Monomial(vec![(length, power)]));
        let (square, linear) = (power(2)?, power(1)?);
        let factor = square.rational()?;
        if !factor.is_positive() || linear.contains(is_sin_cos) {
            return None;
        }
        let two = BigRational::from_integer(2.into());
        let base = &Polynomial::atom(length) + &linear.scaled(&(two * factor).recip());
        let rest = polynomial - &self.ring.product(&base, &base).scaled(factor);
        (rest.len() + base.len() < polynomial.len()).then_some((factor.to_f64()?, base, rest))
    }

    fn group_terms(&self, polynomial: &Polynomial) -> Vec<Term> {
        let collected = polynomial.collect(|atom| self.ring.is_small(atom));
        let mut keys: Vec<&Monomial> = collected.keys().collect();
        keys.sort_by_key(|key| (key.degree(|_| true), (*key).clone()));
        let mut terms = Vec::new();
        for key in keys {
            let coefficient = &collected[key];
            let (shared, rest) = self.shared(coefficient);
            if key.powers().is_empty() && shared.is_empty() {
                terms.extend(self.coefficient_terms(coefficient));
                continue;
            }
            let (minus, mut factors) = if rest.contains(is_sin_cos) {
                let (minus, factor) = as_factor(self.coefficient_terms(&rest));
                (minus, shared.into_iter().chain(factor).collect())
            } else {
                self.length_factors(coefficient)
            };
            factors.extend(self.powers(key));
            terms.push((minus, product(factors)));
        }
        terms
    }

    /// The number, lengths, sines and cosines that terms with several sines and cosines have in common, and the
    /// polynomial without them.
    fn shared(&self, polynomial: &Polynomial) -> (Vec<Tree>, Polynomial) {
        if polynomial.collect(is_sin_cos).len() < 2 {
            return (Vec::new(), polynomial.clone());
        }
        let (number, rest) = without_number(polynomial);
        let shared = common(&rest);
        let (turns, lengths) = shared.split(is_sin_cos);
        let mut factors: Vec<Tree> = number.into_iter().collect();
        factors.extend(self.powers(&lengths));
        factors.extend(self.turns(&turns));
        let mut quotient = Polynomial::default();
        for (monomial, coefficient) in rest.terms() {
            quotient.insert(monomial.divided_by(&shared).unwrap_or_default(), coefficient.clone());
        }
        (factors, quotient)
    }

    /// Sines, then cosines; those of outer axes first.
    fn turns(&self, turn: &Monomial) -> Vec<Tree> {
        let place = |id| self.inputs.iter().position(|input| input.variable() == self.ring.variable(id));
        let mut powers = turn.powers().to_vec();
        powers.sort_by_key(|(atom, _)| match atom {
            Atom::Sin(id) => (0, Reverse(place(*id))),
            Atom::Cos(id) => (1, Reverse(place(*id))),
            Atom::Variable(_) | Atom::Root(_) | Atom::Function(_) => (2, Reverse(None)),
        });
        powers.into_iter().flat_map(|power| self.powers(&Monomial(vec![power]))).collect()
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
            factors.extend(self.turns(turn));
            terms.push((minus, product(factors)));
        }
        positive_first(terms)
    }

    /// Lengths as terms. Terms with a common factor become one term, with the factor in front of the parentheses.
    fn length_terms(&self, polynomial: &Polynomial) -> Vec<Term> {
        let has_number = || without_number(polynomial).0.is_some();
        if polynomial.len() > 1 && (!common(polynomial).powers().is_empty() || has_number()) {
            let (minus, factors) = self.length_factors(polynomial);
            return vec![(minus, product(factors))];
        }
        positive_first(polynomial.terms().map(|term| self.length_term(term)).collect())
    }

    /// Lengths as factors of a product: `R`, or `D` and `(H − Z_CA)`. The number comes first. The first term of a sum is
    /// positive and the sign is returned separately. Empty for 1.
    fn length_factors(&self, polynomial: &Polynomial) -> (bool, Vec<Tree>) {
        let (number, polynomial) = without_number(polynomial);
        let shared = common(&polynomial);
        let rest =
            polynomial.terms().filter_map(|(monomial, coefficient)| Some((monomial.divided_by(&shared)?, coefficient)));
        let terms: Vec<Term> = rest.map(|(m, c)| self.length_term((&m, c))).collect();
        let (minus, inner) = as_factor(terms);
        let mut factors: Vec<Tree> = number.into_iter().collect();
        factors.extend(self.powers(&shared));
        factors.extend(inner);
        (minus, factors)
    }

    fn length_term(&self, (monomial, coefficient): (&Monomial, &BigRational)) -> Term {
        let (number, rest) = number_of(monomial, coefficient);
        let mut factors = Vec::new();
        if number != 1.0 || rest.powers().is_empty() {
            factors.push(Tree::Number(number));
        }
        factors.extend(self.powers(&rest));
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

/// The size of the number in front of a term, with the roots of numbers, and its other atoms.
pub(crate) fn number_of(monomial: &Monomial, coefficient: &BigRational) -> (f64, Monomial) {
    let (roots, rest) = monomial.split(|atom| Ring::root_of_number(atom).is_some());
    let (mut whole, mut under) = (1.0, 1.0);
    for (atom, power) in roots.powers() {
        let root = f64::from(Ring::root_of_number(*atom).unwrap_or(1));
        whole *= root.powi((power / 2) as i32);
        under *= root.powi((power % 2) as i32);
    }
    (coefficient.abs().to_f64().unwrap_or(f64::NAN) * whole * under.sqrt(), rest)
}

/// The number that all terms have in common, unless it is 1, and the polynomial without it.
fn without_number(polynomial: &Polynomial) -> (Option<Tree>, Polynomial) {
    let (roots, _) = common(polynomial).split(|atom| Ring::root_of_number(atom).is_some());
    let mut sizes = polynomial.terms().map(|(_, coefficient)| coefficient.abs());
    let first = sizes.next().unwrap_or_else(BigRational::one);
    let content = if sizes.all(|size| size == first) { first } else { BigRational::one() };
    let (number, _) = number_of(&roots, &content);
    if number == 1.0 {
        return (None, polynomial.clone());
    }
    let mut rest = Polynomial::default();
    for (monomial, coefficient) in polynomial.terms() {
        rest.insert(monomial.divided_by(&roots).unwrap_or_default(), coefficient / &content);
    }
    (Some(Tree::Number(number)), rest)
}

/// The largest common factor of all terms.
fn common(polynomial: &Polynomial) -> Monomial {
    let mut monomials = polynomial.terms().map(|(monomial, _)| monomial.clone());
    let first = monomials.next().unwrap_or_default();
    monomials.fold(first, |shared, monomial| shared.shared_with(&monomial))
}

/// Moves a positive term to the front if there is one.
pub(crate) fn positive_first(mut terms: Vec<Term>) -> Vec<Term> {
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
