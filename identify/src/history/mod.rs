//! The parameters of machines over time: trends, change points, control charts, the next check.
//!
//! - `sessions`: the parameters of one machine in each session; `series`: one parameter of one machine over time,
//!   and its search for drift and steps;
//! - `machine`: all parameters of one machine together, by generalised least squares with the covariances of the
//!   sessions;
//! - [`events`]: steps of several parameters at one time, and what they are;
//! - [`chart`]: control charts; [`faults`]: effects of many sessions, by alias set; [`results`]: what is reported.
//!
//! Every series is tested for any change. Benjamini and Hochberg (1995, J. R. Stat. Soc. B 57, 289) control the false
//! discovery rate over all series of all machines.

pub mod chart;
pub mod events;
pub mod faults;
mod machine;
pub mod results;
mod series;
mod sessions;

pub use sessions::{MachineSessions, SessionValues};

use machine::Fitted;
use results::{History, MachineHistory};
use series::{Costs, Series};

use crate::numerics::parallel;
use crate::numerics::tails::chi_square_quantile;

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
    let all = Series::of_fleet(machines);
    let p_values: Vec<f64> = all.iter().flatten().map(Series::p_value).collect();
    let threshold = benjamini_hochberg(&p_values, options.false_discovery_rate);
    let fitted: Vec<MachineHistory> = parallel::map(machines.len(), &|k| {
        let series = all[k].iter().map(|series| {
            let costs = Costs::of(threshold, series.positions());
            // A series that is not significant keeps its level.
            if series.p_value() <= threshold { series.clone().searched(&costs) } else { series.clone() }
        });
        Fitted::of(&machines[k], series.collect()).history(options)
    });
    History {
        false_discovery_rate: options.false_discovery_rate,
        p_value_threshold: threshold,
        tested_series: p_values.len(),
        machines: fitted,
    }
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

/// The value that χ² with one degree of freedom exceeds with this probability, for probabilities down to zero.
fn quantile(probability: f64) -> f64 {
    chi_square_quantile(probability.clamp(1e-15, 1.0), 1.0)
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
mod simulated;
