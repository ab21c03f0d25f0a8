//! Noise of the readings: standard deviation and autocorrelation.
//!
//! Readings at the same test, direction and position in repeated runs differ by noise alone (pure error: Box, Hunter &
//! Hunter, Statistics for Experimenters, ch. 10). Their deviations from their mean do not depend on a model. Every run
//! is first detrended. Drift and warm-up are structure that would count as slow noise, and a ball that moves between
//! two runs adds one cycle per turn. A long run loses a parabola and one cycle, a short run fewer terms.
//!
//! Means and trends use degrees of freedom. Let `P` be the projector that removes the trends of the runs, and `M` the
//! projector that removes the means of the groups of repeats. The deviations of noise of variance σ² have the expected
//! sum of squares `σ²·tr(M·P)`. Their sum of squares is therefore divided by that trace, not by the number of
//! deviations.

mod autocorrelation;
mod flange;
pub mod outliers;
mod restricted;
mod stated;
pub mod trends;
mod waves;

use abbe_model::document::value::Positive;
use abbe_model::session::Test;
use abbe_model::session::readings::Readings;
use abbe_model::unit::{Unit, reading};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(crate) use autocorrelation::autocorrelated;
pub(crate) use autocorrelation::enlargement_of_mean;
pub use autocorrelation::{Autocorrelation, Process, along_runs};
pub(crate) use stated::silent_channels;
pub use stated::{rigid_targets, stated_against_repeats};
use trends::Trends;
pub use waves::AlongRuns;

use crate::numerics::parallel;

/// The noise of one scalar reading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ModelNoise")]
pub struct Noise {
    /// Standard deviation, mm.
    #[serde(rename = "noise_um", with = "micrometres")]
    #[schemars(with = "Positive", description = "Standard deviation, µm.")]
    pub sigma_mm: f64,
    /// Where it comes from.
    pub source: NoiseSource,
    /// Autoregressive coefficients along a run.
    // They are empty for white noise.
    pub ar_coefficients: Vec<f64>,
    /// Standard uncertainty of their sum.
    // The sum determines how slow the noise is, and thus the uncertainty of its slow part.
    pub ar_sum_u: f64,
    /// Factor on the variance of a reading in the likelihood of families of effects; 1 without families.
    // It exceeds 1 if the misfit of neighbouring readings is correlated, so that they carry less information than
    // independent readings ([`crate::fit`]: families).
    pub inflation: f64,
}

/// A standard deviation in mm, which files state in µm.
mod micrometres {
    use abbe_model::document::value::Positive;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(mm: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        (mm * 1e3).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Positive::deserialize(deserializer).map(|Positive(um)| um * 1e-3)
    }
}

/// Source of a noise standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NoiseSource {
    /// Stated in the session.
    Stated,
    /// Assumed, because neither the session nor readings determine it.
    Assumed,
    /// Repeated readings (pure error).
    Repeats,
    /// Distances between several targets at each pose, which the pose does not change.
    Targets,
    /// The residual of the model: noise and unmodelled effects.
    #[default]
    Residual,
    /// The saved model that a session is compared with.
    Model,
}

impl NoiseSource {
    /// The name in results.
    pub fn word(self) -> &'static str {
        match self {
            NoiseSource::Stated => "stated",
            NoiseSource::Assumed => "assumed",
            NoiseSource::Repeats => "repeats",
            NoiseSource::Targets => "targets",
            NoiseSource::Residual => "residual",
            NoiseSource::Model => "model",
        }
    }

    /// Whether the noise is known without the residual, so that the residual can be judged by it.
    pub fn judges(self) -> bool {
        matches!(self, NoiseSource::Stated | NoiseSource::Repeats | NoiseSource::Targets | NoiseSource::Model)
    }
}

impl std::fmt::Display for NoiseSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())
    }
}

/// The noise of one scalar reading, as JSON has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReadingNoise {
    /// `arcsec` if all readings are angles, in which the keys of figures then end; absent for µm.
    #[serde(rename = "reading_unit", default, skip_serializing_if = "Unit::is_micrometre")]
    #[serde(deserialize_with = "reading::deserialize")]
    #[schemars(schema_with = "reading::schema")]
    pub unit: Unit,
    /// Standard deviation of one scalar reading, µm.
    #[serde(rename = "noise_um")]
    pub value: f64,
    /// Source of `noise_um`: `stated`, `repeats` (repeated readings), `targets` (several targets at each pose), `residual`
    /// (noise and what the model lacks), `assumed`, or of a validation `model`: that of the model's readings.
    #[serde(rename = "noise_source")]
    pub source: NoiseSource,
}

impl Noise {
    /// White noise.
    pub fn white(sigma_mm: f64, source: NoiseSource) -> Noise {
        Noise { sigma_mm, ar_coefficients: Vec::new(), ar_sum_u: 0.0, source, inflation: 1.0 }
    }

    /// Standard deviation that the likelihood assigns to a reading, mm.
    pub fn likelihood_mm(&self) -> f64 {
        self.sigma_mm * self.inflation.sqrt()
    }

    /// Standard deviation of the innovation, mm: the part of a reading that earlier readings of its run do not predict.
    pub fn innovation_mm(&self) -> f64 {
        // The innovation variance is γ0 Π(1 − κ²) with the reflection coefficients κ, from the Durbin–Levinson
        // recursion run backwards.
        let mut variance_ratio = 1.0;
        let mut coefficients = self.ar_coefficients.clone();
        while let Some(reflection) = coefficients.last().copied() {
            let bound = 1.0 - reflection * reflection;
            variance_ratio *= bound;
            let n = coefficients.len();
            coefficients =
                (0..n - 1).map(|k| (coefficients[k] + reflection * coefficients[n - 2 - k]) / bound).collect();
        }
        self.sigma_mm * variance_ratio.max(0.0).sqrt()
    }
}

/// A noise that the readings show without a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownNoise {
    /// Standard deviation, mm.
    pub sigma_mm: f64,
    /// Degrees of freedom.
    pub freedom: usize,
    /// Repeats or targets.
    pub source: NoiseSource,
}

impl ShownNoise {
    /// From repeats; without enough of them, from several targets at each pose. `residuals` are those of any model, mm.
    pub fn of(
        tests: &[Test],
        residuals: &[Vec<f64>],
        kept: impl Fn(usize, usize) -> bool + Sync,
    ) -> Option<ShownNoise> {
        ShownNoise::beside(PureError::of(tests, residuals, &kept).repeatability(), tests, kept)
    }

    /// From known repeats; without enough of them, from several targets at each pose.
    pub(crate) fn beside(
        repeats: Repeatability,
        tests: &[Test],
        kept: impl Fn(usize, usize) -> bool + Sync,
    ) -> Option<ShownNoise> {
        if let Some(sigma_mm) = repeats.sigma_mm {
            return Some(ShownNoise { sigma_mm, freedom: repeats.freedom, source: NoiseSource::Repeats });
        }
        let (sigma_mm, freedom) = flange::noise_of_targets(tests, kept)?;
        // Targets that keep their distances exactly were solved as one body: they show no noise.
        (sigma_mm > RIGID_MM).then_some(ShownNoise { sigma_mm, freedom, source: NoiseSource::Targets })
    }
}

/// The noise that repeats show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeatability {
    /// Standard deviation, mm, if there are at least ten degrees of freedom.
    pub sigma_mm: Option<f64>,
    /// Degrees of freedom.
    pub freedom: usize,
}

/// Noise of targets below which their instrument has solved them as one rigid body: no instrument reads places in space to
/// 0.05 µm.
const RIGID_MM: f64 = 5e-5;

/// Pure error: residuals (rows × channels, mm) without the trend of their run and their mean over repeats, rescaled
/// for the variance that these remove. `None` for readings without repeats.
pub struct PureError {
    /// For each test, one value per scalar reading. The expected mean square within a test is the variance of white
    /// noise.
    pub deviations: Vec<Vec<Option<f64>>>,
    /// Degrees of freedom after means and trends, rounded down.
    pub freedom: usize,
    /// Degrees of freedom of each test.
    freedom_of_tests: Vec<f64>,
    /// For each test, the factor on its deviations for the removed trends.
    rescaling_of_tests: Vec<f64>,
}

impl PureError {
    /// From the residuals of any model. A model error that is equal in all repeats cancels. `kept(test, row)` is false
    /// for outliers.
    pub fn of(tests: &[Test], residuals: &[Vec<f64>], kept: impl Fn(usize, usize) -> bool + Sync) -> PureError {
        let readings: Vec<Option<&Readings>> = tests.iter().map(|test| test.readings.as_deref()).collect();
        PureError::of_readings(&readings, residuals, kept)
    }

    fn of_readings(
        tests: &[Option<&Readings>],
        residuals: &[Vec<f64>],
        kept: impl Fn(usize, usize) -> bool + Sync,
    ) -> PureError {
        let of_tests = parallel::map(tests.len().min(residuals.len()), &|number| {
            let residual = &residuals[number];
            let (mut deviation, mut freedom, mut enlarged) = (vec![None; residual.len()], 0.0, 1.0);
            if let Some(readings) = tests[number] {
                (freedom, enlarged) = deviations(readings, residual, |row| kept(number, row), &mut deviation);
            }
            (deviation, freedom, enlarged)
        });
        let mut pure = PureError {
            deviations: Vec::new(),
            freedom: 0,
            freedom_of_tests: Vec::new(),
            rescaling_of_tests: Vec::new(),
        };
        for (deviation, freedom, enlarged) in of_tests {
            pure.deviations.push(deviation);
            pure.freedom_of_tests.push(freedom);
            pure.rescaling_of_tests.push(enlarged);
        }
        pure.count();
        pure
    }

    /// The factor on the deviations of a test for the removed trends.
    pub fn rescaling(&self, test: usize) -> f64 {
        self.rescaling_of_tests[test]
    }

    fn count(&mut self) {
        // The small term keeps rounding of a trace from costing a degree of freedom.
        self.freedom = (self.freedom_of_tests.iter().sum::<f64>() + 1e-6).floor() as usize;
    }

    /// Its standard deviation and degrees of freedom.
    pub fn repeatability(&self) -> Repeatability {
        Repeatability { sigma_mm: self.sigma_mm(), freedom: self.freedom }
    }

    /// The standard deviation, mm, if there are at least ten degrees of freedom.
    pub fn sigma_mm(&self) -> Option<f64> {
        let (mut sum, mut freedom) = (0.0, 0.0);
        for (deviations, of_test) in self.deviations.iter().zip(&self.freedom_of_tests) {
            let values = deviations.iter().flatten();
            let (squares, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value * value, count + 1));
            if count > 0 {
                sum += of_test * squares / count as f64;
                freedom += of_test;
            }
        }
        (self.freedom >= 10).then(|| (sum / freedom).sqrt())
    }
}

/// Writes the deviations of a test's repeats. Returns their degrees of freedom, and their rescaling factor for the
/// trends. There are no deviations if the trends remove nearly all variance.
fn deviations(
    readings: &Readings,
    residual: &[f64],
    kept: impl Fn(usize) -> bool,
    deviation: &mut [Option<f64>],
) -> (f64, f64) {
    let channels = readings.channels;
    let keys = RepeatKeys::of(readings);
    // Channels that were read in the same rows are treated together.
    let together = match readings.observed.iter().any(|value| value.is_nan()) {
        true => 1,
        false => channels,
    };
    // Over one channel: the trace, the expected sum of squares of deviations rescaled for the means alone, and their
    // number.
    let (mut freedom, mut expected, mut count) = (0.0, 0.0, 0_usize);
    for first in (0..channels).step_by(together.max(1)) {
        let present = |row: usize| kept(row) && readings.was_read(row, first);
        let trends = Trends::of(readings, present);
        let level = trends.detrend(residual, channels);
        let mut order: Vec<usize> = (0..readings.rows()).filter(|row| present(*row)).collect();
        order.sort_by(|a, b| keys.of_row(*a).cmp(keys.of_row(*b)));
        for rows in order.chunk_by(|a, b| keys.of_row(*a) == keys.of_row(*b)).filter(|rows| rows.len() > 1) {
            let repeats = rows.len() as f64;
            let square = repeats / (repeats - 1.0);
            let of_group = trends.freedom_of(rows);
            freedom += of_group;
            expected += of_group * square;
            count += rows.len();
            for channel in first..first + together {
                let at = |row: &usize| level[row * channels + channel];
                let mean = rows.iter().map(at).sum::<f64>() / repeats;
                for row in rows {
                    deviation[row * channels + channel] = Some((at(row) - mean) * square.sqrt());
                }
            }
        }
    }
    if expected < MIN_VARIANCE_SHARE * count as f64 {
        deviation.fill(None);
        return (0.0, 1.0);
    }
    let enlarged = (count as f64 / expected).sqrt();
    deviation.iter_mut().flatten().for_each(|value| *value *= enlarged);
    (freedom * together as f64, enlarged)
}

/// Least share of the variance that the trends must leave.
const MIN_VARIANCE_SHARE: f64 = 0.05;

/// Positions agree to 0.1 µm or 10⁻⁴ rad: positions per mm or rad.
const POSITIONS: f64 = 1e4;
/// Number of these positions on the way of a run from which its steps are no jitter of an axis at rest.
const MIN_WAY: f64 = 100.0;

/// The positions of an axis as integers.
#[derive(Clone, Copy)]
struct Grid {
    origin: f64,
    /// Positions per mm or rad.
    density: f64,
}

impl Grid {
    const COARSE: Grid = Grid { origin: 0.0, density: POSITIONS };

    /// In runs of finer steps neighbouring readings would be repeats of each other, whose deviations from their mean are
    /// correlated. There positions that differ by less than a step are one.
    fn of(readings: &Readings, positions: &[f64]) -> Grid {
        let runs = readings.runs().into_iter().filter(|run| run.len() > 1);
        let ways = runs.map(|run| ((positions[run.end - 1] - positions[run.start]).abs(), (run.len() - 1) as f64));
        let densities = ways.filter(|(way, _)| way * POSITIONS > MIN_WAY).map(|(way, count)| count / way);
        let density = densities.fold(POSITIONS, f64::max);
        if density > POSITIONS { Grid { origin: positions[0], density } } else { Grid::COARSE }
    }

    fn key(self, position: f64) -> i64 {
        ((position - self.origin) * self.density).round() as i64
    }
}

/// The position of a reading as integers that are equal for repeats: axis positions and directions of travel, without
/// those that are equal in all rows.
struct RepeatKeys {
    columns: usize,
    keys: Vec<i64>,
}

impl RepeatKeys {
    /// Of readings that are compared within their test.
    fn of(readings: &Readings) -> RepeatKeys {
        // The comparison of the positions themselves spares most of the rounding.
        let key = |position: f64| Grid::COARSE.key(position);
        let differs = |column: &&Vec<f64>| {
            column.iter().any(|position| *position != column[0] && key(*position) != key(column[0]))
        };
        let moving = readings.positions.iter().filter(differs).map(|column| (column, Grid::of(readings, column)));
        RepeatKeys::of_axes(readings, moving.collect())
    }

    /// Of readings that are compared with those of other tests: axes that are equal in all rows of one test count too.
    fn between_tests(readings: &Readings) -> RepeatKeys {
        RepeatKeys::of_axes(readings, readings.positions.iter().map(|column| (column, Grid::COARSE)).collect())
    }

    fn of_axes(readings: &Readings, moving: Vec<(&Vec<f64>, Grid)>) -> RepeatKeys {
        let directions = if readings.run.is_empty() { Vec::new() } else { directions(readings) };
        let has_directions = directions.iter().any(|direction| *direction != directions[0]);
        let columns = moving.len() + usize::from(has_directions);
        let mut keys = vec![0; readings.rows() * columns];
        for (number, (positions, grid)) in moving.iter().enumerate() {
            let keys = keys.iter_mut().skip(number).step_by(columns);
            keys.zip(*positions).for_each(|(to, position)| *to = grid.key(*position));
        }
        if has_directions {
            keys.iter_mut().skip(moving.len()).step_by(columns).zip(&directions).for_each(|(to, code)| *to = *code);
        }
        RepeatKeys { columns, keys }
    }

    fn of_row(&self, row: usize) -> &[i64] {
        &self.keys[row * self.columns..(row + 1) * self.columns]
    }
}

/// The direction of travel of every axis, one number per row.
fn directions(readings: &Readings) -> Vec<i64> {
    let mut code = vec![0_i64; readings.rows()];
    for (axis, positions) in readings.positions.iter().enumerate() {
        // An axis at rest has one direction in all rows.
        let is_whole = readings.travel_before.is_empty() && readings.row_after.is_none();
        if is_whole && positions.iter().all(|position| *position == positions[0]) {
            continue;
        }
        let samples = readings.axis_samples(axis, abbe_model::axis::AxisKind::Rotary);
        for (code, sample) in code.iter_mut().zip(samples) {
            *code = *code * 3 + sample.direction as i64 + 1;
        }
    }
    code
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use super::trends::TERMS;
    use super::*;

    /// With the impulse response ψ of `x_t = Σ a_k x_{t−k} + e_t`, the variance of x is that of e times `Σ ψ²`.
    #[test]
    fn innovation_follows_from_the_impulse_response() {
        for ar_coefficients in [vec![], vec![0.8], vec![1.1, -0.4], vec![0.5, 0.2, -0.3]] {
            let mut response = vec![1.0];
            for t in 1..2000 {
                let terms = ar_coefficients.iter().enumerate().filter(|(k, _)| *k < t);
                response.push(terms.map(|(k, a)| a * response[t - 1 - k]).sum::<f64>());
            }
            let power: f64 = response.iter().map(|r| r * r).sum();
            let noise = Noise { ar_coefficients, ..Noise::white(2.0, NoiseSource::Stated) };
            let innovation = noise.innovation_mm();
            assert!((innovation - 2.0 / power.sqrt()).abs() < 1e-9, "{noise:?}: {innovation}");
        }
    }

    /// A test of consecutive runs over the same positions.
    fn repeated(places: usize, runs: usize) -> Readings {
        let rows = || (0..runs).flat_map(|run| (0..places).map(move |place| (run, place)));
        Readings {
            run: rows().map(|(run, _)| run as i64).collect(),
            positions: vec![rows().map(|(_, place)| 0.1 * place as f64).collect()],
            channels: 1,
            ..Readings::default()
        }
    }

    /// Number of simulated sessions, from `ABBE_STUDY`.
    fn sessions() -> usize {
        let stated = std::env::var("ABBE_STUDY").ok().and_then(|text| text.parse().ok());
        stated.filter(|count| *count > 1).unwrap_or(200)
    }

    /// White noise of 0.5 µm over structure, and over runs with different ball positions. The mean of σ² over many
    /// sessions is the true one. The scatter of σ² is that of χ² with the remaining degrees of freedom,
    /// `(R − 1)(n − K)` for a test of R runs of n readings which lose K terms each.
    #[test]
    fn pure_error_is_unbiased_for_short_and_long_runs() {
        const SIGMA: f64 = 0.5e-3;
        const TESTS: usize = 4;
        let sessions = sessions();
        let mut generator = rand_pcg::Pcg64::seed_from_u64(19);
        for (places, terms) in [(9_usize, 1), (13, 2), (37, 5), (100, 5)] {
            for runs in [2_usize, 3, 6] {
                let readings = repeated(places, runs);
                let tests = [Some(&readings); TESTS];
                let freedom = TESTS * (runs - 1) * (places - terms);
                let (mut sum, mut squares) = (0.0, 0.0);
                for _ in 0..sessions {
                    let residuals: Vec<Vec<f64>> = (0..TESTS)
                        .map(|_| {
                            let offsets: Vec<f64> = (0..runs).map(|_| generator.sample(StandardNormal)).collect();
                            (0..runs * places)
                                .map(|row| {
                                    let noise: f64 = generator.sample(StandardNormal);
                                    let structure = (1.0 + (row % places) as f64).ln();
                                    SIGMA * (noise + 3.0 * structure + 5.0 * offsets[row / places])
                                })
                                .collect()
                        })
                        .collect();
                    let pure = PureError::of_readings(&tests, &residuals, |_, _| true);
                    assert_eq!(pure.freedom, freedom);
                    let variance = (pure.sigma_mm().unwrap() / SIGMA).powi(2);
                    sum += variance;
                    squares += variance * variance;
                }
                let (count, freedom) = (sessions as f64, freedom as f64);
                let mean = sum / count;
                let scatter = (squares / count - mean * mean) * count / (count - 1.0);
                let expected = 2.0 / freedom;
                println!(
                    "{places} readings, {runs} runs: σ² {mean:.4} ± {:.4} of the true one",
                    (scatter / count).sqrt()
                );
                assert!((mean - 1.0).abs() < 4.0 * (expected / count).sqrt(), "{places} readings, {runs} runs: {mean}");
                assert!(
                    (scatter / expected - 1.0).abs() < 5.0 * (2.0 / count + 12.0 / (freedom * count)).sqrt(),
                    "{places} readings, {runs} runs: {scatter} instead of {expected}"
                );
            }
        }
    }

    /// Two runs in steps of 20 µrad: the neighbours of a reading are no repeats of it, so that each place has one degree of
    /// freedom, less those of the trend.
    #[test]
    fn neighbours_in_fine_steps_are_no_repeats() {
        const PLACES: usize = 5000;
        let readings = repeated(PLACES, 2);
        let fine = readings.positions[0].iter().map(|position| 2e-4 * position + 0.3).collect();
        let readings = Readings { positions: vec![fine], ..readings };
        let residuals = vec![(0..2 * PLACES).map(|row| (row as f64).sin()).collect::<Vec<f64>>()];
        assert_eq!(PureError::of_readings(&[Some(&readings)], &residuals, |_, _| true).freedom, PLACES - TERMS);
    }

    /// The degrees of freedom against the trace of the explicit product of both projectors, in a case where they do not
    /// commute: one run visits its positions three times, another once, and some readings are excluded.
    #[test]
    fn degrees_of_freedom_are_the_trace_of_both_projectors() {
        let places: Vec<usize> = (0..36).map(|row| row % 12).chain(0..12).collect();
        let readings = Readings {
            run: (0..48).map(|row| i64::from(row >= 36)).collect(),
            positions: vec![places.iter().map(|place| (*place as f64).sin()).collect()],
            channels: 1,
            ..Readings::default()
        };
        let kept = |row: usize| row % 11 != 5;
        let directions = directions(&readings);
        let rows: Vec<usize> = (0..48).filter(|row| kept(*row)).collect();
        let group = |row: usize| (places[row], directions[row]);
        let (mut means, mut trends) = (faer::Mat::<f64>::identity(48, 48), faer::Mat::<f64>::identity(48, 48));
        for run in [0..36_usize, 36..48] {
            let of_run: Vec<usize> = run.filter(|row| kept(*row)).collect();
            let times: Vec<f64> = of_run.iter().map(|row| *row as f64).collect();
            let q = trends::trend_terms(&times);
            for (t, a) in of_run.iter().zip(&q) {
                for (s, b) in of_run.iter().zip(&q) {
                    trends[(*t, *s)] -= a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        for t in 0..48 {
            let repeats: Vec<usize> = rows.iter().copied().filter(|s| group(*s) == group(t)).collect();
            if kept(t) && repeats.len() > 1 {
                repeats.iter().for_each(|s| means[(t, *s)] -= 1.0 / repeats.len() as f64);
            } else {
                means[(t, t)] = 0.0;
            }
        }
        let product = means * trends;
        let wanted: f64 = (0..48).map(|t| product[(t, t)]).sum();
        let mut deviation = vec![None; 48];
        let (freedom, _) = deviations(&readings, &[0.0; 48], kept, &mut deviation);
        assert!((freedom - wanted).abs() < 1e-9, "{freedom} {wanted}");
    }
}
