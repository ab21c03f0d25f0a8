//! Conversion of an expression graph to its normal form, complete or truncated at an order in the errors.

use std::collections::{BTreeSet, HashMap};

use abbe_model::Diagnostic;
use num_rational::BigRational;

use crate::constant::{Exact, ROOTS};
use crate::error::no_polynomial;
use crate::polynomial::{Atom, Monomial, Polynomial};
use crate::symbol::{Arena, Binary, Node, NodeId, Operand, Unary, VariableId, operands};
use crate::variable::Variable;

/// The ring of normal forms: the variables of an arena, and the square roots found so far.
#[derive(Debug)]
pub struct Ring<'a> {
    arena: &'a Arena,
    variables: Vec<Variable>,
    order: Option<u32>,
    roots: Vec<Polynomial>,
    known: HashMap<NodeId, Polynomial>,
    /// Positions that stay symbols although they do not change.
    held: Vec<Variable>,
}

impl<'a> Ring<'a> {
    /// The ring of untruncated expressions.
    pub fn exact(arena: &'a Arena) -> Self {
        // The first roots are those of numbers.
        let roots = ROOTS.map(|root| Polynomial::constant(f64::from(root))).to_vec();
        Ring { arena, variables: arena.variables(), order: None, roots, known: HashMap::new(), held: Vec::new() }
    }

    /// The ring of expressions truncated at `order` in errors and instrument parameters: `sin e` is `e`, `cos e` is `1
    /// − e²/2`.
    ///
    /// # Errors
    /// If the order is above 2.
    pub fn truncated(arena: &'a Arena, order: u32) -> Result<Self, Diagnostic> {
        if order > 2 {
            return Err(Diagnostic::equation(format!(
                "order {order} in the errors is not available; the orders are first, bilinear and exact"
            )));
        }
        Ok(Ring { order: Some(order), ..Ring::exact(arena) })
    }

    /// The arena.
    pub fn arena(&self) -> &'a Arena {
        self.arena
    }

    /// A variable by its index.
    pub fn variable(&self, id: VariableId) -> &Variable {
        &self.variables[id.0 as usize]
    }

    /// The radicand of a root.
    pub fn radicand(&self, root: usize) -> &Polynomial {
        &self.roots[root]
    }

    /// Whether an atom is an error or an instrument parameter, or the sine or cosine of one.
    pub fn is_small(&self, atom: Atom) -> bool {
        match atom {
            Atom::Variable(id) | Atom::Sin(id) | Atom::Cos(id) => self.variable(id).is_small(),
            Atom::Root(_) | Atom::Function(_) => false,
        }
    }

    /// The root of a number, if the atom is one.
    pub(crate) fn root_of_number(atom: Atom) -> Option<u32> {
        match atom {
            Atom::Root(root) => ROOTS.get(root).copied(),
            Atom::Variable(_) | Atom::Sin(_) | Atom::Cos(_) | Atom::Function(_) => None,
        }
    }

    /// Declares positions that stay symbols although they do not change.
    pub(crate) fn hold(&mut self, positions: &[Variable]) {
        self.held = positions.to_vec();
    }

    /// Whether an atom depends on the position of a moving axis or on another driver.
    pub fn moves(&self, atom: Atom) -> bool {
        let moves = |id: VariableId| {
            let variable = self.variable(id);
            variable.moves() && !self.held.contains(variable)
        };
        match atom {
            Atom::Variable(id) | Atom::Sin(id) | Atom::Cos(id) => moves(id),
            Atom::Function(id) => self.arena.variables_of(&[Operand::Node(id)]).into_iter().any(moves),
            Atom::Root(root) => self.roots[root].contains(|inner| self.moves(inner)),
        }
    }

    /// The atom of a variable, if the arena contains it.
    pub fn atom_of(&self, variable: &Variable) -> Option<Atom> {
        let index = self.variables.iter().position(|known| known == variable)?;
        Some(Atom::Variable(VariableId(index as u32)))
    }

    /// Whether two expressions are equal, decided by their normal forms. Functions that the normal form does not
    /// expand, such as an exponential or the cosine of a multiple, are compared as terms: equal terms prove equality,
    /// different terms prove nothing.
    ///
    /// # Errors
    /// If one of them is not a polynomial.
    pub fn equal(&mut self, a: Operand, b: Operand) -> Result<bool, Diagnostic> {
        Ok(self.normal_form(a)? == self.normal_form(b)?)
    }

    /// Whether two expressions are equal but for the rounding of their constants.
    pub(crate) fn equal_to_rounding(&mut self, a: Operand, b: Operand) -> Result<bool, Diagnostic> {
        let (a, b) = (self.normal_form(a)?, self.normal_form(b)?);
        Ok(self.is_residue(&(&a - &b), &[a, b]))
    }

    /// The normal form of an expression.
    ///
    /// # Errors
    /// If it is not a polynomial: a quotient of expressions, a root of errors, or a function of errors other than the
    /// sine or cosine of one.
    pub fn normal_form(&mut self, operand: Operand) -> Result<Polynomial, Diagnostic> {
        let mut requested = BTreeSet::new();
        let mut pending = vec![operand];
        while let Some(next) = pending.pop() {
            if let Operand::Node(id) = next
                && !self.known.contains_key(&id)
                && requested.insert(id)
                && !self.is_function(id)
            {
                pending.extend(operands(self.arena.node(id)));
            }
        }
        for id in requested {
            let form = self.of_node(id)?;
            self.known.insert(id, form);
        }
        Ok(self.normal_form_of(operand))
    }

    /// Keeps these nominal expressions as they are, without expanding them.
    pub(crate) fn keep(&mut self, whole: &[Operand]) {
        for operand in whole {
            if let Operand::Node(id) = operand {
                self.known.insert(*id, Polynomial::atom(Atom::Function(*id)));
            }
        }
    }

    /// Whether a node is a function that the form does not expand.
    fn is_function(&self, id: NodeId) -> bool {
        match self.arena.node(id) {
            Node::Unary(Unary::Sin | Unary::Cos, a) => {
                let of_variable = matches!(self.arena.node_of(a), Some(Node::Variable(_)));
                // An angle determined by effects is small; in a truncated ring its sine and cosine are series.
                !(of_variable || self.order.is_some() && self.contains_errors(a))
            }
            Node::Unary(function, _) => !matches!(function, Unary::Neg | Unary::Sqrt),
            Node::Variable(_) | Node::Binary(..) => false,
        }
    }

    fn normal_form_of(&self, operand: Operand) -> Polynomial {
        match operand {
            Operand::Constant(constant) => number(constant.value()),
            Operand::Node(id) => self.known.get(&id).cloned().unwrap_or_default(),
        }
    }

    fn of_node(&mut self, id: NodeId) -> Result<Polynomial, Diagnostic> {
        if self.is_function(id) {
            return if self.order.is_some() && self.contains_errors(Operand::Node(id)) {
                Err(no_polynomial("a function of errors"))
            } else {
                Ok(Polynomial::atom(Atom::Function(id)))
            };
        }
        Ok(match self.arena.node(id) {
            Node::Variable(variable) => {
                let atom = Atom::Variable(variable);
                if self.order == Some(0) && self.is_small(atom) {
                    Polynomial::default()
                } else {
                    Polynomial::atom(atom)
                }
            }
            Node::Unary(Unary::Neg, a) => -&self.normal_form_of(a),
            Node::Unary(function @ (Unary::Sin | Unary::Cos), a) => match self.arena.node_of(a) {
                Some(Node::Variable(variable)) => self.turn(function, variable),
                _ => self.series(function, &self.normal_form_of(a))?,
            },
            Node::Unary(Unary::Sqrt, a) => {
                let radicand = self.normal_form_of(a);
                if radicand.contains(|atom| self.is_small(atom)) {
                    return Err(no_polynomial("a root of errors"));
                }
                self.root(radicand)
            }
            Node::Unary(..) => return Err(no_polynomial("a function")),
            Node::Binary(op, a, b) => {
                let (x, y) = (self.normal_form_of(a), self.normal_form_of(b));
                match op {
                    Binary::Add => &x + &y,
                    Binary::Sub => &x - &y,
                    Binary::Mul => self.product(&x, &y),
                    Binary::Div => {
                        let divisor = b.known().filter(|divisor| *divisor != 0.0 && divisor.is_finite());
                        let divisor = divisor.ok_or_else(|| no_polynomial("a quotient of expressions"))?;
                        self.product(&x, &inverse(divisor))
                    }
                }
            }
        })
    }

    /// Whether an expression contains an error, an instrument parameter or a coefficient of an effect.
    fn contains_errors(&self, operand: Operand) -> bool {
        let variables = self.arena.variables_of(&[operand]);
        variables.into_iter().any(|variable| self.variable(variable).is_small())
    }

    /// The sine or cosine of a sum of errors in a truncated ring: `x` or `1 − x²/2`.
    fn series(&self, function: Unary, angle: &Polynomial) -> Result<Polynomial, Diagnostic> {
        let mut terms = angle.terms();
        if !terms.all(|(monomial, _)| monomial.degree(|atom| self.is_small(atom)) > 0) {
            return Err(no_polynomial("the sine of a sum of an error and a nominal quantity"));
        }
        if function == Unary::Sin {
            return Ok(angle.clone());
        }
        let half = BigRational::new(1.into(), 2.into());
        Ok(&Polynomial::constant(1.0) - &self.product(angle, angle).scaled(&half))
    }

    /// The sine or cosine of a variable; a series for an error in a truncated ring.
    fn turn(&self, function: Unary, variable: VariableId) -> Polynomial {
        let itself = Polynomial::atom(Atom::Variable(variable));
        match (self.order, self.variable(variable).is_small(), function) {
            (Some(0), true, Unary::Sin) => Polynomial::default(),
            (Some(_), true, Unary::Sin) => itself,
            (Some(2), true, _) => {
                let square = self.product(&itself, &itself);
                let half = BigRational::new(1.into(), 2.into());
                &Polynomial::constant(1.0) - &square.scaled(&half)
            }
            (Some(_), true, _) => Polynomial::constant(1.0),
            (_, _, Unary::Sin) => Polynomial::atom(Atom::Sin(variable)),
            _ => Polynomial::atom(Atom::Cos(variable)),
        }
    }

    /// The root of an expression without errors; each radicand has one atom.
    pub fn root(&mut self, radicand: Polynomial) -> Polynomial {
        if radicand.is_zero() {
            return radicand;
        }
        let index = self.roots.iter().position(|known| *known == radicand);
        let index = index.unwrap_or_else(|| {
            self.roots.push(radicand);
            self.roots.len() - 1
        });
        Polynomial::atom(Atom::Root(index))
    }

    /// The product in normal form, truncated at the ring's order.
    pub fn product(&self, a: &Polynomial, b: &Polynomial) -> Polynomial {
        let beyond =
            |monomial: &Monomial| self.order.is_some_and(|order| monomial.degree(|atom| self.is_small(atom)) > order);
        let mut pending: Vec<(Monomial, BigRational)> = a.product(b, beyond).0.into_iter().collect();
        let mut product = Polynomial::default();
        while let Some((mut monomial, coefficient)) = pending.pop() {
            let Some(index) = squared(&monomial) else {
                product.insert(monomial, coefficient);
                continue;
            };
            let (atom, power) = monomial.0[index];
            if power == 2 {
                monomial.0.remove(index);
            } else {
                monomial.0[index].1 = power - 2;
            }
            let square = match atom {
                Atom::Root(root) => self.roots[root].clone(),
                // `squared` never returns a function, because the square of a function has no rule.
                Atom::Function(_) => continue,
                Atom::Sin(variable) | Atom::Cos(variable) | Atom::Variable(variable) => {
                    let cosine = Polynomial::atom(Atom::Cos(variable));
                    &Polynomial::constant(1.0) - &cosine.product(&cosine, |_| false)
                }
            };
            let mut rest = Polynomial::default();
            rest.insert(monomial, coefficient);
            pending.extend(rest.product(&square, beyond).0);
        }
        product
    }

    /// The errors and instrument parameters among `parameters` that none of the forms contains.
    pub fn absent<'v>(&self, forms: &[Polynomial], parameters: &'v [Variable]) -> Vec<&'v Variable> {
        let contains = |variable: &Variable| {
            let Some(Atom::Variable(id)) = self.atom_of(variable) else {
                return false;
            };
            let own = |atom: Atom| match atom {
                Atom::Variable(own) | Atom::Sin(own) | Atom::Cos(own) => own == id,
                Atom::Function(node) => self.arena.variables_of(&[Operand::Node(node)]).contains(&id),
                Atom::Root(_) => false,
            };
            forms.iter().any(|form| form.contains(own))
        };
        parameters.iter().filter(|variable| !contains(variable)).collect()
    }
}

/// The inverse of a constant of the chain.
fn inverse(value: f64) -> Polynomial {
    match Exact::of(value) {
        // 1/(f·√n) is √n/(f·n).
        Some(Exact { factor, root }) => {
            let square = BigRational::from_integer(root.into());
            number(value).scaled(&(&factor * &factor * square).recip())
        }
        None => BigRational::from_float(value)
            .map_or_else(Polynomial::default, |value| Polynomial::constant(1.0).scaled(&value.recip())),
    }
}

/// A constant of the chain: a multiple of a root where it is one.
fn number(value: f64) -> Polynomial {
    let Some(Exact { factor, root }) = Exact::of(value) else {
        return Polynomial::constant(value);
    };
    let roots = ROOTS.iter().enumerate().filter(|(_, prime)| root.is_multiple_of(**prime));
    let mut number = Polynomial::default();
    number.insert(Monomial(roots.map(|(index, _)| (Atom::Root(index), 1)).collect()), factor);
    number
}

/// The index of a sine or root to which a rule applies.
fn squared(monomial: &Monomial) -> Option<usize> {
    let mut powers = monomial.0.iter();
    powers.position(|(atom, power)| *power >= 2 && matches!(atom, Atom::Sin(_) | Atom::Root(_)))
}
