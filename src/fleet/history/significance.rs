//! The test of "no change" of a series: the best drift, step or pair of steps against a level alone.
//!
//! All compete by one criterion, the p value of their F statistic, whose variance is estimated under each alternative:
//! the residual about the line for a drift, within the segments for steps, each beside the prior of the other series.
//! The p value counts all positions (Bonferroni). A pair of steps, such as a collision and its repair, has a share of
//! a tenth of the false claims.

use super::series::Prior;
use super::series::Series;
use abbe_identify::numerics::tails::student_tail;

/// Fewest sessions with which a pair of steps is an alternative.
const FEWEST_FOR_PAIRS: usize = 6;
/// Share of a pair of steps in the probability of a false claim. A drift and one step have half of the rest each.
const SHARE_OF_PAIRS: f64 = 0.1;

/// The most significant alternative.
#[derive(Clone, Debug)]
pub(super) struct Change {
    /// Probability of a change as significant as this one if there is none.
    pub p_value: f64,
    /// The sessions in front of which it has steps; none for a drift.
    pub steps: Vec<usize>,
}

/// Weighted sums of a series, of its first sessions.
struct Sums {
    weights: Vec<f64>,
    values: Vec<f64>,
    total: f64,
}

impl Sums {
    fn of(series: &Series) -> Sums {
        let weight = |u: &f64| u.powi(-2);
        let whole: f64 = series.u.iter().map(weight).sum();
        let mean = series.values.iter().zip(&series.u).map(|(value, u)| value * weight(u)).sum::<f64>() / whole;
        let mut sums = Sums { weights: vec![0.0], values: vec![0.0], total: 0.0 };
        let mut before = [0.0; 2];
        for (value, u) in series.values.iter().zip(&series.u) {
            before = [before[0] + weight(u), before[1] + weight(u) * (value - mean)];
            sums.weights.push(before[0]);
            sums.values.push(before[1]);
            sums.total += weight(u) * (value - mean).powi(2);
        }
        sums
    }

    /// The decrease of the sum of squares by the mean of a segment.
    fn gain(&self, from: usize, to: usize) -> f64 {
        (self.values[to] - self.values[from]).powi(2) / (self.weights[to] - self.weights[from])
    }

    fn sessions(&self) -> usize {
        self.values.len() - 1
    }

    /// The largest decrease by one step, and the session in front of which it is.
    fn best_step(&self) -> (f64, usize) {
        let count = self.sessions();
        let mut best = (0.0, 1);
        for at in 1..count {
            let gain = self.gain(0, at) + self.gain(at, count);
            if gain > best.0 {
                best = (gain, at);
            }
        }
        best
    }

    /// The largest decrease by two steps, and their sessions.
    fn best_pair(&self) -> (f64, Vec<usize>) {
        let count = self.sessions();
        let mut best = (0.0, Vec::new());
        for first in 1..count - 1 {
            for second in first + 1..count {
                let gain = self.gain(0, first) + self.gain(first, second) + self.gain(second, count);
                if gain > best.0 {
                    best = (gain, vec![first, second]);
                }
            }
        }
        best
    }
}

/// The decrease of the sum of squares by a drift; 0 with one date only.
fn gain_of_drift(series: &Series) -> f64 {
    let weights = || series.u.iter().map(|u| u.powi(-2));
    let whole: f64 = weights().sum();
    let mean = series.years.iter().zip(weights()).map(|(years, weight)| years * weight).sum::<f64>() / whole;
    let rows = || series.years.iter().zip(&series.values).zip(weights());
    let square: f64 = rows().map(|((years, _), weight)| weight * (years - mean).powi(2)).sum();
    let middle = series.values[0];
    let product: f64 = rows().map(|((years, value), weight)| weight * (years - mean) * (value - middle)).sum();
    if square > 0.0 { product * product / square } else { 0.0 }
}

/// The most significant change of a series.
pub(super) fn most_significant(series: &Series, prior: &Prior) -> Change {
    let count = series.values.len();
    let positions = (count - 1) as f64;
    let pairs = count >= FEWEST_FOR_PAIRS;
    let share = if pairs { 0.5 * (1.0 - SHARE_OF_PAIRS) } else { 0.5 };
    let sums = Sums::of(series);
    let total = prior.freedom + count as f64;
    let residual = |gain: f64| (sums.total - gain).max(0.0) + prior.sum_of_squares();
    let single = |gain: f64| {
        let freedom = total - 2.0;
        2.0 * student_tail((gain.max(0.0) / residual(gain) * freedom).sqrt(), freedom)
    };
    let mut best = Change { p_value: single(gain_of_drift(series)) / share, steps: Vec::new() };
    let mut compete = |p_value: f64, steps: Vec<usize>| {
        if p_value < best.p_value {
            best = Change { p_value, steps };
        }
    };
    let (gain, at) = sums.best_step();
    compete(positions * single(gain) / share, vec![at]);
    if pairs {
        let (gain, steps) = sums.best_pair();
        // P(F₂,ν > f) = (1 + 2f/ν)^(−ν/2).
        let tail = (-0.5 * (total - 3.0) * (gain / residual(gain)).ln_1p()).exp();
        compete(0.5 * positions * (positions - 1.0) * tail / SHARE_OF_PAIRS, steps);
    }
    best.p_value = best.p_value.min(1.0);
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: Prior = Prior { variance: 1.0, freedom: 0.0 };

    fn series(values: &[f64]) -> Series {
        let known: Vec<_> = values.iter().enumerate().map(|(k, value)| (k, k as f64, *value, 0.5)).collect();
        Series::new(0, &known)
    }

    /// The data of Student (1908), the additional hours of sleep by two drugs, as ten sessions before and ten after a
    /// step: t = 1.8608 with 18 degrees of freedom, p = 0.07919 (R: `t.test(extra ~ group, sleep, var.equal = TRUE)`).
    /// With a prior of many degrees of freedom the variance is that of the prior.
    #[test]
    fn one_step_is_the_t_test_of_two_samples() {
        let sleep =
            [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0, 1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4];
        let sums = Sums::of(&series(&sleep));
        let gain = sums.gain(0, 10) + sums.gain(10, 20);
        let t = (gain / (sums.total - gain) * 18.0).sqrt();
        assert!((t - 1.8608).abs() < 1e-4 && (2.0 * student_tail(t, 18.0) - 0.07919).abs() < 1e-5, "{t}");
        // Two groups that are far apart: the position is found, and counted.
        let apart: Vec<f64> =
            sleep.iter().enumerate().map(|(k, hours)| hours + if k < 10 { 0.0 } else { 20.0 }).collect();
        let found = most_significant(&series(&apart), &NONE);
        let t = (20.0 + 1.58) / 0.8491;
        assert_eq!(found.steps, [10]);
        assert!((found.p_value / (19.0 * 2.0 * student_tail(t, 18.0) / 0.45) - 1.0).abs() < 0.02, "{found:?}");
        let stated = Prior { variance: 4.0 * 1.9_f64.powi(2), freedom: 1e4 };
        let t = 21.58 / (1.9 * 0.2_f64.sqrt());
        let found = most_significant(&series(&apart), &stated);
        assert!((found.p_value.ln() / (38.0 * student_tail(t, f64::INFINITY) / 0.45).ln() - 1.0).abs() < 0.05);
    }

    /// A collision and its repair, and a line, are what they are.
    #[test]
    fn each_alternative_is_the_most_significant_one_of_its_data() {
        let noise = [0.1, -0.3, 0.2, 0.0, -0.1, 0.3, -0.2, 0.1, 0.2, -0.3, 0.0, 0.1];
        let with = |change: &dyn Fn(usize) -> f64| {
            series(&noise.iter().enumerate().map(|(k, noise)| noise + change(k)).collect::<Vec<f64>>())
        };
        let repaired = with(&|k| if (4..8).contains(&k) { 5.0 } else { 0.0 });
        assert_eq!(most_significant(&repaired, &NONE).steps, [4, 8]);
        let line = with(&|k| 0.6 * k as f64);
        let found = most_significant(&line, &NONE);
        assert!(found.steps.is_empty() && found.p_value < 1e-6, "{found:?}");
        assert!(most_significant(&with(&|_| 7.0), &NONE).p_value > 0.3);
    }
}
