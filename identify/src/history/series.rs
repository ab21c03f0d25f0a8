//! One parameter of one machine over time: a level, perhaps a drift, and steps between sessions.
//!
//! The values are independent with known standard uncertainties. The test of "no change" compares the best drift or
//! step with a level alone; its p value counts all positions of a step (Bonferroni). In a series with a change, terms
//! are added, removed and moved until χ² plus the costs of the terms no longer decreases.

use super::sessions::MachineSessions;
use super::{DAYS_PER_YEAR, quantile};
use crate::numerics::regression::Regression;
use crate::numerics::tails::student_tail;
use crate::numerics::{median, parallel};

/// Fewest sessions in which a parameter is a series.
pub(super) const FEWEST: usize = 4;
/// Most steps of a series.
const MOST_STEPS: usize = 12;
/// Standard deviation of the scatter over its predicted value, times the root of the number of differences. It counts
/// that neighbouring differences share a session.
const SCATTER_DEVIATION: f64 = 1.4;
/// Standard deviations above 1 at which the scatter of all series of a fleet enlarges their uncertainties: the many
/// differences make it precise.
const FLEET_EXCESS: f64 = 1.0;
/// Standard deviations above the scatter of the fleet at which that of a machine, and that of one series, take its
/// place. Few differences determine a scatter badly, and its degrees of freedom cost power.
const MACHINE_EXCESS: f64 = 2.0;
const OWN_EXCESS: f64 = 3.0;
/// Differences of correlated parameters that count as one independent difference.
const CORRELATED: f64 = 1.6;
/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL: f64 = 1.4826;

/// What each term of a model has to gain in χ².
pub(super) struct Costs {
    drift: f64,
    step: f64,
}

impl Costs {
    /// The costs at which a term is as significant as a whole series at the threshold.
    pub fn of(threshold: f64, positions: usize) -> Costs {
        Costs { drift: quantile(threshold / 2.0), step: quantile(threshold / (2.0 * positions.max(1) as f64)) }
    }
}

/// One parameter of one machine.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// Position of the parameter among those of the machine.
    pub parameter: usize,
    /// The sessions that have it.
    pub sessions: Vec<usize>,
    /// Years since the first session of the machine.
    pub years: Vec<f64>,
    /// The values.
    pub values: Vec<f64>,
    /// Their standard uncertainties, enlarged by `scatter` where that is significant.
    pub u: Vec<f64>,
    /// Scatter between neighbouring sessions over that which the uncertainties predict.
    pub scatter: f64,
    /// Factor of the uncertainties.
    pub enlargement: f64,
    /// Whether the model has a drift.
    pub drift: bool,
    /// The sessions in front of which the model has a step, as positions in `sessions`.
    pub steps: Vec<usize>,
    /// Degrees of freedom of the enlargement; infinite without one.
    freedom: f64,
    p_value: f64,
}

/// Scatter between neighbouring sessions.
#[derive(Clone, Copy)]
struct Scatter {
    /// Over that which the uncertainties predict.
    ratio: f64,
    /// Number of independent differences.
    differences: f64,
}

impl Scatter {
    /// That of all these series together.
    fn of<'a>(series: impl Iterator<Item = &'a Series>) -> Scatter {
        let (mut pulls, mut count) = (Vec::new(), 0);
        for one in series {
            pulls.extend(one.pulls());
            count += 1;
        }
        let differences = pulls.len() as f64 / if count > 1 { CORRELATED } else { 1.0 };
        Scatter { ratio: if pulls.is_empty() { 1.0 } else { NORMAL * median(&mut pulls) }, differences }
    }

    /// Whether this is above another ratio by a number of standard deviations.
    fn exceeds(&self, ratio: f64, deviations: f64) -> bool {
        self.ratio > ratio * (1.0 + deviations * SCATTER_DEVIATION / self.differences.sqrt())
    }

    /// Degrees of freedom of a variance with the relative standard deviation of this estimate.
    fn freedom(&self) -> f64 {
        self.differences / (2.0 * SCATTER_DEVIATION * SCATTER_DEVIATION)
    }
}

impl Series {
    /// The series of each machine of a fleet, each with its test.
    pub fn of_fleet(machines: &[MachineSessions]) -> Vec<Vec<Series>> {
        let mut all: Vec<Vec<Series>> = parallel::map(machines.len(), &|k| Series::of_machine(&machines[k]));
        let fleet = Scatter::of(all.iter().flatten());
        let fleet = fleet.exceeds(1.0, FLEET_EXCESS).then_some(fleet);
        let usual = fleet.map_or(1.0, |fleet| fleet.ratio);
        for series in &mut all {
            let machine = Scatter::of(series.iter());
            let machine = machine.exceeds(usual, MACHINE_EXCESS).then_some(machine);
            for one in series {
                let own = Scatter::of(std::iter::once(&*one));
                let own = own.exceeds(usual, OWN_EXCESS).then_some(own);
                let largest = [fleet, machine, own].into_iter().flatten().max_by(|a, b| a.ratio.total_cmp(&b.ratio));
                one.enlarge(largest);
            }
        }
        all
    }

    fn of_machine(machine: &MachineSessions) -> Vec<Series> {
        let first = machine.sessions.first().map_or(0.0, |session| session.days);
        (0..machine.parameters.len())
            .filter_map(|parameter| {
                let known = machine.sessions.iter().enumerate().filter_map(|(session, values)| {
                    let (value, u) = values.values[parameter]?;
                    let usable = value.is_finite() && u.is_finite() && u > 0.0;
                    usable.then_some((session, (values.days - first) / DAYS_PER_YEAR, value, u))
                });
                let known: Vec<_> = known.collect();
                (known.len() >= FEWEST).then(|| Series::new(parameter, &known))
            })
            .collect()
    }

    fn new(parameter: usize, known: &[(usize, f64, f64, f64)]) -> Series {
        let mut series = Series {
            parameter,
            sessions: known.iter().map(|known| known.0).collect(),
            years: known.iter().map(|known| known.1).collect(),
            values: known.iter().map(|known| known.2).collect(),
            u: known.iter().map(|known| known.3).collect(),
            scatter: 1.0,
            enlargement: 1.0,
            freedom: f64::INFINITY,
            drift: false,
            steps: Vec::new(),
            p_value: 1.0,
        };
        series.scatter = Scatter::of(std::iter::once(&series)).ratio;
        series
    }

    /// Enlarges the uncertainties by a scatter, and tests.
    fn enlarge(&mut self, scatter: Option<Scatter>) {
        if let Some(scatter) = scatter {
            self.enlargement = scatter.ratio;
            self.freedom = scatter.freedom();
            self.u.iter_mut().for_each(|u| *u *= scatter.ratio);
        }
        self.p_value = self.test();
    }

    /// The differences of neighbouring sessions, less the drift, over their uncertainties. Steps hardly change their
    /// median. The estimated drift takes 5 % of their variance for four sessions, and less for more.
    fn pulls(&self) -> impl Iterator<Item = f64> {
        let drift = self.median_slope();
        (1..self.values.len()).map(move |i| {
            let expected = drift * (self.years[i] - self.years[i - 1]);
            ((self.values[i] - self.values[i - 1] - expected) / self.u[i].hypot(self.u[i - 1])).abs()
        })
    }

    /// Drift per year as the median of the slopes between all pairs of sessions (Theil and Sen); 0 with one date only.
    fn median_slope(&self) -> f64 {
        let count = self.values.len();
        let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
        let pairs = pairs.filter(|(i, j)| self.years[*j] > self.years[*i]);
        let slope = |(i, j): (usize, usize)| (self.values[j] - self.values[i]) / (self.years[j] - self.years[i]);
        let mut slopes: Vec<f64> = pairs.map(slope).collect();
        if slopes.is_empty() { 0.0 } else { median(&mut slopes) }
    }

    /// Whether the sessions determine a drift and steps in front of these sessions of the machine.
    pub fn separates(&self, drift: bool, steps: &[usize]) -> bool {
        let place = |step: &usize| self.sessions.partition_point(|session| session < step);
        let steps: Vec<usize> = steps.iter().map(place).collect();
        let distinct = steps.iter().enumerate().all(|(k, step)| !steps[..k].contains(step));
        let inside = steps.iter().all(|step| *step > 0 && *step < self.sessions.len());
        distinct && inside && self.solved(drift, &steps).is_some()
    }

    /// Number of positions of a step.
    pub fn positions(&self) -> usize {
        self.values.len() - 1
    }

    /// Probability of a change as large as the largest of this series if there is none.
    pub fn p_value(&self) -> f64 {
        self.p_value
    }

    fn test(&self) -> f64 {
        let Some(level) = self.solved(false, &[]) else { return 1.0 };
        let columns = self.columns(false, &[]);
        let tail = |gain: f64| 2.0 * student_tail(gain.max(0.0).sqrt(), self.freedom);
        let drift = 2.0 * tail(level.gain(&columns, &[self.drift_column()]));
        let step = (1..self.values.len()).map(|at| level.gain(&columns, &[self.step_column(at)])).fold(0.0, f64::max);
        drift.min(2.0 * self.positions() as f64 * tail(step)).min(1.0)
    }

    fn whitened(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.values.len()).map(|i| value(i) / self.u[i]).collect()
    }

    fn drift_column(&self) -> Vec<f64> {
        let middle = self.years.iter().sum::<f64>() / self.years.len() as f64;
        self.whitened(|i| self.years[i] - middle)
    }

    fn step_column(&self, at: usize) -> Vec<f64> {
        self.whitened(|i| f64::from(u8::from(i >= at)))
    }

    fn columns(&self, drift: bool, steps: &[usize]) -> Vec<Vec<f64>> {
        let mut columns = vec![self.whitened(|_| 1.0)];
        columns.extend(drift.then(|| self.drift_column()));
        columns.extend(steps.iter().map(|at| self.step_column(*at)));
        columns
    }

    fn solved(&self, drift: bool, steps: &[usize]) -> Option<Regression> {
        Regression::solve(&self.columns(drift, steps), &self.whitened(|i| self.values[i]))
    }

    /// Drift per year with its standard uncertainty, beside the steps of the model.
    pub fn drift_with_u(&self) -> Option<(f64, f64)> {
        let solved = self.solved(true, &self.steps)?;
        Some((solved.beta[1], solved.u(&[(1, 1.0)], 1.0)))
    }

    /// The series with the model of the least χ² plus costs that a search from no term and one from a drift reach.
    pub fn searched(mut self, costs: &Costs) -> Series {
        let found = [false, true].map(|drift| self.search(drift, costs));
        let best = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, drift, steps)) = best {
            (self.drift, self.steps) = (drift, steps);
        }
        self
    }

    /// χ² plus the costs of the terms; infinite for terms that the sessions do not separate.
    fn objective(&self, drift: bool, steps: &[usize], costs: &Costs) -> f64 {
        let Some(solved) = self.solved(drift, steps) else { return f64::INFINITY };
        solved.sum_of_squares() + costs.drift * f64::from(u8::from(drift)) + costs.step * steps.len() as f64
    }

    /// Adds, removes, exchanges and moves terms one at a time while that lowers the objective.
    fn search(&self, drift: bool, costs: &Costs) -> (f64, bool, Vec<usize>) {
        let mut best = (self.objective(drift, &[], costs), drift, Vec::new());
        loop {
            let (_, drift, steps) = &best;
            let mut next: Option<(f64, bool, Vec<usize>)> = None;
            let mut consider = |drift: bool, mut steps: Vec<usize>| {
                steps.sort_unstable();
                let objective = self.objective(drift, &steps, costs);
                if next.as_ref().is_none_or(|next| objective < next.0) {
                    next = Some((objective, drift, steps));
                }
            };
            consider(!drift, steps.clone());
            for at in (1..self.values.len()).filter(|at| !steps.contains(at)) {
                let added = [steps.as_slice(), &[at]].concat();
                if added.len() <= MOST_STEPS {
                    consider(*drift, added.clone());
                    consider(!drift, added);
                }
            }
            for (k, place) in steps.iter().enumerate() {
                let others: Vec<usize> = steps.iter().copied().filter(|at| at != place).collect();
                consider(*drift, others.clone());
                consider(!drift, others);
                for moved in [place - 1, place + 1] {
                    if moved >= 1 && moved < self.values.len() && !steps.contains(&moved) {
                        let mut steps = steps.clone();
                        steps[k] = moved;
                        consider(*drift, steps);
                    }
                }
            }
            match next {
                Some(next) if next.0 < best.0 - 1e-9 => best = next,
                _ => return best,
            }
        }
    }
}
