//! Readings without structure: the null distribution of the search.
//!
//! Along runs, the draws come from the pure error: whitened deviations of repeats from their mean, in blocks with
//! random signs. The blocks keep the autocorrelation that whitening leaves. The deviations lack the trend of their run,
//! and with it most of their slow part. Each block therefore gets the trend of white noise back. Otherwise effects that
//! are constant or slow along a run would exceed the draws too often.
//!
//! Without enough repeats the draws are single deviations from the running median, each with a random sign, or Gaussian
//! noise if there are few. Independent poses have few repeats. For them the residual is drawn with a random sign for
//! each pose (the wild bootstrap). This keeps the magnitude of each pose and removes every dependence on position.
//!
//! The noise model is an estimate. Each draw has a standard deviation and an autocorrelation that differ from the
//! estimates by their uncertainties.

use std::ops::Range;
use std::sync::OnceLock;

use abbe_identify::noise::trends::{TERMS, Trends};
use abbe_identify::noise::{NoiseSource, Process, PureError};
use abbe_identify::numerics::median;
use abbe_identify::problem::Problem;
use rand::{RngExt, SeedableRng};
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::constants::{MAX_AR_SUM, MIN_POOL, SINGLE, SMOOTHING};
use super::policy::{NullSource, Policy};
use crate::candidates::columns::Columns;
use crate::candidates::gram::DrawSource;
use crate::progress::Progress;

/// Null draws from one message of progress to the next.
const BETWEEN_NEWS: usize = 16;

/// Null draws, each over the whitened rows in fold order. A draw is formed when it is taken: a hundred thousand readings
/// times two hundred draws are 160 MB.
pub struct Draws<'d> {
    /// What was fitted.
    pub problem: &'d Problem,
    /// Its rows.
    pub columns: &'d Columns<'d>,
    /// The residuals with the pure error, mm, test by test.
    pub residuals: &'d [Vec<f64>],
    /// The whitened residual.
    pub whitened: &'d [f64],
    /// Number of draws.
    pub count: usize,
    /// Readings of a block.
    pub block: usize,
    /// Seed.
    pub seed: u64,
    /// Receives how many are formed.
    pub progress: Option<&'d (dyn Fn(Progress) -> bool + Sync)>,
}

impl DrawSource for Draws<'_> {
    fn draws(&self) -> Box<dyn ExactSizeIterator<Item = Vec<f64>> + Send + '_> {
        let Draws { problem, columns, whitened, block, .. } = *self;
        let mut generator = Pcg64::seed_from_u64(self.seed ^ 0x6e75_6c6c);
        let mut draw: Box<dyn FnMut() -> Vec<f64> + Send + '_> = match Policy::of(problem).null {
            NullSource::SignFlips => {
                let pose_of_row = &problem.folds.pose_of_row;
                let origins = columns.origin_of_rows().into_iter();
                let poses: Vec<usize> = origins.map(|(test, row, _)| pose_of_row[test][row]).collect();
                Box::new(move || sign_flipped(&poses, whitened, &mut generator))
            }
            NullSource::Repeats => {
                let source = NoiseDraws::of(problem, self.residuals);
                Box::new(move || columns.placed(&source.draw(columns.rows(), block, &mut generator)))
            }
        };
        Box::new((0..self.count).map(move |formed| {
            if let Some(progress) = self.progress.filter(|_| formed > 0 && formed % BETWEEN_NEWS == 0) {
                progress(Progress::NullDraws(formed, self.count));
            }
            draw()
        }))
    }
}

/// The residual with a random sign for each pose. `poses` are the poses of the values: the readings of several targets at
/// one pose have one sign.
fn sign_flipped(poses: &[usize], whitened: &[f64], generator: &mut Pcg64) -> Vec<f64> {
    let mut signs: Vec<Option<f64>> = vec![None; poses.iter().max().map_or(0, |last| last + 1)];
    let flipped = |(pose, value): (&usize, &f64)| *signs[*pose].get_or_insert_with(|| sign(generator)) * value;
    poses.iter().zip(whitened).map(flipped).collect()
}

fn sign(generator: &mut Pcg64) -> f64 {
    if generator.random::<bool>() { 1.0 } else { -1.0 }
}

/// Whitened deviations in uninterrupted stretches, and the uncertainty of the noise model.
struct NoiseDraws {
    pool: Vec<Stretch>,
    /// The deviations of the pool as blocks of one reading, when they are first drawn.
    singles: OnceLock<Vec<Single>>,
    spectrum: Spectrum,
    /// Degrees of freedom of the noise variance. `None` if it is not an estimate.
    freedom: Option<f64>,
}

/// Whitened deviations of one run, of unit variance.
#[derive(Default)]
struct Stretch {
    values: Vec<f64>,
    /// The orthonormal terms of the trend that the values lack, at each value. Empty if they lack none.
    trend: Vec<[f64; TERMS]>,
    /// Readings have this number of channels, one after another, each with a trend of its own.
    channels: usize,
}

/// A whitened deviation as a block of one reading.
struct Single {
    value: f64,
    /// Standard deviation of the trend that it lacks; `None` if it lacks none.
    share: Option<f64>,
}

/// The autocorrelation that an inaccurate whitening leaves.
enum Spectrum {
    /// None.
    White,
    /// Of readings that are whitened as white noise: equally probable first coefficients, and the standard deviation of
    /// what they do not predict over that of the noise.
    NotSignificant(Vec<(f64, f64)>),
    /// Of readings that are whitened with these coefficients, whose sum has this standard uncertainty.
    Significant { coefficients: Vec<f64>, sum_u: f64 },
}

impl NoiseDraws {
    fn of(problem: &Problem, residuals: &[Vec<f64>]) -> NoiseDraws {
        let kept = |test: usize, row: usize| !problem.rejected[test][row];
        let along = PureError::of(&problem.tests, residuals, kept).without_waves(&problem.tests, kept);
        let pure = &along.pure;
        let of_repeats = pure.freedom >= MIN_POOL;
        let pool = if of_repeats { pool_of_repeats(problem, pure) } else { pool_of_residual(problem, residuals) };
        let coefficients = problem.noise.ar_coefficients.clone();
        let spectrum = if coefficients.is_empty() {
            let possible = along.possible_processes(problem.session.stated_noise_mm());
            possible.map_or(Spectrum::White, |possible| {
                Spectrum::not_significant(&possible, problem.noise.sigma_mm, of_repeats)
            })
        } else {
            Spectrum::Significant { coefficients, sum_u: problem.noise.ar_sum_u }
        };
        let estimated = problem.noise.source == NoiseSource::Repeats;
        let freedom = estimated.then_some(pure.freedom as f64);
        NoiseDraws { pool, singles: OnceLock::new(), spectrum, freedom }
    }

    fn draw(&self, rows: usize, block: usize, generator: &mut Pcg64) -> Vec<f64> {
        let mut values = self.blocks(rows, block, generator);
        self.spectrum.give(&mut values, generator);
        // The variance is an estimate with this relative error.
        let law = self.freedom.and_then(|freedom| Some((freedom, ChiSquared::new(freedom).ok()?)));
        if let Some((freedom, law)) = law {
            let scale = (freedom / law.sample(generator)).sqrt();
            values.iter_mut().for_each(|value| *value *= scale);
        }
        values
    }

    /// Draws `rows` deviations from the pool in blocks with random signs. Draws Gaussian noise if the pool is too small.
    /// Blocks of one reading come from a table, which takes no search for the stretch of each.
    fn blocks(&self, rows: usize, block: usize, generator: &mut Pcg64) -> Vec<f64> {
        let ends: Vec<usize> = (self.pool.iter())
            .scan(0, |end, stretch| {
                *end += stretch.values.len();
                Some(*end)
            })
            .collect();
        let total = ends.last().copied().unwrap_or(0);
        if total < MIN_POOL {
            return (0..rows).map(|_| generator.sample(StandardNormal)).collect();
        }
        if block == SINGLE {
            let of_stretch =
                |stretch: &Stretch| (0..stretch.values.len()).map(|i| stretch.single(i)).collect::<Vec<_>>();
            let singles = self.singles.get_or_init(|| self.pool.iter().flat_map(of_stretch).collect());
            return (0..rows).map(|_| singles[generator.random_range(0..total)].draw(generator)).collect();
        }
        let mut values = Vec::with_capacity(rows + block);
        while values.len() < rows {
            // A stretch is chosen with probability proportional to its length, and a start within it uniformly.
            let place = generator.random_range(0..total);
            let chosen = ends.partition_point(|end| *end <= place);
            let stretch = &self.pool[chosen];
            let start = place - (ends[chosen] - stretch.values.len());
            stretch.draw(start..(start + block).min(stretch.values.len()), &mut values, generator);
        }
        values.truncate(rows);
        values
    }
}

impl Stretch {
    /// A stretch of white noise without its trend, given by terms at each value that need not be orthonormal.
    fn without_trend(mut values: Vec<f64>, mut trend: Vec<[f64; TERMS]>, channels: usize) -> Stretch {
        for channel in 0..channels {
            let own = || (channel..values.len()).step_by(channels);
            for term in 0..TERMS {
                let product = |trend: &[[f64; TERMS]], a: usize, b: usize| -> f64 {
                    own().map(|i| trend[i][a] * trend[i][b]).sum()
                };
                let before = product(&trend, term, term);
                for other in (0..term).chain(0..term) {
                    let along = product(&trend, term, other);
                    own().for_each(|i| trend[i][term] -= along * trend[i][other]);
                }
                let square = product(&trend, term, term);
                let scale = if square > 1e-12 * before { 1.0 / square.sqrt() } else { 0.0 };
                own().for_each(|i| trend[i][term] *= scale);
            }
            for term in 0..TERMS {
                let own = || (channel..trend.len()).step_by(channels);
                let along: f64 = own().map(|i| values[i] * trend[i][term]).sum();
                own().for_each(|i| values[i] -= along * trend[i][term]);
            }
        }
        Stretch { values, trend, channels }
    }

    /// A deviation as a block of one reading.
    fn single(&self, i: usize) -> Single {
        let share = |trend: &[f64; TERMS]| trend.iter().map(|q| q * q).sum::<f64>().sqrt();
        Single { value: self.values[i], share: self.trend.get(i).map(share) }
    }

    /// Draws the values of a range with one sign, and a trend of white noise.
    fn draw(&self, range: Range<usize>, values: &mut Vec<f64>, generator: &mut Pcg64) {
        if self.trend.is_empty() {
            // Without their slow part, neighbours would cancel each other.
            values.extend(range.map(|i| sign(generator) * self.values[i]));
            return;
        }
        if range.len() == 1 {
            values.push(self.single(range.start).draw(generator));
            return;
        }
        let sign = sign(generator);
        let coefficients: Vec<[f64; TERMS]> =
            (0..self.channels).map(|_| std::array::from_fn(|_| generator.sample(StandardNormal))).collect();
        values.extend(range.map(|i| {
            let of_trend = self.trend[i].iter().zip(&coefficients[i % self.channels]).map(|(q, z)| q * z);
            sign * self.values[i] + of_trend.sum::<f64>()
        }));
    }
}

impl Single {
    /// Draws the deviation with a random sign, and a trend of white noise.
    fn draw(&self, generator: &mut Pcg64) -> f64 {
        let deviation = sign(generator) * self.value;
        match self.share {
            Some(share) => deviation + share * generator.sample::<f64, _>(StandardNormal),
            None => deviation,
        }
    }
}

impl Spectrum {
    /// An autocorrelation that is not significant. Deviations in blocks have it, and lack its uncertainty only;
    /// independent draws lack all of it.
    fn not_significant(possible: &[Process], sigma_mm: f64, in_blocks: bool) -> Spectrum {
        let first = |process: &Process| process.coefficients[0];
        let mean = possible.iter().map(first).sum::<f64>() / possible.len() as f64;
        let lacking = |process: &Process| match in_blocks {
            true => (first(process) - mean, (1.0 - (first(process) - mean).powi(2)).max(0.0).sqrt()),
            false => (first(process), process.innovation_mm / sigma_mm),
        };
        Spectrum::NotSignificant(possible.iter().map(lacking).collect())
    }

    /// Gives a draw the spectrum that an inaccurate whitening leaves. Whitening with an inaccurate autocorrelation under-
    /// or over-whitens. The AR coefficients of each draw differ from the estimate by its uncertainty. With `A` the
    /// polynomial of the whitening and `A*` that of the draw, `A* w = A ε`.
    fn give(&self, values: &mut [f64], generator: &mut Pcg64) {
        let (own, found, scale) = match self {
            Spectrum::White => return,
            Spectrum::NotSignificant(possible) => {
                let (first, scale) = possible[generator.random_range(0..possible.len())];
                (vec![first], &[0.0][..], scale)
            }
            Spectrum::Significant { coefficients, sum_u } => {
                let standard: f64 = generator.sample(StandardNormal);
                let mut own = coefficients.clone();
                let sum: f64 = own.iter().sum();
                own[0] += (sum_u * standard).clamp(-MAX_AR_SUM - sum, MAX_AR_SUM - sum);
                (own, &coefficients[..], 1.0)
            }
        };
        let drawn = values.to_vec();
        for t in 0..values.len() {
            let mut value = scale * drawn[t];
            for (lag, (own, found)) in own.iter().zip(found).enumerate() {
                if let Some(before) = t.checked_sub(lag + 1) {
                    value += own * values[before] - found * drawn[before];
                }
            }
            values[t] = value;
        }
    }
}

/// The deviations of repeats of each run, without the trend of the run.
fn pool_of_repeats(problem: &Problem, pure: &PureError) -> Vec<Stretch> {
    let mut pool = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let channels = problem.channels(number);
        let trends = Trends::of(readings, |row| !problem.rejected[number][row]);
        // The trend is given back, so the deviations are not rescaled for it.
        let of_scalar = |i: usize| -> Option<[f64; TERMS + 1]> {
            let (trend, deviation) = (trends.terms_at(i / channels), pure.deviations[number][i]?);
            Some(std::array::from_fn(|k| *trend.get(k).unwrap_or(&(deviation / pure.rescaling(number)))))
        };
        for run in readings.runs() {
            for stretch in whitened(problem, number, run, of_scalar) {
                let trend: Vec<[f64; TERMS]> = stretch.iter().map(|row| std::array::from_fn(|k| row[k])).collect();
                let values = stretch.iter().map(|row| row[TERMS]).collect();
                pool.push(Stretch::without_trend(values, trend, channels));
            }
        }
    }
    pool
}

/// The residual of each run less its running median, at unit variance. The stated noise may differ from the true noise,
/// and the search uses whitened readings.
fn pool_of_residual(problem: &Problem, residuals: &[Vec<f64>]) -> Vec<Stretch> {
    let mut pool = Vec::new();
    for block in problem.blocks() {
        let channels = problem.channels(block.test);
        let first = block.rows.start * channels;
        let rough = without_smooth(&residuals[block.test][first..block.rows.end * channels], channels);
        for stretch in whitened(problem, block.test, block.rows, |i| Some([rough[i - first]])) {
            pool.push(Stretch { values: stretch.into_iter().flatten().collect(), trend: Vec::new(), channels });
        }
    }
    let values = || pool.iter().flat_map(|stretch| &stretch.values);
    let mean_square = values().map(|value| value * value).sum::<f64>() / values().count().max(1) as f64;
    if mean_square > 0.0 {
        let values = pool.iter_mut().flat_map(|stretch| &mut stretch.values);
        values.for_each(|value| *value /= mean_square.sqrt());
    }
    pool
}

/// Whitens values at the scalar readings of some rows of a test. Returns uninterrupted stretches: a gap is a reading
/// without values or a rejected one.
fn whitened<const N: usize>(
    problem: &Problem,
    test: usize,
    rows: Range<usize>,
    values_at: impl Fn(usize) -> Option<[f64; N]>,
) -> Vec<Vec<[f64; N]>> {
    let channels = problem.channels(test);
    let (ar, innovation) = (&problem.noise.ar_coefficients, problem.noise.innovation_mm());
    let whitened_at = |i: usize| {
        let mut now = values_at(i).filter(|_| problem.counts(test, i))?;
        for (lag, a) in ar.iter().enumerate() {
            let past = values_at(i - (lag + 1) * channels)?;
            now.iter_mut().zip(past).for_each(|(now, past)| *now -= a * past);
        }
        Some(now.map(|value| value / innovation))
    };
    let first = (rows.start + ar.len()) * channels;
    let values: Vec<Option<[f64; N]>> = (first..rows.end * channels).map(whitened_at).collect();
    let stretches = values.split(Option::is_none).filter(|stretch| !stretch.is_empty());
    stretches.map(|stretch| stretch.iter().flatten().copied().collect()).collect()
}

/// A residual less its running median.
fn without_smooth(residual: &[f64], channels: usize) -> Vec<f64> {
    let rows = residual.len() / channels;
    let mut rough = vec![0.0; residual.len()];
    for row in 0..rows {
        let (start, end) = (row.saturating_sub(SMOOTHING), (row + SMOOTHING + 1).min(rows));
        for channel in 0..channels {
            let mut window: Vec<f64> = (start..end).map(|r| residual[r * channels + channel]).collect();
            let level = median(&mut window);
            rough[row * channels + channel] = residual[row * channels + channel] - level;
        }
    }
    rough
}

#[cfg(test)]
mod tests;
