//! The restricted likelihood of an autoregression along detrended runs, from one pass over the readings.
//!
//! Removing a trend from every run removes slow noise too: with a coefficient of 0.8 and a hundred readings per run, more
//! than half of its slow part. The autoregression is therefore estimated from what the trend leaves. For `n` deviations
//! `d` of a run without the orthonormal terms `Q` of its trend, the restricted likelihood is (Harville, J. Am. Stat. Assoc.
//! 72 (1977) 320)
//!
//! ```text
//! −2 ln L = m ln σ² + ln |R| + ln |QᵀR⁻¹Q| + dᵀPd/σ²,   m = n − rank Q,
//! P = R⁻¹ − R⁻¹Q (QᵀR⁻¹Q)⁻¹ QᵀR⁻¹
//! ```
//!
//! with the autocorrelations `R` of the process. They follow from its partial autocorrelations: the recursion of Durbin and
//! Levinson gives the prediction of each value from those before. For `n > p` values of an autoregression of order `p` with
//! the coefficients `a`, and `c = (1, −a₁, …, −a_p)`, the inverse is a band (Gohberg & Semencul, Mat. Issled. 7 (1972) 201),
//! `v` being the variance that a prediction leaves:
//!
//! ```text
//! v (R⁻¹)_ij = h_l(0) − h_l(i + 1) − h_l(n − j),   l = j − i ≥ 0,   h_l(x) = Σ_{x ≤ k ≤ p − l} c_k c_{k+l}
//! ```
//!
//! `h_l(x)` vanishes except near the ends. So `uᵀR⁻¹v` is a sum of few products of lagged series, each times a polynomial
//! in the coefficients. The products are formed once; a value of the likelihood then takes no pass over the readings.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::{Add, AddAssign, Range};

use abbe_model::session::Test;
use faer::Mat;
use nalgebra::{SMatrix, SVector};

use super::PureError;
use super::trends::{TERMS, Trends, orthonormalise};
use crate::numerics::parallel;
use crate::numerics::regression::dot;

/// Maximum autoregressive order.
pub(super) const MAX_ORDER: usize = 3;
/// Least number of pairs of deviations at the largest lag.
const MIN_PAIRS: usize = 50;

/// The deviations of repeats along runs, as the sums that the likelihood of an autoregression needs.
pub(super) struct DetrendedRuns {
    alike: Vec<AlikeRuns>,
}

/// Runs of one test with deviations at the same places.
struct AlikeRuns {
    /// Number of places of a run with no, one, … deviations before them; the last with so many or more.
    places: [usize; MAX_ORDER + 1],
    /// Degrees of freedom of one run beside its trend.
    freedom: f64,
    /// Number of runs.
    runs: usize,
    /// The terms that the trend lacks.
    missing: [bool; TERMS],
    sums: Vec<LaggedSums>,
    /// Share of independent deviations: two repeats hold the same deviation twice.
    independent: f64,
}

/// Sums over the uninterrupted deviations of one length. Deviations of white noise have its variance, less that of the
/// trend.
struct LaggedSums {
    /// Greatest order of the prediction of these deviations: less than their number.
    most: usize,
    /// Of the terms of the trend with each other: the upper triangle.
    trend: Vec<SVector<f64, PAIRS>>,
    /// Of deviations with themselves, over all runs, mm².
    squares: Vec<f64>,
    /// Of the deviations of each run with the terms of the trend, one run after another, mm.
    along: Vec<SVector<f64, TERMS>>,
}

/// Number of pairs of the terms of a trend.
const PAIRS: usize = TERMS * (TERMS + 1) / 2;

/// The pairs of terms of a trend.
fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..TERMS).flat_map(|j| (0..=j).map(move |i| (i, j)))
}

/// A value of the likelihood.
pub(super) struct RestrictedFit {
    pub minus_two_ln: f64,
    pub sigma_mm: f64,
}

/// `ln |R| + ln |QᵀR⁻¹Q|` of one run, and `dᵀPd` summed over runs, mm².
struct FitOfRuns {
    ln_determinant: f64,
    squares: f64,
}

impl DetrendedRuns {
    /// For processes of at most third order. `None` without enough pairs of deviations, and for readings of several
    /// channels.
    pub fn of(pure: &PureError, tests: &[Test], kept: impl Fn(usize, usize) -> bool + Sync) -> Option<DetrendedRuns> {
        if tests.iter().any(|test| test.readings.as_ref().is_none_or(|readings| readings.channels != 1)) {
            return None;
        }
        let of_tests = parallel::map(tests.len(), &|number| AlikeRuns::of_test(pure, number, tests, &kept));
        let pairs: usize = of_tests.iter().map(|(_, pairs)| pairs).sum();
        let mut alike: Vec<AlikeRuns> = of_tests.into_iter().flat_map(|(alike, _)| alike).collect();
        alike.retain(|alike| alike.freedom > 0.5 && alike.independent > 0.0);
        let is_constant = alike.iter().flat_map(|alike| &alike.sums).all(|sums| sums.squares[0] == 0.0);
        (pairs >= MIN_PAIRS && !is_constant).then_some(DetrendedRuns { alike })
    }

    /// The restricted likelihood of partial autocorrelations, with the stated or else the best standard deviation.
    pub fn fit(&self, partials: &[f64], stated_mm: Option<f64>) -> RestrictedFit {
        let predictions = Predictions::of(partials);
        let weights: Vec<Vec<f64>> = (0..=MAX_ORDER).map(|most| predictions.weights(most)).collect();
        let (mut freedom, mut ln_determinants, mut squares) = (0.0, 0.0, 0.0);
        for alike in &self.alike {
            let of_runs = alike.fit(&predictions, &weights);
            let count = alike.independent * alike.runs as f64;
            freedom += count * alike.freedom;
            ln_determinants += count * of_runs.ln_determinant;
            squares += alike.independent * of_runs.squares;
        }
        let variance = stated_mm.map_or(squares / freedom, |sigma_mm| sigma_mm * sigma_mm);
        let minus_two_ln = freedom * variance.ln() + ln_determinants + squares / variance;
        RestrictedFit { minus_two_ln, sigma_mm: variance.sqrt() }
    }
}

impl AlikeRuns {
    /// The runs of a test, and the number of pairs of deviations at the largest lag.
    fn of_test(
        pure: &PureError,
        number: usize,
        tests: &[Test],
        kept: impl Fn(usize, usize) -> bool,
    ) -> (Vec<AlikeRuns>, usize) {
        let Some(readings) = &tests[number].readings else { return (Vec::new(), 0) };
        let trends = Trends::of(readings, |row| kept(number, row));
        let deviation = |row: usize| pure.deviations[number][row].filter(|_| kept(number, row)).unwrap_or(f64::NAN);
        let mut alike: Vec<(Vec<Range<usize>>, Vec<[f64; TERMS]>, Vec<Vec<f64>>)> = Vec::new();
        let mut whole_runs: HashMap<usize, usize> = HashMap::new();
        let mut pairs = 0;
        for run in readings.runs() {
            let known: Vec<usize> = run.clone().filter(|row| !deviation(*row).is_nan()).collect();
            let values = known.iter().map(|row| deviation(*row) / pure.rescaling(number)).collect();
            let stretches = stretches(&known);
            pairs += stretches.iter().map(|stretch| stretch.len().saturating_sub(MAX_ORDER)).sum::<usize>();
            let place = match whole_runs.entry(run.len()) {
                Entry::Occupied(entry) if known.len() == run.len() => *entry.get(),
                entry => {
                    let mut trend: Vec<[f64; TERMS]> = known.iter().map(|row| trends.terms_at(*row)).collect();
                    orthonormalise(&mut trend);
                    alike.push((stretches, trend, Vec::new()));
                    if known.len() == run.len() {
                        entry.insert_entry(alike.len() - 1);
                    }
                    alike.len() - 1
                }
            };
            alike[place].2.push(values);
        }
        let mut alike = parallel::map(alike.len(), &|place| {
            let (stretches, trend, runs) = &alike[place];
            AlikeRuns::of(stretches, trend, runs)
        });
        let freedom: f64 = alike.iter().map(|alike| alike.freedom * alike.runs as f64).sum();
        let independent = (pure.freedom_of_tests[number] / freedom.max(f64::MIN_POSITIVE)).min(1.0);
        alike.iter_mut().for_each(|alike| alike.independent = independent);
        (alike, pairs)
    }

    /// From the places of uninterrupted deviations, the orthonormal terms of the trend at each place, zero for missing
    /// terms, and the deviations of each run, mm.
    fn of(stretches: &[Range<usize>], trend: &[[f64; TERMS]], runs: &[Vec<f64>]) -> AlikeRuns {
        let mut places = [0; MAX_ORDER + 1];
        let mut of_length: [Vec<Range<usize>>; MAX_ORDER + 1] = Default::default();
        for stretch in stretches.iter().filter(|stretch| !stretch.is_empty()) {
            (0..stretch.len().min(MAX_ORDER)).for_each(|past| places[past] += 1);
            places[MAX_ORDER] += stretch.len().saturating_sub(MAX_ORDER);
            of_length[(stretch.len() - 1).min(MAX_ORDER)].push(stretch.clone());
        }
        let q: Vec<SVector<f64, TERMS>> = trend.iter().map(|q| SVector::from(*q)).collect();
        let terms = Mat::from_fn(q.len(), TERMS, |i, term| q[i][term]);
        let lengths = of_length.iter().enumerate().filter(|(_, stretches)| !stretches.is_empty());
        let sums = lengths.map(|(most, stretches)| {
            let sums = LaggedStretches { stretches, order: most };
            let of_runs = parallel::map(runs.len(), &|run| {
                let d = &runs[run];
                let (square, along) = (|i: usize, j: usize| d[i] * d[j], |i: usize, j: usize| q[i] * d[j]);
                let squares = sums.of(square, |stretch, lag| {
                    let (later, before) = lagged(stretch, lag);
                    let product = dot(&d[later], &d[before]);
                    if lag == 0 { product } else { 2.0 * product }
                });
                let along = sums.of(along, |stretch, lag| {
                    let (later, before) = lagged(stretch, lag);
                    SVector::<f64, TERMS>::from_fn(|term, _| {
                        let terms = terms.col_as_slice(term);
                        let product = dot(&terms[later.clone()], &d[before.clone()]);
                        if lag == 0 { product } else { product + dot(&terms[before.clone()], &d[later.clone()]) }
                    })
                });
                (squares, along)
            });
            let mut squares = vec![0.0; of_runs.first().map_or(0, |(squares, _)| squares.len())];
            for (of_run, _) in &of_runs {
                squares.iter_mut().zip(of_run).for_each(|(sum, of_run)| *sum += of_run);
            }
            let product =
                |i: usize, j: usize| SVector::<f64, PAIRS>::from_iterator(pairs().map(|(s, t)| q[i][s] * q[j][t]));
            // A run with an outlier has terms of its own, so that these are most of the products.
            let trend = sums.of(product, |stretch, lag| {
                let (later, before) = lagged(stretch, lag);
                let products =
                    terms.subrows(later.start, later.len()).transpose() * terms.subrows(before.start, before.len());
                let both = |s: usize, t: usize| products[(s, t)] + if lag == 0 { 0.0 } else { products[(t, s)] };
                SVector::from_iterator(pairs().map(|(s, t)| both(s, t)))
            });
            LaggedSums { most, trend, squares, along: of_runs.into_iter().flat_map(|(_, along)| along).collect() }
        });
        AlikeRuns {
            places,
            freedom: trend.len() as f64 - trend.iter().flatten().map(|q| q * q).sum::<f64>(),
            runs: runs.len(),
            missing: std::array::from_fn(|term| trend.iter().all(|q| q[term] == 0.0)),
            sums: sums.collect(),
            independent: 1.0,
        }
    }

    fn fit(&self, predictions: &Predictions, weights: &[Vec<f64>]) -> FitOfRuns {
        let places = self.places.iter().enumerate().filter(|(_, count)| **count > 0);
        let mut ln_determinant: f64 = places.map(|(past, count)| *count as f64 * predictions.variance(past).ln()).sum();
        let mut products = SMatrix::<f64, TERMS, TERMS>::zeros();
        let mut along = vec![SVector::<f64, TERMS>::zeros(); self.runs];
        let mut squares = 0.0;
        for sums in &self.sums {
            let weights = &weights[sums.most];
            let trend: SVector<f64, PAIRS> = sums.trend.iter().zip(weights).map(|(sum, weight)| sum * *weight).sum();
            for ((s, t), product) in pairs().zip(trend.iter()) {
                products[(t, s)] += product;
            }
            squares += sums.squares.iter().zip(weights).map(|(sum, weight)| sum * weight).sum::<f64>();
            let of_runs = sums.along.chunks_exact(sums.trend.len());
            for (along, of_run) in along.iter_mut().zip(of_runs) {
                *along += of_run.iter().zip(weights).map(|(sum, weight)| sum * *weight).sum::<SVector<f64, TERMS>>();
            }
        }
        // A missing term has no part in the determinant.
        for i in (0..TERMS).filter(|i| self.missing[*i]) {
            products[(i, i)] = 1.0;
        }
        // Only the lower triangle is read.
        if let Some(factor) = products.cholesky() {
            ln_determinant += factor.ln_determinant();
            let factor = factor.l_dirty();
            let of_trend = along.iter().filter_map(|along| Some(factor.solve_lower_triangular(along)?.norm_squared()));
            squares -= of_trend.sum::<f64>();
        }
        FitOfRuns { ln_determinant, squares }
    }
}

/// Stretches whose lagged products are summed up to a lag.
struct LaggedStretches<'s> {
    stretches: &'s [Range<usize>],
    order: usize,
}

impl LaggedStretches<'_> {
    /// The sums of `product(i, j) + product(j, i)`, for `i = j` of `product(i, i)`, in the order of [`Predictions::weights`].
    /// `lagged` gives the sum over a whole stretch at a lag.
    fn of<T: Summand>(
        &self,
        product: impl Fn(usize, usize) -> T,
        lagged: impl Fn(&Range<usize>, usize) -> T,
    ) -> Vec<T> {
        let mut sums = Vec::new();
        for level in 0..=self.order {
            sums.push(sum(self.stretches.iter().map(|stretch| lagged(stretch, level))));
            for lag in 0..level {
                let ends = self.stretches.iter().map(|Range { start, end }| {
                    both(&product, start + level - 1, lag) + both(&product, end + lag - level, lag)
                });
                sums.push(sum(ends));
            }
        }
        sums
    }
}

/// The places of a stretch that have another one so many before them, and these others.
fn lagged(stretch: &Range<usize>, lag: usize) -> (Range<usize>, Range<usize>) {
    (stretch.start + lag..stretch.end, stretch.start..stretch.end - lag)
}

/// What lagged products are.
trait Summand: Copy + Default + Add<Output = Self> + AddAssign {}

impl<T: Copy + Default + Add<Output = T> + AddAssign> Summand for T {}

fn sum<T: Summand>(terms: impl Iterator<Item = T>) -> T {
    let mut sum = T::default();
    terms.for_each(|term| sum += term);
    sum
}

fn both<T: Summand>(product: &impl Fn(usize, usize) -> T, i: usize, lag: usize) -> T {
    if lag == 0 { product(i, i) } else { product(i, i - lag) + product(i - lag, i) }
}

/// The predictions of a value of a process of unit variance from values before it.
pub(super) struct Predictions {
    /// For each number of values before it, up to the order: their coefficients, the last value first.
    pub coefficients: Vec<Vec<f64>>,
    /// For each number of values before it: the variance that these leave.
    pub variances: Vec<f64>,
}

impl Predictions {
    /// From partial autocorrelations, by the recursion of Durbin and Levinson.
    pub fn of(partials: &[f64]) -> Predictions {
        let mut predictions = Predictions { coefficients: vec![Vec::new()], variances: vec![1.0] };
        for (order, partial) in partials.iter().enumerate() {
            let last = &predictions.coefficients[order];
            let mut next: Vec<f64> = (0..order).map(|k| last[k] - partial * last[order - 1 - k]).collect();
            next.push(*partial);
            predictions.variances.push(predictions.variances[order] * (1.0 - partial * partial));
            predictions.coefficients.push(next);
        }
        predictions
    }

    /// The coefficients of the process.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients[self.coefficients.len() - 1]
    }

    pub fn variance(&self, past: usize) -> f64 {
        self.variances[past.min(self.variances.len() - 1)]
    }

    /// The factors of the sums of lagged products in `uᵀR⁻¹v`, for values of which the last is predicted from so many.
    fn weights(&self, most: usize) -> Vec<f64> {
        let order = most.min(self.coefficients.len() - 1);
        let c: Vec<f64> = std::iter::once(1.0).chain(self.coefficients[order].iter().map(|a| -a)).collect();
        let lagged = |lag: usize, from: usize| -> f64 {
            (from..=order - lag).map(|k| c[k] * c[k + lag]).sum::<f64>() / self.variance(order)
        };
        let of_level = |level: usize| {
            let ends = (0..level).map(move |lag| (lag, level - lag));
            std::iter::once(lagged(level, 0)).chain(ends.map(|(lag, from)| -lagged(lag, from))).collect::<Vec<_>>()
        };
        (0..=order).flat_map(of_level).collect()
    }
}

/// The places of uninterrupted rows.
fn stretches(rows: &[usize]) -> Vec<Range<usize>> {
    let mut stretches = Vec::new();
    let mut start = 0;
    for uninterrupted in rows.chunk_by(|a, b| a + 1 == *b) {
        stretches.push(start..start + uninterrupted.len());
        start += uninterrupted.len();
    }
    stretches
}

#[cfg(test)]
pub(super) mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    use super::*;
    use crate::noise::trends::trend_terms;

    impl DetrendedRuns {
        /// Whole runs of deviations, each independent.
        pub fn independent(runs: Vec<Vec<f64>>) -> DetrendedRuns {
            let alike = runs.into_iter().map(|run| {
                let n = run.len();
                AlikeRuns::of(std::slice::from_ref(&(0..n)), &trend(n), &[run])
            });
            DetrendedRuns { alike: alike.collect() }
        }
    }

    fn trend(readings: usize) -> Vec<[f64; TERMS]> {
        trend_terms(&(0..readings).map(|t| t as f64).collect::<Vec<_>>())
    }

    /// Autocorrelations by their recursion: `ρ₁ = a₁/(1 − a₂)`, then `ρ_k = a₁ ρ_{k−1} + a₂ ρ_{k−2}`.
    pub fn correlations(a: [f64; 2], count: usize) -> Vec<f64> {
        let mut correlation = vec![1.0, a[0] / (1.0 - a[1])];
        for k in 2..count {
            correlation.push(a[0] * correlation[k - 1] + a[1] * correlation[k - 2]);
        }
        correlation
    }

    /// Autocorrelations of an autoregression of order three by the impulse response `ψ`: `ρ_k = Σ ψ_t ψ_{t+k}/Σ ψ_t²`.
    fn correlations_of_response(a: [f64; 3], count: usize) -> Vec<f64> {
        let mut response = vec![1.0];
        for t in 1..3000 {
            response.push((0..t.min(3)).map(|lag| a[lag] * response[t - 1 - lag]).sum::<f64>());
        }
        let product = |k: usize| response.iter().zip(&response[k..]).map(|(a, b)| a * b).sum::<f64>();
        (0..count).map(|k| product(k) / product(0)).collect()
    }

    /// The partial autocorrelations of an autoregression of order two are `ρ₁` and `a₂`.
    #[test]
    fn predictions_have_the_coefficients_of_the_process() {
        for a in [[0.8, 0.0], [1.1, -0.4], [-0.5, 0.3]] {
            let correlation = correlations(a, 3);
            let predictions = Predictions::of(&[correlation[1], a[1]]);
            assert!(predictions.coefficients().iter().zip(a).all(|(found, a)| (found - a).abs() < 1e-12));
            // The variance that a prediction leaves: 1 − Σ aₖ ρₖ.
            let left = 1.0 - a[0] * correlation[1] - a[1] * correlation[2];
            assert!(
                (predictions.variance(2) - left).abs() < 1e-12 && predictions.variance(7) == predictions.variances[2]
            );
        }
    }

    /// Compares with the likelihood of contrasts: for orthonormal `N` with `NᵀQ = 0`, those of a run are `Nᵀd` and their
    /// covariance is `σ² NᵀRN`, as explicit matrices.
    #[test]
    fn the_restricted_likelihood_is_that_of_contrasts() {
        // No coefficient, and one to three.
        for partials in [vec![], vec![-0.7], vec![0.8], vec![0.98], vec![0.78, -0.4], vec![0.9, 0.5, -0.6]] {
            contrasts(&partials);
        }
    }

    fn contrasts(partials: &[f64]) {
        let mut a = Predictions::of(partials).coefficients().to_vec();
        a.resize(3, 0.0);
        let correlation = correlations_of_response([a[0], a[1], a[2]], 60);
        let mut generator = Pcg64::seed_from_u64(1);
        let mut alike = Vec::new();
        let (mut minus_two_ln, mut freedom) = (0.0, 0.0);
        // The readings of a run that are missing, and the number of runs: whole ones, one with a gap, and one whose gaps
        // leave stretches of one to five readings.
        let of_runs: [(usize, &[usize], usize); 5] =
            [(30, &[], 2), (12, &[], 3), (9, &[], 2), (27, &[11], 1), (28, &[1, 4, 8, 13, 14, 20, 25], 2)];
        for (length, missing, runs) in of_runs {
            let rows: Vec<usize> = (0..length).filter(|row| !missing.contains(row)).collect();
            let n = rows.len();
            let q = trend(n);
            let runs: Vec<Vec<f64>> =
                (0..runs).map(|_| (0..n).map(|_| generator.sample(StandardNormal)).collect()).collect();
            let r = faer::Mat::from_fn(n, n, |t, s| {
                let (first, last) = (rows[t.min(s)], rows[t.max(s)]);
                let together = !missing.iter().any(|row| (first..last).contains(row));
                if together { correlation[last - first] } else { 0.0 }
            });
            // The eigenvectors of 1 − QQᵀ of eigenvalue 1 are contrasts.
            let terms = faer::Mat::from_fn(n, TERMS, |t, i| q[t][i]);
            let projector = faer::Mat::<f64>::identity(n, n) - &terms * terms.transpose();
            let eigen = projector.self_adjoint_eigen(faer::Side::Lower).unwrap();
            let first = (0..n).find(|i| eigen.S()[*i] > 0.5).unwrap();
            let contrasts = eigen.U().subcols(first, n - first);
            let covariance = contrasts.transpose() * r * contrasts;
            let ln_determinant: f64 =
                covariance.self_adjoint_eigenvalues(faer::Side::Lower).unwrap().iter().map(|value| value.ln()).sum();
            let inverse = {
                use faer::linalg::solvers::DenseSolveCore;
                covariance.partial_piv_lu().inverse()
            };
            for run in &runs {
                let d = contrasts.transpose() * faer::Mat::from_fn(n, 1, |t, _| run[t]);
                minus_two_ln += ln_determinant + (d.transpose() * &inverse * &d)[(0, 0)] / 0.49;
                freedom += (n - first) as f64;
            }
            alike.push(AlikeRuns::of(&stretches(&rows), &q, &runs));
        }
        minus_two_ln += freedom * 0.49_f64.ln();
        let fitted = DetrendedRuns { alike }.fit(partials, Some(0.7));
        assert!(
            (fitted.minus_two_ln / minus_two_ln - 1.0).abs() < 1e-9,
            "{partials:?}: {} {minus_two_ln}",
            fitted.minus_two_ln
        );
        assert_eq!(fitted.sigma_mm, 0.7);
    }

    #[test]
    fn gaps_divide_a_run() {
        assert_eq!(stretches(&[4, 5, 6, 9, 11, 12]), [0..3, 3..4, 4..6]);
        assert_eq!(stretches(&[]), [0..0; 0]);
    }
}
