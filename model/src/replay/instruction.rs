//! The operations of a replay over a block of readings.
//!
//! An operand is a block, one number per reading, or a scalar, one number for all readings. A scalar is loaded once per
//! block and takes no room in the first-level cache. The sign of a term with a scalar is the sign of the scalar:
//! `x·s − y·t = x·s + y·(−t)` exactly.
//!
//! Two sums over the same operands are one operation with two results, so that each operand is loaded once. The two
//! components of a turned vector are such a pair.

use crate::expression::{Binary, Unary};

/// Number of readings in a block.
pub(super) const READINGS: usize = 128;

/// A quantity of a block: one number per reading. The alignment keeps vectors within cache lines.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Block(pub(super) [f64; READINGS]);

/// Index of a block in the register file.
pub(super) type Register = usize;

/// An operation with its operands. Unused operands repeat the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instruction<B> {
    pub(super) operation: Operation,
    /// The blocks `w, x, y, z`.
    pub(super) blocks: [B; 4],
    /// The indices of the scalars `r, s, t, u`.
    pub(super) scalars: [usize; 4],
}

/// What an instruction computes of its blocks `w, x, y, z` and its scalars `r, s, t, u`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operation {
    /// A function of `w`.
    Unary(Unary),
    /// `w` and `x`.
    Blocks(Binary),
    /// `w + r`.
    Shifted,
    /// `r·w`.
    Scaled,
    /// `w / r`.
    OverScalar,
    /// `r − w`.
    ScalarLessBlock,
    /// `r / w`.
    ScalarOverBlock,
    /// `w·x + y`.
    ProductPlusBlock,
    /// `w·x − y`.
    ProductLessBlock,
    /// `y − w·x`.
    BlockLessProduct,
    /// `w·x + r`.
    ProductPlusScalar,
    /// `r − w·x`.
    ScalarLessProduct,
    /// `r·w + x`.
    ScaledPlusBlock,
    /// `r·w − x`.
    ScaledLessBlock,
    /// `r·w + s`.
    ScaledPlusScalar,
    /// `w·x + y·z`.
    ProductPlusProduct,
    /// `w·x − y·z`.
    ProductLessProduct,
    /// `w·x + r·y`.
    ProductPlusScaled,
    /// `r·y − w·x`.
    ScaledLessProduct,
    /// `r·w + s·x`.
    ScaledPlusScaled,
    /// `r·w + s·x` and `t·w + u·x`.
    TwoCombinations,
    /// `w·y − x·z` and `w·z + x·y`.
    Turn,
}

impl Instruction<Register> {
    /// Writes the results. The second result is used by operations that have two.
    #[inline(always)]
    pub(super) fn evaluate(&self, file: &[&mut Block], scalars: &[f64], results: [&mut Block; 2]) {
        let [w, x, y, z] = self.blocks.map(|register| &file[register].0);
        let [r, s, t, u] = self.scalars.map(|index| scalars[index]);
        let [first, second] = results;
        match self.operation {
            Operation::Unary(Unary::Neg) => each(first, |i| -w[i]),
            Operation::Unary(Unary::Sqrt) => each(first, |i| w[i].sqrt()),
            Operation::Unary(op) => each(first, |i| op.of(w[i])),
            Operation::Blocks(Binary::Add) => each(first, |i| w[i] + x[i]),
            Operation::Blocks(Binary::Sub) => each(first, |i| w[i] - x[i]),
            Operation::Blocks(Binary::Mul) => each(first, |i| w[i] * x[i]),
            Operation::Blocks(Binary::Div) => each(first, |i| w[i] / x[i]),
            Operation::Shifted => each(first, |i| w[i] + r),
            Operation::Scaled => each(first, |i| r * w[i]),
            Operation::OverScalar => each(first, |i| w[i] / r),
            Operation::ScalarLessBlock => each(first, |i| r - w[i]),
            Operation::ScalarOverBlock => each(first, |i| r / w[i]),
            Operation::ProductPlusBlock => each(first, |i| w[i] * x[i] + y[i]),
            Operation::ProductLessBlock => each(first, |i| w[i] * x[i] - y[i]),
            Operation::BlockLessProduct => each(first, |i| y[i] - w[i] * x[i]),
            Operation::ProductPlusScalar => each(first, |i| w[i] * x[i] + r),
            Operation::ScalarLessProduct => each(first, |i| r - w[i] * x[i]),
            Operation::ScaledPlusBlock => each(first, |i| r * w[i] + x[i]),
            Operation::ScaledLessBlock => each(first, |i| r * w[i] - x[i]),
            Operation::ScaledPlusScalar => each(first, |i| r * w[i] + s),
            Operation::ProductPlusProduct => each(first, |i| w[i] * x[i] + y[i] * z[i]),
            Operation::ProductLessProduct => each(first, |i| w[i] * x[i] - y[i] * z[i]),
            Operation::ProductPlusScaled => each(first, |i| w[i] * x[i] + r * y[i]),
            Operation::ScaledLessProduct => each(first, |i| r * y[i] - w[i] * x[i]),
            Operation::ScaledPlusScaled => each(first, |i| r * w[i] + s * x[i]),
            Operation::TwoCombinations => {
                both(first, second, |i| (r * w[i] + s * x[i], t * w[i] + u * x[i]));
            }
            Operation::Turn => {
                both(first, second, |i| (w[i] * y[i] - x[i] * z[i], w[i] * z[i] + x[i] * y[i]));
            }
        }
    }
}

#[inline(always)]
fn each(result: &mut Block, value: impl Fn(usize) -> f64) {
    for i in 0..READINGS {
        result.0[i] = value(i);
    }
}

#[inline(always)]
fn both(first: &mut Block, second: &mut Block, values: impl Fn(usize) -> (f64, f64)) {
    for i in 0..READINGS {
        (first.0[i], second.0[i]) = values(i);
    }
}
