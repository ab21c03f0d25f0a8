//! The rank of the readings of some poses.

use abbe_identify::numerics::solve::Svd;
use abbe_model::Diagnostic;
use faer::Mat;

use crate::design::information::{SharedParameters, sum_of};

/// The readings of candidate poses and the priors, without regularisation.
pub(super) struct Readings<'r> {
    /// The parameters, the targets last.
    pub shared: &'r SharedParameters,
    /// Whitened rows of each candidate.
    pub rows: &'r [Mat<f64>],
    /// Whitened rows of the priors.
    pub prior: &'r Mat<f64>,
}

impl Readings<'_> {
    /// Numerical rank of the readings of some poses with the priors, and the number of parameters that they involve: the
    /// place of a socket without a pose is none of them.
    pub fn rank(&self, poses: &[usize]) -> Result<[usize; 2], Diagnostic> {
        let (count, size) = (self.shared.ids.len(), &self.shared.size);
        let first = count - self.shared.targets;
        let involved =
            |k: &usize| *k >= first || poses.iter().any(|pose| self.rows[*pose].col(*k).iter().any(|x| *x != 0.0));
        let (own, others): (Vec<usize>, Vec<usize>) = (0..count).partition(involved);
        // A prior that connects a parameter with one that is not involved tells nothing of it.
        let is_own = |row: &usize| others.iter().all(|k| self.prior[(*row, *k)] == 0.0);
        let prior_rows: Vec<usize> = (0..self.prior.nrows()).filter(is_own).collect();
        let scaled = |rows: &Mat<f64>, of: &[usize]| {
            Mat::from_fn(of.len(), own.len(), |i, k| rows[(of[i], own[k])] * size[own[k]])
        };
        let mut parts = vec![scaled(self.prior, &prior_rows)];
        parts.extend(poses.iter().map(|pose| {
            let rows = &self.rows[*pose];
            scaled(rows, &(0..rows.nrows()).collect::<Vec<_>>())
        }));
        let root = sum_of(parts.iter().map(|part| part.as_ref()));
        Ok([Svd::of(root.as_ref())?.identifiable_rank(), own.len()])
    }
}
