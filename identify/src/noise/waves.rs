//! What comes and goes from run to run: waves along a run that no memory explains.

use abbe_model::session::Test;
use statrs::function::gamma::gamma_ur;

use super::PureError;

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
