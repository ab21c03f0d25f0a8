//! The parameters of machines over time: trends, change points, control charts, the next check.
//!
//! - `sessions`: the parameters of one machine in each session; `series`: one parameter of one machine over time,
//!   and its search for drift and steps; `change_test`: whether it has any; `scatter`, `prior`: how
//!   much sessions scatter;
//! - `machine`: all parameters of one machine together, by generalised least squares with the covariances of the
//!   sessions;
//! - [`events`]: steps of several parameters at one time, and what they are;
//! - [`chart`]: control charts; [`faults`]: effects of many sessions, by alias set; [`results`]: what is reported.
//!
//! Every series is tested for any change. Benjamini and Hochberg (1995, J. R. Stat. Soc. B 57, 289) control the false
//! discovery rate over all series of all machines.

mod change_test;
pub mod chart;
pub mod events;
pub mod faults;
mod machine;
mod prior;
pub mod results;
mod scatter;
mod series;
mod sessions;

pub use sessions::{MachineSessions, SessionValues};

use change_test::most_significant;
use machine::Fitted;
use prior::Prior;
use results::{History, MachineHistory};
use scatter::{priors_of_differences, priors_of_models};
use series::Series;

use abbe_identify::numerics::parallel;

/// Days of a year.
pub const DAYS_PER_YEAR: f64 = 365.25;

/// The options of a history.
#[derive(Clone, Debug)]
pub struct HistoryOptions {
    /// False discovery rate over all series.
    pub false_discovery_rate: f64,
    /// Change of a parameter, in its standard uncertainties, before which the next check is due.
    pub tolerance_u: f64,
    /// Changes of the errors by known compensations.
    pub compensations: Vec<events::Compensation>,
}

impl Default for HistoryOptions {
    fn default() -> Self {
        HistoryOptions { false_discovery_rate: 0.05, tolerance_u: 4.0, compensations: Vec::new() }
    }
}

/// Analyses machines. The sessions of each are sorted by time.
pub fn analyse(machines: &[MachineSessions], options: &HistoryOptions) -> History {
    let plain = Series::of_fleet(machines);
    let (_, first) = modelled(&plain, &priors_of_differences(machines, &plain), options);
    let (threshold, mut all) = modelled(&plain, &priors_of_models(machines, &first), options);
    all.iter_mut().flatten().for_each(Series::enlarge);
    let fitted: Vec<MachineHistory> =
        parallel::map(machines.len(), &|k| Fitted::of(&machines[k], all[k].clone()).history(options));
    History {
        false_discovery_rate: options.false_discovery_rate,
        p_value_threshold: threshold,
        tested_series: all.iter().map(Vec::len).sum(),
        machines: fitted,
    }
}

/// The series with their models for given priors of their scatter, and the largest p value that is significant. A series
/// that is not significant keeps its level.
fn modelled(all: &[Vec<Series>], priors: &[Vec<Prior>], options: &HistoryOptions) -> (f64, Vec<Vec<Series>>) {
    let tested = parallel::map(all.len(), &|k| {
        let test = |(series, prior): (&Series, &Prior)| {
            let change = most_significant(series, prior);
            (series.clone().tested(*prior, change.p_value), change.steps)
        };
        all[k].iter().zip(&priors[k]).map(test).collect::<Vec<_>>()
    });
    let p_values: Vec<f64> = tested.iter().flatten().map(|(series, _)| series.p_value()).collect();
    let threshold = benjamini_hochberg(&p_values, options.false_discovery_rate);
    let models = parallel::map(tested.len(), &|k| {
        let series = tested[k].iter().cloned();
        let model = |(series, steps): (Series, Vec<usize>)| match series.p_value() <= threshold {
            true => series.searched(&steps, threshold),
            false => series,
        };
        series.map(model).collect()
    });
    (threshold, models)
}

/// The largest p value that is significant at a false discovery rate; below every p value if none is.
///
/// The `k` smallest of `m` p values are significant for the largest `k` with `p₍ₖ₎ ≤ k·q/m`.
pub fn benjamini_hochberg(p_values: &[f64], rate: f64) -> f64 {
    let mut sorted = p_values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len() as f64;
    let limits = sorted.iter().enumerate().map(|(k, p)| (*p, (k + 1) as f64 * rate / count));
    limits.filter(|(p, limit)| p <= limit).map(|(_, limit)| limit).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of Benjamini and Hochberg (1995), Section 4.1: of 15 p values the four smallest are significant.
    #[test]
    fn the_published_example_of_the_false_discovery_rate() {
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528,
            0.7590, 1.0,
        ];
        let threshold = benjamini_hochberg(&p, 0.05);
        assert_eq!(p.iter().filter(|p| **p <= threshold).count(), 4);
        assert_eq!(benjamini_hochberg(&[0.3, 0.9], 0.05), 0.0);
        assert_eq!(benjamini_hochberg(&[], 0.05), 0.0);
    }
}

#[cfg(test)]
mod short_series;
#[cfg(test)]
mod simulated;
