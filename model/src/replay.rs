//! Evaluation of a recorded calculation over columns of readings.
//!
//! The chain is recorded once as an [expression](crate::expression). Quantities that are equal for all readings are
//! computed once per evaluation. Every other operation is done for a block of readings before the next operation. This
//! is a loop of fixed length over plain arrays, which the compiler vectorises and which makes the cost of decoding the
//! operation small. The intermediate results of a block stay in the first-level cache.
//!
//! A product that is used only by one sum or difference is fused with it: `a·b + c·d` is one operation.

use std::collections::{HashMap, HashSet};

use pulp::NullaryFnOnce;

use crate::expression::{Arena, Binary, Node, NodeId, Operand, Unary, operands};

/// Number of readings in a block.
const READINGS: usize = 128;

/// A quantity of a block: one number per reading. The alignment keeps vectors within cache lines.
#[derive(Clone)]
#[repr(align(64))]
struct BlockValues([f64; READINGS]);

/// Index of a block in the register file.
type Register = usize;

/// An operation over a block with up to four operands; unused operands repeat the first.
#[derive(Clone, Copy, Debug)]
struct Instruction<Q> {
    operation: Operation,
    operands: [Q; 4],
}

#[derive(Clone, Copy, Debug)]
enum Operation {
    Unary(Unary),
    Binary(Binary),
    /// `a·b` and `c`.
    MultiplyAdd(Combination),
    /// `a·b` and `c·d`.
    SumOfProducts(Combination),
}

/// Combination of two terms.
#[derive(Clone, Copy, Debug)]
enum Combination {
    Sum,
    Difference,
    /// The second less the first.
    Reverse,
}

/// A quantity that is equal for all readings.
#[derive(Clone, Debug)]
enum Uniform<V> {
    Given(V),
    Constant(f64),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
}

/// A recorded calculation of several outputs.
#[derive(Clone, Debug)]
pub struct Replay<V> {
    uniform: Vec<Uniform<V>>,
    /// The uniform quantities that operations or outputs use; they have the first registers.
    broadcast: Vec<usize>,
    /// The variables given for each reading, in the registers that follow.
    columns: Vec<V>,
    /// The operations, each with its result register.
    instructions: Vec<(Instruction<Register>, Register)>,
    registers: usize,
    /// The outputs that no operation computes, because they are uniform or given: output index and register.
    not_computed: Vec<(usize, Register)>,
    /// The computed outputs in the order of their operations: operation index and output index. Each is delivered
    /// immediately, so that its register can be reused.
    computed: Vec<(usize, usize)>,
}

impl<V: Clone + PartialEq> Replay<V> {
    /// Prepares the evaluation of `outputs` of an arena; `varies` tells whether a variable differs between readings.
    pub fn new(arena: &Arena<V>, outputs: &[Operand], varies: impl Fn(&V) -> bool) -> Self {
        let nodes = arena.reachable(outputs);
        let mut compiler = Compiler {
            arena,
            uniform: Vec::new(),
            uniform_of: HashMap::new(),
            uses: HashMap::new(),
            varying: HashSet::new(),
        };
        for id in &nodes {
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
        compiler.replay(&nodes, outputs)
    }

    /// Evaluates the calculation for a number of readings. `given` returns the uniform variables, `column` the varying
    /// ones, one value per reading. For each block and output, `put` receives the index of the output, the first
    /// reading of the block and the values.
    pub fn run<'c>(
        &self,
        rows: usize,
        given: impl Fn(&V) -> f64,
        column: impl Fn(&V) -> &'c [f64],
        put: impl FnMut(usize, usize, &[f64]),
    ) {
        let mut uniform: Vec<f64> = Vec::with_capacity(self.uniform.len());
        for quantity in &self.uniform {
            let value = match quantity {
                Uniform::Given(variable) => given(variable),
                Uniform::Constant(value) => *value,
                Uniform::Unary(op, a) => op.of(uniform[*a]),
                Uniform::Binary(op, a, b) => op.of(uniform[*a], uniform[*b]),
            };
            uniform.push(value);
        }
        let broadcast = self.broadcast.iter().map(|index| uniform[*index]);
        // One more than the registers: an operation writes there and then swaps with the register that it replaces.
        let mut store = vec![BlockValues([0.0; READINGS]); self.registers + 1];
        store.iter_mut().zip(broadcast).for_each(|(block, value)| block.0.fill(value));
        let mut file: Vec<&mut BlockValues> = store.iter_mut().collect();
        let columns: Vec<&[f64]> = self.columns.iter().map(column).collect();
        pulp::Arch::new().dispatch(Evaluation { replay: self, rows, columns: &columns, file: &mut file, put });
    }
}

/// An evaluation over all blocks, compiled for each vector instruction set that the processor may have.
struct Evaluation<'r, 'f, V, P> {
    replay: &'r Replay<V>,
    rows: usize,
    columns: &'r [&'r [f64]],
    file: &'r mut Vec<&'f mut BlockValues>,
    put: P,
}

impl<V, P: FnMut(usize, usize, &[f64])> NullaryFnOnce for Evaluation<'_, '_, V, P> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let first = self.replay.broadcast.len();
        let Some(mut result) = self.file.pop() else { return };
        for start in (0..self.rows).step_by(READINGS) {
            let end = (start + READINGS).min(self.rows);
            for (index, column) in self.columns.iter().enumerate() {
                // Values beyond the last reading are computed too and discarded.
                self.file[first + index].0[..end - start].copy_from_slice(&column[start..end]);
            }
            for (output, register) in &self.replay.not_computed {
                (self.put)(*output, start, &self.file[*register].0[..end - start]);
            }
            let mut computed = self.replay.computed.iter().peekable();
            for (number, (instruction, to)) in self.replay.instructions.iter().enumerate() {
                instruction.evaluate(self.file, result);
                std::mem::swap(&mut self.file[*to], &mut result);
                while let Some((_, output)) = computed.next_if(|(of, _)| *of == number) {
                    (self.put)(*output, start, &self.file[*to].0[..end - start]);
                }
            }
        }
    }
}

impl Instruction<Register> {
    #[inline(always)]
    fn evaluate(&self, file: &[&mut BlockValues], result: &mut BlockValues) {
        let [a, b, c, d] = self.operands;
        let (a, b, c, d) = (&file[a].0, &file[b].0, &file[c].0, &file[d].0);
        match self.operation {
            Operation::Unary(Unary::Neg) => each(result, |i| -a[i]),
            Operation::Unary(Unary::Sqrt) => each(result, |i| a[i].sqrt()),
            Operation::Unary(op) => each(result, |i| op.of(a[i])),
            Operation::Binary(Binary::Add) => each(result, |i| a[i] + b[i]),
            Operation::Binary(Binary::Sub) => each(result, |i| a[i] - b[i]),
            Operation::Binary(Binary::Mul) => each(result, |i| a[i] * b[i]),
            Operation::Binary(Binary::Div) => each(result, |i| a[i] / b[i]),
            Operation::MultiplyAdd(Combination::Sum) => each(result, |i| a[i] * b[i] + c[i]),
            Operation::MultiplyAdd(Combination::Difference) => each(result, |i| a[i] * b[i] - c[i]),
            Operation::MultiplyAdd(Combination::Reverse) => each(result, |i| c[i] - a[i] * b[i]),
            Operation::SumOfProducts(Combination::Sum) => each(result, |i| a[i] * b[i] + c[i] * d[i]),
            Operation::SumOfProducts(Combination::Difference) => each(result, |i| a[i] * b[i] - c[i] * d[i]),
            Operation::SumOfProducts(Combination::Reverse) => each(result, |i| c[i] * d[i] - a[i] * b[i]),
        }
    }
}

#[inline(always)]
fn each(result: &mut BlockValues, value: impl Fn(usize) -> f64) {
    for i in 0..READINGS {
        result.0[i] = value(i);
    }
}

/// State of the nodes while an evaluation is prepared.
struct Compiler<'a, V> {
    arena: &'a Arena<V>,
    uniform: Vec<Uniform<V>>,
    uniform_of: HashMap<Operand, usize>,
    /// For each use of an operand, whether a sum or difference uses it and could fuse with a product.
    uses: HashMap<Operand, Vec<bool>>,
    varying: HashSet<NodeId>,
}

impl<V: Clone + PartialEq> Compiler<'_, V> {
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

    /// The factors of a product that is used only by one sum or difference.
    fn product(&self, operand: Operand) -> Option<[Operand; 2]> {
        match self.arena.node_of(operand)? {
            Node::Binary(Binary::Mul, a, b) if self.varies(operand) && self.uses[&operand] == [true] => Some([a, b]),
            _ => None,
        }
    }

    /// The operation of a node; `None` for a variable, and for a product that is fused with another operation.
    fn instruction(&self, id: NodeId) -> Option<Instruction<Operand>> {
        if self.product(Operand::Node(id)).is_some() {
            return None;
        }
        let (operation, operands) = match self.arena.node(id) {
            Node::Variable(_) => return None,
            Node::Unary(op, a) => (Operation::Unary(op), [a; 4]),
            Node::Binary(op @ (Binary::Add | Binary::Sub), a, b) => {
                let (combination, reverse) = match op {
                    Binary::Add => (Combination::Sum, Combination::Sum),
                    _ => (Combination::Difference, Combination::Reverse),
                };
                match (self.product(a), self.product(b)) {
                    (Some([x, y]), Some([z, w])) => (Operation::SumOfProducts(combination), [x, y, z, w]),
                    (Some([x, y]), None) => (Operation::MultiplyAdd(combination), [x, y, b, x]),
                    (None, Some([x, y])) => (Operation::MultiplyAdd(reverse), [x, y, a, x]),
                    (None, None) => (Operation::Binary(op), [a, b, a, a]),
                }
            }
            Node::Binary(op, a, b) => (Operation::Binary(op), [a, b, a, a]),
        };
        Some(Instruction { operation, operands })
    }

    fn replay(mut self, nodes: &[NodeId], outputs: &[Operand]) -> Replay<V> {
        let mut instructions: Vec<(NodeId, Instruction<Operand>)> = Vec::new();
        let mut columns: Vec<V> = Vec::new();
        let mut column_nodes: Vec<Operand> = Vec::new();
        for id in nodes.iter().filter(|id| self.varying.contains(id)) {
            if let Node::Variable(variable) = self.arena.node(*id) {
                columns.push(self.arena.variable_at(variable));
                column_nodes.push(Operand::Node(*id));
            } else if let Some(instruction) = self.instruction(*id) {
                instructions.push((*id, instruction));
            }
        }
        let mut broadcast = Vec::new();
        let mut register_of: HashMap<Operand, Register> = HashMap::new();
        for operand in
            instructions.iter().flat_map(|(_, instruction)| instruction.operands).chain(outputs.iter().copied())
        {
            if !self.varies(operand) && !register_of.contains_key(&operand) {
                register_of.insert(operand, broadcast.len());
                let index = self.uniform(operand);
                broadcast.push(index);
            }
        }
        for operand in column_nodes {
            register_of.insert(operand, register_of.len());
        }
        // The other registers are reused after their last use.
        let kept = register_of.len();
        let mut registers = kept;
        let mut last_read: HashMap<Operand, usize> = HashMap::new();
        for (number, (_, instruction)) in instructions.iter().enumerate() {
            last_read.extend(instruction.operands.map(|operand| (operand, number)));
        }
        let mut free: Vec<Register> = Vec::new();
        let mut allocated = Vec::with_capacity(instructions.len());
        let mut computed = Vec::new();
        for (number, (id, instruction)) in instructions.into_iter().enumerate() {
            let operands = instruction.operands.map(|operand| register_of[&operand]);
            for (operand, register) in instruction.operands.iter().zip(operands) {
                if register >= kept && last_read[operand] == number && !free.contains(&register) {
                    free.push(register);
                }
            }
            let to = free.pop().unwrap_or_else(|| {
                registers += 1;
                registers - 1
            });
            register_of.insert(Operand::Node(id), to);
            let result = (outputs.iter().enumerate()).filter(|(_, output)| **output == Operand::Node(id));
            computed.extend(result.map(|(output, _)| (number, output)));
            if !last_read.contains_key(&Operand::Node(id)) {
                free.push(to);
            }
            let operation = instruction.operation;
            allocated.push((Instruction { operation, operands }, to));
        }
        Replay {
            uniform: self.uniform,
            broadcast,
            columns,
            instructions: allocated,
            registers,
            not_computed: (outputs.iter().enumerate())
                .filter_map(|(number, output)| Some((number, *register_of.get(output)?)).filter(|(_, r)| *r < kept))
                .collect(),
            computed,
        }
    }
}
