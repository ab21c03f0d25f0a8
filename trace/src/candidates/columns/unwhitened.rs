//! Unwhitened rows of the readings that are not rejected as outliers, block after block.

use abbe_identify::heldout::FoldKind;
use abbe_identify::problem::RowBlock;
use abbe_model::Diagnostic;
use faer::Mat;

use super::{Columns, EffectColumns};
use crate::paired::Units;

impl Columns<'_> {
    /// The rows of an effect for the accepted readings of one fold, in mm, unwhitened, block after block.
    pub fn unwhitened_rows_of_fold(&self, column_set: &EffectColumns, fold: usize) -> Mat<f64> {
        let of_row = &self.problem.folds.of_row;
        let mut found: Vec<f64> = Vec::new();
        for block in &self.blocks {
            let channels = self.problem.channels(block.test);
            let is_inside = |i: &usize| of_row[block.test][block.rows.start + i / channels] == fold;
            let rows: Vec<usize> = self.counting(block).into_iter().filter(is_inside).collect();
            if !rows.is_empty() {
                let of_block = self.block_rows(&[column_set], block);
                rows.iter().for_each(|i| found.extend((0..column_set.count).map(|j| of_block[(*i, j)])));
            }
        }
        let count = column_set.count;
        Mat::from_fn(found.len() / count.max(1), count, |i, j| found[i * count + j])
    }

    /// The unwhitened rows of `J T` and `r` at given parameter values, with parameters × columns `T`, block after block.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn unwhitened_model_rows(
        &self,
        beta: &[f64],
        to_parameters: &Mat<f64>,
    ) -> Result<(Mat<f64>, Vec<f64>), Diagnostic> {
        let values = self.problem.slot_values(beta);
        let rows = self.blocks.iter().map(|block| self.counting(block).len()).sum();
        let (mut model, mut residual) = (Mat::zeros(rows, to_parameters.ncols()), Vec::with_capacity(rows));
        for block in &self.blocks {
            let raw = self.problem.rows(&values, block)?;
            let counting = self.counting(block);
            let own = Mat::from_fn(counting.len(), beta.len(), |i, j| raw[(counting[i], j)]);
            model.as_mut().subrows_mut(residual.len(), own.nrows()).copy_from(&own * to_parameters);
            residual.extend(counting.iter().map(|i| raw[(*i, beta.len())]));
        }
        Ok((model, residual))
    }

    /// The fold of each row of [`Columns::unwhitened_model_rows`].
    pub fn unwhitened_folds(&self) -> Vec<usize> {
        let fold = |block: &RowBlock, i: usize| {
            self.problem.folds.of_row[block.test][block.rows.start + i / self.problem.channels(block.test)]
        };
        self.blocks.iter().flat_map(|block| self.counting(block).into_iter().map(move |i| fold(block, i))).collect()
    }

    /// The independent units over which held-out errors are paired. Along runs they are the folds (runs or blocks). Among
    /// poses they are the blocks of joint space, because one fit predicts a whole block, or the poses if folds are random.
    /// The rows are those of [`Columns::unwhitened_model_rows`].
    pub fn unwhitened_units(&self) -> Units {
        let rows = self.blocks.iter().flat_map(|block| {
            let channels = self.problem.channels(block.test);
            let reading = move |i: usize| (block.test, block.rows.start + i / channels);
            self.counting(block).into_iter().map(reading)
        });
        let fold = |test: usize, row: usize| self.problem.folds.of_row[test][row];
        match self.problem.folds.kind {
            FoldKind::RandomPoses => Units::of(rows.map(|(test, row)| self.problem.folds.pose_of_row[test][row])),
            FoldKind::PoseBlocks | FoldKind::Runs | FoldKind::RunGroups | FoldKind::Blocks => {
                Units::of(rows.map(|(test, row)| fold(test, row))).divided()
            }
        }
    }

    /// The scalar rows of a block whose readings are accepted.
    fn counting(&self, block: &RowBlock) -> Vec<usize> {
        let channels = self.problem.channels(block.test);
        let start = block.rows.start * channels;
        (0..block.rows.len() * channels).filter(|i| self.problem.counts(block.test, start + i)).collect()
    }
}
