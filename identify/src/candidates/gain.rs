//! The gain of a candidate, and a score that compares candidates with different numbers of columns.
//!
//! If a candidate with `k` observable columns is absent, its gain follows a `χ²ₖ` distribution. The gain is the
//! decrease of the sum of squares of whitened residuals. The score is `−ln P(χ²ₖ > gain)` less the candidate's cost in
//! the library. The tail is computed in logarithms, because it underflows at real effect sizes.

use std::borrow::Cow;
use std::ops::Range;

use super::moments::{FoldMoments, Moments};
use crate::error::IdentifyError;
use crate::numerics::gain::ObservableSubspace;
use crate::numerics::parallel;
use crate::numerics::symmetric::pseudo_inverse;
use crate::numerics::tails::{ln_chi_square_tail, most_evidence};
use faer::{Mat, MatRef};

/// A model over the base: its base columns and its training folds.
pub struct TrainedModel<'m> {
    moments: &'m Moments,
    /// Indices of its base columns.
    pub base: Vec<usize>,
    /// The training folds.
    pub folds: Vec<usize>,
    /// `(XᵀX)⁻¹`.
    pub inverse: Mat<f64>,
    /// `Xᵀ C` and `(XᵀX)⁻¹ Xᵀ C` of all candidates. `None` for a model that evaluates few candidates.
    all: Option<(Mat<f64>, Mat<f64>)>,
    /// The summed products, each with its sign. A sum over most folds is the sum over all folds less the others.
    parts: Vec<(&'m FoldMoments, f64)>,
    /// `Xᵀ y`.
    pub base_y: Vec<f64>,
    /// Coefficients of the base columns: `(XᵀX)⁻¹ Xᵀ y`.
    pub coefficients: Vec<f64>,
}

/// The priors as products with the first base columns.
pub struct PriorMoments {
    /// Base with base.
    pub base: Mat<f64>,
    /// Base with residual.
    pub base_y: Vec<f64>,
}

/// The gain of a candidate.
#[derive(Clone, Debug, Default)]
pub struct Gain {
    /// Decrease of the sum of squares.
    pub gain: f64,
    /// Number of added directions and tuned shape numbers.
    pub freedom: usize,
}

/// `Xᵀ C` and `(XᵀX)⁻¹ Xᵀ C` of a candidate, borrowed from those of all candidates or computed for this one.
struct GivenModel<'t> {
    cross: Cow<'t, Mat<f64>>,
    solved: Cow<'t, Mat<f64>>,
    /// Its columns within these matrices.
    columns: Range<usize>,
}

impl GivenModel<'_> {
    /// Of its `k`-th column.
    fn cross(&self, k: usize) -> &[f64] {
        self.cross.col_as_slice(self.columns.start + k)
    }

    /// Of its `k`-th column.
    fn solved(&self, k: usize) -> &[f64] {
        self.solved.col_as_slice(self.columns.start + k)
    }

    /// Of all its columns.
    fn all_solved(&self) -> MatRef<'_, f64> {
        self.solved.subcols(self.columns.start, self.columns.len())
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<'m> TrainedModel<'m> {
    /// Trains a model for the evaluation of every candidate.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn new(
        moments: &'m Moments,
        prior: &PriorMoments,
        base: Vec<usize>,
        folds: Vec<usize>,
    ) -> Result<TrainedModel<'m>, IdentifyError> {
        let mut trained = TrainedModel::projection(moments, prior, base, folds)?;
        let total = moments.first.last().map_or(0, |first| first + moments.count.last().copied().unwrap_or(0));
        let cross = trained.cross(0, total);
        let solved = &trained.inverse * &cross;
        trained.all = Some((cross, solved));
        Ok(trained)
    }

    /// Trains a model for the evaluation of few candidates.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn projection(
        moments: &'m Moments,
        prior: &PriorMoments,
        base: Vec<usize>,
        folds: Vec<usize>,
    ) -> Result<TrainedModel<'m>, IdentifyError> {
        let m = base.len();
        let left_out: Vec<usize> = (0..moments.folds.len()).filter(|fold| !folds.contains(fold)).collect();
        let parts: Vec<(&FoldMoments, f64)> = if left_out.len() < folds.len() {
            std::iter::once((&moments.whole, 1.0))
                .chain(left_out.iter().map(|fold| (&moments.folds[*fold], -1.0)))
                .collect()
        } else {
            folds.iter().map(|fold| (&moments.folds[*fold], 1.0)).collect()
        };
        let of_prior = prior.base.nrows();
        let mut gram = Mat::<f64>::zeros(m, m);
        let mut base_y = vec![0.0; m];
        for (i, bi) in base.iter().enumerate() {
            for (j, bj) in base.iter().enumerate() {
                let mut sum = if *bi < of_prior && *bj < of_prior { prior.base[(*bi, *bj)] } else { 0.0 };
                for (part, sign) in &parts {
                    sum += sign * part.base[(*bi, *bj)];
                }
                gram[(i, j)] = sum;
            }
            base_y[i] = if *bi < of_prior { prior.base_y[*bi] } else { 0.0 };
            for (part, sign) in &parts {
                base_y[i] += sign * part.base_y[*bi];
            }
        }
        let inverse = pseudo_inverse(gram.as_ref())?;
        let coefficients = (0..m).map(|i| (0..m).map(|j| inverse[(i, j)] * base_y[j]).sum()).collect();
        Ok(TrainedModel { moments, base, folds, inverse, all: None, parts, base_y, coefficients })
    }

    /// `Xᵀ C` of consecutive candidate columns.
    fn cross(&self, first: usize, count: usize) -> Mat<f64> {
        let mut cross = Mat::zeros(self.base.len(), count);
        for (part, sign) in &self.parts {
            for (j, to) in cross.col_iter_mut().enumerate() {
                let of_part = part.cross.col_as_slice(first + j);
                to.iter_mut().zip(&self.base).for_each(|(to, base)| *to += sign * of_part[*base]);
            }
        }
        cross
    }

    /// `Xᵀ C` and `(XᵀX)⁻¹ Xᵀ C` of a candidate.
    fn beside(&self, candidate: usize) -> GivenModel<'_> {
        let (first, count) = (self.moments.first[candidate], self.moments.count[candidate]);
        match &self.all {
            Some((cross, solved)) => {
                GivenModel { cross: Cow::Borrowed(cross), solved: Cow::Borrowed(solved), columns: first..first + count }
            }
            None => {
                let cross = self.cross(first, count);
                GivenModel { solved: Cow::Owned(&self.inverse * &cross), cross: Cow::Owned(cross), columns: 0..count }
            }
        }
    }

    /// `D`, `g` and the product with itself of a candidate.
    pub fn projected(&self, candidate: usize) -> (Mat<f64>, Vec<f64>, Mat<f64>) {
        self.projected_with(candidate, &self.beside(candidate))
    }

    fn projected_with(&self, candidate: usize, beside: &GivenModel<'_>) -> (Mat<f64>, Vec<f64>, Mat<f64>) {
        let (first, count) = (self.moments.first[candidate], self.moments.count[candidate]);
        let over_parts =
            |of: &dyn Fn(&FoldMoments) -> f64| -> f64 { self.parts.iter().map(|(part, sign)| sign * of(part)).sum() };
        let mut own = Mat::from_fn(count, count, |k, l| over_parts(&|part| part.own[candidate][(k, l)]));
        let mut g: Vec<f64> = (0..count).map(|k| over_parts(&|part| part.cross_y[first + k])).collect();
        // A difference at the rounding level counts as zero.
        let whole = &self.moments.whole.own[candidate];
        for k in 0..count {
            if own[(k, k)] <= 1e-12 * whole[(k, k)] {
                own.row_mut(k).fill(0.0);
                own.col_mut(k).fill(0.0);
                g[k] = 0.0;
            }
        }
        let d = Mat::from_fn(count, count, |k, l| own[(k, l)] - dot(beside.cross(k), beside.solved(l)));
        for k in 0..count {
            g[k] -= dot(beside.solved(k), &self.base_y);
        }
        (d, g, own)
    }

    /// The decrease of the sum of squares by the model, priors included.
    pub fn explained(&self) -> f64 {
        self.base_y.iter().zip(&self.coefficients).map(|(y, c)| y * c).sum()
    }

    /// The degrees of freedom of a candidate's gain: its observable directions and its tuned shape numbers. Without the
    /// latter, tunable candidates would be preferred.
    fn freedom(&self, candidate: usize, observable: usize) -> usize {
        if observable == 0 { 0 } else { observable + self.moments.numbers[candidate] }
    }

    /// The gain of a candidate.
    pub fn gain(&self, candidate: usize) -> Gain {
        let (d, g, own) = self.projected(candidate);
        let inverse = ObservableSubspace::of(&d, &own);
        Gain { gain: inverse.quadratic(&g), freedom: self.freedom(candidate, inverse.freedom) }
    }

    /// The gains of all candidates.
    pub fn gains(&self) -> Vec<Gain> {
        self.remaining_gains(Vec::new())
    }

    /// The gains of all candidates. `known` are those of the first candidates with the same model.
    pub fn remaining_gains(&self, mut known: Vec<Gain>) -> Vec<Gain> {
        let first = known.len();
        known.extend(parallel::map(self.moments.count.len() - first, &|k| self.gain(first + k)));
        known
    }

    /// The best score of each null draw over all candidates. `costs` and `variance` are those of the real search.
    pub fn null_best(&self, costs: &[f64], variance: f64) -> Vec<f64> {
        let draws = self.moments.null_cross.nrows();
        let h = Mat::from_fn(draws, self.base.len(), |d, i| self.moments.null_base[(self.base[i], d)]);
        const AT_ONCE: usize = 64;
        let per_chunk: Vec<Vec<f64>> = parallel::map(costs.len().div_ceil(AT_ONCE), &|chunk| {
            let mut best = vec![f64::NEG_INFINITY; draws];
            let mut g = Vec::new();
            let of_chunk = chunk * AT_ONCE..((chunk + 1) * AT_ONCE).min(costs.len());
            for candidate in of_chunk.filter(|candidate| costs[*candidate].is_finite()) {
                let beside = self.beside(candidate);
                let (d, _, own) = self.projected_with(candidate, &beside);
                let inverse = ObservableSubspace::of(&d, &own);
                let freedom = self.freedom(candidate, inverse.freedom);
                if freedom == 0 {
                    continue;
                }
                let (first, count) = (self.moments.first[candidate], self.moments.count[candidate]);
                let modelled = &h * beside.all_solved();
                for draw in 0..draws {
                    g.clear();
                    let left = |k: usize| self.moments.null_cross[(draw, first + k)] - modelled[(draw, k)];
                    g.extend((0..count).map(left));
                    let gain = inverse.quadratic(&g) / variance;
                    // The tail is computed only if it can exceed the best score.
                    if most_evidence(gain, freedom) - costs[candidate] <= best[draw] {
                        continue;
                    }
                    let score = -ln_chi_square_tail(gain, freedom) - costs[candidate];
                    best[draw] = best[draw].max(score);
                }
            }
            best
        });
        let mut best = vec![f64::NEG_INFINITY; draws];
        for chunk in per_chunk {
            best.iter_mut().zip(chunk).for_each(|(b, c)| *b = b.max(c));
        }
        best
    }

    /// The share of a signature that a candidate can reproduce in addition to the model: `cos²` of the angle between
    /// the two. The signature is given by coefficients of base columns that are not in this model.
    pub fn explained_by_signature(&self, candidate: usize, signature: &[(usize, f64)]) -> f64 {
        let (d, _, own) = self.projected(candidate);
        let (first, count) = (self.moments.first[candidate], self.moments.count[candidate]);
        let mut g = vec![0.0; count];
        let mut gram_with = vec![0.0; self.base.len()];
        let mut length = 0.0;
        for (part, sign) in &self.parts {
            for (a, ca) in signature {
                for k in 0..count {
                    g[k] += sign * ca * part.cross[(*a, first + k)];
                }
                for (i, bi) in self.base.iter().enumerate() {
                    gram_with[i] += sign * ca * part.base[(*a, *bi)];
                }
                for (b, cb) in signature {
                    length += sign * ca * cb * part.base[(*a, *b)];
                }
            }
        }
        let beside = self.beside(candidate);
        for k in 0..count {
            g[k] -= dot(beside.solved(k), &gram_with);
        }
        let inverse = ObservableSubspace::of(&d, &own);
        let projected = length - self.model_share(&gram_with);
        if projected <= 0.0 { 0.0 } else { (inverse.quadratic(&g) / projected).clamp(0.0, 1.0) }
    }

    /// `gᵀ (XᵀX)⁻¹ g`.
    fn model_share(&self, gram_with: &[f64]) -> f64 {
        let m = self.base.len();
        let quadratic = |i: usize, j: usize| gram_with[i] * self.inverse[(i, j)] * gram_with[j];
        (0..m).flat_map(|i| (0..m).map(move |j| (i, j))).map(|(i, j)| quadratic(i, j)).sum()
    }

    /// Coefficients of the model's base columns and of a candidate's columns if the candidate is added.
    pub fn with_candidate(&self, candidate: usize) -> (Vec<f64>, Vec<f64>) {
        let (d, g, own) = self.projected(candidate);
        let of_candidate = ObservableSubspace::of(&d, &own).solve(&g);
        let beside = self.beside(candidate);
        let of_model = (0..self.base.len())
            .map(|i| {
                let shift: f64 = of_candidate.iter().enumerate().map(|(k, c)| beside.solved(k)[i] * c).sum();
                self.coefficients[i] - shift
            })
            .collect();
        (of_model, of_candidate)
    }

    /// Sum of squares of a fold's residual under this model.
    pub fn sum_of_squares_on(&self, fold: usize) -> f64 {
        let fold = &self.moments.folds[fold];
        let mut sum = fold.yy;
        for (i, bi) in self.base.iter().enumerate() {
            sum -= 2.0 * self.coefficients[i] * fold.base_y[*bi];
            for (j, bj) in self.base.iter().enumerate() {
                sum += self.coefficients[i] * self.coefficients[j] * fold.base[(*bi, *bj)];
            }
        }
        sum
    }
}
