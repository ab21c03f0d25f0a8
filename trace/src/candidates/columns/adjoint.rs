//! Carries values of whitened rows back to the readings: `Wᵀ z` with the whitening `W`.
//!
//! The product of a whitened column with `z` is that of the unwhitened column with `Wᵀ z`. Sums over the states of a
//! driver can then be formed before any basis function is known.

use std::sync::Arc;

use abbe_identify::problem::Filter;
use faer::{ColRef, Mat, MatRef};

use super::Columns;

/// Some whitened rows of one block.
pub struct WhitenedRows {
    /// The test.
    pub test: usize,
    /// The scalar reading of the test at which the block begins.
    pub start: usize,
    /// For each whitened row its scalar row in the block, and its index in fold order.
    rows: Vec<(u32, u32)>,
}

impl WhitenedRows {
    /// Number of the rows.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// For each whitened row its scalar row in the block, and its index in fold order.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize)> {
        self.rows.iter().map(|(scalar, row)| (*scalar as usize, *row as usize))
    }
}

/// Whitened rows, and the filter that forms them.
pub struct TrainingRows {
    /// Block after block.
    pub blocks: Vec<Arc<WhitenedRows>>,
    /// The filter of every block.
    pub filter: Filter,
    /// Number of channels of a reading of each test.
    pub channels: Vec<usize>,
}

impl Columns<'_> {
    /// The whitened rows of every block that has some.
    fn whole_blocks(&self) -> &[Arc<WhitenedRows>] {
        self.whole.get_or_init(|| {
            let mut start = 0;
            let mut blocks = Vec::new();
            for (block, kept) in self.blocks.iter().zip(&self.kept) {
                let target = &self.target[start..start + kept.len()];
                start += kept.len();
                let rows: Vec<(u32, u32)> =
                    kept.iter().zip(target).map(|(scalar, row)| (*scalar as u32, *row as u32)).collect();
                if !rows.is_empty() {
                    let start = block.rows.start * self.problem.channels(block.test);
                    blocks.push(Arc::new(WhitenedRows { test: block.test, start, rows }));
                }
            }
            blocks
        })
    }

    /// The whitened rows of some folds.
    pub fn training_rows(&self, folds: &[usize]) -> TrainingRows {
        let mut inside = vec![false; self.rows];
        folds.iter().for_each(|fold| inside[self.fold_rows[*fold].clone()].fill(true));
        let mut blocks = Vec::new();
        for whole in self.whole_blocks() {
            let count = whole.iter().filter(|(_, row)| inside[*row]).count();
            if count == whole.count() {
                blocks.push(Arc::clone(whole));
            } else if count > 0 {
                let rows = whole.rows.iter().copied().filter(|(_, row)| inside[*row as usize]).collect();
                blocks.push(Arc::new(WhitenedRows { test: whole.test, start: whole.start, rows }));
            }
        }
        let channels = (0..self.problem.tests.len()).map(|test| self.problem.channels(test)).collect();
        TrainingRows { blocks, filter: self.problem.filter(), channels }
    }
}

/// `Wᵀ z` of several vectors.
pub struct Adjoint<T = f64> {
    /// The test and the scalar reading of each row, in ascending order.
    pub rows: Arc<Vec<(u32, u32)>>,
    /// Vectors × rows.
    pub values: Mat<T>,
}

impl Adjoint {
    /// Of vectors over all whitened rows in fold order (rows × vectors), restricted to some rows.
    pub fn of(training: &TrainingRows, vectors: MatRef<'_, f64>) -> Adjoint {
        Adjoint::beside(training, vectors, &[])
    }

    /// The same with further vectors, one column after another.
    pub fn beside(training: &TrainingRows, vectors: MatRef<'_, f64>, others: &[MatRef<'_, f64>]) -> Adjoint {
        let vectors: Vec<ColRef<'_, f64>> =
            std::iter::once(vectors).chain(others.iter().copied()).flat_map(|some| some.col_iter()).collect();
        const NONE: usize = usize::MAX;
        let mut rows = Vec::new();
        let mut places: Vec<Vec<usize>> = Vec::with_capacity(training.blocks.len());
        for block in &training.blocks {
            let length = block.iter().map(|(i, _)| i + 1).max().unwrap_or(0);
            let mut place = vec![NONE; length];
            block.iter().for_each(|(i, _)| training.filter.terms(i).for_each(|(raw, _)| place[raw] = 0));
            for (raw, place) in place.iter_mut().enumerate().filter(|(_, place)| **place != NONE) {
                *place = rows.len();
                rows.push((block.test as u32, (block.start + raw) as u32));
            }
            places.push(place);
        }
        let mut values = Mat::zeros(vectors.len(), rows.len());
        let mut entries = vec![0.0; vectors.len()];
        for (block, place) in training.blocks.iter().zip(&places) {
            for (i, row) in block.iter() {
                entries.iter_mut().zip(&vectors).for_each(|(entry, vector)| *entry = vector[row]);
                for (raw, factor) in training.filter.terms(i) {
                    let sums = values.col_as_slice_mut(place[raw]);
                    sums.iter_mut().zip(&entries).for_each(|(sum, entry)| *sum += factor * entry);
                }
            }
        }
        Adjoint { rows: Arc::new(rows), values }
    }

    /// The same in single precision.
    pub fn single(self) -> Adjoint<f32> {
        let values = &self.values;
        Adjoint { values: Mat::from_fn(values.nrows(), values.ncols(), |i, j| values[(i, j)] as f32), rows: self.rows }
    }
}
