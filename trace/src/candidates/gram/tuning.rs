//! The products of one channel with a model, from which the gain of any basis functions follows.

use std::sync::Arc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::Gram;
use super::projection::{ChosenEffect, Projection};
use super::states::{LocalStates, OwnProducts};
use crate::candidates::columns::{Adjoint, Channel};

/// What the columns of a tuned effect are multiplied with: the model, its residual, and the chosen effects.
pub(in crate::candidates) struct TuningSide {
    side: Adjoint,
}

/// The sums over the states of one channel.
pub(in crate::candidates) struct ChannelProducts<'m> {
    local: LocalStates,
    /// Vectors × states.
    sums: Mat<f64>,
    own: OwnProducts<'m>,
}

impl TuningSide {
    /// Of a projection and chosen effects.
    pub fn of(gram: &Gram<'_>, projection: &Projection, chosen: &[Arc<ChosenEffect>]) -> TuningSide {
        let rank = gram.rank();
        let width = rank + 1 + chosen.iter().map(|chosen| chosen.rows.ncols()).sum::<usize>();
        let mut vectors = Mat::zeros(projection.residual.nrows(), width);
        vectors.as_mut().subcols_mut(0, rank).copy_from(gram.model());
        vectors.as_mut().subcols_mut(rank, 1).copy_from(&projection.residual);
        let mut next = rank + 1;
        for chosen in chosen {
            vectors.as_mut().subcols_mut(next, chosen.rows.ncols()).copy_from(&chosen.rows);
            next += chosen.rows.ncols();
        }
        TuningSide { side: Adjoint::of(&projection.training, vectors.as_ref()) }
    }

    /// The sums over the states of a channel.
    pub fn channel<'m>(&self, projection: &'m Projection, channel: &'m Arc<Channel>) -> ChannelProducts<'m> {
        let training = &projection.training;
        let local = LocalStates::of(&channel.states, training, &self.side.rows);
        let mut sums = Mat::zeros(self.side.values.nrows(), local.count());
        local.gather(0..local.count(), std::slice::from_ref(channel), &self.side, sums.as_mut());
        let own = OwnProducts::of(channel, &local, training);
        ChannelProducts { local, sums, own }
    }
}

impl ChannelProducts<'_> {
    /// The basis functions at the states of the training rows, their products with the vectors of the side (vectors ×
    /// columns), and with themselves.
    pub fn of(&self, basis: &Mat<f64>) -> (Mat<f64>, Mat<f64>, Mat<f64>) {
        let count = basis.ncols();
        let mut local = Mat::zeros(self.local.count(), count);
        for k in 0..count {
            self.local.copy(0..self.local.count(), basis.col_as_slice(k), local.col_as_slice_mut(k));
        }
        let mut cross = Mat::zeros(self.sums.nrows(), count);
        matmul(cross.as_mut(), Accum::Replace, self.sums.as_ref(), local.as_ref(), 1.0, Par::Seq);
        let mut squares = Vec::with_capacity(count * count);
        self.own.append(local.as_ref(), basis, &mut squares);
        let own = MatRef::from_column_major_slice(&squares, count, count).to_owned();
        (local, cross, own)
    }

    /// The product of two columns: at the states of the training rows, and at all states.
    pub fn between(&self, a: (&[f64], &[f64]), b: (&[f64], &[f64])) -> f64 {
        self.own.between(a, b)
    }
}
