//! One parameter of one machine over time: a level, perhaps a drift, and steps between sessions.
//!
//! The values are independent, with uncertainties that are known but for a factor, the scatter. In a series with a
//! change, terms are added, removed and moved while the model improves. The scatter is estimated under each model, the
//! residual within the segments beside the prior of the other series, so that a change is no scatter.

use super::DAYS_PER_YEAR;
use super::sessions::Machine;
use abbe_identify::numerics::median;
use abbe_identify::numerics::regression::Regression;
use abbe_identify::numerics::tails::{student_quantile, student_tail};
use abbe_identify::results::Estimate;

/// Fewest sessions in which a parameter is a series.
pub(super) const FEWEST: usize = 4;
/// Most steps of a series.
const MOST_STEPS: usize = 12;
/// Intervals between sessions at which a drift is half as probable as a step. Each interval is as likely to hold a step as
/// any other; a drift is the likelier the longer the series is, by the square of its length.
const INTERVALS_OF_DRIFT: f64 = 9.0;

/// What each term of a model has to gain, by the number of terms that the model then has.
struct Costs {
    /// Squared t of a drift, then of a step, with so many terms.
    drift: Vec<f64>,
    step: Vec<f64>,
}

impl Costs {
    /// The costs at which a term is as significant as a whole series at the threshold.
    fn of(threshold: f64, series: &Series) -> Costs {
        let count = series.values.len();
        let positions = (count - 1) as f64;
        // The odds of a drift against a step reduce the positions that a step has to count.
        let odds = positions * positions / (positions * positions + INTERVALS_OF_DRIFT * INTERVALS_OF_DRIFT);
        let total = series.prior.freedom + positions;
        let costs = |probability: f64| -> Vec<f64> {
            let terms = 0..=(MOST_STEPS + 1).min(count - 2);
            terms.map(|terms| student_quantile(0.5 * probability, total - terms as f64).powi(2)).collect()
        };
        Costs { drift: costs(0.5 * threshold), step: costs(0.5 * threshold / (positions * odds).max(1.0)) }
    }
}

/// Smallest variance, in units of the stated one: sessions that agree to a millionth of their uncertainties.
pub(super) const LEAST_VARIANCE: f64 = 1e-12;

/// What is known of the variance of a series before its own scatter: that of an estimate with so many degrees of
/// freedom, in units of the stated variance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior {
    pub variance: f64,
    pub freedom: f64,
}

impl Prior {
    /// Its sum of squares. A trace remains of none, so that sessions without any scatter have a variance.
    pub fn sum_of_squares(&self) -> f64 {
        self.freedom * self.variance + LEAST_VARIANCE
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
    /// Their standard uncertainties, after [`Series::enlarge`] with the scatter.
    pub u: Vec<f64>,
    /// Scatter of the sessions about the model over that which the stated uncertainties predict.
    pub scatter: f64,
    /// Factor of the uncertainties.
    pub enlargement: f64,
    /// Whether the model has a drift.
    pub drift: bool,
    /// The sessions in front of which the model has a step, as positions in `sessions`.
    pub steps: Vec<usize>,
    /// What the other series say of the scatter.
    prior: Prior,
    /// Variance of the sessions about the model, in units of the stated one, beside the prior, and its degrees of
    /// freedom.
    variance: (f64, f64),
    /// Probability of a change as large as the largest of this series if there is none.
    pub p_value: f64,
}

impl Series {
    /// The series of a machine.
    pub fn of_machine(machine: &Machine) -> Vec<Series> {
        let first = machine.sessions.first().map_or(0.0, |session| session.days);
        (0..machine.count())
            .filter_map(|parameter| {
                let known = machine.sessions.iter().enumerate().filter_map(|(session, dated)| {
                    let Estimate { value, u, .. } = *machine.estimate(parameter, session)?;
                    let usable = value.is_finite() && u.is_finite() && u > 0.0;
                    usable.then_some((session, (dated.days - first) / DAYS_PER_YEAR, value, u))
                });
                let known: Vec<_> = known.collect();
                (known.len() >= FEWEST).then(|| Series::new(parameter, &known))
            })
            .collect()
    }

    pub(super) fn new(parameter: usize, known: &[(usize, f64, f64, f64)]) -> Series {
        Series {
            parameter,
            sessions: known.iter().map(|known| known.0).collect(),
            years: known.iter().map(|known| known.1).collect(),
            values: known.iter().map(|known| known.2).collect(),
            u: known.iter().map(|known| known.3).collect(),
            scatter: 1.0,
            enlargement: 1.0,
            variance: (1.0, f64::INFINITY),
            drift: false,
            steps: Vec::new(),
            prior: Prior { variance: 1.0, freedom: 0.0 },
            p_value: 1.0,
        }
    }

    /// The differences of neighbouring sessions, less the median drift between them, over their uncertainties. A step
    /// is in one of them.
    pub fn pulls(&self) -> Vec<f64> {
        let count = self.values.len();
        let time = |i: usize| self.years[i] - self.years[i - 1];
        let mut rates: Vec<f64> =
            (1..count).filter(|i| time(*i) > 0.0).map(|i| (self.values[i] - self.values[i - 1]) / time(i)).collect();
        let drift = if rates.is_empty() { 0.0 } else { median(&mut rates) };
        let pull = |i: usize| {
            let difference = self.values[i] - self.values[i - 1] - drift * time(i);
            (difference / self.u[i].hypot(self.u[i - 1])).abs()
        };
        (1..count).map(pull).collect()
    }

    /// Whether the sessions determine a drift and steps in front of these sessions of the machine.
    pub fn separates(&self, drift: bool, steps: &[usize]) -> bool {
        let place = |step: &usize| self.sessions.partition_point(|session| session < step);
        let steps: Vec<usize> = steps.iter().map(place).collect();
        let distinct = steps.iter().enumerate().all(|(k, step)| !steps[..k].contains(step));
        let inside = steps.iter().all(|step| *step > 0 && *step < self.sessions.len());
        distinct && inside && self.solved(drift, &steps).is_some()
    }

    /// The series as a level, with a prior of its scatter and the p value of its most significant change.
    pub fn tested(mut self, prior: Prior, p_value: f64) -> Series {
        (self.prior, self.p_value) = (prior, p_value);
        (self.drift, self.steps) = (false, Vec::new());
        self
    }

    /// χ² of the residual about the model, by the stated uncertainties, and its degrees of freedom; `None` if the model
    /// leaves none.
    pub fn residual(&self) -> Option<(f64, f64)> {
        let terms = 1 + usize::from(self.drift) + self.steps.len();
        let solved = self.solved(self.drift, &self.steps)?;
        Some((solved.sum_of_squares(), (self.values.len() - terms) as f64)).filter(|(_, freedom)| *freedom > 0.0)
    }

    /// Enlarges the uncertainties by the scatter about the model, if that is above 1.
    pub fn enlarge(&mut self) {
        let (sum, own) = self.residual().unwrap_or((0.0, 0.0));
        let freedom = self.prior.freedom + own;
        if own > 0.0 {
            self.scatter = (sum / own).sqrt();
            self.variance = ((self.prior.sum_of_squares() + sum) / freedom, freedom);
        }
        self.enlargement = self.variance.0.max(1.0).sqrt();
        self.u.iter_mut().for_each(|u| *u *= self.enlargement);
    }

    /// The probability of a term as large as this one, with its enlarged uncertainty, if there is none.
    pub fn p_value_of_term(&self, value: f64, u: f64) -> f64 {
        let (variance, freedom) = self.variance;
        (2.0 * student_tail((value / u).abs() * self.enlargement / variance.sqrt(), freedom)).min(1.0)
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
        Regression::solve(self.columns(drift, steps), &self.whitened(|i| self.values[i]))
    }

    /// Drift per year with its standard uncertainty, beside the steps of the model.
    pub fn drift_with_u(&self) -> Option<(f64, f64)> {
        let solved = self.solved(true, &self.steps)?;
        Some((solved.beta[1], solved.u(&[(1, 1.0)], 1.0)))
    }

    /// The series with the best model that a search from a level, from a drift and from the steps of its most significant
    /// change reaches.
    pub fn searched(mut self, steps: &[usize], threshold: f64) -> Series {
        let costs = Costs::of(threshold, &self);
        let starts = [(false, &[] as &[usize]), (true, &[]), (false, steps)];
        let found = starts.map(|(drift, steps)| self.search(drift, steps, &costs));
        let best = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, drift, steps)) = best {
            (self.drift, self.steps) = (drift, steps);
        }
        self
    }

    /// Logarithm of the sum of squares plus the costs of the terms. A further term lowers it if its F statistic, with
    /// the variance under the larger model, exceeds its cost. Infinite for terms that the sessions do not separate.
    fn objective(&self, drift: bool, steps: &[usize], costs: &Costs) -> f64 {
        let Some(solved) = self.solved(drift, steps) else { return f64::INFINITY };
        let drifts = drift.then_some(&costs.drift).into_iter();
        let terms = drifts.chain(steps.iter().map(|_| &costs.step)).enumerate();
        let freedom = self.prior.freedom + (self.values.len() - 1) as f64;
        let costs = terms.map(|(before, costs)| match costs.get(before + 1) {
            Some(cost) => (cost / (freedom - (before + 1) as f64)).ln_1p(),
            None => f64::INFINITY,
        });
        freedom * ((self.prior.sum_of_squares() + solved.sum_of_squares()).ln() + costs.sum::<f64>())
    }

    /// Adds, removes, exchanges and moves terms one at a time while that lowers the objective.
    fn search(&self, drift: bool, steps: &[usize], costs: &Costs) -> (f64, bool, Vec<usize>) {
        let mut best = (self.objective(drift, steps, costs), drift, steps.to_vec());
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Differences over the hypotenuse of both uncertainties, less the median rate: of 2, 2, 14 and 2 a year it is 2.
    #[test]
    fn pulls_are_differences_less_the_median_drift() {
        let known =
            [(0, 0.0, 1.0, 0.3), (1, 0.5, 2.0, 0.4), (2, 1.0, 3.0, 0.3), (3, 1.5, 10.0, 0.4), (4, 2.5, 12.0, 0.3)];
        let pulls = Series::new(0, &known).pulls();
        assert_eq!(pulls.len(), 4);
        for (found, wanted) in pulls.iter().zip([0.0, 0.0, 6.0 / 0.5, 0.0]) {
            assert!((found - wanted).abs() < 1e-12, "{pulls:?}");
        }
        // On one date there is no rate.
        let pulls = Series::new(0, &[(0, 1.0, 5.0, 0.6), (1, 1.0, 3.0, 0.8)]).pulls();
        assert!((pulls[0] - 2.0).abs() < 1e-12, "{pulls:?}");
    }
}
