//! How much of a reading is noise: its size and its memory.
//!
//! Readings at the same test, direction and position in repeated runs differ by noise alone (pure error: Box, Hunter & Hunter, Statistics for
//! Experimenters, ch. 10). What they differ by from their mean, rescaled by `√(R/(R−1))`, needs no model of the structure. A straight line a run is
//! taken out first, since slow drift is structure and would be taken for noise.

use std::collections::BTreeMap;

use abbe_model::session::Test;

/// The noise of one scalar reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation, mm.
    pub sigma_mm: f64,
    /// Autoregressive coefficients along a run; empty for white noise.
    pub memory: Vec<f64>,
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
                let level = without_run_lines(readings, residual, |row| kept(number, row));
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

impl PureError {
    /// How the deviations remember each other along runs: autoregressive coefficients by Yule–Walker, of the least order up to three whose successor
    /// adds nothing. `None` without enough repeats to tell.
    ///
    /// The line that was taken out of every run took slow noise with it: with 0.8 between neighbours and a hundred readings a run, half of what is
    /// slow. Covariances are therefore corrected until noise of the found memory, treated alike, would show those that were seen (indirect inference:
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
        let mut coefficients = autoregression(&seen, insignificant);
        let mut variance = seen[0];
        for _ in 0..CORRECTIONS {
            let (process, shown) = with_lines_out(&coefficients, &lengths);
            variance = seen[0] / shown[0];
            let corrected = std::array::from_fn(|lag| seen[lag] + variance * (process[lag] - shown[lag]));
            coefficients = autoregression(&corrected, insignificant);
        }
        Some(Memory {
            coefficients,
            inflation: (variance / seen[0]).sqrt(),
        })
    }
}

/// The highest order of a memory.
const MOST: usize = 3;
const CORRECTIONS: usize = 8;
/// Runs longer than this lose next to nothing with a line.
const LONG: usize = 600;

/// How readings remember each other along runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory {
    /// Autoregressive coefficients; empty where readings are as good as white.
    pub coefficients: Vec<f64>,
    /// By how much the noise is larger than its deviations from lines show.
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

/// Autocorrelations of a process, and what is seen of them once a straight line is taken out of runs of these lengths (and how many readings are in
/// runs of each).
fn with_lines_out(
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
        // Orthonormal constant and slope; d = e − Q Qᵀe, so Cov d = Γ − Q(QᵀΓ) − (ΓQ)Qᵀ + Q(QᵀΓQ)Qᵀ.
        let middle = (n as f64 - 1.0) / 2.0;
        let slope = (0..n).map(|t| (t as f64 - middle).powi(2)).sum::<f64>().sqrt();
        let q = |t: usize| [1.0 / (n as f64).sqrt(), (t as f64 - middle) / slope];
        let gq: Vec<[f64; 2]> = (0..n)
            .map(|t| {
                (0..n).fold([0.0; 2], |sum, s| {
                    let c = correlation[t.abs_diff(s)];
                    [sum[0] + c * q(s)[0], sum[1] + c * q(s)[1]]
                })
            })
            .collect();
        let mut qgq = [[0.0; 2]; 2];
        for t in 0..n {
            for i in 0..2 {
                for j in 0..2 {
                    qgq[i][j] += q(t)[i] * gq[t][j];
                }
            }
        }
        for lag in 0..=MOST {
            let sum: f64 = (lag..n)
                .map(|t| {
                    let s = t - lag;
                    let mut value = correlation[lag];
                    for i in 0..2 {
                        value -= q(t)[i] * gq[s][i] + gq[t][i] * q(s)[i];
                        for j in 0..2 {
                            value += q(t)[i] * qgq[i][j] * q(s)[j];
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

/// Residuals less a straight line a run (and coordinate).
fn without_run_lines(
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
        for coordinate in 0..coordinates {
            let (mut n, mut st, mut sx, mut stt, mut stx) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for row in run.clone().filter(|row| kept(*row)) {
                let (t, x) = ((row - run.start) as f64, residual[row * coordinates + coordinate]);
                n += 1.0;
                st += t;
                sx += x;
                stt += t * t;
                stx += t * x;
            }
            let determinant = n * stt - st * st;
            if n < 3.0 || determinant <= 0.0 {
                continue;
            }
            let slope = (n * stx - st * sx) / determinant;
            let intercept = (sx - slope * st) / n;
            for row in run.clone() {
                level[row * coordinates + coordinate] -= intercept + slope * (row - run.start) as f64;
            }
        }
    }
    level
}
