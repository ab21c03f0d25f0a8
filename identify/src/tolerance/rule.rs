//! The decision rule of ISO 14253-1: conformity or nonconformity is stated where its probability is high enough.
//!
//! The true value lies about the measured one, `y`, with a Gaussian distribution of standard deviation `u`. With the
//! probability `p` and `z = Φ⁻¹(p)`
//!
//! ```text
//! pass:  Φ((T_U − y)/u) − Φ((T_L − y)/u) ≥ p          fail:  y ≥ T_U + z·u  or  y ≤ T_L − z·u
//! ```
//!
//! Otherwise nothing is stated. Where `u` is small against the tolerance, the guard band `T_U − y` at the end of the
//! acceptance zone is `z·u` too: 1.645 `u` at 95 %. Where it is not, both limits count, and the zone is narrower (JCGM
//! 106, 7.3); below `T_U − T_L = 2 Φ⁻¹((1 + p)/2)·u` it is empty.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::numerics::tails::{normal_quantile, normal_tail};
use crate::results::Interval;

/// The decision about one quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Decision {
    /// The quantity is within its limits with at least the stated probability.
    Pass,
    /// It is outside them with at least the stated probability.
    Fail,
    /// Neither is proven.
    Undecided,
}

impl Decision {
    /// `pass`, `fail`, `undecided`.
    pub fn word(self) -> &'static str {
        match self {
            Decision::Pass => "pass",
            Decision::Fail => "fail",
            Decision::Undecided => "undecided",
        }
    }
}

/// Limits of a quantity with the standard uncertainty of its measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// The lower limit, if there is one.
    pub lower: Option<f64>,
    /// The upper limit.
    pub upper: f64,
    /// Standard uncertainty of the measured value.
    pub u: f64,
    /// Least probability of a true statement.
    pub probability: f64,
}

impl Rule {
    /// The probability that the true value is within the limits, for a measured value.
    pub fn conformance_probability(&self, value: f64) -> f64 {
        if self.u <= 0.0 {
            let inside = value <= self.upper && self.lower.is_none_or(|lower| value >= lower);
            return if inside { 1.0 } else { 0.0 };
        }
        let above = normal_tail((self.upper - value) / self.u);
        let below = self.lower.map_or(0.0, |lower| normal_tail((value - lower) / self.u));
        (1.0 - above - below).max(0.0)
    }

    /// The decision for a measured value.
    pub fn decide(&self, value: f64) -> Decision {
        let guard = self.one_sided_guard_band();
        if value >= self.upper + guard && value > self.upper {
            return Decision::Fail;
        }
        if self.lower.is_some_and(|lower| value <= lower - guard && value < lower) {
            return Decision::Fail;
        }
        if self.conformance_probability(value) >= self.probability { Decision::Pass } else { Decision::Undecided }
    }

    /// The measured values that pass; `None` if none does.
    pub fn acceptance_zone(&self) -> Option<Interval> {
        let guard = self.one_sided_guard_band();
        let Some(lower) = self.lower else {
            // A figure without a lower limit is never negative.
            return (self.upper >= guard).then_some(Interval { low: 0.0, high: self.upper - guard });
        };
        let half = 0.5 * (self.upper - lower);
        if self.conformance_probability(self.upper - half) < self.probability {
            return None;
        }
        // The probability falls from the middle to the limit: its place is halved until it is exact.
        let (mut inside, mut outside) = (half, 0.0_f64.max(guard * 0.5).min(half));
        for _ in 0..80 {
            let middle = 0.5 * (inside + outside);
            if self.conformance_probability(self.upper - middle) >= self.probability {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        Some(Interval { low: lower + inside, high: self.upper - inside })
    }

    /// The guard band outside a limit, and inside one where the other limit is far: `Φ⁻¹(p)·u`.
    pub fn one_sided_guard_band(&self) -> f64 {
        normal_quantile(1.0 - self.probability) * self.u
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Factors of the tables of the normal distribution: 1.645 for one side, 1.960 for both at 95 %.
    #[test]
    fn guard_bands_are_those_of_the_normal_distribution() {
        let wide = Rule { lower: Some(-20.0), upper: 20.0, u: 1.0, probability: 0.95 };
        assert!((wide.one_sided_guard_band() - 1.644_854).abs() < 1e-5);
        let zone = wide.acceptance_zone().unwrap();
        assert!((20.0 - zone.high - 1.644_854).abs() < 1e-5, "{zone:?}");
        for (width, is_empty) in [(1.959, true), (1.961, false)] {
            let narrow = Rule { lower: Some(-width), upper: width, ..wide };
            assert_eq!(narrow.acceptance_zone().is_none(), is_empty);
            assert_eq!(narrow.decide(0.0), if is_empty { Decision::Undecided } else { Decision::Pass });
        }
        let middle = Rule { lower: Some(-2.5), upper: 2.5, ..wide };
        let zone = middle.acceptance_zone().unwrap();
        assert!((middle.conformance_probability(zone.high) - 0.95).abs() < 1e-9);
        assert_eq!(middle.decide(zone.high - 1e-6), Decision::Pass);
        assert_eq!(middle.decide(zone.low - 1e-6), Decision::Undecided);
        assert_eq!(middle.decide(2.5 + 1.6449), Decision::Fail);
        assert_eq!(middle.decide(-2.5 - 1.6448), Decision::Undecided);
        let one = Rule { lower: None, upper: 10.0, ..wide };
        assert_eq!(one.decide(8.3551), Decision::Pass);
        assert_eq!(one.decide(8.3552), Decision::Undecided);
    }
}
