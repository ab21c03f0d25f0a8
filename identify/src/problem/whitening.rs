//! Whitening of rows along a run, without outliers.

use faer::{Mat, MatMut};

use super::{Problem, RowBlock};

/// The linear filter that whitens the rows of a run.
pub struct Filter {
    /// Factor of a row without a complete past.
    at_start: f64,
    /// Number of scalar rows at the start of a block without a complete past.
    past: usize,
    /// Lag in scalar rows and factor of each term, the present first.
    terms: Vec<(usize, f64)>,
}

impl Filter {
    /// Whether each whitened row is formed from one row.
    pub fn is_pointwise(&self) -> bool {
        self.terms.len() == 1
    }

    /// The scalar rows of a block from which its whitened row `i` is formed, with their factors.
    pub fn terms(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let (count, first) = if i < self.past { (1, self.at_start) } else { (self.terms.len(), self.terms[0].1) };
        let factor = move |k: usize, factor: f64| if k == 0 { first } else { factor };
        self.terms[..count].iter().enumerate().map(move |(k, (lag, of))| (i - lag, factor(k, *of)))
    }
}

impl Problem {
    /// The scalar rows of a block that remain after whitening. A row is dropped if its value, or one within the filter's
    /// order before it, was not read or is an outlier.
    pub fn kept_rows(&self, block: &RowBlock) -> Vec<usize> {
        let channels = self.channels(block.test);
        let all = 0..block.rows.len() * channels;
        if !self.rejected[block.test][block.rows.clone()].contains(&true) && self.missing[block.test].is_empty() {
            return all.collect();
        }
        let start = block.rows.start * channels;
        all.filter(|i| {
            let reach = self.noise.ar_coefficients.len().min(i / channels);
            (0..=reach).all(|lag| self.counts(block.test, start + i - lag * channels))
        })
        .collect()
    }

    /// Whitens rows along a run, `(x_t − Σ a_k x_{t−k})/σ_innovation`, and drops outliers. Returns the remaining rows
    /// and the fold of each.
    pub fn whiten(&self, rows: &Mat<f64>, block: &RowBlock) -> (Mat<f64>, Vec<usize>) {
        let kept = self.kept_rows(block);
        let folds = self.folds_of(&kept, block).collect();
        (self.whitened(rows.clone(), &kept), folds)
    }

    /// The fold of each of the given scalar rows of a block.
    pub fn folds_of(&self, rows: &[usize], block: &RowBlock) -> impl Iterator<Item = usize> {
        let fold_of = &self.folds.of_row[block.test][block.rows.clone()];
        let channels = self.channels(block.test);
        rows.iter().map(move |i| fold_of[i / channels])
    }

    /// What whitening makes of each scalar row of a block: the value of that row times the first factor, plus earlier
    /// values times the others. The rows at the start of a run have no past.
    pub fn filter(&self) -> Filter {
        let inflation = self.noise.inflation.sqrt();
        let innovation = 1.0 / (self.noise.innovation_mm() * inflation);
        // Noise is autocorrelated only where every reading has one channel.
        let lagged = self.noise.ar_coefficients.iter().enumerate().map(|(lag, a)| (lag + 1, -a * innovation));
        Filter {
            at_start: 1.0 / self.noise.likelihood_mm(),
            past: self.noise.ar_coefficients.len(),
            terms: std::iter::once((0, innovation)).chain(lagged).collect(),
        }
    }

    /// The rows of [`Problem::whiten`] for known remaining rows.
    pub fn whitened(&self, mut rows: Mat<f64>, kept: &[usize]) -> Mat<f64> {
        self.whiten_in_place(rows.as_mut(), kept);
        rows.truncate(kept.len(), rows.ncols());
        rows
    }

    /// The same in place: the remaining rows come first.
    pub(super) fn whiten_in_place(&self, rows: MatMut<'_, f64>, kept: &[usize]) {
        let ar_coefficients = &self.noise.ar_coefficients;
        let inflation = self.noise.inflation.sqrt();
        let innovation = 1.0 / (self.noise.innovation_mm() * inflation);
        let marginal = 1.0 / self.noise.likelihood_mm();
        let past = ar_coefficients.len().min(rows.nrows());
        let mut before = vec![0.0; if past > 0 { rows.nrows() } else { 0 }];
        for column in rows.col_iter_mut().filter_map(|column| Some(column.try_as_col_major_mut()?.as_slice_mut())) {
            // One coefficient after the other, so that the compiler can vectorise the loops.
            before.iter_mut().zip(&*column).for_each(|(before, value)| *before = *value);
            for (lag, a) in (1..).zip(ar_coefficients) {
                let earlier = &before[past - lag.min(past)..];
                column[past..].iter_mut().zip(earlier).for_each(|(value, earlier)| *value -= a * earlier);
            }
            column[past..].iter_mut().for_each(|value| *value *= innovation);
            column[..past].iter_mut().for_each(|value| *value *= marginal);
            if kept.len() < column.len() {
                let mut next = 0;
                for stretch in kept.chunk_by(|a, b| a + 1 == *b) {
                    column.copy_within(stretch[0]..stretch[0] + stretch.len(), next);
                    next += stretch.len();
                }
            }
        }
    }
}
