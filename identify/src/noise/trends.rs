//! The trend that is removed from every run before repeats are compared.

use std::collections::BTreeMap;
use std::ops::Range;

use abbe_model::session::readings::Readings;

/// Terms of the trend of a long run: constant, slope, curvature, and sine and cosine of one cycle over the run.
pub const TERMS: usize = 5;
/// Number of powers of time among the terms.
const POWERS: usize = 3;
/// Least number of readings of a run for the cycle and for the search for waves.
pub(super) const MIN_RUN: usize = 24;
/// Readings per power: shorter runs lose fewer powers.
const READINGS_PER_POWER: usize = 5;
/// Least number of readings of a run that loses its mean.
const MIN_TREND: usize = 4;

/// Number of powers of time for a run of so many readings: 1 from 4 readings on, 2 from 10, 3 from 15.
fn powers(readings: usize) -> usize {
    match readings {
        0..MIN_TREND => 0,
        _ => (readings / READINGS_PER_POWER).clamp(1, POWERS),
    }
}

/// The terms of a trend, orthonormal over the given times. Terms that need more times are zero.
pub fn trend_terms(times: &[f64]) -> Vec<[f64; TERMS]> {
    let n = times.len() as f64;
    let powers = powers(times.len());
    let middle = times.iter().sum::<f64>() / n;
    let half = times.iter().map(|t| (t - middle).abs()).fold(f64::MIN_POSITIVE, f64::max);
    let has_cycle = times.len() >= MIN_RUN;
    let terms = |t: &f64| -> [f64; TERMS] {
        let time = (t - middle) / half;
        let (sin, cos) = if has_cycle { (std::f64::consts::PI * time).sin_cos() } else { (0.0, 0.0) };
        std::array::from_fn(|i| match i {
            0..POWERS if i < powers => time.powi(i as i32),
            0..POWERS => 0.0,
            POWERS => cos,
            _ => sin,
        })
    };
    let mut q: Vec<[f64; TERMS]> = times.iter().map(terms).collect();
    orthonormalise(&mut q);
    q
}

/// Makes the terms orthonormal (Gram–Schmidt, twice). A term that depends on those before it becomes zero.
pub(super) fn orthonormalise(q: &mut [[f64; TERMS]]) {
    for i in 0..TERMS {
        for j in (0..i).chain(0..i) {
            let along: f64 = q.iter().map(|row| row[i] * row[j]).sum();
            q.iter_mut().for_each(|row| row[i] -= along * row[j]);
        }
        let length = q.iter().map(|row| row[i] * row[i]).sum::<f64>().sqrt();
        let scale = if length > 1e-9 { 1.0 / length } else { 0.0 };
        q.iter_mut().for_each(|row| row[i] *= scale);
    }
}

/// The terms of the trend of a run, one row per reading; zero for excluded rows.
type Terms = Vec<[f64; TERMS]>;

/// The trends of the runs of a test.
pub struct Trends {
    /// The rows of each run, in order.
    runs: Vec<Range<usize>>,
    /// The run of each row; empty without runs.
    run_of: Vec<u32>,
    /// For each run, which of the terms are its own.
    terms_of_run: Vec<usize>,
    /// Whole runs of one length share their terms.
    terms: Vec<Terms>,
}

impl Trends {
    /// The trends over the rows that are not excluded. Readings without runs have no trend.
    pub fn of(readings: &Readings, kept: impl Fn(usize) -> bool) -> Trends {
        let mut trends = Trends { runs: Vec::new(), run_of: Vec::new(), terms_of_run: Vec::new(), terms: Vec::new() };
        if readings.run.is_empty() {
            return trends;
        }
        let mut of_length: BTreeMap<usize, usize> = BTreeMap::new();
        for run in readings.runs() {
            let rows: Vec<usize> = run.clone().filter(|row| kept(*row)).collect();
            let is_whole = rows.len() == run.len();
            let number = match of_length.get(&run.len()).filter(|_| is_whole) {
                Some(known) => *known,
                None => {
                    let times: Vec<f64> = rows.iter().map(|row| *row as f64).collect();
                    let mut terms = vec![[0.0; TERMS]; run.len()];
                    if !rows.is_empty() {
                        for (row, of_row) in rows.iter().zip(trend_terms(&times)) {
                            terms[row - run.start] = of_row;
                        }
                    }
                    trends.terms.push(terms);
                    trends.terms.len() - 1
                }
            };
            if is_whole {
                of_length.insert(run.len(), number);
            }
            trends.run_of.resize(run.end, trends.runs.len() as u32);
            trends.terms_of_run.push(number);
            trends.runs.push(run);
        }
        trends
    }

    /// The run of a row; `None` without runs.
    fn run(&self, row: usize) -> Option<usize> {
        self.run_of.get(row).map(|run| *run as usize)
    }

    /// The terms of the trend at a row.
    pub fn terms_at(&self, row: usize) -> [f64; TERMS] {
        self.run(row).map_or([0.0; TERMS], |run| self.terms_in(run, row))
    }

    fn terms_in(&self, run: usize, row: usize) -> [f64; TERMS] {
        self.terms[self.terms_of_run[run]][row - self.runs[run].start]
    }

    /// Residuals without the trend of each run and channel.
    pub fn detrend(&self, residual: &[f64], channels: usize) -> Vec<f64> {
        let mut level = residual.to_vec();
        for (run, number) in self.runs.iter().zip(&self.terms_of_run) {
            // The residual of an excluded row may be no number.
            let rows = || run.clone().zip(&self.terms[*number]).filter(|(_, terms)| **terms != [0.0; TERMS]);
            for channel in 0..channels {
                let at = |row: usize| row * channels + channel;
                let along: [f64; TERMS] =
                    std::array::from_fn(|i| rows().map(|(row, terms)| residual[at(row)] * terms[i]).sum());
                for (row, terms) in rows() {
                    level[at(row)] -= along.iter().zip(terms).map(|(a, q)| a * q).sum::<f64>();
                }
            }
        }
        level
    }

    /// Contribution of a group of repeats to the trace of `M·P`: `Σ_t P_tt − (1/R)·Σ_ts P_ts` over its R rows. `P_ts`
    /// is `δ_ts − Σ_i q_ti q_si` for rows of one run, and `δ_ts` for others. The rows are in ascending order.
    pub fn freedom_of(&self, group: &[usize]) -> f64 {
        let repeats = group.len() as f64;
        let square = |terms: &[f64; TERMS]| terms.iter().map(|q| q * q).sum::<f64>();
        // The trends' part of Σ_ts: for each run, the squared norm of the sum of its rows' terms.
        let (mut own, mut of_trends) = (0.0, 0.0);
        let (mut run, mut sum) = (None, [0.0; TERMS]);
        for row in group {
            let run_of_row = self.run(*row);
            let terms = run_of_row.map_or([0.0; TERMS], |run| self.terms_in(run, *row));
            own += square(&terms);
            if run_of_row != run {
                of_trends += square(&std::mem::replace(&mut sum, [0.0; TERMS]));
                run = run_of_row;
            }
            sum.iter_mut().zip(&terms).for_each(|(sum, q)| *sum += q);
        }
        (repeats - own) - (repeats - of_trends - square(&sum)) / repeats
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trend_is_a_parabola_and_one_cycle() {
        let times: Vec<f64> = (0..60).map(|t| f64::from(t) * 1.5 + 7.0).collect();
        let q = trend_terms(&times);
        let remaining_share = |of: &dyn Fn(f64) -> f64| -> f64 {
            let values: Vec<f64> = times.iter().map(|t| of(*t)).collect();
            let along: [f64; TERMS] =
                std::array::from_fn(|i| values.iter().zip(&q).map(|(value, q)| value * q[i]).sum());
            let rest =
                values.iter().zip(&q).map(|(value, q)| value - along.iter().zip(q).map(|(a, q)| a * q).sum::<f64>());
            let (remaining, total) = (rest.map(|r| r * r).sum::<f64>(), values.iter().map(|v| v * v).sum::<f64>());
            (remaining / total).sqrt()
        };
        // One cycle from the first reading to the last.
        let angle = |t: f64| std::f64::consts::TAU * (t - 7.0) / 88.5;
        assert!(remaining_share(&|t| 3.0 - 0.2 * t + 0.01 * t * t) < 1e-12);
        assert!(remaining_share(&|t| (angle(t) + 0.7).cos()) < 1e-12);
        assert!(remaining_share(&|t| (4.0 * angle(t) + 0.7).cos()) > 0.9);
        // A run of few readings loses no cycle. Shorter runs also lose no parabola, no slope, or nothing.
        for (readings, terms) in [(23, 3), (15, 3), (14, 2), (10, 2), (9, 1), (4, 1), (3, 0), (1, 0)] {
            let few = trend_terms(&times[..readings]);
            let count: f64 = few.iter().flatten().map(|q| q * q).sum();
            assert!((count - f64::from(terms)).abs() < 1e-12, "{readings}: {count}");
            assert!(few.iter().all(|q| q[terms as usize..].iter().all(|q| *q == 0.0)));
        }
    }

    /// Runs of one length share their terms, wherever they begin. A run with an excluded row has its own, zero there.
    #[test]
    fn whole_runs_of_one_length_share_their_terms() {
        let run: Vec<i64> = [1; 30].into_iter().chain([2; 30]).chain([3; 12]).chain([4; 30]).collect();
        let readings = Readings { positions: vec![vec![0.0; run.len()]], run, channels: 1, ..Readings::default() };
        let trends = Trends::of(&readings, |row| row != 75);
        assert_eq!((&trends.terms_of_run[..], trends.terms.len()), (&[0, 0, 1, 2][..], 3));
        let alone = |rows: std::ops::Range<usize>| {
            let rows: Vec<usize> = rows.filter(|row| *row != 75).collect();
            let terms = trend_terms(&rows.iter().map(|row| *row as f64).collect::<Vec<_>>());
            rows.into_iter().zip(terms).collect::<Vec<_>>()
        };
        for rows in [0..30, 30..60, 60..72, 72..102] {
            for (row, terms) in alone(rows) {
                assert_eq!(trends.terms_at(row), terms, "{row}");
            }
        }
        assert_eq!(trends.terms_at(75), [0.0; TERMS]);
        // A residual that is one of the terms vanishes; that of the excluded row stays, even if it is no number.
        let residual: Vec<f64> = (0..102).map(|row| if row == 75 { f64::NAN } else { 7.0 }).collect();
        let level = trends.detrend(&residual, 1);
        assert!(level[75].is_nan() && (0..102).filter(|row| *row != 75).all(|row| level[row].abs() < 1e-12));
        // Without runs there is no trend.
        assert_eq!(Trends::of(&Readings::default(), |_| true).terms_at(0), [0.0; TERMS]);
    }
}
