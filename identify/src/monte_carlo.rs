//! Propagation of distributions by Monte Carlo (JCGM 101): the distribution of a function of uncertain quantities,
//! linear or nonlinear.
//!
//! Each run is counted in one histogram per output and then dropped, so memory does not grow with the number of runs.
//! Runs are drawn in blocks, each from its own stream of the generator. The result depends on the seed and the number
//! of runs, not on the number of processors.

use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Serialize;

use crate::numerics::parallel;

/// A function from input quantities to output quantities.
pub trait Function: Sync {
    /// Reusable memory for evaluations.
    type Scratch: Default;
    /// Runs per stream. Functions with long runs use fewer, so that processors share the work.
    const BLOCK: u64 = 4096;
    /// Runs for the ranges of the histograms.
    const PILOT: u64 = 4096;
    /// Number of input quantities.
    fn inputs(&self) -> usize;
    /// Number of output quantities.
    fn outputs(&self) -> usize;
    /// Evaluates the function. An output that is not finite counts as a run without a value.
    fn evaluate(&self, inputs: &[f64], outputs: &mut [f64], scratch: &mut Self::Scratch);
}

/// The inputs and the number of runs of a Monte Carlo propagation.
#[derive(Clone, Copy, Debug)]
pub struct Draws<'a> {
    /// Expectation of each input.
    pub mean: &'a [f64],
    /// Standard uncertainty of each input; the inputs are independent and Gaussian.
    pub u: &'a [f64],
    /// Number of runs.
    pub runs: u64,
    /// Seed.
    pub seed: u64,
    /// Coverage probability of the intervals.
    pub coverage: f64,
}

/// Number of runs, seed and coverage probability of a Monte Carlo propagation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MonteCarlo {
    /// Number of runs.
    pub runs: u64,
    /// Seed of the runs.
    pub seed: u64,
    /// Coverage probability of the intervals, 0 to 1.
    #[serde(rename = "coverage_probability")]
    pub coverage: f64,
}

/// The distribution of an output, in the output's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Mean over the runs.
    pub mean: f64,
    /// Standard deviation over the runs: the standard uncertainty (JCGM 101, 7.6).
    pub u: f64,
    /// The shortest coverage interval (JCGM 101, 5.3.4).
    pub shortest: [f64; 2],
    /// The probabilistically symmetric coverage interval (JCGM 101, 5.3.3).
    pub symmetric: [f64; 2],
    /// Lower end of the first bin.
    pub from: f64,
    /// Upper end of the last bin.
    pub to: f64,
    /// Number of runs in each bin.
    pub counts: Vec<u64>,
    /// Number of runs below the first bin, above the last bin, and without a value.
    pub outside: [u64; 3],
}

/// Number of accumulators, each for every `LANES`th block. It divides the parallel work and bounds the memory.
const LANES: u64 = 32;
/// Stream of the first pilot runs. A block's stream is its number.
const PILOT_STREAM: u128 = 1 << 64;
/// Bins of a histogram. A range of 16 standard deviations gives bins of 1/60 standard deviation.
const BINS: usize = 1000;
/// Half range of a histogram, at least, in standard deviations.
const REACH: f64 = 8.0;

/// The histogram of one output.
#[derive(Clone)]
struct Histogram {
    centre: f64,
    from: f64,
    per_width: f64,
    sum: f64,
    square: f64,
    counts: Vec<u64>,
    outside: [u64; 3],
}

impl Histogram {
    fn over(centre: f64, reach: f64) -> Histogram {
        Histogram {
            centre,
            from: centre - reach,
            per_width: BINS as f64 / (2.0 * reach),
            sum: 0.0,
            square: 0.0,
            counts: vec![0; BINS],
            outside: [0; 3],
        }
    }

    #[inline]
    fn add(&mut self, value: f64) {
        if !value.is_finite() {
            self.outside[2] += 1;
            return;
        }
        let off = value - self.centre;
        self.sum += off;
        self.square += off * off;
        let place = (value - self.from) * self.per_width;
        if place < 0.0 {
            self.outside[0] += 1;
        } else if let Some(bin) = self.counts.get_mut(place as usize) {
            *bin += 1;
        } else {
            self.outside[1] += 1;
        }
    }

    fn merge(&mut self, other: &Histogram) {
        self.sum += other.sum;
        self.square += other.square;
        for (mine, theirs) in self.counts.iter_mut().zip(&other.counts) {
            *mine += theirs;
        }
        for (mine, theirs) in self.outside.iter_mut().zip(other.outside) {
            *mine += theirs;
        }
    }

    fn distribution(self, coverage: f64) -> Distribution {
        let inside: u64 = self.counts.iter().sum();
        let count = (inside + self.outside[0] + self.outside[1]).max(1) as f64;
        let off = self.sum / count;
        let variance = (self.square - self.sum * off) / (count - 1.0).max(1.0);
        let width = 1.0 / self.per_width;
        let to = self.from + BINS as f64 * width;
        let mut below = Vec::with_capacity(BINS + 1);
        let mut total = self.outside[0];
        below.push(total as f64);
        for bin in &self.counts {
            total += bin;
            below.push(total as f64);
        }
        let quantile = |share: f64| -> f64 {
            let wanted = share * count;
            if wanted < below[0] {
                return f64::NEG_INFINITY;
            }
            let Some(end) = below.iter().position(|reached| *reached >= wanted) else {
                return f64::INFINITY;
            };
            if end == 0 {
                return self.from;
            }
            let part = (wanted - below[end - 1]) / (below[end] - below[end - 1]);
            self.from + (end as f64 - 1.0 + part) * width
        };
        let tail = (1.0 - coverage) / 2.0;
        let symmetric = [quantile(tail), quantile(1.0 - tail)];
        // The density is equal at both ends of the shortest interval. The search varies the probability of the lower
        // tail. Of intervals of equal length, as a symmetric distribution has them, the lowest counts: rounding must not
        // decide.
        const TAIL_STEPS: usize = 400;
        const EQUAL_LENGTH: f64 = 1e-9;
        let mut shortest = symmetric;
        for slide in 0..=TAIL_STEPS {
            let share = 2.0 * tail * slide as f64 / TAIL_STEPS as f64;
            let interval = [quantile(share), quantile(share + coverage)];
            if interval[1] - interval[0] < (shortest[1] - shortest[0]) * (1.0 - EQUAL_LENGTH) {
                shortest = interval;
            }
        }
        Distribution {
            mean: self.centre + off,
            u: variance.max(0.0).sqrt(),
            shortest,
            symmetric,
            from: self.from,
            to,
            counts: self.counts,
            outside: self.outside,
        }
    }
}

/// Draws inputs and passes each vector of outputs to a function.
fn draw(function: &impl Function, draws: &Draws<'_>, stream: u128, runs: u64, mut take: impl FnMut(&[f64])) {
    let mut random = Pcg64::new(u128::from(draws.seed), stream);
    let mut inputs = vec![0.0; function.inputs()];
    let mut outputs = vec![0.0; function.outputs()];
    let mut scratch = Default::default();
    for _ in 0..runs {
        for ((input, mean), u) in inputs.iter_mut().zip(draws.mean).zip(draws.u) {
            let normal: f64 = StandardNormal.sample(&mut random);
            *input = mean + u * normal;
        }
        function.evaluate(&inputs, &mut outputs, &mut scratch);
        take(&outputs);
    }
}

/// The distribution of every output.
pub(crate) fn propagate<F: Function>(function: &F, draws: &Draws<'_>) -> Vec<Distribution> {
    let empty = pilot(function, draws);
    let blocks = draws.runs.div_ceil(F::BLOCK);
    let lanes = parallel::map(LANES.min(blocks) as usize, &|lane| {
        let mut counts = empty.clone();
        for block in (lane as u64..blocks).step_by(LANES as usize) {
            let runs = F::BLOCK.min(draws.runs - block * F::BLOCK);
            draw(function, draws, u128::from(block), runs, |outputs| {
                for (count, value) in counts.iter_mut().zip(outputs) {
                    count.add(*value);
                }
            });
        }
        counts
    });
    let mut counts = empty;
    for lane in &lanes {
        for (count, other) in counts.iter_mut().zip(lane) {
            count.merge(other);
        }
    }
    counts.into_iter().map(|count| count.distribution(draws.coverage)).collect()
}

/// Empty histograms with ranges from the pilot runs.
fn pilot<F: Function>(function: &F, draws: &Draws<'_>) -> Vec<Histogram> {
    let blocks = parallel::map(F::PILOT.div_ceil(F::BLOCK) as usize, &|block| {
        let block = block as u64;
        let runs = F::BLOCK.min(F::PILOT - block * F::BLOCK);
        let mut drawn = Vec::with_capacity(runs as usize * function.outputs());
        draw(function, draws, PILOT_STREAM + u128::from(block), runs, |outputs| {
            drawn.extend_from_slice(outputs);
        });
        drawn
    });
    let values = (0..function.outputs()).map(|output| {
        let runs = blocks.iter().flat_map(|drawn| drawn.chunks_exact(function.outputs()));
        let column = runs.map(|outputs| outputs[output]);
        column.filter(|value| value.is_finite()).collect::<Vec<f64>>()
    });
    values
        .map(|mut column| {
            column.sort_by(f64::total_cmp);
            let at = |share: f64| column.get(((column.len() as f64 - 1.0) * share) as usize).copied();
            let (Some(low), Some(middle), Some(high)) = (at(0.1587), at(0.5), at(0.8413)) else {
                return Histogram::over(0.0, 1.0);
            };
            // Quantiles, not moments: a few extreme runs should count as outside instead of widening the bins.
            let reach = REACH * (high - low) / 2.0;
            let least = (middle.abs() * 1e-12).max(f64::MIN_POSITIVE * 1e20);
            Histogram::over(middle, reach.max(least))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangular distribution over 0 to 1 with mode `m`. Of the probability `1 − p` outside the shortest interval,
    /// the share `m` lies below it. The shortest interval is thus `m √(1 − p)` to `1 − (1 − m) √(1 − p)`. The symmetric
    /// one is `√(m (1 − p) / 2)` to `1 − √((1 − m) (1 − p) / 2)`.
    #[test]
    fn a_triangular_distribution_has_its_closed_form_intervals() {
        const DRAWS: usize = 200_000;
        let (m, p) = (0.25_f64, 0.95_f64);
        let mut count = Histogram::over(0.5, 0.6);
        for k in 0..DRAWS {
            let share = (k as f64 + 0.5) / DRAWS as f64;
            count.add(if share < m { (share * m).sqrt() } else { 1.0 - ((1.0 - share) * (1.0 - m)).sqrt() });
        }
        let found = count.distribution(p);
        let near = |found: f64, wanted: f64, within: f64| {
            assert!((found - wanted).abs() < within, "{found} instead of {wanted}");
        };
        near(found.mean, (1.0 + m) / 3.0, 1e-6);
        near(found.u, ((1.0 - m + m * m) / 18.0).sqrt(), 1e-5);
        near(found.symmetric[0], (m * (1.0 - p) / 2.0).sqrt(), 1e-3);
        near(found.symmetric[1], 1.0 - ((1.0 - m) * (1.0 - p) / 2.0).sqrt(), 1e-3);
        // The length of the interval is stationary at its minimum.
        let root = (1.0 - p).sqrt();
        near(found.shortest[0], m * root, 0.01);
        near(found.shortest[1], 1.0 - (1.0 - m) * root, 0.01);
        near(found.shortest[1] - found.shortest[0], 1.0 - root, 1e-3);
        assert_eq!(found.counts.iter().sum::<u64>(), DRAWS as u64);
        near(found.from, -0.1, 1e-12);
        near(found.to, 1.1, 1e-12);
    }

    /// A density that falls linearly from both ends to the middle: bins of 1000, 999, … 501, 501, … 999, 1000 runs. The
    /// shortest interval excludes one end, and both ends are equal. The upper 5 % of the 750 500 runs are 38 bins, which
    /// hold 37 297, and 228 of the 962 runs in the next.
    #[test]
    fn of_two_intervals_of_equal_length_the_lower_one_is_the_shortest() {
        for (centre, reach) in [(0.0, 1.0), (1e3 / 3.0, 0.1), (std::f64::consts::PI, 0.7), (-2.0 / 3.0, 1.0 / 3.0)] {
            let mut count = Histogram::over(centre, reach);
            let falling = (501..=1000).rev();
            count.counts = falling.clone().chain(falling.rev()).collect();
            let [low, high] = count.distribution(0.95).shortest;
            let bins = 38.0 + 228.0 / 962.0;
            assert_eq!(low, centre - reach);
            assert!((high - (centre + reach * (1.0 - bins / 500.0))).abs() < 1e-9 * reach.max(centre.abs()), "{high}");
        }
    }

    #[test]
    fn values_outside_the_range_are_counted_and_nan_is_excluded() {
        let mut count = Histogram::over(0.0, 1.0);
        for value in [-3.0, -2.0, 0.5, 2.0, f64::NAN, f64::INFINITY] {
            count.add(value);
        }
        let mut both = Histogram::over(0.0, 1.0);
        both.merge(&count);
        both.merge(&count);
        let found = both.distribution(0.95);
        assert_eq!(found.outside, [4, 2, 4]);
        assert!((found.mean + 2.5 / 4.0).abs() < 1e-12);
        // For eight values in pairs: Σ(x − x̄)² / 7.
        let square: f64 = [-3.0, -2.0, 0.5, 2.0].iter().map(|x: &f64| 2.0 * (x + 0.625).powi(2)).sum();
        assert!((found.u - (square / 7.0).sqrt()).abs() < 1e-12);
        assert_eq!(found.symmetric, [f64::NEG_INFINITY, f64::INFINITY]);
    }
}
