//! Autocorrelation of the noise along runs, from the deviations of repeats.
//!
//! The likelihood of an autoregression is that of deviations without the trend of their run ([`super::restricted`]). Its
//! partial autocorrelations `κ` lie between −1 and 1. In short runs the likelihood is flat towards a random walk, so `κ₁` is
//! the mean of its posterior with a uniform prior. Its maximum would often lie at the bound.

use super::PureError;
use super::restricted::{DetrendedRuns, MAX_ORDER, Predictions};
use super::waves::AlongRuns;
use crate::numerics::golden_section::highest;
use crate::problem::Problem;

/// The largest partial autocorrelation.
const MAX_PARTIAL: f64 = 0.98;
/// Decrease of −2 ln L that the first coefficient needs, and by which repeats contradict a stated standard deviation: 1 %.
const SIGNIFICANT: f64 = 6.63;
/// Decrease of −2 ln L that each further coefficient needs: 0.3 %.
const SIGNIFICANT_FURTHER: f64 = 9.0;
/// Places of a first look at the likelihood, and steps of its search between three of them.
const PLACES: usize = 9;
const STEPS: usize = 16;
/// −2 ln L above its minimum at which the posterior ends, and places within it.
const NEGLIGIBLE: f64 = 20.0;
const PLACES_OF_POSTERIOR: usize = 40;
/// Number of equally probable processes that represent the posterior.
const POSSIBLE: usize = 20;

/// Autocorrelation of the noise along runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Autocorrelation {
    /// The estimate. White if no coefficient is significant.
    pub process: Process,
    /// Standard uncertainty of the sum of the coefficients; 0 if none is significant.
    pub sum_u: f64,
    /// Whether the standard deviation is the stated one, which the repeats do not contradict.
    pub is_as_stated: bool,
}

/// An autoregressive process.
#[derive(Clone, Debug, PartialEq)]
pub struct Process {
    /// Coefficients; empty for white noise.
    pub coefficients: Vec<f64>,
    /// Standard deviation of a value, mm.
    pub sigma_mm: f64,
    /// Standard deviation of the part that earlier values do not predict, mm.
    pub innovation_mm: f64,
}

/// The pure error of readings along runs, and the autocorrelation that it shows. `None` for independent poses and without
/// enough repeats. `residuals` are those of any model, mm, test by test.
pub fn along_runs(problem: &Problem, residuals: &[Vec<f64>]) -> Option<(PureError, Autocorrelation)> {
    let kept = |test: usize, row: usize| !problem.rejected[test][row];
    autocorrelated(problem, PureError::of(&problem.tests, residuals, kept))
}

/// The same of the pure error of a problem.
pub(crate) fn autocorrelated(problem: &Problem, pure: PureError) -> Option<(PureError, Autocorrelation)> {
    if problem.folds.kind.is_poses() {
        return None;
    }
    let along = pure.without_waves(&problem.tests, |test, row| !problem.rejected[test][row]);
    let shown = along.autocorrelation(problem.session.stated_noise_mm())?;
    Some((along.pure, shown))
}

impl AlongRuns {
    /// Autocorrelation along runs. The order is the least one, up to three, whose successor is insignificant. `None`
    /// without enough repeats. With a stated standard deviation, mm, that the repeats do not contradict, the coefficients
    /// are those of noise of this standard deviation.
    pub fn autocorrelation(&self, stated_mm: Option<f64>) -> Option<Autocorrelation> {
        let runs = self.runs.as_ref()?;
        Some(runs.autocorrelation(&runs.estimate(MAX_ORDER, stated_mm)))
    }

    /// Equally probable processes, of first order if no coefficient is significant. `None` and `stated_mm` as for
    /// [`AlongRuns::autocorrelation`].
    pub fn possible_processes(&self, stated_mm: Option<f64>) -> Option<Vec<Process>> {
        let runs = self.runs.as_ref()?;
        Some(runs.possible_processes(&runs.estimate(MAX_ORDER, stated_mm)))
    }
}

impl DetrendedRuns {
    /// The coefficients of at most first order.
    pub fn coefficients_of_first_order(&self) -> Vec<f64> {
        self.autocorrelation(&self.estimate(1, None)).process.coefficients
    }

    /// The partial autocorrelations with the greatest likelihood, up to the last significant order.
    fn estimate(&self, most: usize, stated_mm: Option<f64>) -> Estimate {
        let free = self.best(&[0.0], 0, None);
        let white = self.fit(&[], None).minus_two_ln;
        let as_stated = stated_mm.map(|sigma_mm| (sigma_mm, self.best(&[0.0], 0, Some(sigma_mm))));
        // White noise of another standard deviation has as many parameters.
        let (stated_mm, first, mut least) = match as_stated {
            Some((sigma_mm, first)) if first.0 - free.0 < SIGNIFICANT && first.0 < white => {
                (Some(sigma_mm), first, self.fit(&[], Some(sigma_mm)).minus_two_ln)
            }
            _ => (None, free, white),
        };
        let mut partials: Vec<f64> = Vec::new();
        for needed in [SIGNIFICANT, SIGNIFICANT_FURTHER, SIGNIFICANT_FURTHER].into_iter().take(most) {
            let mut further = [&partials[..], &[0.0]].concat();
            let mut value = least;
            if partials.is_empty() {
                (value, further[0]) = first;
            } else {
                // The partial autocorrelations hardly depend on each other.
                for k in (0..further.len()).rev() {
                    (value, further[k]) = self.best(&further, k, stated_mm);
                }
            }
            if least - value < needed {
                break;
            }
            (partials, least) = (further, value);
        }
        Estimate { partials, first: first.1, stated_mm }
    }

    fn autocorrelation(&self, estimate: &Estimate) -> Autocorrelation {
        let mut partials = estimate.partials.clone();
        let mut sum_u = 0.0;
        if let Some(first) = partials.first_mut() {
            let posterior = self.posterior(&estimate.partials, estimate.stated_mm);
            *first = posterior.mean();
            sum_u = posterior.u_of_sum();
        }
        let process = self.process(&partials, estimate.stated_mm);
        Autocorrelation { process, sum_u, is_as_stated: estimate.stated_mm.is_some() }
    }

    /// Equally probable processes.
    fn possible_processes(&self, estimate: &Estimate) -> Vec<Process> {
        let mode = if estimate.partials.is_empty() { &[estimate.first][..] } else { &estimate.partials };
        let posterior = self.posterior(mode, estimate.stated_mm);
        let mut possible = Vec::with_capacity(POSSIBLE);
        let mut cumulative = 0.0;
        for (partials, weight) in posterior.partials.iter().zip(&posterior.weights) {
            cumulative += weight;
            while (possible.len() as f64 + 0.5) < cumulative * POSSIBLE as f64 {
                possible.push(self.process(partials, estimate.stated_mm));
            }
        }
        possible
    }

    /// The partial autocorrelation of order `k + 1` with the greatest likelihood beside the others, and −2 ln L.
    fn best(&self, partials: &[f64], k: usize, stated_mm: Option<f64>) -> (f64, f64) {
        let at = |partial: f64| {
            let mut partials = partials.to_vec();
            partials[k] = partial;
            self.fit(&partials, stated_mm).minus_two_ln
        };
        let spacing = 2.0 * MAX_PARTIAL / (PLACES - 1) as f64;
        let place = |i: usize| -MAX_PARTIAL + i as f64 * spacing;
        let values: Vec<f64> = (0..PLACES).map(|i| at(place(i))).collect();
        let lowest = (0..PLACES).min_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0);
        let (low, high) = (place(lowest.saturating_sub(1)), place((lowest + 1).min(PLACES - 1)));
        let (negative, partial) = highest(
            |share| {
                let partial = low + share * (high - low);
                (-at(partial), partial)
            },
            STEPS,
        );
        (-negative, partial)
    }

    /// The posterior of the first partial autocorrelation about the mode, beside the others.
    fn posterior(&self, mode: &[f64], stated_mm: Option<f64>) -> Posterior {
        let with_first = |first: f64| [&[first], &mode[1..]].concat();
        let value = |first: f64| self.fit(&with_first(first), stated_mm).minus_two_ln;
        let least = value(mode[0]);
        // The end of what is not negligible on one side, by bisection.
        let end = |bound: f64| {
            let (mut inside, mut outside) = (mode[0], bound);
            for _ in 0..STEPS {
                if value(outside) - least < NEGLIGIBLE {
                    break;
                }
                let middle = 0.5 * (inside + outside);
                if value(middle) - least < NEGLIGIBLE { inside = middle } else { outside = middle }
            }
            outside
        };
        let (low, high) = (end(-MAX_PARTIAL), end(MAX_PARTIAL));
        let step = (high - low) / PLACES_OF_POSTERIOR as f64;
        let places: Vec<f64> = (0..PLACES_OF_POSTERIOR).map(|i| low + (i as f64 + 0.5) * step).collect();
        let mut weights: Vec<f64> = places.iter().map(|first| (-0.5 * (value(*first) - least)).exp()).collect();
        let total: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= total);
        Posterior { partials: places.into_iter().map(with_first).collect(), weights }
    }

    /// The process with these partial autocorrelations.
    fn process(&self, partials: &[f64], stated_mm: Option<f64>) -> Process {
        let predictions = Predictions::of(partials);
        let sigma_mm = self.fit(partials, stated_mm).sigma_mm;
        let innovation_mm = sigma_mm * predictions.variances[partials.len()].sqrt();
        Process { coefficients: predictions.coefficients().to_vec(), sigma_mm, innovation_mm }
    }
}

/// What the likelihood shows.
struct Estimate {
    /// The partial autocorrelations up to the last significant order.
    partials: Vec<f64>,
    /// The first partial autocorrelation without others.
    first: f64,
    /// The stated standard deviation, mm, if the repeats do not contradict it.
    stated_mm: Option<f64>,
}

/// The posterior of the first partial autocorrelation, at places of equal distance.
struct Posterior {
    /// The partial autocorrelations at each place.
    partials: Vec<Vec<f64>>,
    /// The probability of each place.
    weights: Vec<f64>,
}

impl Posterior {
    fn mean_of(&self, of: impl Fn(&[f64]) -> f64) -> f64 {
        self.partials.iter().zip(&self.weights).map(|(partials, weight)| weight * of(partials)).sum()
    }

    /// The mean of the first partial autocorrelation.
    fn mean(&self) -> f64 {
        self.mean_of(|partials| partials[0])
    }

    /// Standard deviation of the sum of the coefficients.
    fn u_of_sum(&self) -> f64 {
        let sum = |partials: &[f64]| Predictions::of(partials).coefficients().iter().sum::<f64>();
        let mean = self.mean_of(sum);
        self.mean_of(|partials| (sum(partials) - mean).powi(2)).sqrt()
    }
}

/// Factor on the variance of a mean if neighbouring values are correlated: `(1 + r)/(1 − r)`. `r` is the sum of the
/// products of neighbours over the sum of their squares, from 0 to `most`.
pub(crate) fn enlargement_of_mean(products: f64, squares: f64, most: f64) -> f64 {
    let correlation = if squares > 0.0 { (products / squares).clamp(0.0, most) } else { 0.0 };
    (1.0 + correlation) / (1.0 - correlation)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    use super::*;
    use crate::noise::restricted::tests::correlations;

    impl DetrendedRuns {
        fn recovered(&self, stated_mm: Option<f64>) -> Autocorrelation {
            self.autocorrelation(&self.estimate(MAX_ORDER, stated_mm))
        }
    }

    /// Runs of noise without their trend. Each is independent.
    fn noise(a: [f64; 2], sigma: f64, lengths: &[usize], generator: &mut Pcg64) -> DetrendedRuns {
        let predictions = Predictions::of(&[correlations(a, 2)[1], a[1]]);
        let run = |n: usize, generator: &mut Pcg64| -> Vec<f64> {
            let mut values: Vec<f64> = Vec::new();
            for t in 0..n {
                let coefficients = &predictions.coefficients[t.min(2)];
                let predicted: f64 = coefficients.iter().enumerate().map(|(lag, a)| a * values[t - lag - 1]).sum();
                let new: f64 = generator.sample(StandardNormal);
                values.push(predicted + predictions.variance(t).sqrt() * new);
            }
            values.iter().map(|value| sigma * value).collect()
        };
        DetrendedRuns::independent(lengths.iter().map(|n| run(*n, generator)).collect())
    }

    /// The coefficients, their uncertainty and the standard deviation, over many draws.
    #[test]
    fn coefficients_and_variance_are_recovered_from_detrended_runs() {
        const DRAWS: usize = 60;
        let mut generator = Pcg64::seed_from_u64(2);
        for a in [[0.8, 0.0], [0.5, 0.0], [1.1, -0.4]] {
            let drawn: Vec<Autocorrelation> =
                (0..DRAWS).map(|_| noise(a, 1.5, &[100; 8], &mut generator).recovered(None)).collect();
            let order = if a[1] == 0.0 { 1 } else { 2 };
            let right = drawn.iter().filter(|drawn| drawn.process.coefficients.len() == order).count();
            assert!(right >= DRAWS - 3, "{a:?}: {right}");
            let mean = |of: &dyn Fn(&Autocorrelation) -> f64| drawn.iter().map(of).sum::<f64>() / DRAWS as f64;
            let pull =
                |drawn: &Autocorrelation| (drawn.process.coefficients.iter().sum::<f64>() - a[0] - a[1]) / drawn.sum_u;
            let scatter = (mean(&|drawn| pull(drawn).powi(2)) - mean(&pull).powi(2)).sqrt();
            // Four standard errors of the mean, and of the scatter.
            assert!(mean(&pull).abs() < 4.0 / (DRAWS as f64).sqrt(), "{a:?}: {}", mean(&pull));
            assert!((scatter - 1.0).abs() < 4.0 / (2.0 * DRAWS as f64).sqrt(), "{a:?}: {scatter}");
            let sigma = mean(&|drawn| drawn.process.sigma_mm);
            assert!((sigma / 1.5 - 1.0).abs() < 0.05, "{a:?}: {sigma}");
        }
    }

    /// Possible processes have the mean and the scatter of the posterior.
    #[test]
    fn possible_processes_are_those_of_the_posterior() {
        let mut generator = Pcg64::seed_from_u64(4);
        let runs = noise([0.8, 0.0], 1.5, &[100; 8], &mut generator);
        let estimate = runs.estimate(MAX_ORDER, None);
        let shown = runs.autocorrelation(&estimate);
        let firsts: Vec<f64> =
            runs.possible_processes(&estimate).iter().map(|process| process.coefficients[0]).collect();
        assert_eq!(firsts.len(), POSSIBLE);
        let mean = firsts.iter().sum::<f64>() / POSSIBLE as f64;
        let scatter = (firsts.iter().map(|first| (first - mean).powi(2)).sum::<f64>() / POSSIBLE as f64).sqrt();
        assert!((mean - shown.process.coefficients[0]).abs() < 0.2 * shown.sum_u, "{mean} {shown:?}");
        assert!((scatter / shown.sum_u - 1.0).abs() < 0.15, "{scatter} {shown:?}");
    }

    /// Of white noise 1 % has a significant coefficient, in short runs too. In short runs of autocorrelated noise a stated
    /// standard deviation shows the coefficient, as long as the repeats do not contradict it.
    #[test]
    fn short_runs_show_the_autocorrelation_of_a_stated_standard_deviation() {
        const DRAWS: usize = 200;
        let mut generator = Pcg64::seed_from_u64(3);
        let mut drawn = |first: f64, stated: Option<f64>| -> Vec<Autocorrelation> {
            let runs = |generator: &mut Pcg64| noise([first, 0.0], 0.3, &[6, 10, 12, 15, 17], generator);
            (0..DRAWS).map(|_| runs(&mut generator).recovered(stated)).collect()
        };
        let significant = |of: &[Autocorrelation]| of.iter().filter(|of| !of.process.coefficients.is_empty()).count();
        let white = drawn(0.0, None);
        assert!(significant(&white) <= 8, "{}", significant(&white));
        let stated = drawn(0.8, Some(0.3));
        let kept = stated.iter().filter(|of| of.is_as_stated).count();
        assert!(kept >= 180, "{kept}");
        let firsts: Vec<f64> =
            stated.iter().filter(|of| of.is_as_stated).map(|of| of.process.coefficients[0]).collect();
        let mean = firsts.iter().sum::<f64>() / firsts.len() as f64;
        let scatter = (firsts.iter().map(|first| (first - mean).powi(2)).sum::<f64>() / firsts.len() as f64).sqrt();
        assert!((mean - 0.8).abs() < 0.03 && scatter < 0.1, "{mean} {scatter}");
        assert!(stated.iter().filter(|of| of.is_as_stated).all(|of| of.process.sigma_mm == 0.3));
        // White noise of a third of the stated standard deviation contradicts it.
        let contradicted = drawn(0.0, Some(0.9)).iter().filter(|of| !of.is_as_stated).count();
        assert!(contradicted >= 196, "{contradicted}");
    }
}
