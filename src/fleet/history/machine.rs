//! All parameters of one machine together: levels, drifts and steps by generalised least squares with the covariances
//! of the sessions.

use faer::Mat;

use super::HistoryOptions;
use super::events::{self, Change};
use super::results::{ChangeResult, Due, MachineHistory, ParameterHistory, PointResult};
use super::series::Series;
use super::sessions::{Dated, Machine};
use super::{DAYS_PER_YEAR, chart};
use abbe_identify::numerics::regression::Regression;
use abbe_identify::results::MeasuredValue;

/// Years ahead in which a due date is stated.
const HORIZON_YEARS: f64 = 10.0;

/// The terms of a series in a joint fit.
#[derive(Clone, Debug)]
struct Terms {
    drift: bool,
    /// The sessions of the machine in front of which there is a step.
    steps: Vec<usize>,
}

/// A machine with the models of its series.
pub(super) struct Fitted<'m> {
    machine: &'m Machine,
    series: Vec<Series>,
    terms: Vec<Terms>,
}

/// Sessions in front of which one change has its steps.
struct Cluster {
    /// The earliest session that lies before one of the steps in its series.
    before: usize,
    /// The sessions, ascending.
    sessions: Vec<usize>,
}

impl Cluster {
    fn last(&self) -> usize {
        self.sessions.last().copied().unwrap_or(self.before)
    }

    fn add(&mut self, before: usize, session: usize) {
        self.before = self.before.min(before);
        if self.last() != session {
            self.sessions.push(session);
        }
    }
}

/// A joint fit: the first coefficient of each series.
struct Joint {
    solved: Regression,
    first: Vec<usize>,
}

impl Joint {
    fn estimate(&self, coefficient: usize) -> MeasuredValue {
        MeasuredValue { value: self.solved.beta[coefficient], u: self.solved.u(&[(coefficient, 1.0)], 1.0) }
    }
}

impl<'m> Fitted<'m> {
    /// A machine with its searched series.
    pub fn of(machine: &'m Machine, series: Vec<Series>) -> Fitted<'m> {
        let terms = series
            .iter()
            .map(|series| Terms {
                drift: series.drift,
                steps: series.steps.iter().map(|at| series.sessions[*at]).collect(),
            })
            .collect();
        Fitted { machine, series, terms }
    }

    fn years(&self, session: usize) -> f64 {
        (self.machine.sessions[session].days - self.machine.sessions[0].days) / DAYS_PER_YEAR
    }

    /// Generalised least squares over all series; `None` if their terms are not separable.
    fn solve(&self, terms: &[Terms]) -> Option<Joint> {
        let mut first = Vec::with_capacity(terms.len());
        let mut count = 0;
        for terms in terms {
            first.push(count);
            count += 1 + usize::from(terms.drift) + terms.steps.len();
        }
        let (mut columns, mut y) = (vec![Vec::new(); count], Vec::new());
        for session in 0..self.machine.sessions.len() {
            let present = self.series.iter().enumerate();
            let present: Vec<(usize, usize)> = present
                .filter_map(|(k, series)| Some((k, series.sessions.iter().position(|own| *own == session)?)))
                .collect();
            if present.is_empty() {
                continue;
            }
            let whitening = self.whitening(session, &present)?;
            let mut rows = Mat::<f64>::zeros(present.len(), count + 1);
            for (row, (k, at)) in present.iter().enumerate() {
                let (series, terms) = (&self.series[*k], &terms[*k]);
                let mut column = first[*k];
                rows[(row, column)] = 1.0;
                if terms.drift {
                    column += 1;
                    rows[(row, column)] = self.years(session) - self.middle(*k);
                }
                for step in &terms.steps {
                    column += 1;
                    rows[(row, column)] = f64::from(u8::from(session >= *step));
                }
                rows[(row, count)] = series.values[*at];
            }
            let white = &whitening * &rows;
            for row in 0..present.len() {
                for (column, values) in columns.iter_mut().enumerate() {
                    values.push(white[(row, column)]);
                }
                y.push(white[(row, count)]);
            }
        }
        Some(Joint { solved: Regression::solve(columns, &y)?, first })
    }

    /// The year to which the level of a series with drift belongs.
    fn middle(&self, series: usize) -> f64 {
        let years = &self.series[series].years;
        years.iter().sum::<f64>() / years.len() as f64
    }

    /// A root of the inverse covariance of the present series in a session.
    fn whitening(&self, session: usize, present: &[(usize, usize)]) -> Option<Mat<f64>> {
        let covariance = |i: usize, j: usize| self.machine.covariance(session, i, j);
        let count = present.len();
        let u: Vec<f64> = present.iter().map(|(k, at)| self.series[*k].u[*at]).collect();
        let place = |k: usize| self.series[present[k].0].parameter;
        let stated = |i: usize| covariance(place(i), place(i)).sqrt();
        let correlation = Mat::from_fn(count, count, |i, j| match i == j {
            true => 1.0,
            false => covariance(place(i), place(j)) / (stated(i) * stated(j)),
        });
        if correlation.col_iter().any(|column| column.iter().any(|entry| !entry.is_finite())) {
            return Some(Mat::from_fn(count, count, |i, j| if i == j { 1.0 / u[i] } else { 0.0 }));
        }
        events::inverse_root(&correlation, &u)
    }

    /// The history of the machine.
    pub fn history(&self, options: &HistoryOptions) -> MachineHistory {
        let joint = self.solve(&self.terms);
        let parameters: Vec<ParameterHistory> =
            (0..self.series.len()).map(|k| self.parameter(k, joint.as_ref(), options)).collect();
        // A parameter that the latest session does not have may have been adjusted since.
        let last = self.machine.sessions.len().checked_sub(1);
        let present = self.series.iter().zip(&parameters);
        let present = present.filter(|(series, _)| series.sessions.last().copied() == last).map(|(_, one)| one);
        let first_due = present.clone().filter_map(|one| Some((one.due_days?, one.id.clone())));
        let first_due = first_due.min_by(|a, b| a.0.total_cmp(&b.0));
        let due = match &first_due {
            Some(_) => Due::Date,
            None if present.clone().any(|one| one.due == Due::BeyondTenYears) => Due::BeyondTenYears,
            None => Due::NotDetermined,
        };
        let days = |session: Option<&Dated>| session.map_or(0.0, |session| session.days);
        let followed = self.series.iter().filter(|series| series.sessions.last().copied() == last).count();
        let axes = self.machine.latest().and_then(|record| record.machine.as_ref());
        MachineHistory {
            machine_id: self.machine.id().to_string(),
            name: axes.map_or_else(String::new, |machine| machine.name.clone()),
            code: axes.map_or_else(String::new, |machine| machine.code.clone()),
            sessions: self.machine.sessions.len(),
            first_days: days(self.machine.sessions.first()),
            last_days: days(self.machine.sessions.last()),
            changes: self.changes(options),
            due,
            due_days: first_due.as_ref().map(|due| due.0),
            due_parameter: first_due.map(|due| due.1),
            followed,
            determined: self.machine.determined().max(followed),
            held_at_nominal: self.machine.held_at_nominal(),
            validation: self.machine.validation(),
            out_of_control: parameters.iter().filter(|one| one.is_out_of_control()).map(|one| one.id.clone()).collect(),
            parameters,
        }
    }

    fn parameter(&self, k: usize, joint: Option<&Joint>, options: &HistoryOptions) -> ParameterHistory {
        let series = &self.series[k];
        let [id, unit, meaning] = self.machine.named(series.parameter).map(str::to_string);
        let first = joint.map(|joint| (joint, joint.first[k]));
        let drift = first.filter(|_| series.drift).map(|(joint, first)| joint.estimate(first + 1));
        let chart = chart::Charts::of(&series.values, &series.u, &series.steps);
        let points = series.sessions.iter().enumerate().map(|(at, session)| PointResult {
            days: self.machine.sessions[*session].days,
            value: series.values[at],
            u: series.u[at],
            shewhart: chart.points[at].shewhart,
            ewma: chart.points[at].ewma,
            out_of_control: chart.points[at].is_out(),
        });
        let steps = series.steps.iter().enumerate().filter_map(|(number, at)| {
            let (joint, first) = first?;
            let change = joint.estimate(first + 1 + usize::from(series.drift) + number);
            Some(ChangeResult {
                after_days: self.machine.sessions[series.sessions[at - 1]].days,
                before_days: self.machine.sessions[series.sessions[*at]].days,
                change,
                p_value: series.p_value_of_term(change.value, change.u),
            })
        });
        let (due, due_days) = self.due(series, options);
        ParameterHistory {
            id,
            unit,
            meaning,
            points: points.collect(),
            p_value: series.p_value,
            scatter_ratio: series.scatter,
            enlargement: series.enlargement,
            level: first.map(|(joint, first)| joint.estimate(first)),
            drift_per_year: drift,
            steps: steps.collect(),
            reference: chart.reference,
            due,
            due_days,
        }
    }

    /// The day on which a parameter may have changed by the tolerance since its last session: the drift, or one
    /// standard uncertainty of a drift that is not significant, plus twice the uncertainty of the last value.
    fn due(&self, series: &Series, options: &HistoryOptions) -> (Due, Option<f64>) {
        let Some(((drift, u_drift), last)) = series.drift_with_u().zip(series.sessions.last()) else {
            return (Due::NotDetermined, None);
        };
        let rate = if series.drift { drift.abs() } else { u_drift };
        let mut u = series.u.clone();
        u.sort_by(f64::total_cmp);
        let u = u[u.len() / 2];
        let years = ((options.tolerance_u - 2.0) * u / rate).max(0.0);
        let last = self.machine.sessions[*last].days;
        match years <= HORIZON_YEARS {
            true => (Due::Date, Some(last + years * DAYS_PER_YEAR)),
            false => (Due::BeyondTenYears, None),
        }
    }

    /// The steps of all parameters by session, each with its direction.
    fn changes(&self, options: &HistoryOptions) -> Vec<events::ChangeEvent> {
        let mut clusters: Vec<Cluster> = Vec::new();
        for (before, session) in self.steps() {
            match clusters.last_mut() {
                // One change has steps in neighbouring sessions where noise moves the position of a step.
                Some(cluster) if before <= cluster.last() => cluster.add(before, session),
                _ => clusters.push(Cluster { before, sessions: vec![session] }),
            }
        }
        clusters.iter().filter_map(|cluster| self.change(cluster, options)).collect()
    }

    /// The steps of all series by session: the session of the series before the step, and that behind it.
    fn steps(&self) -> Vec<(usize, usize)> {
        let of_series = |series: &Series| -> Vec<(usize, usize)> {
            series.steps.iter().map(|at| (series.sessions[at - 1], series.sessions[*at])).collect()
        };
        let mut steps: Vec<(usize, usize)> = self.series.iter().flat_map(of_series).collect();
        steps.sort_unstable_by_key(|(before, session)| (*session, *before));
        steps
    }

    /// The change of a cluster of sessions, at the session where its joint χ² is largest.
    fn change(&self, cluster: &Cluster, options: &HistoryOptions) -> Option<events::ChangeEvent> {
        let candidates = cluster.sessions.iter().filter_map(|session| self.change_at(*session, cluster));
        let candidates = candidates.map(|change| change.event(self.machine, &options.compensations));
        candidates.max_by(|a, b| a.chi_square.total_cmp(&b.chi_square))
    }

    fn change_at(&self, session: usize, cluster: &Cluster) -> Option<Change> {
        let mut terms = self.terms.clone();
        let mut members = Vec::new();
        for (k, terms) in terms.iter_mut().enumerate() {
            let mut steps: Vec<usize> =
                terms.steps.iter().copied().filter(|step| !cluster.sessions.contains(step)).collect();
            steps.push(session);
            // A series with sessions on one side only, or none between this step and its next, does not have the step.
            if self.series[k].separates(terms.drift, &steps) {
                terms.steps = steps;
                members.push(k);
            }
        }
        let joint = self.solve(&terms)?;
        let place = |k: usize| joint.first[k] + usize::from(terms[k].drift) + terms[k].steps.len();
        let has_step = |k: usize| self.terms[k].steps.iter().any(|step| cluster.sessions.contains(step));
        // A series may lack the sessions just before its step.
        let before = self.steps().into_iter().filter(|(_, at)| *at == session).map(|(before, _)| before).min();
        let count = members.len();
        let covariance =
            Mat::from_fn(count, count, |i, j| joint.solved.inverse[(place(members[i]), place(members[j]))]);
        let sessions = &self.machine.sessions;
        Some(Change {
            after_days: sessions[before.unwrap_or(session - 1)].days,
            before_days: sessions[session].days,
            possible_days: [sessions[cluster.before].days, sessions[cluster.last()].until_days],
            parameters: members.iter().map(|k| self.series[*k].parameter).collect(),
            values: members.iter().map(|k| joint.solved.beta[place(*k)]).collect(),
            covariance,
            before: members.iter().map(|k| self.level_before(*k, session, &joint, &terms[*k])).collect(),
            found: (0..self.series.len()).filter(|k| has_step(*k)).map(|k| self.series[k].parameter).collect(),
        })
    }

    /// The modelled value of a series just before a session.
    fn level_before(&self, k: usize, session: usize, joint: &Joint, terms: &Terms) -> f64 {
        let beta = |offset: usize| joint.solved.beta[joint.first[k] + offset];
        let drift = if terms.drift { beta(1) * (self.years(session - 1) - self.middle(k)) } else { 0.0 };
        let steps = terms.steps.iter().enumerate().filter(|(_, step)| **step < session);
        let steps: f64 = steps.map(|(number, _)| beta(1 + usize::from(terms.drift) + number)).sum();
        beta(0) + drift + steps
    }
}
