//! Counts, and tests of rates against them.

use statrs::function::beta::beta_reg;

/// A count out of a total.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rate {
    /// Number of hits.
    pub hits: usize,
    /// Number of trials.
    pub of: usize,
}

/// Significance level at which a count contradicts a bound.
const CHANCE: f64 = 0.005;

impl Rate {
    /// Adds one trial.
    pub fn count(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.of += 1;
    }

    /// The proportion of hits.
    pub fn share(self) -> f64 {
        self.hits as f64 / self.of.max(1) as f64
    }

    /// Standard error of the proportion, from a uniform prior: never zero.
    pub fn standard_error(self) -> f64 {
        let n = self.of as f64;
        let p = (self.hits as f64 + 1.0) / (n + 2.0);
        (p * (1.0 - p) / (n + 3.0)).sqrt()
    }

    /// Whether the count is consistent with a rate of at least `rate`.
    pub fn is_consistent_with_at_least(self, rate: f64) -> bool {
        // P(at most k hits) = I_{1−rate}(n − k, k + 1).
        self.hits == self.of || beta_reg((self.of - self.hits) as f64, self.hits as f64 + 1.0, 1.0 - rate) > CHANCE
    }

    /// Whether the count is consistent with a rate of at most `rate`.
    pub fn is_consistent_with_at_most(self, rate: f64) -> bool {
        let misses = Rate { hits: self.of - self.hits, of: self.of };
        misses.is_consistent_with_at_least(1.0 - rate)
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (share, error) = (100.0 * self.share(), 100.0 * self.standard_error());
        write!(formatter, "{} of {} = {share:.1} ± {error:.1} %", self.hits, self.of)
    }
}

/// Pulls of parameters: deviation from the truth over the standard uncertainty.
#[derive(Clone, Debug, Default)]
pub struct Pulls(pub Vec<f64>);

impl Pulls {
    /// Root mean square.
    pub fn rms(&self) -> f64 {
        (self.0.iter().map(|pull| pull * pull).sum::<f64>() / self.0.len().max(1) as f64).sqrt()
    }

    /// The proportion of absolute values above a limit.
    pub fn beyond(&self, limit: f64) -> f64 {
        self.0.iter().filter(|pull| pull.abs() > limit).count() as f64 / self.0.len().max(1) as f64
    }
}

#[test]
fn bounds_allow_for_the_sampling_error_of_a_count() {
    assert!(Rate { hits: 14, of: 16 }.is_consistent_with_at_least(0.95));
    assert!(!Rate { hits: 11, of: 16 }.is_consistent_with_at_least(0.95));
    assert!(Rate { hits: 16, of: 16 }.is_consistent_with_at_least(0.95));
    assert!(Rate { hits: 2, of: 16 }.is_consistent_with_at_most(0.02));
    assert!(!Rate { hits: 4, of: 16 }.is_consistent_with_at_most(0.02));
    assert!(!Rate { hits: 17, of: 400 }.is_consistent_with_at_most(0.02));
}
