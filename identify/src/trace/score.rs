//! How much a candidate gains, compared across numbers of columns.
//!
//! A candidate with `k` visible columns lowers the sum of squares of whitened residuals by a `χ²ₖ` variate if it is not there. What is compared
//! is `−ln P(χ²ₖ > gain)` less the candidate's cost in the library. The tail is computed in logarithms: at real effect sizes it underflows.

use faer::Mat;
use rayon::prelude::*;
use statrs::function::gamma::{gamma_ur, ln_gamma};

use super::moments::{FoldMoments, Moments};

/// Share of a candidate's own length that has to remain beside the model for it to count as seen.
pub const LEAST_VISIBLE: f64 = 1e-7;

/// `ln P(χ²ₖ > x)`.
pub fn ln_chi_square_tail(x: f64, k: usize) -> f64 {
    if k == 0 || x <= 0.0 {
        return 0.0;
    }
    let (a, z) = (k as f64 / 2.0, x / 2.0);
    if z < a + 1.0 {
        return gamma_ur(a, z).max(f64::MIN_POSITIVE).ln();
    }
    // Γ(a, z) by its continued fraction (Lentz; Abramowitz & Stegun 6.5.31), logarithm taken before anything underflows.
    let tiny = 1e-300;
    let mut b = z + 1.0 - a;
    let mut c = 1.0 / tiny;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..500 {
        let an = -(i as f64) * (i as f64 - a);
        b += 2.0;
        d = an * d + b;
        d = 1.0 / if d.abs() < tiny { tiny } else { d };
        c = b + an / c;
        if c.abs() < tiny {
            c = tiny;
        }
        let delta = c * d;
        h *= delta;
        if (delta - 1.0).abs() < 1e-14 {
            break;
        }
    }
    -z + a * z.ln() - ln_gamma(a) + h.ln()
}

/// No less than `−ln P(χ²ₖ > x)`, and quick: the tail of two degrees of freedom is `e^(−x/2)`, that of more is larger, that of one at least
/// `√(2/π) √x/(1 + x) e^(−x/2)`.
fn most_evidence(x: f64, k: usize) -> f64 {
    if k == 1 && x > 0.0 {
        0.5 * x + ((1.0 + x) / x.sqrt()).ln() + 0.5 * std::f64::consts::FRAC_PI_2.ln()
    } else {
        0.5 * x
    }
}

/// A model over the base: which base columns it has, and which folds it is trained on.
pub struct Trained<'m> {
    moments: &'m Moments,
    /// The base columns it has.
    pub base: Vec<usize>,
    /// The folds it is trained on.
    pub folds: Vec<usize>,
    /// `(XᵀX)⁻¹`.
    pub inverse: Mat<f64>,
    /// `Xᵀ C` and `(XᵀX)⁻¹ Xᵀ C` of all candidates, or none yet: many models are asked for few candidates or for none.
    all: Option<(Mat<f64>, Mat<f64>)>,
    /// The products that are summed: which, and with what sign. Nearly all folds are all of them less a few.
    parts: Vec<(&'m FoldMoments, f64)>,
    /// `Xᵀ y`.
    pub base_y: Vec<f64>,
    /// Coefficients of the base columns: `(XᵀX)⁻¹ Xᵀ y`.
    pub coefficients: Vec<f64>,
}

/// What is known beforehand, as products with the first base columns.
pub struct PriorMoments {
    /// Base with base.
    pub base: Mat<f64>,
    /// Base with residual.
    pub base_y: Vec<f64>,
}

/// What a candidate would gain.
#[derive(Clone, Debug, Default)]
pub struct Gain {
    /// Fall of the sum of squares.
    pub gain: f64,
    /// Directions that it adds, and numbers of its shape that were chosen.
    pub freedom: usize,
    /// The share of its own length that the model does not have already.
    pub visible: f64,
}

impl<'m> Trained<'m> {
    /// Trains a model that will be asked for every candidate.
    pub fn new(
        moments: &'m Moments,
        prior: &PriorMoments,
        base: Vec<usize>,
        folds: Vec<usize>,
    ) -> Trained<'m> {
        let mut trained = Trained::lean(moments, prior, base, folds);
        let total = moments
            .first
            .last()
            .map_or(0, |first| first + moments.count.last().copied().unwrap_or(0));
        let cross = trained.cross(0, total);
        let solved = &trained.inverse * &cross;
        trained.all = Some((cross, solved));
        trained
    }

    /// Trains a model that will be asked for few candidates.
    pub fn lean(
        moments: &'m Moments,
        prior: &PriorMoments,
        base: Vec<usize>,
        folds: Vec<usize>,
    ) -> Trained<'m> {
        let m = base.len();
        let left_out: Vec<usize> = (0..moments.folds.len())
            .filter(|fold| !folds.contains(fold))
            .collect();
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
                let mut sum = if *bi < of_prior && *bj < of_prior {
                    prior.base[(*bi, *bj)]
                } else {
                    0.0
                };
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
        let inverse = pseudo_inverse(&gram);
        let coefficients = (0..m)
            .map(|i| (0..m).map(|j| inverse[(i, j)] * base_y[j]).sum())
            .collect();
        Trained {
            moments,
            base,
            folds,
            inverse,
            all: None,
            parts,
            base_y,
            coefficients,
        }
    }

    /// `Xᵀ C` of consecutive candidate columns.
    fn cross(&self, first: usize, count: usize) -> Mat<f64> {
        Mat::from_fn(self.base.len(), count, |i, j| {
            self.parts
                .iter()
                .map(|(part, sign)| sign * part.cross[(self.base[i], first + j)])
                .sum()
        })
    }

    /// `Xᵀ C` and `(XᵀX)⁻¹ Xᵀ C` of a candidate.
    fn beside(&self, candidate: usize) -> (Mat<f64>, Mat<f64>) {
        let (first, count) = (self.moments.first[candidate], self.moments.count[candidate]);
        match &self.all {
            Some((cross, solved)) => (
                cross.subcols(first, count).to_owned(),
                solved.subcols(first, count).to_owned(),
            ),
            None => {
                let cross = self.cross(first, count);
                let solved = &self.inverse * &cross;
                (cross, solved)
            }
        }
    }

    /// `D` and `g` of a candidate, and its product with itself.
    pub fn projected(&self, candidate: usize) -> (Mat<f64>, Vec<f64>, Mat<f64>) {
        let (first, count) = (self.moments.first[candidate], self.moments.count[candidate]);
        let mut own = Mat::<f64>::zeros(count, count);
        let mut g = vec![0.0; count];
        for (part, sign) in &self.parts {
            own += faer::Scale(*sign) * &part.own[candidate];
            for k in 0..count {
                g[k] += sign * part.cross_y[first + k];
            }
        }
        // What is left of a difference by rounding is nothing.
        let whole = &self.moments.whole.own[candidate];
        for k in 0..count {
            if own[(k, k)] <= 1e-12 * whole[(k, k)] {
                own.row_mut(k).fill(0.0);
                own.col_mut(k).fill(0.0);
                g[k] = 0.0;
            }
        }
        let (cross, solved) = self.beside(candidate);
        let mut d = own.clone();
        for k in 0..count {
            for l in 0..count {
                let sum: f64 = (0..self.base.len()).map(|i| cross[(i, k)] * solved[(i, l)]).sum();
                d[(k, l)] -= sum;
            }
            g[k] -= (0..self.base.len())
                .map(|i| solved[(i, k)] * self.base_y[i])
                .sum::<f64>();
        }
        (d, g, own)
    }

    /// How much the model lowers the sum of squares, priors included.
    pub fn explained(&self) -> f64 {
        self.base_y
            .iter()
            .zip(&self.coefficients)
            .map(|(y, c)| y * c)
            .sum()
    }

    /// What the gain of a candidate is judged by: its directions that are seen, and the numbers of its shape. Without the latter whatever may be tuned would
    /// be preferred to what may not.
    fn freedom(&self, candidate: usize, seen: usize) -> usize {
        if seen == 0 {
            0
        } else {
            seen + self.moments.numbers[candidate]
        }
    }

    /// What a candidate would gain.
    pub fn gain(&self, candidate: usize) -> Gain {
        let (d, g, own) = self.projected(candidate);
        let inverse = Visible::of(&d, &own);
        Gain {
            gain: inverse.quadratic(&g),
            freedom: self.freedom(candidate, inverse.freedom),
            visible: inverse.share,
        }
    }

    /// What every candidate would gain.
    pub fn gains(&self) -> Vec<Gain> {
        (0..self.moments.count.len())
            .into_par_iter()
            .map(|candidate| self.gain(candidate))
            .collect()
    }

    /// The best score that each null draw gives to any candidate: `cost` and the inflation of the variance as in the real search.
    pub fn null_best(&self, costs: &[f64], variance: f64) -> Vec<f64> {
        let draws = self.moments.null_cross.nrows();
        let m = self.base.len();
        let h = Mat::from_fn(m, draws, |i, d| self.moments.null_base[(self.base[i], d)]);
        let per_chunk: Vec<Vec<f64>> = (0..costs.len())
            .collect::<Vec<_>>()
            .par_chunks(64)
            .map(|chunk| {
                let mut best = vec![f64::NEG_INFINITY; draws];
                for &candidate in chunk.iter().filter(|candidate| costs[**candidate].is_finite()) {
                    let (d, _, own) = self.projected(candidate);
                    let inverse = Visible::of(&d, &own);
                    let freedom = self.freedom(candidate, inverse.freedom);
                    if freedom == 0 {
                        continue;
                    }
                    let (first, count) = (self.moments.first[candidate], self.moments.count[candidate]);
                    let (_, solved) = self.beside(candidate);
                    for draw in 0..draws {
                        let g: Vec<f64> = (0..count)
                            .map(|k| {
                                let modelled: f64 = (0..m).map(|i| solved[(i, k)] * h[(i, draw)]).sum();
                                self.moments.null_cross[(draw, first + k)] - modelled
                            })
                            .collect();
                        let gain = inverse.quadratic(&g) / variance;
                        // The tail is worth computing only where it can be the best.
                        if most_evidence(gain, freedom) - costs[candidate] <= best[draw] {
                            continue;
                        }
                        let score = -ln_chi_square_tail(gain, freedom) - costs[candidate];
                        best[draw] = best[draw].max(score);
                    }
                }
                best
            })
            .collect();
        let mut best = vec![f64::NEG_INFINITY; draws];
        for chunk in per_chunk {
            best.iter_mut().zip(chunk).for_each(|(b, c)| *b = b.max(c));
        }
        best
    }

    /// The share of a signature in the base (coefficients over base columns that are not in this model) that a candidate can imitate, beside the
    /// model: `cos²` of the angle between the two.
    pub fn imitated(&self, candidate: usize, signature: &[(usize, f64)]) -> f64 {
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
        let (_, solved) = self.beside(candidate);
        for k in 0..count {
            g[k] -= (0..self.base.len())
                .map(|i| solved[(i, k)] * gram_with[i])
                .sum::<f64>();
        }
        let inverse = Visible::of(&d, &own);
        let projected = length - self.model_share(&gram_with);
        if projected <= 0.0 {
            0.0
        } else {
            (inverse.quadratic(&g) / projected).clamp(0.0, 1.0)
        }
    }

    /// `gᵀ (XᵀX)⁻¹ g`.
    fn model_share(&self, gram_with: &[f64]) -> f64 {
        let m = self.base.len();
        let quadratic = |i: usize, j: usize| gram_with[i] * self.inverse[(i, j)] * gram_with[j];
        (0..m)
            .flat_map(|i| (0..m).map(move |j| (i, j)))
            .map(|(i, j)| quadratic(i, j))
            .sum()
    }

    /// Coefficients of the model's base columns and of a candidate's columns if the candidate joins.
    pub fn joined(&self, candidate: usize) -> (Vec<f64>, Vec<f64>) {
        let (d, g, own) = self.projected(candidate);
        let of_candidate = Visible::of(&d, &own).solve(&g);
        let (_, solved) = self.beside(candidate);
        let of_model = (0..self.base.len())
            .map(|i| {
                let shift: f64 = of_candidate
                    .iter()
                    .enumerate()
                    .map(|(k, c)| solved[(i, k)] * c)
                    .sum();
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

/// `gᵀ D⁻¹ g` on the directions that are seen.
pub fn quadratic_gain(d: &Mat<f64>, own: &Mat<f64>, g: &[f64]) -> f64 {
    Visible::of(d, own).quadratic(g)
}

/// The inverse of a candidate's projected product on the directions that are seen.
struct Visible {
    vectors: Mat<f64>,
    values: Vec<f64>,
    scale: Vec<f64>,
    freedom: usize,
    share: f64,
}

impl Visible {
    fn of(d: &Mat<f64>, own: &Mat<f64>) -> Visible {
        let n = d.nrows();
        let scale: Vec<f64> = (0..n)
            .map(|k| {
                if own[(k, k)] > 0.0 {
                    1.0 / own[(k, k)].sqrt()
                } else {
                    0.0
                }
            })
            .collect();
        let scaled = Mat::from_fn(n, n, |i, j| d[(i, j)] * scale[i] * scale[j]);
        let share = if n == 0 {
            0.0
        } else {
            (0..n).map(|i| scaled[(i, i)]).fold(0.0, f64::max)
        };
        if n == 1 {
            let seen = scaled[(0, 0)] > LEAST_VISIBLE;
            let values = vec![if seen { 1.0 / scaled[(0, 0)] } else { 0.0 }];
            return Visible {
                vectors: Mat::identity(1, 1),
                values,
                scale,
                freedom: usize::from(seen),
                share,
            };
        }
        let Ok(eigen) = scaled.self_adjoint_eigen(faer::Side::Lower) else {
            return Visible {
                vectors: Mat::identity(n, n),
                values: vec![0.0; n],
                scale,
                freedom: 0,
                share,
            };
        };
        let values: Vec<f64> = eigen
            .S()
            .column_vector()
            .iter()
            .map(|value| if *value > LEAST_VISIBLE { 1.0 / value } else { 0.0 })
            .collect();
        let freedom = values.iter().filter(|value| **value > 0.0).count();
        Visible {
            vectors: eigen.U().to_owned(),
            values,
            scale,
            freedom,
            share,
        }
    }

    fn quadratic(&self, g: &[f64]) -> f64 {
        let n = g.len();
        (0..n)
            .filter(|k| self.values[*k] > 0.0)
            .map(|k| {
                let along: f64 = (0..n).map(|i| self.vectors[(i, k)] * g[i] * self.scale[i]).sum();
                along * along * self.values[k]
            })
            .sum()
    }

    fn solve(&self, g: &[f64]) -> Vec<f64> {
        let n = g.len();
        let mut solution = vec![0.0; n];
        for k in (0..n).filter(|k| self.values[*k] > 0.0) {
            let along: f64 = (0..n).map(|i| self.vectors[(i, k)] * g[i] * self.scale[i]).sum();
            for i in 0..n {
                solution[i] += self.vectors[(i, k)] * self.scale[i] * along * self.values[k];
            }
        }
        solution
    }
}

/// Inverse of a symmetric product, directions below rounding left out.
fn pseudo_inverse(gram: &Mat<f64>) -> Mat<f64> {
    let n = gram.nrows();
    let Ok(eigen) = gram.self_adjoint_eigen(faer::Side::Lower) else {
        return Mat::identity(n, n);
    };
    let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
    let largest = values.iter().fold(0.0_f64, |a, b| a.max(*b));
    let u = eigen.U();
    let scaled = Mat::from_fn(n, n, |i, k| {
        if values[k] > largest * 1e-12 {
            u[(i, k)] / values[k]
        } else {
            0.0
        }
    });
    &scaled * u.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_bound_is_a_bound() {
        for k in 1..6 {
            for x in [1e-6, 0.01, 0.5, 1.0, 3.0, 20.0, 200.0, 4000.0] {
                let evidence = -ln_chi_square_tail(x, k);
                assert!(most_evidence(x, k) >= evidence - 1e-12, "{x} {k} {evidence}");
            }
        }
    }
}
