//! Evaluation of a recorded calculation over columns of readings.
//!
//! The chain is recorded once as an [expression](crate::expression). Quantities that are equal for all readings are
//! computed once per evaluation: scalars. Every other operation is done for a block of readings before the next
//! operation. This is a loop of fixed length over plain arrays, which the compiler vectorises and which makes the cost
//! of decoding the operation small. The intermediate results of a block stay in the first-level cache.
//!
//! Trips through that cache cost more than arithmetic. A product that is used only by one sum or difference is therefore
//! fused with it, and two sums over the same operands are one operation.

mod compile;
mod instruction;
#[cfg(test)]
mod tests;

use pulp::NullaryFnOnce;

use crate::expression::{Arena, Binary, Operand, Unary};
use compile::Compiler;
use instruction::{Block, Instruction, READINGS, Register};

/// A quantity that is equal for all readings.
#[derive(Clone, Debug)]
enum Uniform<V> {
    Given(V),
    Constant(f64),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
}

/// A number for all readings: a uniform quantity or its negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Scalar {
    uniform: usize,
    negative: bool,
}

/// An operation with the registers of its results.
#[derive(Clone, Copy, Debug)]
struct Step {
    instruction: Instruction<Register>,
    first: Register,
    second: Option<Register>,
}

/// An output in a register.
#[derive(Clone, Copy, Debug)]
struct Delivery {
    /// The step that computes it.
    step: usize,
    output: usize,
    register: Register,
}

/// A recorded calculation of several outputs.
#[derive(Clone, Debug)]
pub struct Replay<V> {
    uniform: Vec<Uniform<V>>,
    scalars: Vec<Scalar>,
    /// The variables given for each reading; they have the first registers.
    columns: Vec<V>,
    /// The indices of the uniform outputs among the scalars, in the registers that follow.
    uniform_outputs: Vec<usize>,
    steps: Vec<Step>,
    registers: usize,
    /// The outputs that no step computes, because they are uniform or given: output index and register.
    not_computed: Vec<(usize, Register)>,
    /// The computed outputs in the order of their steps. Each is delivered immediately, so that its register can be
    /// reused.
    computed: Vec<Delivery>,
}

impl<V: Clone + PartialEq> Replay<V> {
    /// Prepares the evaluation of `outputs` of an arena; `varies` tells whether a variable differs between readings.
    pub fn new(arena: &Arena<V>, outputs: &[Operand], varies: impl Fn(&V) -> bool) -> Self {
        Compiler::new(arena, outputs, varies).replay(outputs)
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
        let signed = |scalar: &Scalar| if scalar.negative { -uniform[scalar.uniform] } else { uniform[scalar.uniform] };
        // An instruction without scalars has index 0 too.
        let mut scalars: Vec<f64> = self.scalars.iter().map(signed).collect();
        scalars.push(0.0);
        // Two more than the registers: a step writes there and then swaps with the registers that it replaces.
        let mut store = vec![Block([0.0; READINGS]); self.registers + 2];
        let constant = store.iter_mut().skip(self.columns.len());
        constant.zip(&self.uniform_outputs).for_each(|(block, index)| block.0.fill(scalars[*index]));
        let mut file: Vec<&mut Block> = store.iter_mut().collect();
        let columns: Vec<&[f64]> = self.columns.iter().map(column).collect();
        let evaluation = Evaluation { replay: self, rows, columns: &columns, scalars: &scalars, file: &mut file, put };
        pulp::Arch::new().dispatch(evaluation);
    }
}

/// An evaluation over all blocks, compiled for each vector instruction set that the processor may have.
struct Evaluation<'r, 'f, V, P> {
    replay: &'r Replay<V>,
    rows: usize,
    columns: &'r [&'r [f64]],
    scalars: &'r [f64],
    file: &'r mut Vec<&'f mut Block>,
    put: P,
}

impl<V, P: FnMut(usize, usize, &[f64])> NullaryFnOnce for Evaluation<'_, '_, V, P> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let (Some(mut first), Some(mut second)) = (self.file.pop(), self.file.pop()) else { return };
        for start in (0..self.rows).step_by(READINGS) {
            let end = (start + READINGS).min(self.rows);
            for (register, column) in self.columns.iter().enumerate() {
                // Values beyond the last reading are computed too and discarded.
                self.file[register].0[..end - start].copy_from_slice(&column[start..end]);
            }
            for (output, register) in &self.replay.not_computed {
                (self.put)(*output, start, &self.file[*register].0[..end - start]);
            }
            let mut computed = self.replay.computed.iter().peekable();
            for (number, step) in self.replay.steps.iter().enumerate() {
                step.instruction.evaluate(self.file, self.scalars, [&mut *first, &mut *second]);
                std::mem::swap(&mut self.file[step.first], &mut first);
                if let Some(register) = step.second {
                    std::mem::swap(&mut self.file[register], &mut second);
                }
                while let Some(delivery) = computed.next_if(|delivery| delivery.step == number) {
                    (self.put)(delivery.output, start, &self.file[delivery.register].0[..end - start]);
                }
            }
        }
    }
}
