//! Evaluation of a recorded calculation over columns of readings.
//!
//! The chain is recorded once as an [expression](crate::expression). Quantities that are equal for all readings are computed once per
//! evaluation. Every other operation is done for a block of readings before the next operation. This is a loop of fixed length over plain
//! arrays, which the compiler vectorises and which makes the cost of decoding the operation small. The intermediate results of a block
//! stay in the first-level cache.
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
struct Block([f64; READINGS]);

/// Index of a block in the register file.
type Register = usize;

/// An operation over a block with up to four operands; unused operands repeat the first.
#[derive(Clone, Copy, Debug)]
struct Step<Q> {
    operation: Operation,
    of: [Q; 4],
}

#[derive(Clone, Copy, Debug)]
enum Operation {
    Unary(Unary),
    Binary(Binary),
    /// `a·b` and `c`.
    ProductAnd(Joined),
    /// `a·b` and `c·d`.
    Products(Joined),
}

/// Combination of two terms.
#[derive(Clone, Copy, Debug)]
enum Joined {
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
    spread: Vec<usize>,
    /// The variables given for each reading, in the registers that follow.
    columns: Vec<V>,
    /// The operations, each with its result register.
    steps: Vec<(Step<Register>, Register)>,
    registers: usize,
    /// The outputs that no operation computes, because they are uniform or given: output index and register.
    standing: Vec<(usize, Register)>,
    /// The computed outputs in the order of their operations: operation index and output index. Each is delivered immediately, so that
    /// its register can be reused.
    computed: Vec<(usize, usize)>,
}

impl<V: Clone + PartialEq> Replay<V> {
    /// Prepares the evaluation of `outputs` of an arena; `varies` tells whether a variable differs between readings.
    pub fn new(arena: &Arena<V>, outputs: &[Operand], varies: impl Fn(&V) -> bool) -> Self {
        let nodes = arena.reachable(outputs);
        let mut recorder = Recorder {
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
                _ => operands(node).any(|operand| recorder.varies(operand)),
            };
            if varying {
                recorder.varying.insert(*id);
            }
            for operand in operands(node) {
                let takes_up = matches!(node, Node::Binary(Binary::Add | Binary::Sub, ..));
                recorder.uses.entry(operand).or_default().push(takes_up);
            }
        }
        for output in outputs {
            recorder.uses.entry(*output).or_default().push(false);
        }
        recorder.replay(&nodes, outputs)
    }

    /// Evaluates the calculation for a number of readings. `given` returns the uniform variables, `column` the varying ones, one value
    /// per reading. For each block and output, `put` receives the index of the output, the first reading of the block and the values.
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
        let spread = self.spread.iter().map(|place| uniform[*place]);
        // One more than the registers: an operation writes there and then swaps with the register that it replaces.
        let mut store = vec![Block([0.0; READINGS]); self.registers + 1];
        store
            .iter_mut()
            .zip(spread)
            .for_each(|(block, value)| block.0.fill(value));
        let mut file: Vec<&mut Block> = store.iter_mut().collect();
        let columns: Vec<&[f64]> = self.columns.iter().map(column).collect();
        pulp::Arch::new().dispatch(Blocks {
            replay: self,
            rows,
            columns: &columns,
            file: &mut file,
            put,
        });
    }
}

/// An evaluation over all blocks, compiled for each vector instruction set that the processor may have.
struct Blocks<'r, 'f, V, P> {
    replay: &'r Replay<V>,
    rows: usize,
    columns: &'r [&'r [f64]],
    file: &'r mut Vec<&'f mut Block>,
    put: P,
}

impl<V, P: FnMut(usize, usize, &[f64])> NullaryFnOnce for Blocks<'_, '_, V, P> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let first = self.replay.spread.len();
        let Some(mut made) = self.file.pop() else { return };
        for start in (0..self.rows).step_by(READINGS) {
            let end = (start + READINGS).min(self.rows);
            for (place, column) in self.columns.iter().enumerate() {
                // Values beyond the last reading are computed too and discarded.
                self.file[first + place].0[..end - start].copy_from_slice(&column[start..end]);
            }
            for (output, register) in &self.replay.standing {
                (self.put)(*output, start, &self.file[*register].0[..end - start]);
            }
            let mut computed = self.replay.computed.iter().peekable();
            for (number, (step, to)) in self.replay.steps.iter().enumerate() {
                step.of_block(self.file, made);
                std::mem::swap(&mut self.file[*to], &mut made);
                while let Some((_, output)) = computed.next_if(|(of, _)| *of == number) {
                    (self.put)(*output, start, &self.file[*to].0[..end - start]);
                }
            }
        }
    }
}

impl Step<Register> {
    #[inline(always)]
    fn of_block(&self, file: &[&mut Block], made: &mut Block) {
        let [a, b, c, d] = self.of;
        let (a, b, c, d) = (&file[a].0, &file[b].0, &file[c].0, &file[d].0);
        match self.operation {
            Operation::Unary(Unary::Neg) => each(made, |i| -a[i]),
            Operation::Unary(Unary::Sqrt) => each(made, |i| a[i].sqrt()),
            Operation::Unary(op) => each(made, |i| op.of(a[i])),
            Operation::Binary(Binary::Add) => each(made, |i| a[i] + b[i]),
            Operation::Binary(Binary::Sub) => each(made, |i| a[i] - b[i]),
            Operation::Binary(Binary::Mul) => each(made, |i| a[i] * b[i]),
            Operation::Binary(Binary::Div) => each(made, |i| a[i] / b[i]),
            Operation::ProductAnd(Joined::Sum) => each(made, |i| a[i] * b[i] + c[i]),
            Operation::ProductAnd(Joined::Difference) => each(made, |i| a[i] * b[i] - c[i]),
            Operation::ProductAnd(Joined::Reverse) => each(made, |i| c[i] - a[i] * b[i]),
            Operation::Products(Joined::Sum) => each(made, |i| a[i] * b[i] + c[i] * d[i]),
            Operation::Products(Joined::Difference) => each(made, |i| a[i] * b[i] - c[i] * d[i]),
            Operation::Products(Joined::Reverse) => each(made, |i| c[i] * d[i] - a[i] * b[i]),
        }
    }
}

#[inline(always)]
fn each(made: &mut Block, value: impl Fn(usize) -> f64) {
    for i in 0..READINGS {
        made.0[i] = value(i);
    }
}

/// State of the nodes while an evaluation is prepared.
struct Recorder<'a, V> {
    arena: &'a Arena<V>,
    uniform: Vec<Uniform<V>>,
    uniform_of: HashMap<Operand, usize>,
    /// For each use of an operand, whether a sum or difference uses it and could fuse with a product.
    uses: HashMap<Operand, Vec<bool>>,
    varying: HashSet<NodeId>,
}

impl<V: Clone + PartialEq> Recorder<'_, V> {
    fn varies(&self, operand: Operand) -> bool {
        matches!(operand, Operand::Node(id) if self.varying.contains(&id))
    }

    /// The index of a uniform operand among the uniform quantities.
    fn uniform(&mut self, operand: Operand) -> usize {
        if let Some(place) = self.uniform_of.get(&operand) {
            return *place;
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
            Node::Binary(Binary::Mul, a, b) if self.varies(operand) && self.uses[&operand] == [true] => {
                Some([a, b])
            }
            _ => None,
        }
    }

    /// The operation of a node; `None` for a variable, and for a product that is fused with another operation.
    fn step(&self, id: NodeId) -> Option<Step<Operand>> {
        if self.product(Operand::Node(id)).is_some() {
            return None;
        }
        let (operation, of) = match self.arena.node(id) {
            Node::Variable(_) => return None,
            Node::Unary(op, a) => (Operation::Unary(op), [a; 4]),
            Node::Binary(op @ (Binary::Add | Binary::Sub), a, b) => {
                let (joined, reverse) = match op {
                    Binary::Add => (Joined::Sum, Joined::Sum),
                    _ => (Joined::Difference, Joined::Reverse),
                };
                match (self.product(a), self.product(b)) {
                    (Some([x, y]), Some([z, w])) => (Operation::Products(joined), [x, y, z, w]),
                    (Some([x, y]), None) => (Operation::ProductAnd(joined), [x, y, b, x]),
                    (None, Some([x, y])) => (Operation::ProductAnd(reverse), [x, y, a, x]),
                    (None, None) => (Operation::Binary(op), [a, b, a, a]),
                }
            }
            Node::Binary(op, a, b) => (Operation::Binary(op), [a, b, a, a]),
        };
        Some(Step { operation, of })
    }

    fn replay(mut self, nodes: &[NodeId], outputs: &[Operand]) -> Replay<V> {
        let mut steps: Vec<(NodeId, Step<Operand>)> = Vec::new();
        let mut columns: Vec<V> = Vec::new();
        let mut column_nodes: Vec<Operand> = Vec::new();
        for id in nodes.iter().filter(|id| self.varying.contains(id)) {
            if let Node::Variable(variable) = self.arena.node(*id) {
                columns.push(self.arena.variable_at(variable));
                column_nodes.push(Operand::Node(*id));
            } else if let Some(step) = self.step(*id) {
                steps.push((*id, step));
            }
        }
        let mut spread = Vec::new();
        let mut register_of: HashMap<Operand, Register> = HashMap::new();
        for operand in steps
            .iter()
            .flat_map(|(_, step)| step.of)
            .chain(outputs.iter().copied())
        {
            if !self.varies(operand) && !register_of.contains_key(&operand) {
                register_of.insert(operand, spread.len());
                let place = self.uniform(operand);
                spread.push(place);
            }
        }
        for operand in column_nodes {
            register_of.insert(operand, register_of.len());
        }
        // The other registers are reused after their last use.
        let kept = register_of.len();
        let mut registers = kept;
        let mut last_read: HashMap<Operand, usize> = HashMap::new();
        for (number, (_, step)) in steps.iter().enumerate() {
            last_read.extend(step.of.map(|operand| (operand, number)));
        }
        let mut free: Vec<Register> = Vec::new();
        let mut placed = Vec::with_capacity(steps.len());
        let mut computed = Vec::new();
        for (number, (id, step)) in steps.into_iter().enumerate() {
            let of = step.of.map(|operand| register_of[&operand]);
            for (operand, register) in step.of.iter().zip(of) {
                if register >= kept && last_read[operand] == number && !free.contains(&register) {
                    free.push(register);
                }
            }
            let to = free.pop().unwrap_or_else(|| {
                registers += 1;
                registers - 1
            });
            register_of.insert(Operand::Node(id), to);
            let made = (outputs.iter().enumerate()).filter(|(_, output)| **output == Operand::Node(id));
            computed.extend(made.map(|(output, _)| (number, output)));
            if !last_read.contains_key(&Operand::Node(id)) {
                free.push(to);
            }
            let operation = step.operation;
            placed.push((Step { operation, of }, to));
        }
        Replay {
            uniform: self.uniform,
            spread,
            columns,
            steps: placed,
            registers,
            standing: (outputs.iter().enumerate())
                .filter_map(|(number, output)| {
                    Some((number, *register_of.get(output)?)).filter(|(_, r)| *r < kept)
                })
                .collect(),
            computed,
        }
    }
}
