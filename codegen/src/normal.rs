//! From an expression graph to its normal form, whole or up to an order in the errors.

use std::collections::HashMap;

use num_rational::BigRational;

use crate::error::CodegenError;
use crate::polynomial::{Atom, Monomial, Polynomial};
use crate::symbol::{Arena, Binary, Node, NodeId, Operand, Unary, VariableId};
use crate::variable::Variable;

/// The ring that normal forms live in: the arena's variables, and the roots that were met.
#[derive(Debug)]
pub struct Ring<'a> {
    arena: &'a Arena,
    variables: Vec<Variable>,
    order: Option<u32>,
    roots: Vec<Polynomial>,
    known: HashMap<NodeId, Polynomial>,
}

impl<'a> Ring<'a> {
    /// The ring of whole expressions.
    pub fn exact(arena: &'a Arena) -> Self {
        Ring {
            arena,
            variables: arena.variables(),
            order: None,
            roots: Vec::new(),
            known: HashMap::new(),
        }
    }

    /// The ring of expressions up to `order` in errors and instrument unknowns: `sin e` is `e`, `cos e` is `1 − e²/2`.
    ///
    /// # Errors
    /// If the order is above 2.
    pub fn truncated(arena: &'a Arena, order: u32) -> Result<Self, CodegenError> {
        if order > 2 {
            return Err(CodegenError::OrderTooHigh { order });
        }
        Ok(Ring {
            order: Some(order),
            ..Ring::exact(arena)
        })
    }

    /// The arena.
    pub fn arena(&self) -> &'a Arena {
        self.arena
    }

    /// A variable by its place.
    pub fn variable(&self, id: VariableId) -> &Variable {
        &self.variables[id.0 as usize]
    }

    /// What is under a root.
    pub fn radicand(&self, root: usize) -> &Polynomial {
        &self.roots[root]
    }

    /// Whether an atom is an error or an instrument unknown, or a sine or cosine of one.
    pub fn is_small(&self, atom: Atom) -> bool {
        match atom {
            Atom::Variable(id) | Atom::Sin(id) | Atom::Cos(id) => self.variable(id).is_small(),
            Atom::Root(_) => false,
        }
    }

    /// Whether an atom follows the position of an axis.
    pub fn moves(&self, atom: Atom) -> bool {
        match atom {
            Atom::Variable(id) | Atom::Sin(id) | Atom::Cos(id) => {
                matches!(self.variable(id), Variable::Position { .. })
            }
            Atom::Root(root) => self.roots[root].contains(|inner| self.moves(inner)),
        }
    }

    /// The atom of a variable, if the arena knows it.
    pub fn atom_of(&self, variable: &Variable) -> Option<Atom> {
        let place = self.variables.iter().position(|known| known == variable)?;
        Some(Atom::Variable(VariableId(place as u32)))
    }

    /// Whether two expressions are equal, decided by their normal forms.
    ///
    /// # Errors
    /// If one of them is no polynomial.
    pub fn equal(&mut self, a: Operand, b: Operand) -> Result<bool, CodegenError> {
        Ok(self.normal_form(a)? == self.normal_form(b)?)
    }

    /// The normal form of an expression.
    ///
    /// # Errors
    /// If it is no polynomial: a quotient of expressions, a root of errors, a sine of anything but a variable.
    pub fn normal_form(&mut self, operand: Operand) -> Result<Polynomial, CodegenError> {
        for id in self.arena.reachable(&[operand]) {
            if !self.known.contains_key(&id) {
                let form = self.of_node(id)?;
                self.known.insert(id, form);
            }
        }
        Ok(self.look_up(operand))
    }

    fn look_up(&self, operand: Operand) -> Polynomial {
        match operand {
            Operand::Constant(constant) => Polynomial::constant(constant.value()),
            Operand::Node(id) => self.known.get(&id).cloned().unwrap_or_default(),
        }
    }

    fn of_node(&mut self, id: NodeId) -> Result<Polynomial, CodegenError> {
        let no = |what: &str| CodegenError::NoPolynomial {
            what: what.to_string(),
        };
        Ok(match self.arena.node(id) {
            Node::Variable(variable) => {
                let atom = Atom::Variable(variable);
                if self.order == Some(0) && self.is_small(atom) {
                    Polynomial::default()
                } else {
                    Polynomial::atom(atom)
                }
            }
            Node::Unary(Unary::Neg, a) => -&self.look_up(a),
            Node::Unary(function @ (Unary::Sin | Unary::Cos), a) => {
                let Some(Node::Variable(variable)) = self.arena.node_of(a) else {
                    return Err(no("a sine of an expression"));
                };
                self.turn(function, variable)
            }
            Node::Unary(Unary::Sqrt, a) => {
                let radicand = self.look_up(a);
                if radicand.contains(|atom| self.is_small(atom)) {
                    return Err(no("a root of errors"));
                }
                self.root(radicand)
            }
            Node::Unary(Unary::Exp | Unary::Signum, _) => return Err(no("an exponential or a sign")),
            Node::Binary(op, a, b) => {
                let (x, y) = (self.look_up(a), self.look_up(b));
                match op {
                    Binary::Add => &x + &y,
                    Binary::Sub => &x - &y,
                    Binary::Mul => self.product(&x, &y),
                    Binary::Div => {
                        let divisor = BigRational::from_float(b.known().unwrap_or(0.0));
                        let zero = BigRational::from_integer(0.into());
                        let divisor = divisor.filter(|divisor| *divisor != zero);
                        let divisor = divisor.ok_or_else(|| no("a quotient of expressions"))?;
                        x.scaled(&divisor.recip())
                    }
                }
            }
        })
    }

    /// The sine or cosine of a variable, as a series where it is an error and the ring is truncated.
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

    /// The root of an expression without errors, one atom for each radicand.
    pub fn root(&mut self, radicand: Polynomial) -> Polynomial {
        if radicand.is_zero() {
            return radicand;
        }
        let place = self.roots.iter().position(|known| *known == radicand);
        let place = place.unwrap_or_else(|| {
            self.roots.push(radicand);
            self.roots.len() - 1
        });
        Polynomial::atom(Atom::Root(place))
    }

    /// The product in normal form, up to the ring's order.
    pub fn product(&self, a: &Polynomial, b: &Polynomial) -> Polynomial {
        let beyond = |monomial: &Monomial| {
            self.order
                .is_some_and(|order| monomial.degree(|atom| self.is_small(atom)) > order)
        };
        let mut pending: Vec<(Monomial, BigRational)> = a.product(b, beyond).0.into_iter().collect();
        let mut product = Polynomial::default();
        while let Some((mut monomial, coefficient)) = pending.pop() {
            let Some(place) = squared(&monomial) else {
                product.insert(monomial, coefficient);
                continue;
            };
            let (atom, power) = monomial.0[place];
            if power == 2 {
                monomial.0.remove(place);
            } else {
                monomial.0[place].1 = power - 2;
            }
            let square = match atom {
                Atom::Root(root) => self.roots[root].clone(),
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

    /// The errors and instrument unknowns among `parameters` that none of the forms contains.
    pub fn absent<'v>(&self, forms: &[Polynomial], parameters: &'v [Variable]) -> Vec<&'v Variable> {
        let contains = |variable: &Variable| {
            let Some(Atom::Variable(id)) = self.atom_of(variable) else {
                return false;
            };
            let own =
                |atom: Atom| atom == Atom::Variable(id) || atom == Atom::Sin(id) || atom == Atom::Cos(id);
            forms.iter().any(|form| form.contains(own))
        };
        parameters.iter().filter(|variable| !contains(variable)).collect()
    }
}

/// The place of a sine or root that a rule applies to.
fn squared(monomial: &Monomial) -> Option<usize> {
    let mut powers = monomial.0.iter();
    powers.position(|(atom, power)| *power >= 2 && matches!(atom, Atom::Sin(_) | Atom::Root(_)))
}
