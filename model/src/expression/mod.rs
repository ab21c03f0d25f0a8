//! The symbolic scalar: hash-consed and `Copy`; expressions are owned by an arena of the caller.
//!
//! A [`Symbol`] takes the place of a number in the chain. The calculation is recorded as a graph in an [`Arena`]. Equal
//! expressions are one node, so a common subexpression is found when it is built. A symbol contains constants directly,
//! and 0, 1 and −1 are eliminated. The caller defines the meaning of a variable: a printed name (`abbe-codegen`), or a
//! column of numbers ([`crate::sensitivity`]).

mod derivative;
mod fold;

pub use derivative::Adjoints;

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::{Nominal, Scalar};

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
pub struct NodeId(u32);

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

/// The owner of symbols. Symbols cannot outlive it, and arenas share nothing.
#[derive(Debug)]
pub struct Arena<V> {
    nodes: RefCell<Vec<Node>>,
    places: RefCell<HashMap<Node, NodeId>>,
    variables: RefCell<Vec<V>>,
}

impl<V> Default for Arena<V> {
    fn default() -> Self {
        Arena { nodes: RefCell::default(), places: RefCell::default(), variables: RefCell::default() }
    }
}

impl<V: Clone + PartialEq> Arena<V> {
    /// An empty arena.
    pub fn new() -> Self {
        Arena::default()
    }

    /// The symbol of a variable; the same variable is always the same symbol.
    pub fn variable(&self, variable: V) -> Symbol<'_, V> {
        let index = self.variables.borrow().iter().position(|known| *known == variable);
        let index = index.unwrap_or_else(|| {
            self.variables.borrow_mut().push(variable);
            self.variables.borrow().len() - 1
        });
        self.symbol(self.intern(Node::Variable(VariableId(index as u32))))
    }

    /// The symbol of an operand of this arena.
    pub fn symbol(&self, operand: Operand) -> Symbol<'_, V> {
        Symbol(match operand {
            Operand::Constant(constant) => Repr::Constant(constant.value()),
            Operand::Node(id) => Repr::Node(self, id),
        })
    }

    /// A node by its index.
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes.borrow()[id.0 as usize]
    }

    /// The node of an operand, unless it is a constant.
    pub fn node_of(&self, operand: Operand) -> Option<Node> {
        match operand {
            Operand::Constant(_) => None,
            Operand::Node(id) => Some(self.node(id)),
        }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.borrow().len()
    }

    /// A variable by its index.
    pub fn variable_at(&self, id: VariableId) -> V {
        self.variables.borrow()[id.0 as usize].clone()
    }

    /// All variables in the order of their creation.
    pub fn variables(&self) -> Vec<V> {
        self.variables.borrow().clone()
    }

    /// Returns the node and records it if it is new. `a + b` and `b + a` are one node, and likewise the products.
    fn intern(&self, node: Node) -> Operand {
        let mut places = self.places.borrow_mut();
        if let Some(id) = places.get(&node) {
            return Operand::Node(*id);
        }
        if let Node::Binary(op @ (Binary::Add | Binary::Mul), a, b) = node
            && let Some(id) = places.get(&Node::Binary(op, b, a))
        {
            return Operand::Node(*id);
        }
        let mut nodes = self.nodes.borrow_mut();
        let id = NodeId(nodes.len() as u32);
        nodes.push(node);
        places.insert(node, id);
        Operand::Node(id)
    }

    /// Whether the variable itself is used, not only its sine or cosine.
    pub fn is_used_directly(&self, variable: &V) -> bool {
        let nodes = self.nodes.borrow();
        let variables = self.variables.borrow();
        let itself = |operand: Operand| {
            matches!(operand, Operand::Node(id) if matches!(nodes[id.0 as usize], Node::Variable(index)
                if variables[index.0 as usize] == *variable))
        };
        let plain =
            |node: &Node| !matches!(node, Node::Unary(Unary::Sin | Unary::Cos, _)) && operands(*node).any(itself);
        nodes.iter().any(plain)
    }

    /// The variables on which `outputs` depend.
    pub fn variables_of(&self, outputs: &[Operand]) -> Vec<VariableId> {
        let variable = |id: NodeId| match self.node(id) {
            Node::Variable(variable) => Some(variable),
            Node::Unary(..) | Node::Binary(..) => None,
        };
        self.reachable(outputs).into_iter().filter_map(variable).collect()
    }

    /// The nodes on which `outputs` depend; operands precede the nodes that use them.
    pub fn reachable(&self, outputs: &[Operand]) -> Vec<NodeId> {
        let mut used = vec![false; self.node_count()];
        for output in outputs {
            if let Operand::Node(id) = output {
                used[id.0 as usize] = true;
            }
        }
        for index in (0..used.len()).rev() {
            if !used[index] {
                continue;
            }
            for operand in operands(self.node(NodeId(index as u32))) {
                if let Operand::Node(id) = operand {
                    used[id.0 as usize] = true;
                }
            }
        }
        (0..used.len()).filter(|&index| used[index]).map(|index| NodeId(index as u32)).collect()
    }
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

/// A symbolic number: an expression in an [`Arena`], or a constant.
pub struct Symbol<'arena, V>(Repr<'arena, V>);

enum Repr<'arena, V> {
    Constant(f64),
    Node(&'arena Arena<V>, NodeId),
}

impl<V> Clone for Symbol<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V> Copy for Symbol<'_, V> {}

impl<V> Clone for Repr<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V> Copy for Repr<'_, V> {}

impl<'arena, V: Clone + PartialEq> Symbol<'arena, V> {
    /// The operand, which is independent of the borrow of the arena.
    pub fn operand(self) -> Operand {
        match self.0 {
            Repr::Constant(value) => Operand::constant(value),
            Repr::Node(_, id) => Operand::Node(id),
        }
    }

    fn arena(self) -> Option<&'arena Arena<V>> {
        match self.0 {
            Repr::Constant(_) => None,
            Repr::Node(arena, _) => Some(arena),
        }
    }

    fn unary(self, op: Unary) -> Self {
        match self.0 {
            Repr::Constant(value) => Symbol(Repr::Constant(op.of(value))),
            Repr::Node(arena, id) => arena.symbol(fold::unary(arena, op, Operand::Node(id))),
        }
    }

    fn binary(self, op: Binary, other: Self) -> Self {
        match self.arena().or(other.arena()) {
            Some(arena) => arena.symbol(fold::binary(arena, op, self.operand(), other.operand())),
            None => match (self.0, other.0) {
                (Repr::Constant(a), Repr::Constant(b)) => Symbol(Repr::Constant(op.of(a, b))),
                _ => self,
            },
        }
    }

    /// Sine and cosine.
    pub fn sin_cos(self) -> (Self, Self) {
        (self.unary(Unary::Sin), self.unary(Unary::Cos))
    }

    /// The non-negative square root.
    pub fn sqrt(self) -> Self {
        self.unary(Unary::Sqrt)
    }
}

impl<V> PartialEq for Symbol<'_, V> {
    /// Equality of constants or of nodes of the same arena. Algebraic equality is decided by the normal form of
    /// `abbe-codegen`.
    fn eq(&self, other: &Self) -> bool {
        match (self.0, other.0) {
            (Repr::Constant(a), Repr::Constant(b)) => a == b,
            (Repr::Node(arena, a), Repr::Node(other, b)) => std::ptr::eq(arena, other) && a == b,
            _ => false,
        }
    }
}

impl<V> std::fmt::Debug for Symbol<'_, V> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Repr::Constant(value) => write!(formatter, "{value}"),
            Repr::Node(_, id) => write!(formatter, "node {}", id.0),
        }
    }
}

impl<V: Clone + PartialEq> Add for Symbol<'_, V> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.binary(Binary::Add, other)
    }
}

impl<V: Clone + PartialEq> Sub for Symbol<'_, V> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.binary(Binary::Sub, other)
    }
}

impl<V: Clone + PartialEq> Mul for Symbol<'_, V> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.binary(Binary::Mul, other)
    }
}

impl<V: Clone + PartialEq> Div for Symbol<'_, V> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        self.binary(Binary::Div, other)
    }
}

impl<V: Clone + PartialEq> Neg for Symbol<'_, V> {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary(Unary::Neg)
    }
}

impl<V: Clone + PartialEq> Nominal for Symbol<'_, V> {
    fn constant(value: f64) -> Self {
        Symbol(Repr::Constant(value))
    }
    fn sin_cos(self) -> (Self, Self) {
        Symbol::sin_cos(self)
    }
    fn sqrt(self) -> Self {
        Symbol::sqrt(self)
    }
    fn exp(self) -> Self {
        self.unary(Unary::Exp)
    }
    fn signum(self) -> Self {
        self.unary(Unary::Signum)
    }
    fn step(self) -> Self {
        self.unary(Unary::Step)
    }
    fn floor(self) -> Self {
        self.unary(Unary::Floor)
    }
    fn round(self) -> Self {
        self.unary(Unary::Round)
    }
    fn known(self) -> Option<f64> {
        self.operand().known()
    }
}

impl<V: Clone + PartialEq> Scalar for Symbol<'_, V> {
    type Nominal = Self;
    fn nominal(value: Self) -> Self {
        value
    }
    fn sin_cos(self) -> (Self, Self) {
        Symbol::sin_cos(self)
    }
    fn sqrt(self) -> Self {
        Symbol::sqrt(self)
    }
}
