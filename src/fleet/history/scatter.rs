//! How much more the sessions of a fleet scatter than their uncertainties say.
//!
//! A series has few sessions, so that its own scatter is badly known: that of the other series stands beside it as a
//! prior (Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3, 3: moderated t statistics). The prior of a series is the
//! logarithm of the variance of the other series of its machine and of the other machines, each weighted by how well
//! it is known and by how much machines, and series of one machine, differ. Medians keep series out that scatter, or
//! change, unlike the others. The prior is at least 1: a stated uncertainty is not taken to be too large.
//!
//! The first estimate is that of the differences of neighbouring sessions, which a step enters once; the second is that
//! about the models which the first one yields, within the segments between steps.

use super::series::{LEAST_VARIANCE, Prior, Series};
use super::sessions::Machine;
use abbe_identify::numerics::median;

/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL: f64 = 1.4826;
/// Degrees of freedom that one difference of neighbouring sessions adds to the median of all: half the inverse square
/// of its relative standard deviation, which counts that neighbouring differences share a session.
const FREEDOM_OF_DIFFERENCE: f64 = 0.26;
/// Efficiency of the median of variances over their mean.
const MEDIAN_EFFICIENCY: f64 = 0.64;
/// Fewest machines, and fewest series, from which their spread is estimated.
const FEWEST_FOR_SPREAD: usize = 4;
/// Machines above which the median of the fleet does not depend on any one of them.
const MANY_MACHINES: usize = 20;
/// Most degrees of freedom of a prior. The t distribution is normal long before.
const MOST_FREEDOM: f64 = 1e4;

/// An estimate of a variance.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// Its median is the variance.
    variance: f64,
    freedom: f64,
}

/// A variance of many series.
#[derive(Clone, Copy, Default)]
struct Pooled {
    ln_variance: f64,
    freedom: f64,
}

impl Pooled {
    /// The median, weighted by the degrees of freedom.
    fn of(mut samples: Vec<Sample>) -> Pooled {
        samples.sort_by(|a, b| a.variance.total_cmp(&b.variance));
        let freedom: f64 = samples.iter().map(|sample| sample.freedom).sum();
        let mut below = 0.0;
        let middle = samples.iter().find(|sample| {
            below += sample.freedom;
            below >= 0.5 * freedom
        });
        middle.map_or_else(Pooled::default, |middle| Pooled { ln_variance: middle.variance.ln(), freedom })
    }

    /// Inverse variance of the logarithm as an estimate of one that differs by a spread of its own.
    fn weight(&self, spread: f64) -> f64 {
        if self.freedom > 0.0 { 1.0 / (2.0 / self.freedom + spread) } else { 0.0 }
    }
}

/// Variances of the logarithm of the variance: between the series of a machine, and between machines.
#[derive(Clone, Copy, Default)]
struct Spread {
    within: f64,
    between: f64,
}

/// The priors of all series by the differences of neighbouring sessions.
pub(super) fn priors_of_differences(machines: &[Machine], all: &[Vec<Series>]) -> Vec<Vec<Prior>> {
    let of_series = |one: &Series| -> Vec<Sample> {
        // The median that is subtracted takes a part of a short series.
        let count = one.values.len() as f64;
        let factor = NORMAL * (count - 1.0) / (count - 2.0);
        let sample = |pull: f64| Sample {
            variance: (factor * pull).powi(2).max(LEAST_VARIANCE),
            freedom: FREEDOM_OF_DIFFERENCE,
        };
        one.pulls().into_iter().map(sample).collect()
    };
    let samples: Vec<Vec<Vec<Sample>>> = all.iter().map(|series| series.iter().map(of_series).collect()).collect();
    priors(&shares(machines, all), &samples, Spread::default())
}

/// The priors of all series by the residuals of their models.
pub(super) fn priors_of_models(machines: &[Machine], all: &[Vec<Series>]) -> Vec<Vec<Prior>> {
    let of_series = |one: &Series| -> Option<(Sample, f64)> {
        let (sum, freedom) = one.residual()?;
        // The median of χ² (Wilson and Hilferty 1931).
        let middle = freedom * (1.0 - 2.0 / (9.0 * freedom)).powi(3);
        let variance = (sum / middle).max(LEAST_VARIANCE);
        Some((Sample { variance, freedom: MEDIAN_EFFICIENCY * freedom }, freedom))
    };
    let found: Vec<Vec<Option<(Sample, f64)>>> =
        all.iter().map(|series| series.iter().map(of_series).collect()).collect();
    let shares = shares(machines, all);
    let spread = Spread::of(&found, &shares);
    let samples: Vec<Vec<Vec<Sample>>> = found
        .iter()
        .map(|series| series.iter().map(|one| one.iter().map(|(sample, _)| *sample).collect()).collect())
        .collect();
    priors(&shares, &samples, spread)
}

/// The priors by the samples of each series of each machine.
fn priors(shares: &[f64], samples: &[Vec<Vec<Sample>>], spread: Spread) -> Vec<Vec<Prior>> {
    let of_machine = |k: usize| {
        let share = shares[k];
        let scaled = move |sample: &Sample| Sample { freedom: share * sample.freedom, ..*sample };
        samples[k].iter().flatten().map(scaled).collect::<Vec<Sample>>()
    };
    let but = |machine: Option<usize>| {
        Pooled::of((0..samples.len()).filter(|k| Some(*k) != machine).flat_map(of_machine).collect())
    };
    let whole = (samples.len() > MANY_MACHINES).then(|| but(None));
    (0..samples.len())
        .map(|machine| {
            let fleet = whole.unwrap_or_else(|| but(Some(machine)));
            let own: Vec<&Vec<Sample>> = samples[machine].iter().collect();
            (0..own.len())
                .map(|series| {
                    let others = own.iter().enumerate().filter(|(other, _)| *other != series);
                    let share = shares[machine];
                    let scaled = |sample: &Sample| Sample { freedom: share * sample.freedom, ..*sample };
                    let beside = Pooled::of(others.flat_map(|(_, samples)| samples.iter().map(scaled)).collect());
                    prior(beside, fleet, spread)
                })
                .collect()
        })
        .collect()
}

/// The prior of a series by the other series of its machine and by the other machines.
fn prior(beside: Pooled, fleet: Pooled, spread: Spread) -> Prior {
    let weights = [beside.weight(0.0), fleet.weight(spread.between)];
    let weight: f64 = weights.iter().sum();
    if weight <= 0.0 {
        return Prior { variance: 1.0, freedom: 0.0 };
    }
    let ln_variance = (weights[0] * beside.ln_variance + weights[1] * fleet.ln_variance) / weight;
    let freedom = 2.0 / (1.0 / weight + spread.within);
    Prior { variance: ln_variance.exp().max(1.0), freedom: freedom.min(MOST_FREEDOM) }
}

impl Spread {
    /// That of the variances of series in excess of what their degrees of freedom make.
    fn of(found: &[Vec<Option<(Sample, f64)>>], shares: &[f64]) -> Spread {
        let (mut about, mut centres, mut expected) = (Vec::new(), Vec::new(), Vec::new());
        let mut count = 0.0;
        for series in found {
            let mut logarithms: Vec<f64> = series.iter().flatten().map(|(sample, _)| sample.variance.ln()).collect();
            if logarithms.is_empty() {
                continue;
            }
            expected.extend(series.iter().flatten().map(|(_, freedom)| variance_of_logarithm(*freedom)));
            count += 1.0;
            let centre = median(&mut logarithms);
            centres.push(centre);
            if logarithms.len() > 1 {
                about.extend(logarithms.iter().map(|one| (one - centre).abs()));
            }
        }
        if expected.len() < FEWEST_FOR_SPREAD {
            return Spread::default();
        }
        let mean = expected.len() as f64 / count;
        let expected = median(&mut expected);
        let mut spread = Spread::default();
        if !about.is_empty() {
            let variance = (NORMAL * median(&mut about)).powi(2) * mean / (mean - 1.0).max(1.0);
            spread.within = (variance - expected).max(0.0);
        }
        if centres.len() >= FEWEST_FOR_SPREAD {
            let centre = median(&mut centres.clone());
            let mut distances: Vec<f64> = centres.iter().map(|one| (one - centre).abs()).collect();
            let variance = (NORMAL * median(&mut distances)).powi(2) * count / (count - 1.0);
            let share = shares.iter().sum::<f64>() / shares.len() as f64;
            let of_median = if mean > 1.0 { 1.0 / (MEDIAN_EFFICIENCY * share * mean) } else { 1.0 };
            spread.between = (variance - (expected + spread.within) * of_median).max(0.0);
        }
        spread
    }
}

/// Variance of the logarithm of χ² with so many degrees of freedom: the trigamma function of their half, by its
/// asymptotic series.
fn variance_of_logarithm(freedom: f64) -> f64 {
    let x = 0.5 * freedom;
    1.0 / x + 1.0 / (2.0 * x * x) + 1.0 / (6.0 * x.powi(3)) - 1.0 / (30.0 * x.powi(5))
}

/// For each machine, the share of its series that counts as independent: `n / Σ ρᵢⱼ²`, since the squares of normal
/// variables with the correlation ρ are correlated by ρ².
fn shares(machines: &[Machine], all: &[Vec<Series>]) -> Vec<f64> {
    let share = |(machine, series): (&Machine, &Vec<Series>)| {
        let last = machine.sessions.len().saturating_sub(1);
        let entry = |i: usize, j: usize| machine.covariance(last, i, j);
        let squared = |i: usize, j: usize| match entry(i, j).powi(2) / (entry(i, i) * entry(j, j)) {
            squared if squared.is_finite() => squared.min(1.0),
            _ => 0.0,
        };
        let place: Vec<usize> = series.iter().map(|one| one.parameter).collect();
        let pairs = place.iter().flat_map(|i| place.iter().filter(move |j| *j != i).map(move |j| (*i, *j)));
        let sum: f64 = pairs.map(|(i, j)| squared(i, j)).sum();
        let count = series.len() as f64;
        if series.is_empty() { 1.0 } else { count / (count + sum) }
    };
    machines.iter().zip(all).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz and Stegun 6.4.2 and 6.4.4: ψ′(1) = π²/6, ψ′(3/2) = π²/2 − 4.
    #[test]
    fn the_variance_of_the_logarithm_of_chi_square_is_trigamma() {
        let square = std::f64::consts::PI.powi(2);
        assert!((variance_of_logarithm(2.0) / (square / 6.0) - 1.0).abs() < 0.01);
        assert!((variance_of_logarithm(3.0) / (square / 2.0 - 4.0) - 1.0).abs() < 0.002);
    }

    /// Neither a few series that scatter ten times as much nor a stated uncertainty that is too large move the prior.
    #[test]
    fn the_prior_is_that_of_most_series() {
        let samples = |variance: f64| vec![Sample { variance, freedom: 4.0 }];
        let fleet: Vec<Vec<Vec<Sample>>> =
            (0..10).map(|k| vec![samples(2.0 + 0.01 * f64::from(k)), samples(2.0), samples(200.0)]).collect();
        let found = priors(&[1.0; 10], &fleet, Spread::default());
        assert!(found.iter().flatten().all(|prior| (1.9..2.2).contains(&prior.variance)), "{found:?}");
        assert!(found.iter().flatten().all(|prior| (prior.freedom - 4.0 * 29.0).abs() < 1e-9), "{found:?}");
        let small = priors(&[1.0], &[vec![samples(0.01), samples(0.01)]], Spread::default());
        assert!((small[0][0].variance - 1.0).abs() < 1e-12);
        let alone = priors(&[1.0], &[vec![samples(5.0)]], Spread::default());
        assert_eq!(alone[0][0].freedom, 0.0);
    }
}
