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
    /// Over the same rows: the model and the residual, then each chosen effect.
    sides: Vec<Arc<Adjoint>>,
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
        let of_chosen = chosen.iter().map(|chosen| chosen.side(&projection.training));
        TuningSide { sides: std::iter::once(projection.side(gram)).chain(of_chosen).collect() }
    }

    /// The sums over the states of a channel.
    pub fn channel<'m>(&self, projection: &'m Projection, channel: &'m Arc<Channel>) -> ChannelProducts<'m> {
        let training = &projection.training;
        let local = LocalStates::of(&channel.states, training, &self.sides[0].rows);
        let vectors: usize = self.sides.iter().map(|side| side.values.nrows()).sum();
        let mut sums = Mat::zeros(vectors, local.count());
        let mut first = 0;
        for side in &self.sides {
            let mut of_side = Mat::zeros(side.values.nrows(), local.count());
            local.gather(0..local.count(), std::slice::from_ref(channel), side, of_side.as_mut());
            sums.as_mut().subrows_mut(first, of_side.nrows()).copy_from(&of_side);
            first += of_side.nrows();
        }
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
