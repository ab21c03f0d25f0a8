//! How much of a reading is noise: its size and its memory.
//!
//! Readings at the same test, direction and position in repeated runs differ by noise alone (pure error: Box, Hunter & Hunter, Statistics for
//! Experimenters, ch. 10). What they differ by from their mean, rescaled by `√(R/(R−1))`, needs no model of the structure. A parabola a run is
//! taken out first, since slow drift and warming up are structure and would be taken for noise.

use std::collections::BTreeMap;

use abbe_model::session::Test;
use statrs::function::gamma::gamma_ur;

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
                let mut groups: BTreeMap<Vec<i64>, Vec<usize>> = BTreeMap::new();
                let directions = directions(readings);
                for row in (0..readings.rows()).filter(|row| kept(number, *row)) {
                    let mut key: Vec<i64> = readings
                        .positions
                        .iter()
                        // Positions agree to 0.1 µm or 10⁻⁶ rad.
                        .map(|column| (column[row] * 1e4).round() as i64)
                        .collect();
                    if !readings.run.is_empty() {
                        key.push(directions[row]);
                    }
                    groups.entry(key).or_default().push(row);
                }
                for rows in groups.values().filter(|rows| rows.len() > 1) {
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

/// Half cycles along a run of the waves that are looked for in deviations.
const WAVES: std::ops::RangeInclusive<usize> = 2..=40;
/// The most waves that are taken out.
const MOST_WAVES: usize = 6;
/// Probability that anything is taken out of noise that is as smooth as its memory says.
const WAVE_BY_CHANCE: f64 = 1e-4;
/// The fewest readings of a run whose waves are looked at.
const LEAST_RUN: usize = 24;

impl PureError {
    /// The same less waves along runs that no memory explains: what comes and goes from run to run is structure, and would be taken for noise. A wave is taken
    /// out where the periodogram of the whitened deviations, summed over runs, stands out.
    pub fn without_waves(mut self, tests: &[&Test], kept: impl Fn(usize, usize) -> bool) -> PureError {
        for _ in 0..MOST_WAVES {
            let Some(half_cycles) = self.wave(tests, &kept) else {
                break;
            };
            for (number, test) in tests.iter().enumerate() {
                let Some(readings) = &test.readings else { continue };
                for run in readings.runs().into_iter().filter(|run| run.len() >= LEAST_RUN) {
                    take_out(&mut self.deviations[number][run], half_cycles);
                }
            }
        }
        self
    }

    /// The half cycles of the wave that stands out most, if any does.
    fn wave(&self, tests: &[&Test], kept: &impl Fn(usize, usize) -> bool) -> Option<usize> {
        let memory = self.memory(tests, kept)?;
        let mut whitened: Vec<Vec<f64>> = Vec::new();
        for (number, test) in tests.iter().enumerate() {
            for run in test
                .readings
                .as_ref()?
                .runs()
                .into_iter()
                .filter(|run| run.len() >= LEAST_RUN)
            {
                let deviation = |row: usize| self.deviations[number][row].unwrap_or(0.0);
                let past = |row: usize| -> f64 {
                    let lags = memory.coefficients.iter().enumerate();
                    lags.filter(|(lag, _)| row > run.start + lag)
                        .map(|(lag, a)| a * deviation(row - lag - 1))
                        .sum()
                };
                whitened.push(run.clone().map(|row| deviation(row) - past(row)).collect());
            }
        }
        let count: usize = whitened.iter().map(Vec::len).sum();
        let power: f64 = whitened.iter().flatten().map(|value| value * value).sum();
        if count == 0 || power <= 0.0 {
            return None;
        }
        let variance = power / count as f64;
        // Repeats hold the same deviation more than once: so many of these runs are independent.
        let seen = self.deviations.iter().flatten().flatten().count().max(1);
        let independent = self.freedom as f64 / seen as f64;
        let ordinate = |run: &Vec<f64>, half_cycles: usize| {
            let step = std::f64::consts::PI * half_cycles as f64 / run.len() as f64;
            let (c, s) = run.iter().enumerate().fold((0.0, 0.0), |(c, s), (t, value)| {
                let (sin, cos) = (step * t as f64).sin_cos();
                (c + value * cos, s + value * sin)
            });
            (c * c + s * s) / (run.len() as f64 * variance)
        };
        let runs = whitened.len() as f64 * independent;
        let looks = WAVES.count() as f64;
        WAVES
            .map(|half_cycles| {
                let sum: f64 = whitened.iter().map(|run| ordinate(run, half_cycles)).sum();
                (half_cycles, sum * independent)
            })
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, sum)| gamma_ur(runs, *sum) < WAVE_BY_CHANCE / looks)
            .map(|(half_cycles, _)| half_cycles)
    }
}

/// Takes a wave of so many half cycles out of the deviations of a run, by least squares.
fn take_out(run: &mut [Option<f64>], half_cycles: usize) {
    let step = std::f64::consts::PI * half_cycles as f64 / run.len() as f64;
    let (mut cc, mut cs, mut ss, mut cy, mut sy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (t, value) in run.iter().enumerate() {
        if let Some(value) = value {
            let (s, c) = (step * t as f64).sin_cos();
            cc += c * c;
            cs += c * s;
            ss += s * s;
            cy += c * value;
            sy += s * value;
        }
    }
    let determinant = cc * ss - cs * cs;
    if determinant <= 1e-6 * cc * ss {
        return;
    }
    let (a, b) = (
        (ss * cy - cs * sy) / determinant,
        (cc * sy - cs * cy) / determinant,
    );
    for (t, value) in run.iter_mut().enumerate() {
        let (s, c) = (step * t as f64).sin_cos();
        if let Some(value) = value {
            *value -= a * c + b * s;
        }
    }
}

impl PureError {
    /// How the deviations remember each other along runs: autoregressive coefficients by Yule–Walker, of the least order up to three whose successor
    /// adds nothing. `None` without enough repeats to tell.
    ///
    /// The parabola that was taken out of every run took slow noise with it: with 0.8 between neighbours and a hundred readings a run, more than half of
    /// what is slow. Covariances are therefore corrected until noise of the found memory, treated alike, would show those that were seen (indirect inference:
    /// Gouriéroux, Monfort & Renault, J. Appl. Econometrics 8 (1993) S85).
    pub fn memory(&self, tests: &[&Test], kept: impl Fn(usize, usize) -> bool) -> Option<Memory> {
        let mut covariance = [0.0; MOST + 1];
        let mut pairs = [0_usize; MOST + 1];
        let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
        for (number, test) in tests.iter().enumerate() {
            let readings = test.readings.as_ref()?;
            if readings.coordinates != 1 {
                return None;
            }
            for run in readings.runs() {
                for lag in 0..=MOST {
                    for row in run.start + lag..run.end {
                        let both = self.deviations[number][row].zip(self.deviations[number][row - lag]);
                        if let Some((now, before)) = both
                            && kept(number, row)
                            && kept(number, row - lag)
                        {
                            covariance[lag] += now * before;
                            pairs[lag] += 1;
                        }
                    }
                }
                *lengths.entry(run.len()).or_default() += run.len();
            }
        }
        if pairs[MOST] < 100 || covariance[0] <= 0.0 {
            return None;
        }
        let seen: [f64; MOST + 1] = std::array::from_fn(|lag| covariance[lag] / pairs[lag] as f64);
        // Two repeats hold the same deviation twice; half the pairs are independent.
        let insignificant = 3.0 / (0.5 * pairs[0] as f64).sqrt();
        let (coefficients, variance) = without_trends_taken(&seen, insignificant, &lengths);
        // Bartlett's standard error of the correlation between neighbours, carried through the correction.
        let neighbours = seen[1] / seen[0];
        let u = SCATTER * ((1.0 - neighbours * neighbours).max(0.0) / self.freedom.max(1) as f64).sqrt();
        let mut slower = seen;
        slower[1..].iter_mut().for_each(|value| *value += u * seen[0]);
        let (of_slower, _) = without_trends_taken(&slower, insignificant, &lengths);
        let total = |coefficients: &[f64]| coefficients.iter().sum::<f64>();
        let sum_u = (total(&of_slower) - total(&coefficients)).abs();
        Some(Memory {
            sum_u: if coefficients.is_empty() { 0.0 } else { sum_u },
            coefficients,
            inflation: (variance / seen[0]).sqrt(),
        })
    }
}

/// Coefficients and variance of the noise whose deviations from trends have these autocovariances.
fn without_trends_taken(
    seen: &[f64; MOST + 1],
    insignificant: f64,
    lengths: &BTreeMap<usize, usize>,
) -> (Vec<f64>, f64) {
    let mut coefficients = autoregression(seen, insignificant);
    let mut variance = seen[0];
    for _ in 0..CORRECTIONS {
        let (process, shown) = with_trends_out(&coefficients, lengths);
        variance = seen[0] / shown[0];
        let corrected = std::array::from_fn(|lag| seen[lag] + variance * (process[lag] - shown[lag]));
        coefficients = autoregression(&corrected, insignificant);
    }
    (coefficients, variance)
}

/// The highest order of a memory.
const MOST: usize = 3;
const CORRECTIONS: usize = 8;
/// By how much memories scatter beyond Bartlett's formula, for trends that were taken out and orders that were chosen: 0.035 was seen over 79 simulated
/// sessions of memory 0.8.
const SCATTER: f64 = 1.4;
/// Runs longer than this lose next to nothing with a parabola.
const LONG: usize = 600;

/// How readings remember each other along runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory {
    /// Autoregressive coefficients; empty where readings are as good as white.
    pub coefficients: Vec<f64>,
    /// Standard uncertainty of their sum.
    pub sum_u: f64,
    /// By how much the noise is larger than its deviations from parabolas show.
    pub inflation: f64,
}

/// Coefficients from autocovariances (Durbin–Levinson); the last coefficient of each order is its partial autocorrelation.
fn autoregression(covariance: &[f64; MOST + 1], insignificant: f64) -> Vec<f64> {
    let correlation = covariance.map(|value| value / covariance[0]);
    let mut coefficients: Vec<f64> = Vec::new();
    let mut accepted = Vec::new();
    let mut left = 1.0;
    for order in 1..=MOST {
        let predicted: f64 = coefficients
            .iter()
            .enumerate()
            .map(|(k, a)| a * correlation[order - 1 - k])
            .sum();
        let partial = ((correlation[order] - predicted) / left).clamp(-0.99, 0.99);
        let previous = coefficients.clone();
        for k in 0..previous.len() {
            coefficients[k] = previous[k] - partial * previous[previous.len() - 1 - k];
        }
        coefficients.push(partial);
        left *= 1.0 - partial * partial;
        if partial.abs() > insignificant {
            accepted = coefficients.clone();
        }
    }
    accepted
}

/// Autocorrelations of a process, and what is seen of them once a parabola is taken out of runs of these lengths (and how many readings are in
/// runs of each).
fn with_trends_out(
    coefficients: &[f64],
    lengths: &BTreeMap<usize, usize>,
) -> ([f64; MOST + 1], [f64; MOST + 1]) {
    let longest = lengths
        .keys()
        .copied()
        .filter(|n| *n <= LONG)
        .max()
        .unwrap_or(0)
        .max(MOST + 1);
    // Impulse response, long enough for any memory that is not a drift.
    let mut response = vec![0.0; longest + 2000];
    response[0] = 1.0;
    for t in 1..response.len() {
        response[t] = coefficients
            .iter()
            .enumerate()
            .filter(|(k, _)| *k < t)
            .map(|(k, a)| a * response[t - 1 - k])
            .sum();
    }
    let power: f64 = response.iter().map(|r| r * r).sum();
    let correlation: Vec<f64> = (0..longest)
        .map(|lag| {
            response[lag..]
                .iter()
                .zip(&response)
                .map(|(a, b)| a * b)
                .sum::<f64>()
                / power
        })
        .collect();
    let process = std::array::from_fn(|lag| correlation[lag]);
    let mut shown = [0.0; MOST + 1];
    let mut total = 0.0;
    for (&n, &readings) in lengths {
        let weight = readings as f64;
        total += weight;
        if !(MOST + 3..=LONG).contains(&n) {
            (0..=MOST).for_each(|lag| shown[lag] += weight * process[lag]);
            continue;
        }
        // d = e − Q Qᵀe with orthonormal polynomials Q, so Cov d = Γ − Q(QᵀΓ) − (ΓQ)Qᵀ + Q(QᵀΓQ)Qᵀ.
        let times: Vec<f64> = (0..n).map(|t| t as f64).collect();
        let q = polynomials(&times);
        let gq: Vec<[f64; TERMS]> = (0..n)
            .map(|t| {
                let along = |i: usize| (0..n).map(|s| correlation[t.abs_diff(s)] * q[s][i]).sum();
                std::array::from_fn(along)
            })
            .collect();
        let qgq: [[f64; TERMS]; TERMS] =
            std::array::from_fn(|i| std::array::from_fn(|j| (0..n).map(|t| q[t][i] * gq[t][j]).sum()));
        for lag in 0..=MOST {
            let sum: f64 = (lag..n)
                .map(|t| {
                    let s = t - lag;
                    let mut value = correlation[lag];
                    for i in 0..TERMS {
                        value -= q[t][i] * gq[s][i] + gq[t][i] * q[s][i];
                        for j in 0..TERMS {
                            value += q[t][i] * qgq[i][j] * q[s][j];
                        }
                    }
                    value
                })
                .sum();
            shown[lag] += weight * sum / (n - lag) as f64;
        }
    }
    (process, shown.map(|value| value / total))
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

/// Coefficients of the trend that is taken out of a run: constant, slope, curvature.
const TERMS: usize = 3;

/// Polynomials in time that are orthonormal over given times (Gram–Schmidt, twice); those that the times are too few for are zero.
fn polynomials(times: &[f64]) -> Vec<[f64; TERMS]> {
    let n = times.len() as f64;
    let middle = times.iter().sum::<f64>() / n;
    let half = times
        .iter()
        .map(|t| (t - middle).abs())
        .fold(f64::MIN_POSITIVE, f64::max);
    let mut q: Vec<[f64; TERMS]> = times
        .iter()
        .map(|t| std::array::from_fn(|power| ((t - middle) / half).powi(power as i32)))
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

/// Residuals less a parabola a run (and coordinate).
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
        if rows.len() <= TERMS {
            continue;
        }
        let times: Vec<f64> = rows.iter().map(|row| *row as f64).collect();
        let q = polynomials(&times);
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
