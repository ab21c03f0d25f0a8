//! Nodes of a recorded calculation: variables, constants, functions and operations.

use crate::scalar::Nominal;

/// A constant, compared bit by bit; −0 is stored as 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Constant(u64);

impl Constant {
    /// The constant `value`.
    pub fn new(value: f64) -> Self {
        Constant(if value == 0.0 { 0.0_f64.to_bits() } else { value.to_bits() })
    }

    /// Its value.
    pub fn value(self) -> f64 {
        f64::from_bits(self.0)
    }
}

/// The index of a node in its arena. The operands of a node have smaller indices than the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub(super) u32);

impl NodeId {
    /// The index, from 0.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The index of a variable in its arena.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VariableId(pub u32);

/// A constant or a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Operand {
    /// A constant.
    Constant(Constant),
    /// A node of the arena.
    Node(NodeId),
}

impl Operand {
    /// The constant `value`.
    pub fn constant(value: f64) -> Self {
        Operand::Constant(Constant::new(value))
    }

    /// The value, if the operand is a constant.
    pub fn known(self) -> Option<f64> {
        match self {
            Operand::Constant(constant) => Some(constant.value()),
            Operand::Node(_) => None,
        }
    }
}

/// A function of one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Unary {
    Neg,
    Sin,
    Cos,
    Sqrt,
    Exp,
    Signum,
    Step,
    Floor,
    Round,
}

impl Unary {
    /// Evaluates the function.
    pub fn of<N: Nominal>(self, a: N) -> N {
        match self {
            Unary::Neg => -a,
            Unary::Sin => a.sin_cos().0,
            Unary::Cos => a.sin_cos().1,
            Unary::Sqrt => a.sqrt(),
            Unary::Exp => a.exp(),
            Unary::Signum => a.signum(),
            Unary::Step => a.step(),
            Unary::Floor => a.floor(),
            Unary::Round => a.round(),
        }
    }
}

/// An operation on two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Binary {
    Add,
    Sub,
    Mul,
    Div,
}

impl Binary {
    /// Evaluates the operation.
    pub fn of<N: Nominal>(self, a: N, b: N) -> N {
        match self {
            Binary::Add => a + b,
            Binary::Sub => a - b,
            Binary::Mul => a * b,
            Binary::Div => a / b,
        }
    }
}

/// One operation of the recorded calculation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A variable.
    Variable(VariableId),
    /// A function of one operand.
    Unary(Unary, Operand),
    /// An operation on two operands.
    Binary(Binary, Operand, Operand),
}

/// The operands of a node.
pub fn operands(node: Node) -> impl Iterator<Item = Operand> {
    let pair = match node {
        Node::Variable(_) => [None, None],
        Node::Unary(_, a) => [Some(a), None],
        Node::Binary(_, a, b) => [Some(a), Some(b)],
    };
    pair.into_iter().flatten()
}
