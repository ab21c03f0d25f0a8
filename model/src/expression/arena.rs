//! The arena: the recorded calculation as a graph in which equal expressions are one node.

use std::cell::RefCell;
use std::collections::HashMap;

use super::node::{Binary, Node, NodeId, Operand, Unary, VariableId, operands};

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

    /// Returns the node of a variable and records it if it is new.
    pub(super) fn intern_variable(&self, variable: V) -> Operand {
        let index = self.variables.borrow().iter().position(|known| *known == variable);
        let index = index.unwrap_or_else(|| {
            self.variables.borrow_mut().push(variable);
            self.variables.borrow().len() - 1
        });
        self.intern(Node::Variable(VariableId(index as u32)))
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
    pub(super) fn intern(&self, node: Node) -> Operand {
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
