//! How much of a reading is noise: its size and its memory.
//!
//! Readings at the same test, direction and position in repeated runs differ by noise alone (pure error: Box, Hunter & Hunter, Statistics for
//! Experimenters, ch. 10). What they differ by from their mean, rescaled by `√(R/(R−1))`, needs no model of the structure. A parabola and one cycle
//! are taken out of every run first: drift and warming up are structure and would be taken for slow noise, and a ball that has moved from one run to the
//! next leaves a cycle along each turn.

mod memory;
mod waves;

use abbe_model::session::Test;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::problem::Problem;
pub use memory::Memory;

/// The noise of one scalar reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation, mm.
    pub sigma_mm: f64,
    /// Autoregressive coefficients along a run; empty for white noise.
    pub memory: Vec<f64>,
    /// Standard uncertainty of the sum of these coefficients: how slow noise is, which decides how large it is where it is slow.
    pub memory_u: f64,
    /// Where the size comes from.
    pub source: NoiseSource,
}

/// Where a noise figure comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseSource {
    /// The session states it.
    Stated,
    /// Repeated readings.
    Repeats,
    /// What the fit leaves over.
    Fit,
}

impl NoiseSource {
    /// As it stands in results.
    pub fn word(self) -> &'static str {
        match self {
            NoiseSource::Stated => "stated",
            NoiseSource::Repeats => "repeats",
            NoiseSource::Fit => "fit",
        }
    }
}

impl Noise {
    /// White noise.
    pub fn white(sigma_mm: f64, source: NoiseSource) -> Noise {
        Noise {
            sigma_mm,
            memory: Vec::new(),
            memory_u: 0.0,
            source,
        }
    }

    /// Standard deviation of what a reading adds to the readings before it, mm: the innovation.
    pub fn innovation_mm(&self) -> f64 {
        // Yule–Walker: γ0 (1 − Σ a_k ρ_k) with ρ of the process itself; for the orders used here by the recursion on simulated
        // autocovariances is not needed, since ρ follows from the coefficients (Durbin–Levinson run backwards).
        let mut variance_ratio = 1.0;
        let mut coefficients = self.memory.clone();
        while let Some(reflection) = coefficients.last().copied() {
            let bound = 1.0 - reflection * reflection;
            variance_ratio *= bound;
            let n = coefficients.len();
            coefficients = (0..n - 1)
                .map(|k| (coefficients[k] + reflection * coefficients[n - 2 - k]) / bound)
                .collect();
        }
        self.sigma_mm * variance_ratio.max(0.0).sqrt()
    }
}

/// Readings that differ by noise alone: the residuals (rows × coordinates, mm) less their mean over repeats, rescaled; `None` for readings without a
/// partner.
pub struct PureError {
    /// For each test, one value a scalar reading.
    pub deviations: Vec<Vec<Option<f64>>>,
    /// Degrees of freedom.
    pub freedom: usize,
}

impl PureError {
    /// From residuals of any model (a model that is wrong alike in all repeats does no harm). `kept(test, row)` leaves rejected readings out.
    pub fn of(tests: &[&Test], residuals: &[Vec<f64>], kept: impl Fn(usize, usize) -> bool) -> PureError {
        let mut deviations = Vec::new();
        let mut freedom = 0;
        for (number, test) in tests.iter().enumerate() {
            let residual = &residuals[number];
            let mut deviation = vec![None; residual.len()];
            if let Some(readings) = &test.readings {
                let coordinates = readings.coordinates;
                let level = without_trends(readings, residual, |row| kept(number, row));
                let directions = directions(readings);
                let columns = readings.positions.len() + 1;
                let mut keys = Vec::with_capacity(readings.rows() * columns);
                for row in 0..readings.rows() {
                    // Positions agree to 0.1 µm or 10⁻⁴ rad.
                    let positions = readings.positions.iter();
                    keys.extend(positions.map(|column| (column[row] * 1e4).round() as i64));
                    keys.push(if readings.run.is_empty() {
                        0
                    } else {
                        directions[row]
                    });
                }
                let key = |row: usize| &keys[row * columns..(row + 1) * columns];
                let mut order: Vec<usize> = (0..readings.rows()).filter(|row| kept(number, *row)).collect();
                order.sort_by(|a, b| key(*a).cmp(key(*b)));
                for rows in order
                    .chunk_by(|a, b| key(*a) == key(*b))
                    .filter(|rows| rows.len() > 1)
                {
                    let count = rows.len() as f64;
                    let rescale = (count / (count - 1.0)).sqrt();
                    for coordinate in 0..coordinates {
                        let at = |row: &usize| level[row * coordinates + coordinate];
                        let mean = rows.iter().map(at).sum::<f64>() / count;
                        for row in rows {
                            deviation[row * coordinates + coordinate] = Some((at(row) - mean) * rescale);
                        }
                    }
                    freedom += (rows.len() - 1) * coordinates;
                }
            }
            deviations.push(deviation);
        }
        PureError { deviations, freedom }
    }

    /// The standard deviation, mm, if there are at least ten degrees of freedom.
    pub fn sigma_mm(&self) -> Option<f64> {
        let (sum, count) = self
            .deviations
            .iter()
            .flatten()
            .flatten()
            .fold((0.0, 0_usize), |(sum, count), value| {
                (sum + value * value, count + 1)
            });
        (self.freedom >= 10).then(|| (sum / count as f64).sqrt())
    }
}

/// Beyond this factor a stated noise and that of repeats disagree in what matters.
const DISAGREEMENT: f64 = 2.0;
/// Probability of a false word on that.
const DISAGREEMENT_P: f64 = 0.001;

/// A warning where repeated readings scatter by more than twice or less than half of what the session states, and not by chance; `residuals` are those of
/// any model, mm, test by test.
pub fn stated_against_repeats(problem: &Problem<'_>, residuals: &[Vec<f64>]) -> Option<String> {
    let stated_mm = problem.session.noise_mm.filter(|sigma| *sigma > 0.0)?;
    let pure = PureError::of(&problem.tests, residuals, |test, row| {
        !problem.rejected[test][row]
    });
    let sigma_mm = pure.sigma_mm()?;
    let resolution_mm = problem.session.resolution_mm.unwrap_or(0.0) / 12.0_f64.sqrt();
    let ratio = sigma_mm.max(resolution_mm) / stated_mm;
    let freedom = pure.freedom as f64;
    let below = ChiSquared::new(freedom).ok()?.cdf(freedom * ratio * ratio);
    let by_chance = below.min(1.0 - below) > DISAGREEMENT_P / 2.0;
    (!by_chance && !(1.0 / DISAGREEMENT..=DISAGREEMENT).contains(&ratio)).then(|| {
        format!(
            "the session states a noise of {} µm, and repeated readings scatter by {:.3} µm ({} degrees of freedom): the uncertainties of a fit follow from \
             what is stated; correct `noise_um`, or leave it out",
            stated_mm * 1e3,
            sigma_mm * 1e3,
            pure.freedom
        )
    })
}

/// The direction of travel of every axis as one number a row.
fn directions(readings: &abbe_model::session::readings::Readings) -> Vec<i64> {
    let mut code = vec![0_i64; readings.rows()];
    for axis in 0..readings.positions.len() {
        let samples = readings.axis_samples(axis, abbe_model::axis::AxisKind::Rotary);
        for (code, sample) in code.iter_mut().zip(samples) {
            *code = *code * 3 + sample.direction as i64 + 1;
        }
    }
    code
}

/// Coefficients of the trend that is taken out of a run: constant, slope, curvature, and one cycle over the run.
const TERMS: usize = 5;
/// How many of them are powers of time.
const POWERS: usize = 3;
/// The fewest readings of a run whose waves are looked at.
const LEAST_RUN: usize = 24;

/// The terms of a trend, orthonormal over given times (Gram–Schmidt, twice); those that the times are too few for are zero.
fn trend_terms(times: &[f64]) -> Vec<[f64; TERMS]> {
    let n = times.len() as f64;
    let middle = times.iter().sum::<f64>() / n;
    let half = times
        .iter()
        .map(|t| (t - middle).abs())
        .fold(f64::MIN_POSITIVE, f64::max);
    let term = |t: &f64, i: usize| -> f64 {
        let time = (t - middle) / half;
        let (sin, cos) = (std::f64::consts::PI * time).sin_cos();
        match i {
            0..POWERS => time.powi(i as i32),
            _ if times.len() < LEAST_RUN => 0.0,
            POWERS => cos,
            _ => sin,
        }
    };
    let mut q: Vec<[f64; TERMS]> = times
        .iter()
        .map(|t| std::array::from_fn(|i| term(t, i)))
        .collect();
    for i in 0..TERMS {
        for j in (0..i).chain(0..i) {
            let along: f64 = q.iter().map(|row| row[i] * row[j]).sum();
            q.iter_mut().for_each(|row| row[i] -= along * row[j]);
        }
        let length = q.iter().map(|row| row[i] * row[i]).sum::<f64>().sqrt();
        let scale = if length > 1e-9 { 1.0 / length } else { 0.0 };
        q.iter_mut().for_each(|row| row[i] *= scale);
    }
    q
}

/// Residuals less the trend of each run (and coordinate).
fn without_trends(
    readings: &abbe_model::session::readings::Readings,
    residual: &[f64],
    kept: impl Fn(usize) -> bool,
) -> Vec<f64> {
    let coordinates = readings.coordinates;
    let mut level = residual.to_vec();
    if readings.run.is_empty() {
        return level;
    }
    for run in readings.runs() {
        let rows: Vec<usize> = run.filter(|row| kept(*row)).collect();
        if rows.len() <= POWERS {
            continue;
        }
        let times: Vec<f64> = rows.iter().map(|row| *row as f64).collect();
        let q = trend_terms(&times);
        for coordinate in 0..coordinates {
            let at = |row: usize| row * coordinates + coordinate;
            let along: [f64; TERMS] = std::array::from_fn(|i| {
                rows.iter()
                    .zip(&q)
                    .map(|(row, q)| residual[at(*row)] * q[i])
                    .sum()
            });
            for (row, q) in rows.iter().zip(&q) {
                level[at(*row)] -= along.iter().zip(q).map(|(a, q)| a * q).sum::<f64>();
            }
        }
    }
    level
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With the impulse response ψ of `x_t = Σ a_k x_{t−k} + e_t` the variance of x is that of e times `Σ ψ²`.
    #[test]
    fn what_a_reading_adds_is_what_the_impulse_response_says() {
        for memory in [vec![], vec![0.8], vec![1.1, -0.4], vec![0.5, 0.2, -0.3]] {
            let mut response = vec![1.0];
            for t in 1..2000 {
                let terms = memory.iter().enumerate().filter(|(k, _)| *k < t);
                response.push(terms.map(|(k, a)| a * response[t - 1 - k]).sum::<f64>());
            }
            let power: f64 = response.iter().map(|r| r * r).sum();
            let noise = Noise {
                memory,
                ..Noise::white(2.0, NoiseSource::Stated)
            };
            let innovation = noise.innovation_mm();
            assert!(
                (innovation - 2.0 / power.sqrt()).abs() < 1e-9,
                "{noise:?}: {innovation}"
            );
        }
    }

    #[test]
    fn a_trend_is_a_parabola_and_one_cycle_and_nothing_else() {
        let times: Vec<f64> = (0..60).map(|t| f64::from(t) * 1.5 + 7.0).collect();
        let q = trend_terms(&times);
        let left = |of: &dyn Fn(f64) -> f64| -> f64 {
            let values: Vec<f64> = times.iter().map(|t| of(*t)).collect();
            let along: [f64; TERMS] =
                std::array::from_fn(|i| values.iter().zip(&q).map(|(value, q)| value * q[i]).sum());
            let rest = values
                .iter()
                .zip(&q)
                .map(|(value, q)| value - along.iter().zip(q).map(|(a, q)| a * q).sum::<f64>());
            let (left, whole) = (
                rest.map(|r| r * r).sum::<f64>(),
                values.iter().map(|v| v * v).sum::<f64>(),
            );
            (left / whole).sqrt()
        };
        // One cycle from the first reading to the last.
        let angle = |t: f64| std::f64::consts::TAU * (t - 7.0) / 88.5;
        assert!(left(&|t| 3.0 - 0.2 * t + 0.01 * t * t) < 1e-12);
        assert!(left(&|t| (angle(t) + 0.7).cos()) < 1e-12);
        assert!(left(&|t| (4.0 * angle(t) + 0.7).cos()) > 0.9);
        // A run of few readings loses no cycle.
        let few = trend_terms(&times[..LEAST_RUN - 1]);
        assert!(few.iter().all(|terms| terms[POWERS..] == [0.0, 0.0]));
    }
}
