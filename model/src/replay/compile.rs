//! From an expression to the steps of a replay: uniform quantities, fused operations, pairs, registers.

use std::collections::{HashMap, HashSet};

use super::instruction::{Instruction, Operation, Register};
use super::{Delivery, Replay, Scalar, Step, Uniform};
use crate::expression::{Arena, Binary, Node, NodeId, Operand, operands};

/// State of the nodes while an evaluation is prepared.
pub(super) struct Compiler<'a, V> {
    arena: &'a Arena<V>,
    /// The nodes on which the outputs depend; operands precede the nodes that use them.
    nodes: Vec<NodeId>,
    uniform: Vec<Uniform<V>>,
    uniform_of: HashMap<Operand, usize>,
    scalars: Vec<Scalar>,
    scalar_of: HashMap<Scalar, usize>,
    /// For each use of an operand, whether a sum or difference uses it and could fuse with a product.
    uses: HashMap<Operand, Vec<bool>>,
    varying: HashSet<NodeId>,
}

/// A term of a sum.
#[derive(Clone, Copy)]
enum Term {
    Block(Operand),
    Scalar(Operand),
    /// Of two blocks.
    Product(Operand, Operand),
    /// A scalar times a block.
    Scaled(Operand, Operand),
}

/// An instruction with the nodes that it computes.
struct Computed {
    instruction: Instruction<Operand>,
    first: NodeId,
    second: Option<NodeId>,
}

impl<'a, V: Clone + PartialEq> Compiler<'a, V> {
    pub(super) fn new(arena: &'a Arena<V>, outputs: &[Operand], varies: impl Fn(&V) -> bool) -> Self {
        let mut compiler = Compiler {
            arena,
            nodes: arena.reachable(outputs),
            uniform: Vec::new(),
            uniform_of: HashMap::new(),
            scalars: Vec::new(),
            scalar_of: HashMap::new(),
            uses: HashMap::new(),
            varying: HashSet::new(),
        };
        for id in &compiler.nodes {
            let node = arena.node(*id);
            let varying = match node {
                Node::Variable(variable) => varies(&arena.variable_at(variable)),
                _ => operands(node).any(|operand| compiler.varies(operand)),
            };
            if varying {
                compiler.varying.insert(*id);
            }
            for operand in operands(node) {
                let can_fuse = matches!(node, Node::Binary(Binary::Add | Binary::Sub, ..));
                compiler.uses.entry(operand).or_default().push(can_fuse);
            }
        }
        for output in outputs {
            compiler.uses.entry(*output).or_default().push(false);
        }
        compiler
    }

    fn varies(&self, operand: Operand) -> bool {
        matches!(operand, Operand::Node(id) if self.varying.contains(&id))
    }

    /// The index of a uniform operand among the uniform quantities.
    fn uniform(&mut self, operand: Operand) -> usize {
        if let Some(index) = self.uniform_of.get(&operand) {
            return *index;
        }
        let quantity = match operand {
            Operand::Constant(constant) => Uniform::Constant(constant.value()),
            Operand::Node(id) => match self.arena.node(id) {
                Node::Variable(variable) => Uniform::Given(self.arena.variable_at(variable)),
                Node::Unary(op, a) => Uniform::Unary(op, self.uniform(a)),
                Node::Binary(op, a, b) => Uniform::Binary(op, self.uniform(a), self.uniform(b)),
            },
        };
        self.uniform.push(quantity);
        self.uniform_of.insert(operand, self.uniform.len() - 1);
        self.uniform.len() - 1
    }

    /// The index of a uniform operand or its negative among the scalars.
    fn scalar(&mut self, operand: Operand, negative: bool) -> usize {
        let scalar = Scalar { uniform: self.uniform(operand), negative };
        *self.scalar_of.entry(scalar).or_insert_with(|| {
            self.scalars.push(scalar);
            self.scalars.len() - 1
        })
    }

    /// The factors of a product that is used only by one sum or difference.
    fn product(&self, operand: Operand) -> Option<[Operand; 2]> {
        match self.arena.node_of(operand)? {
            Node::Binary(Binary::Mul, a, b) if self.varies(operand) && self.uses[&operand] == [true] => Some([a, b]),
            _ => None,
        }
    }

    fn term(&self, operand: Operand) -> Term {
        if !self.varies(operand) {
            return Term::Scalar(operand);
        }
        match self.product(operand) {
            None => Term::Block(operand),
            Some([a, b]) if !self.varies(a) => Term::Scaled(a, b),
            Some([a, b]) if !self.varies(b) => Term::Scaled(b, a),
            Some([a, b]) => Term::Product(a, b),
        }
    }

    /// The instruction of a node; `None` for a variable, and for a product that is fused with another operation.
    fn instruction(&mut self, id: NodeId) -> Option<Instruction<Operand>> {
        if self.product(Operand::Node(id)).is_some() {
            return None;
        }
        match self.arena.node(id) {
            Node::Variable(_) => None,
            Node::Unary(op, a) => Some(of(Operation::Unary(op), &[a], &[])),
            Node::Binary(Binary::Add, a, b) => self.sum(self.term(a), self.term(b), false),
            Node::Binary(Binary::Sub, a, b) => self.sum(self.term(a), self.term(b), true),
            Node::Binary(op, a, b) => Some(match (op, self.varies(a), self.varies(b)) {
                (_, true, true) => of(Operation::Blocks(op), &[a, b], &[]),
                (Binary::Mul, true, false) => of(Operation::Scaled, &[a], &[self.scalar(b, false)]),
                (Binary::Mul, false, _) => of(Operation::Scaled, &[b], &[self.scalar(a, false)]),
                (_, true, false) => of(Operation::OverScalar, &[a], &[self.scalar(b, false)]),
                (_, false, _) => of(Operation::ScalarOverBlock, &[b], &[self.scalar(a, false)]),
            }),
        }
    }

    /// The sum of two terms, or with `less` their difference. `None` if both are scalars.
    fn sum(&mut self, a: Term, b: Term, less: bool) -> Option<Instruction<Operand>> {
        let either = |sum: Operation, difference: Operation| if less { difference } else { sum };
        let plain = if less { Binary::Sub } else { Binary::Add };
        Some(match (a, b) {
            (Term::Scalar(_), Term::Scalar(_)) => return None,
            (Term::Block(w), Term::Block(x)) => of(Operation::Blocks(plain), &[w, x], &[]),
            (Term::Block(w), Term::Scalar(r)) => of(Operation::Shifted, &[w], &[self.scalar(r, less)]),
            (Term::Scalar(r), Term::Block(w)) => {
                of(either(Operation::Shifted, Operation::ScalarLessBlock), &[w], &[self.scalar(r, false)])
            }
            (Term::Product(w, x), Term::Block(y)) => {
                of(either(Operation::ProductPlusBlock, Operation::ProductLessBlock), &[w, x, y], &[])
            }
            (Term::Block(y), Term::Product(w, x)) => {
                of(either(Operation::ProductPlusBlock, Operation::BlockLessProduct), &[w, x, y], &[])
            }
            (Term::Product(w, x), Term::Scalar(r)) => {
                of(Operation::ProductPlusScalar, &[w, x], &[self.scalar(r, less)])
            }
            (Term::Scalar(r), Term::Product(w, x)) => {
                let operation = either(Operation::ProductPlusScalar, Operation::ScalarLessProduct);
                of(operation, &[w, x], &[self.scalar(r, false)])
            }
            (Term::Scaled(r, w), Term::Block(x)) => {
                let operation = either(Operation::ScaledPlusBlock, Operation::ScaledLessBlock);
                of(operation, &[w, x], &[self.scalar(r, false)])
            }
            (Term::Block(x), Term::Scaled(r, w)) => of(Operation::ScaledPlusBlock, &[w, x], &[self.scalar(r, less)]),
            (Term::Scaled(r, w), Term::Scalar(s)) => {
                of(Operation::ScaledPlusScalar, &[w], &[self.scalar(r, false), self.scalar(s, less)])
            }
            (Term::Scalar(s), Term::Scaled(r, w)) => {
                of(Operation::ScaledPlusScalar, &[w], &[self.scalar(r, less), self.scalar(s, false)])
            }
            (Term::Product(w, x), Term::Product(y, z)) => {
                of(either(Operation::ProductPlusProduct, Operation::ProductLessProduct), &[w, x, y, z], &[])
            }
            (Term::Product(w, x), Term::Scaled(r, y)) => {
                of(Operation::ProductPlusScaled, &[w, x, y], &[self.scalar(r, less)])
            }
            (Term::Scaled(r, y), Term::Product(w, x)) => {
                let operation = either(Operation::ProductPlusScaled, Operation::ScaledLessProduct);
                of(operation, &[w, x, y], &[self.scalar(r, false)])
            }
            (Term::Scaled(r, w), Term::Scaled(s, x)) => {
                of(Operation::ScaledPlusScaled, &[w, x], &[self.scalar(r, false), self.scalar(s, less)])
            }
        })
    }

    pub(super) fn replay(mut self, outputs: &[Operand]) -> Replay<V> {
        let mut computed: Vec<Computed> = Vec::new();
        let mut columns: Vec<V> = Vec::new();
        let mut register_of: HashMap<Operand, Register> = HashMap::new();
        let nodes = std::mem::take(&mut self.nodes);
        for id in nodes {
            if !self.varying.contains(&id) {
                continue;
            }
            if let Node::Variable(variable) = self.arena.node(id) {
                register_of.insert(Operand::Node(id), columns.len());
                columns.push(self.arena.variable_at(variable));
            } else if let Some(instruction) = self.instruction(id) {
                computed.push(Computed { instruction, first: id, second: None });
            }
        }
        let mut uniform_outputs = Vec::new();
        for output in outputs {
            if !self.varies(*output) && !register_of.contains_key(output) {
                register_of.insert(*output, columns.len() + uniform_outputs.len());
                uniform_outputs.push(self.scalar(*output, false));
            }
        }
        let kept = register_of.len();
        let not_computed = outputs.iter().enumerate();
        let not_computed = not_computed.filter_map(|(output, of)| Some((output, *register_of.get(of)?))).collect();
        let mut file = Registers { of: register_of, kept, count: kept, free: Vec::new() };
        let (steps, computed) = file.allocate(&in_pairs(computed), outputs);
        Replay {
            uniform: self.uniform,
            scalars: self.scalars,
            columns,
            uniform_outputs,
            steps,
            registers: file.count,
            not_computed,
            computed,
        }
    }
}

/// An instruction with its blocks and scalars.
fn of(operation: Operation, blocks: &[Operand], scalars: &[usize]) -> Instruction<Operand> {
    Instruction {
        operation,
        blocks: std::array::from_fn(|k| *blocks.get(k).unwrap_or(&blocks[0])),
        scalars: std::array::from_fn(|k| scalars.get(k).or(scalars.first()).copied().unwrap_or(0)),
    }
}

/// Joins each instruction with the next one over the same blocks, if one operation computes both. The second is then
/// computed where the first stands: its operands are known there.
fn in_pairs(computed: Vec<Computed>) -> Vec<Computed> {
    let mut waiting: HashMap<Vec<Operand>, Vec<usize>> = HashMap::new();
    let mut joined: Vec<Computed> = Vec::with_capacity(computed.len());
    for next in computed {
        let mut blocks = next.instruction.blocks.to_vec();
        blocks.sort();
        blocks.dedup();
        let waiting = waiting.entry(blocks).or_default();
        let found = waiting.iter().enumerate().find_map(|(k, index)| Some((k, *index, pair(&joined[*index], &next)?)));
        match found {
            Some((k, index, pair)) => {
                joined[index] = pair;
                waiting.remove(k);
            }
            None => {
                waiting.push(joined.len());
                joined.push(next);
            }
        }
    }
    joined
}

/// Two instructions as one.
fn pair(a: &Computed, b: &Computed) -> Option<Computed> {
    if a.second.is_some() {
        return None;
    }
    let joined = |operation: Operation, blocks: [Operand; 4], scalars: [usize; 4], [first, second]: [NodeId; 2]| {
        Some(Computed { instruction: Instruction { operation, blocks, scalars }, first, second: Some(second) })
    };
    let ([w, x, y, z], [e, f, g, h]) = (a.instruction.blocks, b.instruction.blocks);
    match (a.instruction.operation, b.instruction.operation) {
        (Operation::ScaledPlusScaled, Operation::ScaledPlusScaled) => {
            let ([r, s, ..], [t, u, ..]) = (a.instruction.scalars, b.instruction.scalars);
            let [t, u] = if (e, f) == (w, x) { [t, u] } else { [u, t] };
            joined(Operation::TwoCombinations, a.instruction.blocks, [r, s, t, u], [a.first, b.first])
        }
        (Operation::ProductLessProduct, Operation::ProductPlusProduct) => {
            // a = w·x − y·z. b has to be w·z + y·x, or w·y + z·x, in which y and z are exchanged.
            let same = |[i, j]: [Operand; 2], [k, l]: [Operand; 2]| (i, j) == (k, l) || (i, j) == (l, k);
            let is = |p, q| same([e, f], p) && same([g, h], q) || same([e, f], q) && same([g, h], p);
            let scalars = a.instruction.scalars;
            if is([w, z], [y, x]) {
                joined(Operation::Turn, [w, y, x, z], scalars, [a.first, b.first])
            } else if is([w, y], [z, x]) {
                joined(Operation::Turn, [w, z, x, y], scalars, [a.first, b.first])
            } else {
                None
            }
        }
        (Operation::ProductPlusProduct, Operation::ProductLessProduct) => pair(b, a),
        _ => None,
    }
}

/// The register file while registers are given to results.
struct Registers {
    of: HashMap<Operand, Register>,
    /// Registers below this index are never reused.
    kept: usize,
    count: usize,
    free: Vec<Register>,
}

impl Registers {
    fn take(&mut self, id: NodeId) -> Register {
        let register = self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            self.count - 1
        });
        self.of.insert(Operand::Node(id), register);
        register
    }

    /// Gives registers to results. A register is reused after its last use.
    fn allocate(&mut self, computed: &[Computed], outputs: &[Operand]) -> (Vec<Step>, Vec<Delivery>) {
        let mut last_read: HashMap<Operand, usize> = HashMap::new();
        for (step, Computed { instruction, .. }) in computed.iter().enumerate() {
            last_read.extend(instruction.blocks.map(|operand| (operand, step)));
        }
        let (mut steps, mut deliveries) = (Vec::with_capacity(computed.len()), Vec::new());
        for (step, Computed { instruction, first, second }) in computed.iter().enumerate() {
            let blocks = instruction.blocks.map(|operand| self.of[&operand]);
            for (operand, register) in instruction.blocks.iter().zip(blocks) {
                if register >= self.kept && last_read[operand] == step && !self.free.contains(&register) {
                    self.free.push(register);
                }
            }
            let results: Vec<NodeId> = [*first].into_iter().chain(*second).collect();
            let registers: Vec<Register> = results.iter().map(|id| self.take(*id)).collect();
            for (id, register) in results.iter().zip(&registers) {
                let delivered = outputs.iter().enumerate().filter(|(_, output)| **output == Operand::Node(*id));
                deliveries.extend(delivered.map(|(output, _)| Delivery { step, output, register: *register }));
                if !last_read.contains_key(&Operand::Node(*id)) {
                    self.free.push(*register);
                }
            }
            let instruction = Instruction { operation: instruction.operation, blocks, scalars: instruction.scalars };
            steps.push(Step { instruction, first: registers[0], second: registers.get(1).copied() });
        }
        (steps, deliveries)
    }
}
