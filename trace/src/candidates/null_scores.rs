//! The best score of all candidates on each null draw: the null distribution of one round of the search.

use abbe_identify::numerics::gain::ObservableSubspace;
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::tails::{ln_chi_square_tail, most_evidence};
use abbe_model::Diagnostic;
use faer::Mat;

use super::gain::{AT_ONCE, TrainedModel};

impl TrainedModel<'_> {
    /// The best score of each null draw over all candidates. `costs` and `variance` are those of the real search.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn null_best(&self, chosen: &[usize], costs: &[f64], variance: f64) -> Result<Vec<f64>, Diagnostic> {
        let draws = self.gram.draws();
        let mut h = Mat::zeros(draws, self.along.len());
        let mut column = 0;
        for candidate in chosen {
            let (segment, local) = self.gram.place(*candidate);
            let products = self.gram.null_products(segment)?;
            for k in self.gram.columns_of(segment, local) {
                h.col_mut(column).copy_from(products.col(k));
                column += 1;
            }
        }
        let counted: Vec<usize> = (0..costs.len()).filter(|candidate| costs[*candidate].is_finite()).collect();
        for candidate in &counted {
            let segment = self.gram.place(*candidate).0;
            self.segment(segment)?;
            self.gram.null_products(segment)?;
        }
        let chunks: Vec<&[usize]> = counted.chunks(AT_ONCE).collect();
        let of_chunks = parallel::map(chunks.len(), &|k| self.null_best_of(chunks[k], costs, variance, &h));
        let mut best = vec![f64::NEG_INFINITY; draws];
        for chunk in of_chunks {
            best.iter_mut().zip(chunk?).for_each(|(b, c)| *b = b.max(c));
        }
        Ok(best)
    }

    fn null_best_of(
        &self,
        candidates: &[usize],
        costs: &[f64],
        variance: f64,
        h: &Mat<f64>,
    ) -> Result<Vec<f64>, Diagnostic> {
        let draws = h.nrows();
        let mut best = vec![f64::NEG_INFINITY; draws];
        let mut g: Vec<f64> = Vec::new();
        let mut left = Mat::zeros(0, 0);
        for candidate in candidates {
            let (number, local) = self.gram.place(*candidate);
            let (columns, square) = (self.gram.columns_of(number, local), self.gram.square_of(number, local));
            let (segment, null) = (self.segment(number)?, self.gram.null_products(number)?);
            let projected = self.projected_in(&segment, columns.clone(), square);
            let subspace = ObservableSubspace::of(&projected.d, &projected.own);
            let freedom = self.freedom(*candidate, subspace.freedom);
            if freedom == 0 {
                continue;
            }
            let null = null.as_ref().subcols(columns.start, columns.len());
            let null = if h.ncols() == 0 {
                null
            } else {
                left = null - h * segment.solved.as_ref().subcols(columns.start, columns.len());
                left.as_ref()
            };
            for (draw, best) in best.iter_mut().enumerate() {
                g.clear();
                g.extend((0..columns.len()).map(|k| null[(draw, k)]));
                let gain = subspace.quadratic(&g) / variance;
                // The tail is computed only if it can exceed the best score.
                if most_evidence(gain, freedom) - costs[*candidate] <= *best {
                    continue;
                }
                let score = -ln_chi_square_tail(gain, freedom) - costs[*candidate];
                *best = best.max(score);
            }
        }
        drop(left);
        Ok(best)
    }
}
