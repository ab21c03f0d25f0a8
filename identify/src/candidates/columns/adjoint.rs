//! Carries values of whitened rows back to the readings: `Wᵀ z` with the whitening `W`.
//!
//! The product of a whitened column with `z` is that of the unwhitened column with `Wᵀ z`. Sums over the states of a
//! driver can then be formed before any basis function is known.

use faer::{Mat, MatRef};

use super::Columns;
use crate::problem::Filter;

/// Some whitened rows of one block.
pub struct WhitenedRows {
    /// The test.
    pub test: usize,
    /// The scalar reading of the test at which the block begins.
    pub start: usize,
    /// For each whitened row its scalar row in the block, and its index in fold order.
    pub rows: Vec<(usize, usize)>,
}

/// Whitened rows, and the filter that forms them.
pub struct TrainingRows {
    /// Block after block.
    pub blocks: Vec<WhitenedRows>,
    /// The filter of every block.
    pub filter: Filter,
    /// Scalar rows of a reading.
    pub coordinates: usize,
}

impl Columns<'_> {
    /// The whitened rows of some folds.
    pub fn training_rows(&self, folds: &[usize]) -> TrainingRows {
        let mut inside = vec![false; self.rows];
        folds.iter().for_each(|fold| inside[self.fold_rows[*fold].clone()].fill(true));
        let mut start = 0;
        let mut blocks = Vec::new();
        let coordinates = self.problem.coordinates();
        for (block, kept) in self.blocks.iter().zip(&self.kept) {
            let target = &self.target[start..start + kept.len()];
            start += kept.len();
            let rows = kept.iter().copied().zip(target.iter().copied());
            let rows: Vec<(usize, usize)> = rows.filter(|(_, row)| inside[*row]).collect();
            if !rows.is_empty() {
                blocks.push(WhitenedRows { test: block.test, start: block.rows.start * coordinates, rows });
            }
        }
        TrainingRows { blocks, filter: self.problem.filter(), coordinates }
    }
}

/// `Wᵀ z` of several vectors.
pub struct Adjoint {
    /// The test and the scalar reading of each row, in ascending order.
    pub rows: Vec<(usize, usize)>,
    /// Vectors × rows.
    pub values: Mat<f64>,
}

impl Adjoint {
    /// Of vectors over all whitened rows in fold order (rows × vectors), restricted to some rows.
    pub fn of(training: &TrainingRows, vectors: MatRef<'_, f64>) -> Adjoint {
        const NONE: usize = usize::MAX;
        let mut rows = Vec::new();
        let mut places: Vec<Vec<usize>> = Vec::with_capacity(training.blocks.len());
        for block in &training.blocks {
            let length = block.rows.iter().map(|(i, _)| i + 1).max().unwrap_or(0);
            let mut place = vec![NONE; length];
            block.rows.iter().for_each(|(i, _)| training.filter.terms(*i).for_each(|(raw, _)| place[raw] = 0));
            for (raw, place) in place.iter_mut().enumerate().filter(|(_, place)| **place != NONE) {
                *place = rows.len();
                rows.push((block.test, block.start + raw));
            }
            places.push(place);
        }
        let mut values = Mat::zeros(vectors.ncols(), rows.len());
        let mut entries = vec![0.0; vectors.ncols()];
        for (block, place) in training.blocks.iter().zip(&places) {
            for (i, row) in &block.rows {
                entries.iter_mut().enumerate().for_each(|(j, entry)| *entry = vectors[(*row, j)]);
                for (raw, factor) in training.filter.terms(*i) {
                    let sums = values.col_as_slice_mut(place[raw]);
                    sums.iter_mut().zip(&entries).for_each(|(sum, entry)| *sum += factor * entry);
                }
            }
        }
        Adjoint { rows, values }
    }
}
