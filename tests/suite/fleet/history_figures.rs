//! Every figure of a history, recomputed: least squares over all parameters of a machine by another library, control
//! charts by their definitions, the next check by its formula, and changes in the metric of their covariance.

use abbe::fleet::compensations::Compensation;
use abbe::fleet::history::HistoryOptions;
use abbe::fleet::history::events::{ChangeEvent, Kind};
use abbe::fleet::history::results::{Due, MachineHistory, ParameterHistory};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::machines::{MachineSessions, SessionValues, analyse};

const SESSIONS: usize = 24;
const YEAR: f64 = 365.25;
/// The session in front of which `EA0C` has its step and `EX0C` a small one.
const STEP: usize = 13;
/// A session without `EY0C`.
const MISSING: usize = 9;
const IDS: [&str; 4] = ["EX0C", "EY0C", "EA0C", "EB0C"];

/// Days at which the sessions lie, not evenly.
fn day(session: usize) -> f64 {
    20_000.0 + 31.0 * session as f64 + [0.0, 4.5, -3.25][session % 3]
}

/// Stated standard uncertainties, which differ from session to session.
fn u(parameter: usize, session: usize) -> f64 {
    [0.5, 0.8, 0.3, 0.4][parameter] * [1.0, 1.3, 0.8, 1.1, 0.9][session % 5]
}

/// Normal scores in a fixed order, 1.6 times as wide as stated.
fn scatter(parameter: usize, session: usize) -> f64 {
    let place = (session * 7 + parameter * 11 + session * session * (parameter + 2)) % 29;
    1.6 * Normal::standard().inverse_cdf((place as f64 + 0.5) / 29.0)
}

fn truth(parameter: usize, session: usize) -> f64 {
    let years = (day(session) - day(0)) / YEAR;
    let after = f64::from(u8::from(session >= STEP));
    [7.0 + 1.5 * after, -4.0 + 14.0 * years, 6.0 - 9.0 * after, 2.0][parameter]
}

/// Neighbours are correlated.
fn correlation(i: usize, j: usize) -> f64 {
    [1.0, 0.6, 0.3, 0.1][i.abs_diff(j)]
}

fn machine(id: &str) -> MachineSessions {
    let sessions = (0..SESSIONS).map(|session| SessionValues {
        days: day(session),
        until_days: day(session) + 1.0,
        values: (0..4)
            .map(|k| {
                let value = truth(k, session) + scatter(k, session) * u(k, session);
                (k != 1 || session != MISSING).then_some((value, u(k, session)))
            })
            .collect(),
        covariance: (0..4)
            .map(|i| (0..4).map(|j| correlation(i, j) * u(i, session) * u(j, session)).collect())
            .collect(),
    });
    MachineSessions {
        machine_id: id.into(),
        name: "Mill".into(),
        code: "w C A b Y X Z t".into(),
        parameters: IDS.map(|id| (id.to_string(), "um".to_string(), format!("meaning of {id}"))).to_vec(),
        sessions: sessions.collect(),
    }
}

/// Terms of a parameter: a level, a drift or not, and steps before these sessions.
#[derive(Clone)]
struct Terms {
    drift: bool,
    steps: Vec<usize>,
}

/// Values and covariance of the terms of all parameters, by generalised least squares with the uncertainties enlarged
/// by a factor for each parameter.
fn least_squares(machine: &MachineSessions, terms: &[Terms], factors: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
    let starts: Vec<usize> =
        (0..=4).map(|k| terms[..k].iter().map(|t| 1 + usize::from(t.drift) + t.steps.len()).sum()).collect();
    let count = starts[4];
    let (mut normal, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
    for (number, session) in machine.sessions.iter().enumerate() {
        let present: Vec<usize> = (0..4).filter(|k| session.values[*k].is_some()).collect();
        let weight = DMatrix::from_fn(present.len(), present.len(), |i, j| {
            let (i, j) = (present[i], present[j]);
            session.covariance[i][j] * factors[i] * factors[j]
        });
        let weight = weight.try_inverse().unwrap();
        let mut rows = DMatrix::zeros(present.len(), count);
        for (row, k) in present.iter().enumerate() {
            let mut column = starts[*k];
            rows[(row, column)] = 1.0;
            if terms[*k].drift {
                column += 1;
                rows[(row, column)] = (session.days - mean_day(machine, *k)) / YEAR;
            }
            for step in &terms[*k].steps {
                column += 1;
                rows[(row, column)] = f64::from(u8::from(number >= *step));
            }
        }
        let values = DVector::from_iterator(present.len(), present.iter().map(|k| session.values[*k].unwrap().0));
        normal += rows.transpose() * &weight * &rows;
        right += rows.transpose() * &weight * values;
    }
    let covariance = normal.try_inverse().unwrap();
    (&covariance * right, covariance)
}

fn mean_day(machine: &MachineSessions, parameter: usize) -> f64 {
    let days: Vec<f64> =
        machine.sessions.iter().filter(|s| s.values[parameter].is_some()).map(|session| session.days).collect();
    days.iter().sum::<f64>() / days.len() as f64
}

fn near(found: f64, wanted: f64, what: &str) {
    assert!((found - wanted).abs() <= 1e-7 * wanted.abs().max(1e-3), "{what}: {found} instead of {wanted}");
}

fn history(compensations: Vec<Compensation>, machines: &[MachineSessions]) -> MachineHistory {
    let options = HistoryOptions { compensations, tolerance_u: 5.0, ..HistoryOptions::default() };
    analyse(machines, &options).machines.remove(0)
}

/// The terms that the history has found.
fn found_terms(machine: &MachineSessions, found: &MachineHistory) -> Vec<Terms> {
    let session = |days: f64| machine.sessions.iter().position(|session| session.days == days).unwrap();
    let of = |one: &ParameterHistory| Terms {
        drift: one.drift_per_year.is_some(),
        steps: one.steps.iter().map(|step| session(step.before_days)).collect(),
    };
    found.parameters.iter().map(of).collect()
}

#[test]
fn figures_of_parameters_follow_from_least_squares() {
    let machine = machine("M1");
    let whole = analyse(std::slice::from_ref(&machine), &HistoryOptions { tolerance_u: 5.0, ..Default::default() });
    let found = &whole.machines[0];
    let terms = found_terms(&machine, found);
    assert!(terms[1].drift && terms[1].steps.is_empty() && !terms[2].drift && terms[2].steps == [STEP]);
    assert!(!terms[3].drift && terms[3].steps.is_empty());
    let factors: Vec<f64> = found.parameters.iter().map(|one| one.enlargement).collect();
    assert!(factors.iter().all(|factor| (1.2..2.2).contains(factor)), "{factors:?}");
    let (values, covariance) = least_squares(&machine, &terms, &factors);
    let mut place = 0;
    let mut term = || {
        place += 1;
        (values[place - 1], covariance[(place - 1, place - 1)].sqrt())
    };
    assert_eq!((whole.tested_series, whole.false_discovery_rate), (4, 0.05));
    let mut p_values: Vec<f64> = found.parameters.iter().map(|one| one.p_value).collect();
    p_values.sort_by(f64::total_cmp);
    let significant = (0..4).rev().find(|k| p_values[*k] <= (k + 1) as f64 * 0.05 / 4.0).unwrap();
    near(whole.p_value_threshold, (significant + 1) as f64 * 0.05 / 4.0, "the threshold");
    for (k, one) in found.parameters.iter().enumerate() {
        let what = |figure: &str| format!("{} {figure}", one.id);
        assert_eq!((one.id.as_str(), one.unit.as_str()), (IDS[k], "um"));
        assert_eq!(one.meaning, format!("meaning of {}", IDS[k]));
        let has_terms = one.drift_per_year.is_some() || !one.steps.is_empty();
        assert!(one.p_value <= whole.p_value_threshold || !has_terms, "{}", one.id);
        let (value, u) = term();
        near(one.level.unwrap().value, value, &what("level"));
        near(one.level.unwrap().u, u, &what("u of the level"));
        if let Some(drift) = one.drift_per_year {
            let (value, u) = term();
            near(drift.value, value, &what("drift"));
            near(drift.u, u, &what("u of the drift"));
        }
        for step in &one.steps {
            let (value, u) = term();
            near(step.change.value, value, &what("step"));
            near(step.change.u, u, &what("u of the step"));
            assert_eq!(step.before_days, day(STEP));
            assert_eq!(step.after_days, day(STEP - 1));
            // The freedom is that of the series and of its prior.
            let own = StudentsT::new(0.0, 1.0, 22.0).unwrap().sf((value / u).abs()) * 2.0;
            let normal = Normal::standard().sf((value / u).abs()) * 2.0;
            assert!(step.p_value >= 0.999 * normal && step.p_value <= own * 1.001, "{normal} {} {own}", step.p_value);
        }
        check_line(&machine, one, k, &terms[k]);
        check_points(&machine, one, k, &terms[k]);
        check_due(&machine, one, k, &terms[k]);
    }
    assert_eq!((found.machine_id.as_str(), found.name.as_str()), ("M1", "Mill"));
    assert_eq!((found.code.as_str(), found.sessions), ("w C A b Y X Z t", SESSIONS));
    assert_eq!((found.first_days, found.last_days), (day(0), day(SESSIONS - 1)));
    let due = found.parameters.iter().filter_map(|one| Some((one.due_days?, &one.id)));
    let (days, id) = due.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    assert_eq!((found.due, found.due_days, found.due_parameter.as_ref()), (Due::Date, Some(days), Some(id)));
    let out: Vec<&String> = found.parameters.iter().filter(|one| one.is_out_of_control()).map(|one| &one.id).collect();
    assert_eq!(found.out_of_control.iter().collect::<Vec<_>>(), out);
    // The drift is out of control, what stands still after its step is not.
    assert!(out.contains(&&"EY0C".to_string()) && !out.contains(&&"EA0C".to_string()), "{out:?}");
}

/// The line of a figure is level, drift and steps at each session, with both values where it steps.
fn check_line(machine: &MachineSessions, one: &ParameterHistory, k: usize, terms: &Terms) {
    let mut line = one.modelled().into_iter();
    for (session, point) in machine.sessions.iter().enumerate().filter(|(_, session)| session.values[k].is_some()) {
        let drift = one.drift_per_year.map_or(0.0, |drift| drift.value) * (point.days - mean_day(machine, k)) / YEAR;
        let steps = |until: usize| -> f64 {
            one.steps.iter().zip(&terms.steps).filter(|(_, at)| **at <= until).map(|(step, _)| step.change.value).sum()
        };
        let mut values = vec![steps(session)];
        if terms.steps.contains(&session) {
            values.insert(0, steps(session - 1));
        }
        for value in values {
            let (days, found) = line.next().unwrap();
            assert_eq!(days, point.days);
            near(found, one.level.unwrap().value + drift + value, &format!("the line of {}", one.id));
        }
    }
    assert_eq!(line.next(), None);
}

/// Charts by their definitions, with the uncertainties enlarged: from the weighted mean of the first six sessions after
/// the last step, with the variance of an average of correlated deviations summed over all pairs.
fn check_points(machine: &MachineSessions, one: &ParameterHistory, k: usize, terms: &Terms) {
    let present: Vec<usize> = (0..SESSIONS).filter(|session| machine.sessions[*session].values[k].is_some()).collect();
    assert_eq!(one.points.len(), present.len());
    let mut bounds = vec![0];
    bounds.extend(terms.steps.iter().map(|step| present.iter().position(|session| session == step).unwrap()));
    bounds.push(present.len());
    let u: Vec<f64> = present.iter().map(|session| u(k, *session) * one.enlargement).collect();
    for (point, (session, u)) in one.points.iter().zip(present.iter().zip(&u)) {
        let (value, _) = machine.sessions[*session].values[k].unwrap();
        assert_eq!((point.days, point.value), (day(*session), value));
        near(point.u, *u, "u of a point");
        assert_eq!(point.out_of_control, point.shewhart.abs() > 3.0 || point.ewma.abs() > 2.962);
    }
    for pair in bounds.windows(2) {
        let (points, u) = (&one.points[pair[0]..pair[1]], &u[pair[0]..pair[1]]);
        let first = 6.min(points.len() / 2);
        let weight: f64 = u[..first].iter().map(|u| 1.0 / (u * u)).sum();
        let reference = points[..first].iter().map(|point| point.value / (point.u * point.u)).sum::<f64>() / weight;
        if pair[1] == present.len() {
            near(one.reference, reference, "the reference");
        }
        // The reference contains these sessions, whose deviations from it scatter less by that.
        for (point, u) in points[..first].iter().zip(u) {
            let scale = (u * u - 1.0 / weight).max(0.0).sqrt();
            let expected = if scale > 1e-6 * u { (point.value - reference) / scale } else { 0.0 };
            near(point.shewhart, expected, "a session of the reference");
            assert_eq!(point.ewma, 0.0);
        }
        let scale: Vec<f64> = u.iter().map(|u| (u * u + 1.0 / weight).sqrt()).collect();
        let z = |i: usize| (points[i].value - reference) / scale[i];
        for at in first..points.len() {
            near(points[at].shewhart, z(at), "a Shewhart chart");
            let share = |i: usize| 0.2 * 0.8_f64.powi((at - i) as i32);
            let average: f64 = (first..=at).map(|i| share(i) * z(i)).sum();
            let covariance =
                |i: usize, j: usize| (f64::from(u8::from(i == j)) * u[i] * u[i] + 1.0 / weight) / (scale[i] * scale[j]);
            let pairs = (first..=at).flat_map(|i| (first..=at).map(move |j| (i, j)));
            let variance: f64 = pairs.map(|(i, j)| share(i) * share(j) * covariance(i, j)).sum();
            near(points[at].ewma, average / variance.sqrt(), "a moving average");
        }
    }
}

/// `last + (5 − 2)·u / rate` with the median `u`, and the scatter about the model of this parameter alone.
fn check_due(machine: &MachineSessions, one: &ParameterHistory, k: usize, terms: &Terms) {
    let alone = |drift: bool| {
        let present: Vec<&SessionValues> = machine.sessions.iter().filter(|s| s.values[k].is_some()).collect();
        let mut columns: Vec<Box<dyn Fn(&SessionValues) -> f64>> = vec![Box::new(|_| 1.0)];
        if drift {
            columns.push(Box::new(|session| (session.days - day(0)) / YEAR));
        }
        for step in &terms.steps {
            columns.push(Box::new(|session| f64::from(u8::from(session.days >= day(*step)))));
        }
        let x = DMatrix::from_fn(present.len(), columns.len(), |i, j| {
            columns[j](present[i]) / present[i].values[k].unwrap().1
        });
        let y = DVector::from_iterator(
            present.len(),
            present.iter().map(|session| session.values[k].unwrap()).map(|(value, u)| value / u),
        );
        let inverse = (x.transpose() * &x).try_inverse().unwrap();
        let beta = &inverse * x.transpose() * &y;
        (beta.clone(), inverse, (y.clone() - &x * beta).norm_squared(), y.len() - columns.len())
    };
    let (_, _, sum, freedom) = alone(terms.drift);
    near(one.scatter_ratio, (sum / freedom as f64).sqrt(), "the scatter");
    let (beta, inverse, ..) = alone(true);
    let rate = if terms.drift { beta[1].abs() } else { one.enlargement * inverse[(1, 1)].sqrt() };
    let mut u: Vec<f64> = one.points.iter().map(|point| point.u).collect();
    u.sort_by(f64::total_cmp);
    let years = 3.0 * u[u.len() / 2] / rate;
    assert_eq!(one.due, if years <= 10.0 { Due::Date } else { Due::BeyondTenYears }, "{}", one.id);
    match one.due_days {
        Some(days) => near(days - day(SESSIONS - 1), years * YEAR, &format!("the next check of {}", one.id)),
        None => assert!(years > 10.0),
    }
}

/// The change of all parameters at the step, its covariance, and the values before it.
fn change(machine: &MachineSessions, found: &MachineHistory) -> (DVector<f64>, DMatrix<f64>, DVector<f64>) {
    let mut terms = found_terms(machine, found);
    let factors: Vec<f64> = found.parameters.iter().map(|one| one.enlargement).collect();
    terms.iter_mut().for_each(|terms| terms.steps = vec![STEP]);
    let (values, covariance) = least_squares(machine, &terms, &factors);
    let places: Vec<usize> = (0..4)
        .scan(0, |start, k| {
            *start += 2 + usize::from(terms[k].drift);
            Some(*start - 1)
        })
        .collect();
    let before = DVector::from_iterator(
        4,
        (0..4).map(|k| match terms[k].drift {
            true => values[places[k] - 2] + values[places[k] - 1] * (day(STEP - 1) - mean_day(machine, k)) / YEAR,
            false => values[places[k] - 1],
        }),
    );
    (values.select_rows(&places), covariance.select_rows(&places).select_columns(&places), before)
}

fn cosine(metric: &DMatrix<f64>, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
    let product = |a: &DVector<f64>, b: &DVector<f64>| (a.transpose() * metric * b)[(0, 0)];
    product(a, b) / (product(a, a) * product(b, b)).sqrt()
}

fn table(machine: &str, at: f64, changes: &[(&str, f64)]) -> Vec<Compensation> {
    let row = |(id, value): &(&str, f64)| Compensation {
        machine_id: machine.into(),
        days: [at; 2],
        id: id.to_string(),
        value: *value,
        unit: "um".into(),
        source: "table.toml:3".into(),
    };
    changes.iter().map(row).collect()
}

#[test]
fn figures_of_changes_are_in_the_metric_of_their_covariance() {
    let machine = machine("M1");
    let quiet = history(Vec::new(), std::slice::from_ref(&machine));
    let (values, covariance, before) = change(&machine, &quiet);
    let metric = covariance.clone().try_inverse().unwrap();
    let chi_square = |v: &DVector<f64>| (v.transpose() * &metric * v)[(0, 0)];
    let check = |event: &ChangeEvent| {
        assert_eq!((event.after_days, event.before_days), (day(STEP - 1), day(STEP)));
        assert_eq!(event.degrees_of_freedom, 4);
        near(event.chi_square, chi_square(&values), "χ² of the change");
        assert!(event.parameters.contains(&"EA0C".to_string()) && !event.parameters.contains(&"EY0C".to_string()));
        for (k, change) in event.changes.iter().enumerate() {
            assert_eq!((change.id.as_str(), change.unit.as_str()), (IDS[k], "um"));
            near(change.value, values[k], &format!("the change of {}", change.id));
            near(change.u, covariance[(k, k)].sqrt(), &format!("u of the change of {}", change.id));
        }
    };
    let (at, own) = (day(STEP) - 10.0, [("EX0C", 1.5), ("EA0C", -9.0)]);
    let whole = values.map(f64::from);
    let as_found: Vec<(&str, f64)> = IDS.into_iter().zip(whole.iter().copied()).collect();
    let more: Vec<(&str, f64)> =
        as_found.iter().map(|(id, value)| (*id, value + if *id == "EB0C" { 4.0 } else { 0.0 })).collect();
    let opposite: Vec<(&str, f64)> = as_found.iter().map(|(id, value)| (*id, -value)).collect();
    // Tables of another machine, another time or other parameters say nothing of this change.
    let unknown = [
        table("M2", at, &own),
        table("M1", day(STEP - 1) - 2.0, &own),
        table("M1", day(STEP) + 2.0, &own),
        table("M1", at, &[("EZ0A", 3.0)]),
    ];
    let to_zero = cosine(&metric, &values, &-before);
    for compensations in unknown.into_iter().chain([Vec::new()]) {
        let history = history(compensations.clone(), std::slice::from_ref(&machine));
        assert_eq!(history.changes.len(), 1, "{:?}", history.changes);
        let event = &history.changes[0];
        check(event);
        near(event.direction_cosine, to_zero, "the direction to zero");
        assert_eq!(event.kind, if to_zero >= 0.9 { Kind::Correction } else { Kind::Shift }, "{compensations:?}");
        assert_eq!(event.remainder_chi_square, None, "{compensations:?}");
    }
    for (known, kind) in [
        (table("M1", at, &own), None),
        (table("M1", day(STEP) + 0.5, &as_found), Some(Kind::Compensation)),
        (table("M1", day(STEP - 1), &as_found), Some(Kind::Compensation)),
        ([table("M1", at, &as_found[..2]), table("M1", at, &as_found[2..])].concat(), Some(Kind::Compensation)),
        ([table("M1", at, &more), table("M2", at, &more)].concat(), None),
        (table("M1", at, &opposite), Some(Kind::Shift)),
    ] {
        let mut stated = DVector::zeros(4);
        for Compensation { id, value, .. } in known.iter().filter(|one| one.machine_id == "M1") {
            stated[IDS.iter().position(|own| own == id).unwrap()] += value;
        }
        let history = history(known, std::slice::from_ref(&machine));
        let event = &history.changes[0];
        check(event);
        let rest = chi_square(&(&values - &stated));
        println!("{:?} remainder {rest:.3} cosine {:.3}", event.kind, event.direction_cosine);
        assert!((event.remainder_chi_square.unwrap() - rest).abs() < 1e-6 * chi_square(&values));
        near(event.direction_cosine, cosine(&metric, &values, &stated), "the direction of the table");
        // χ² with four degrees of freedom has its 0.1 % at 18.467.
        let wanted = match (rest < 18.467, event.direction_cosine) {
            (true, cosine) if cosine >= 0.9 => Kind::Compensation,
            (false, cosine) if cosine > 0.0 && rest < chi_square(&values) => Kind::CompensationAndShift,
            _ => Kind::Shift,
        };
        assert_eq!(event.kind, wanted);
        assert!(kind.is_none_or(|kind| kind == wanted));
    }
}
