//! Derivatives of an expression by reverse accumulation on its graph.
//!
//! From the output backwards, every node adds its adjoint `w = ∂output/∂node` to its operands:
//!
//! ```text
//! n = a + b: a += w, b += w        n = a·b: a += w·b, b += w·a        n = √a: a += w·(½/n)
//! n = a − b: a += w, b −= w        n = a/b: a += w/b, b −= w·n/b      n = sin a: a += w·cos a
//! ```
//!
//! For the length of the bar, the first adjoint is the unit vector of the bar. It is then transformed back through the
//! chain, frame by frame, and gives the derivative by every error on the way. Nothing is expanded and nothing is
//! computed twice.

use std::collections::HashMap;

use super::{Arena, Binary, Node, NodeId, Operand, Symbol, Unary, operands};

/// `∂output/∂node` for the nodes that depend on the requested variables.
#[derive(Clone, Debug, Default)]
pub struct Adjoints(HashMap<NodeId, Operand>);

impl Adjoints {
    /// The derivative by the node of an operand; zero if the output does not depend on it.
    pub fn of(&self, operand: Operand) -> Operand {
        match operand {
            Operand::Node(id) => self.0.get(&id).copied().unwrap_or(Operand::constant(0.0)),
            Operand::Constant(_) => Operand::constant(0.0),
        }
    }

    fn add<'a, V: Clone + PartialEq>(&mut self, arena: &'a Arena<V>, operand: Operand, contribution: Symbol<'a, V>) {
        if let Operand::Node(id) = operand {
            let sum = match self.0.get(&id) {
                Some(sum) => arena.symbol(*sum) + contribution,
                None => contribution,
            };
            self.0.insert(id, sum.operand());
        }
    }
}

impl<V: Clone + PartialEq> Arena<V> {
    /// The derivatives of `output` by every node between it and `variables`.
    pub fn adjoints(&self, output: Operand, variables: &[Operand]) -> Adjoints {
        let mut adjoints = Adjoints::default();
        let Operand::Node(root) = output else {
            return adjoints;
        };
        let nodes = self.reachable(&[output]);
        let mut active: HashMap<NodeId, bool> = HashMap::new();
        for id in &nodes {
            let itself = variables.contains(&Operand::Node(*id));
            let through = operands(self.node(*id))
                .any(|operand| matches!(operand, Operand::Node(a) if active.get(&a) == Some(&true)));
            active.insert(*id, itself || through);
        }
        let is_active = |operand: Operand| matches!(operand, Operand::Node(id) if active.get(&id) == Some(&true));
        let one = Operand::constant(1.0);
        adjoints.0.insert(root, one);
        for id in nodes.into_iter().rev() {
            let (Some(weight), true) = (adjoints.0.get(&id).copied(), is_active(Operand::Node(id))) else {
                continue;
            };
            let w = self.symbol(weight);
            let n = self.symbol(Operand::Node(id));
            let mut pass = |operand: Operand, contribution: Symbol<'_, V>| {
                if is_active(operand) {
                    adjoints.add(self, operand, self.symbol(contribution.operand()));
                }
            };
            let constant = |value: f64| self.symbol(Operand::constant(value));
            match self.node(id) {
                Node::Variable(_) => {}
                Node::Unary(op, a) => {
                    let x = self.symbol(a);
                    match op {
                        Unary::Neg => pass(a, -w),
                        Unary::Sin => pass(a, w * x.sin_cos().1),
                        Unary::Cos => pass(a, -(w * x.sin_cos().0)),
                        Unary::Sqrt => pass(a, w * (constant(0.5) / n)),
                        Unary::Exp => pass(a, w * n),
                        Unary::Signum | Unary::Step | Unary::Floor | Unary::Round => {}
                    }
                }
                Node::Binary(op, a, b) => {
                    let (x, y) = (self.symbol(a), self.symbol(b));
                    match op {
                        Binary::Add => {
                            pass(a, w);
                            pass(b, w);
                        }
                        Binary::Sub => {
                            pass(a, w);
                            pass(b, -w);
                        }
                        Binary::Mul if a == b => pass(a, constant(2.0) * w * x),
                        Binary::Mul => {
                            if is_active(a) {
                                pass(a, w * y);
                            }
                            if is_active(b) {
                                pass(b, w * x);
                            }
                        }
                        Binary::Div => {
                            pass(a, w / y);
                            if is_active(b) {
                                pass(b, -(w * n / y));
                            }
                        }
                    }
                }
            }
        }
        adjoints
    }

    /// The derivatives of `output` by each of `variables`.
    pub fn gradient(&self, output: Operand, variables: &[Operand]) -> Vec<Operand> {
        let adjoints = self.adjoints(output, variables);
        variables.iter().map(|variable| adjoints.of(*variable)).collect()
    }

    /// The second derivatives of `output` by each pair of `variables`: row `i` is the gradient of the derivative by
    /// variable `i`.
    pub fn second_derivatives(&self, output: Operand, variables: &[Operand]) -> Vec<Vec<Operand>> {
        self.gradient(output, variables).into_iter().map(|derivative| self.gradient(derivative, variables)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Nominal;

    /// ∂(b·exp(a·x))/∂x = b·exp(a·x)·a and ∂/∂b = exp(a·x) use the same nodes, because equal nodes are recorded once.
    #[test]
    fn an_exponential_is_its_own_derivative() {
        let arena = Arena::default();
        let [a, b, x] = ["a", "b", "x"].map(|name| arena.variable(name));
        let exponential = (a * x).exp();
        let gradient = arena.gradient((b * exponential).operand(), &[x.operand(), b.operand()]);
        assert_eq!(gradient, [(b * exponential * a).operand(), exponential.operand()]);
    }
}
