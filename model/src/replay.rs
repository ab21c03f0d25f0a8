//! A recorded calculation, replayed over columns of readings.
//!
//! What the chain computes is recorded once as an [expression](crate::expression). What is the same for all readings is computed once a replay; of
//! the rest every step is done for a block of readings before the next one: a loop of fixed length over plain arrays, which the compiler turns into vector
//! instructions, and beside which looking the step up costs little. The block's intermediate results stay in the processor's first cache.
//!
//! Products that only one sum or difference uses are absorbed by it: `a·b + c·d` is one step.

use std::collections::{HashMap, HashSet};

use pulp::NullaryFnOnce;

use crate::expression::{Arena, Binary, Node, NodeId, Operand, Unary, operands};

/// Readings in a block.
const READINGS: usize = 128;

/// A quantity of a block: a number a reading. Aligned so that no vector lies across two lines of the cache.
#[derive(Clone)]
#[repr(align(64))]
struct Block([f64; READINGS]);

/// Where a quantity of a block lies.
type Register = usize;

/// A step over a block: an operation on up to four quantities; those that it does not need repeat the first.
#[derive(Clone, Copy, Debug)]
struct Step<Q> {
    operation: Operation,
    of: [Q; 4],
}

#[derive(Clone, Copy, Debug)]
enum Operation {
    Unary(Unary),
    Binary(Binary),
    /// Of `a·b` and `c`.
    ProductAnd(Joined),
    /// Of `a·b` and `c·d`.
    Products(Joined),
}

/// How two terms are joined.
#[derive(Clone, Copy, Debug)]
enum Joined {
    Sum,
    Difference,
    /// The second less the first.
    Reverse,
}

/// A quantity that is the same for all readings.
#[derive(Clone, Debug)]
enum Uniform<V> {
    Given(V),
    Constant(f64),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
}

/// A recorded calculation of some outputs.
#[derive(Clone, Debug)]
pub struct Replay<V> {
    uniform: Vec<Uniform<V>>,
    /// The uniform quantities that steps or outputs use; they take the first registers.
    spread: Vec<usize>,
    /// What is given reading by reading, in the registers that follow.
    columns: Vec<V>,
    /// What is computed, and into which register.
    steps: Vec<(Step<Register>, Register)>,
    registers: usize,
    /// The outputs that no step computes: uniform or given. By number, with where each stands.
    standing: Vec<(usize, Register)>,
    /// The others in the order of their steps: the step, and the output's number. They are handed over at once, so that their registers are free again.
    computed: Vec<(usize, usize)>,
}

impl<V: Clone + PartialEq> Replay<V> {
    /// Of `outputs` of an arena; `varies` tells whether a variable differs from reading to reading.
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

    /// Replays the calculation for a number of readings: `given` are the uniform variables, `column` those that vary, a value a reading. Block by
    /// block `put` takes for each output by its number the values of the readings from the one named on.
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
        // One more than the registers: a step is computed there, then trades places with what it replaces.
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

/// A replay over all blocks, compiled for each kind of vector instructions that the processor may have.
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
                // What lies beyond the last reading is computed too and goes nowhere.
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

/// What is known of the nodes while a replay is laid out.
struct Recorder<'a, V> {
    arena: &'a Arena<V>,
    uniform: Vec<Uniform<V>>,
    uniform_of: HashMap<Operand, usize>,
    /// For each use of an operand, whether a sum or difference makes it, which could absorb a product.
    uses: HashMap<Operand, Vec<bool>>,
    varying: HashSet<NodeId>,
}

impl<V: Clone + PartialEq> Recorder<'_, V> {
    fn varies(&self, operand: Operand) -> bool {
        matches!(operand, Operand::Node(id) if self.varying.contains(&id))
    }

    /// The place of a uniform operand among the uniform quantities.
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

    /// The factors of a product that one sum or difference uses and nothing else.
    fn product(&self, operand: Operand) -> Option<[Operand; 2]> {
        match self.arena.node_of(operand)? {
            Node::Binary(Binary::Mul, a, b) if self.varies(operand) && self.uses[&operand] == [true] => {
                Some([a, b])
            }
            _ => None,
        }
    }

    /// The step that computes a node; `None` for a variable, and for a product that another step absorbs.
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
        // The others are taken again once nothing reads them any more.
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
