//! Expressions over the inputs and steps of a program, and how sums and products of them are built and taken apart.

use abbe_model::scalar::Nominal;

use crate::symbol::{Arena, Binary, Operand, Symbol, Unary};

/// An expression to be printed on one line.
#[derive(Clone, Debug, PartialEq)]
pub enum Tree {
    /// A number.
    Number(f64),
    /// An input, by its index in [`Program::inputs`](crate::program::Program::inputs).
    Input(usize),
    /// An earlier step, by its index in [`Program::steps`](crate::program::Program::steps).
    Step(usize),
    /// A function of one operand.
    Unary(Unary, Box<Tree>),
    /// An operation on two operands.
    Binary(Binary, Box<Tree>, Box<Tree>),
}

impl Tree {
    /// Whether it contains an input.
    pub(crate) fn holds(&self, input: usize) -> bool {
        match self {
            Tree::Input(index) => *index == input,
            Tree::Number(_) | Tree::Step(_) => false,
            Tree::Unary(_, a) => a.holds(input),
            Tree::Binary(_, a, b) => a.holds(input) || b.holds(input),
        }
    }

    /// Number of names and numbers in it.
    pub(crate) fn leaves(&self) -> usize {
        match self {
            Tree::Number(_) | Tree::Input(_) | Tree::Step(_) => 1,
            Tree::Unary(_, a) => a.leaves(),
            Tree::Binary(_, a, b) => a.leaves() + b.leaves(),
        }
    }

    /// Replaces every occurrence of an expression by another one.
    pub(crate) fn replaced(&self, what: &Tree, by: &Tree) -> Tree {
        self.mapped(&|tree| (tree == what).then(|| by.clone()))
    }

    /// Replaces every expression for which `by` gives another one, from the outside inwards.
    pub(crate) fn mapped(&self, by: &dyn Fn(&Tree) -> Option<Tree>) -> Tree {
        if let Some(other) = by(self) {
            return other;
        }
        let inner = |tree: &Tree| Box::new(tree.mapped(by));
        match self {
            Tree::Number(_) | Tree::Input(_) | Tree::Step(_) => self.clone(),
            Tree::Unary(function, a) => Tree::Unary(*function, inner(a)),
            Tree::Binary(op, a, b) => Tree::Binary(*op, inner(a), inner(b)),
        }
    }

    /// The value for these inputs and earlier steps.
    pub(crate) fn value(&self, inputs: &[f64], steps: &[f64]) -> f64 {
        match self {
            Tree::Number(value) => *value,
            Tree::Input(index) => inputs[*index],
            Tree::Step(index) => steps[*index],
            Tree::Unary(function, a) => function.of(a.value(inputs, steps)),
            Tree::Binary(op, a, b) => op.of(a.value(inputs, steps), b.value(inputs, steps)),
        }
    }

    /// Builds the expression in an arena; `inputs` are the operands of the program's inputs.
    pub(crate) fn symbol<'a>(&self, arena: &'a Arena, inputs: &[Operand]) -> Symbol<'a> {
        match self {
            Tree::Number(value) => arena.symbol(Operand::constant(*value)),
            Tree::Input(index) | Tree::Step(index) => arena.symbol(inputs[*index]),
            Tree::Unary(function, a) => {
                let a = a.symbol(arena, inputs);
                match function {
                    Unary::Neg => -a,
                    Unary::Sqrt => a.sqrt(),
                    Unary::Sin => a.sin_cos().0,
                    Unary::Cos => a.sin_cos().1,
                    Unary::Exp => a.exp(),
                    Unary::Signum => a.signum(),
                    Unary::Step => a.step(),
                    Unary::Floor => a.floor(),
                    Unary::Round => a.round(),
                }
            }
            Tree::Binary(op, a, b) => {
                let (a, b) = (a.symbol(arena, inputs), b.symbol(arena, inputs));
                match op {
                    Binary::Add => a + b,
                    Binary::Sub => a - b,
                    Binary::Mul => a * b,
                    Binary::Div => a / b,
                }
            }
        }
    }
}

/// A term with its sign; true means minus.
pub(crate) type Term = (bool, Tree);

/// `a op b`.
pub(crate) fn binary(op: Binary, a: Tree, b: Tree) -> Tree {
    Tree::Binary(op, Box::new(a), Box::new(b))
}

/// `−tree`.
pub(crate) fn negative(tree: Tree) -> Tree {
    Tree::Unary(Unary::Neg, Box::new(tree))
}

/// `a·b·c`; 1 for no factors.
pub(crate) fn product(factors: Vec<Tree>) -> Tree {
    let product = factors.into_iter().reduce(|a, b| binary(Binary::Mul, a, b));
    product.unwrap_or(Tree::Number(1.0))
}

/// `a + b − c`; 0 for no terms.
pub(crate) fn sum(terms: Vec<Term>) -> Tree {
    let mut terms = terms.into_iter();
    let Some((minus, first)) = terms.next() else {
        return Tree::Number(0.0);
    };
    let first = if minus { negative(first) } else { first };
    terms.fold(first, |sum, (minus, term)| binary(if minus { Binary::Sub } else { Binary::Add }, sum, term))
}

/// The terms of a sum with their signs; true means minus.
pub(crate) fn terms_of(tree: &Tree) -> Vec<Term> {
    fn flatten(tree: &Tree, minus: bool, terms: &mut Vec<Term>) {
        match tree {
            Tree::Binary(op @ (Binary::Add | Binary::Sub), a, b) => {
                flatten(a, minus, terms);
                flatten(b, minus != (*op == Binary::Sub), terms);
            }
            Tree::Unary(Unary::Neg, a) => flatten(a, !minus, terms),
            Tree::Number(value) if *value < 0.0 => terms.push((!minus, Tree::Number(-value))),
            other => terms.push((minus, other.clone())),
        }
    }
    let mut terms = Vec::new();
    flatten(tree, false, &mut terms);
    terms
}
