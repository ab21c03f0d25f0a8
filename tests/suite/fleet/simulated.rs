//! Machines with known drifts and steps: how often they are found, and how often something else is.

use abbe::fleet::compensations::Compensation;
use abbe::fleet::history::events::{ChangeEvent, Kind};
use abbe::fleet::history::results::{Due, ParameterHistory};
use abbe::fleet::history::{DAYS_PER_YEAR, FleetHistory, HistoryOptions};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use statrs::distribution::{Binomial, DiscreteCDF};

use super::machines::{MachineSessions, SessionValues, analyse};

/// Parameters of a machine: eight location errors.
pub(super) const PARAMETERS: usize = 8;
/// Three years, one session a month.
const SESSIONS: usize = 36;

/// A machine of three years.
pub(super) fn machine(number: usize, truth: impl Fn(usize, f64, usize) -> f64, random: &mut Pcg64) -> MachineSessions {
    machine_of(SESSIONS, number, truth, random)
}

/// A machine with correlated estimates of known uncertainty about its true values, one session a month.
pub(super) fn machine_of(
    sessions: usize,
    number: usize,
    truth: impl Fn(usize, f64, usize) -> f64,
    random: &mut Pcg64,
) -> MachineSessions {
    let u = |parameter: usize| 0.5 + 0.2 * parameter as f64;
    // Neighbouring parameters are correlated by 0.5: estimates of one set-up.
    let root = DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| match i as isize - j as isize {
        0 if i == 0 => 1.0,
        0 => 0.75_f64.sqrt(),
        1.. => 0.5_f64.powi((i - j) as i32) * if j == 0 { 1.0 } else { 0.75_f64.sqrt() },
        _ => 0.0,
    });
    let correlation = &root * root.transpose();
    let covariance: Vec<Vec<f64>> =
        (0..PARAMETERS).map(|i| (0..PARAMETERS).map(|j| correlation[(i, j)] * u(i) * u(j)).collect()).collect();
    let sessions = (0..sessions)
        .map(|session| {
            let days = 30.4375 * session as f64;
            let normal: Vec<f64> = (0..PARAMETERS).map(|_| StandardNormal.sample(random)).collect();
            let values = (0..PARAMETERS).map(|i| {
                let noise: f64 = (0..PARAMETERS).map(|j| root[(i, j)] * normal[j]).sum();
                Some(((truth(i, days / DAYS_PER_YEAR, session) + noise) * u(i), u(i)))
            });
            SessionValues { days, until_days: days, values: values.collect(), covariance: covariance.clone() }
        })
        .collect();
    let parameters = (0..PARAMETERS).map(|i| (format!("E{i}"), "um".to_string(), String::new())).collect();
    MachineSessions { machine_id: number.to_string(), parameters, sessions, ..MachineSessions::default() }
}

#[derive(Clone, Copy, PartialEq)]
enum Truth {
    Nothing,
    Drift,
    Step(usize),
}

/// Found and false claims of fleets of 20 machines, each with a drift of one parameter and a step of another.
#[derive(Default)]
struct Counts {
    drifts: [u64; 2],
    steps: [u64; 2],
    /// Parameters without a change that are claimed to have changed, of all that are claimed.
    claims: [u64; 2],
    /// Terms of changed parameters that are not the true one (a step in place of a drift, a second step), of all terms.
    other_terms: [u64; 2],
}

impl Counts {
    fn add(&mut self, history: &FleetHistory, truth: &[[Truth; PARAMETERS]]) {
        for (machine, truth) in history.machines.iter().zip(truth) {
            for (parameter, truth) in machine.parameters.iter().zip(truth) {
                let terms = u64::from(parameter.drift_per_year.is_some()) + parameter.steps.len() as u64;
                self.claims[0] += u64::from(terms > 0 && *truth == Truth::Nothing);
                self.claims[1] += u64::from(terms > 0);
                let true_terms = match truth {
                    Truth::Nothing => 0,
                    Truth::Drift => {
                        let found = parameter.drift_per_year.is_some();
                        self.drifts[0] += u64::from(found);
                        self.drifts[1] += 1;
                        u64::from(found)
                    }
                    Truth::Step(at) => {
                        let near = |days: f64| (days / 30.4375 - *at as f64).abs() < 1.5;
                        let found = parameter.steps.iter().any(|step| near(step.before_days));
                        self.steps[0] += u64::from(found);
                        self.steps[1] += 1;
                        u64::from(found)
                    }
                };
                if *truth != Truth::Nothing {
                    self.other_terms[0] += terms - true_terms;
                    self.other_terms[1] += terms;
                }
            }
        }
    }
}

/// Whether a proportion is consistent with at least (at most) a rate: a smaller (larger) count has a probability above
/// 0.1 %.
pub(super) fn consistent(count: [u64; 2], at_least: bool, rate: f64) -> bool {
    let law = Binomial::new(rate, count[1]).unwrap();
    if at_least { law.cdf(count[0]) > 1e-3 } else { count[0] == 0 || law.sf(count[0] - 1) > 1e-3 }
}

/// The number of fleets of a test: this, or that of a study.
pub(super) fn number_of_fleets(usual: u64) -> u64 {
    std::env::var("ABBE_STUDY").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[test]
fn drifts_and_steps_of_a_fleet_are_found() {
    let (mut counts, mut any) = (Counts::default(), [0; 2]);
    for fleet in 0..number_of_fleets(6) {
        let mut random = Pcg64::seed_from_u64(41 + fleet);
        let mut truth = [[Truth::Nothing; PARAMETERS]; 20];
        for truth in &mut truth {
            let drifting = random.random_range(0..PARAMETERS);
            truth[drifting] = Truth::Drift;
            let stepping = (drifting + random.random_range(1..PARAMETERS)) % PARAMETERS;
            truth[stepping] = Truth::Step(random.random_range(3..SESSIONS - 2));
        }
        let mut machines = Vec::new();
        for (number, truth) in truth.iter().enumerate() {
            let value = |parameter: usize, years: f64, session: usize| match truth[parameter] {
                Truth::Nothing => 0.0,
                Truth::Drift => years,
                Truth::Step(at) => 4.0 * f64::from(u8::from(session >= at)),
            };
            machines.push(machine(number, value, &mut random));
        }
        counts.add(&analyse(&machines, &HistoryOptions::default()), &truth);
        // A fleet in which nothing changes.
        let quiet: Vec<MachineSessions> = (0..20).map(|number| machine(number, |_, _, _| 3.0, &mut random)).collect();
        let history = analyse(&quiet, &HistoryOptions::default());
        any[0] += u64::from(history.machines.iter().flat_map(|machine| &machine.parameters).any(has_change));
        any[1] += 1;
    }
    let Counts { drifts, steps, claims, other_terms } = &counts;
    println!(
        "drifts {drifts:?}, steps {steps:?}, false of all claims {claims:?}, other terms {other_terms:?}, fleets \
         without a change that have a claim {any:?}"
    );
    assert!(consistent(counts.drifts, true, 0.9), "{:?}", counts.drifts);
    assert!(consistent(counts.steps, true, 0.9), "{:?}", counts.steps);
    assert!(consistent(counts.claims, false, 0.05), "{:?}", counts.claims);
    // Few fleets; `scatter_is_no_change` counts more.
    assert!(consistent(any, false, 0.05), "{any:?}");
}

/// The table of a compensation half a month before a session.
fn table(number: usize, session: usize, change: impl Fn(usize) -> f64) -> Vec<Compensation> {
    let row = |i| Compensation {
        machine_id: number.to_string(),
        days: [(session as f64 - 0.5) * 30.4375; 2],
        id: format!("E{i}"),
        value: change(i),
        unit: "um".into(),
        source: String::new(),
    };
    (0..PARAMETERS).map(row).collect()
}

/// Compensations of 4 u of all parameters, whose steps noise moves by a session: each is one change, and named. The
/// remainder is significant with a probability of 0.1 %; a position beside the true one may add to that.
#[test]
fn small_compensations_are_named() {
    let mut random = Pcg64::seed_from_u64(11);
    let mut named = [0, 0];
    for number in 0..80 {
        let at = random.random_range(4..SESSIONS - 3);
        let value = |_: usize, _: f64, session: usize| 4.0 * f64::from(u8::from(session >= at));
        let machines = [machine(number, value, &mut random)];
        let compensations = table(number, at, |i| 4.0 * (0.5 + 0.2 * i as f64));
        let history = analyse(&machines, &HistoryOptions { compensations, ..HistoryOptions::default() });
        let is_named = |change: &ChangeEvent| change.kind == Kind::Compensation;
        named[0] += u64::from(history.machines[0].changes.iter().any(is_named));
        named[1] += 1;
    }
    println!("named compensations {named:?}");
    assert!(consistent(named, true, 0.98), "{named:?}");
}

/// A parameter that every second session has may change during two months: a table of that time is its explanation. A
/// table of other parameters says nothing.
#[test]
fn a_compensation_between_sparse_sessions_is_named() {
    let mut random = Pcg64::seed_from_u64(31);
    let value = |parameter: usize, _: f64, session: usize| if parameter == 0 && session >= 15 { 9.0 } else { 0.0 };
    let mut one = machine(0, value, &mut random);
    for values in one.sessions.iter_mut().skip(1).step_by(2) {
        values.values[0] = None;
    }
    // Between the sessions 14 and 15. The session 15 lacks the parameter: its step lies between 14 and 16.
    let own = table(0, 15, |i| if i == 0 { 9.0 * 0.5 } else { 0.0 });
    let days = [one.sessions[14].days, one.sessions[16].days];
    for at in [14.5, 15.5] {
        let moved = |row: &Compensation| Compensation { days: [at * 30.4375; 2], ..row.clone() };
        let compensations = own.iter().map(moved).collect();
        let options = HistoryOptions { compensations, ..HistoryOptions::default() };
        let changes = &analyse(std::slice::from_ref(&one), &options).machines[0].changes;
        assert_eq!(changes.len(), 1, "{changes:?}");
        assert_eq!((changes[0].kind, [changes[0].after_days, changes[0].before_days]), (Kind::Compensation, days));
    }
    let other = Compensation { id: "E99".into(), value: 5.0, ..own[0].clone() };
    let kinds = |compensations: Vec<Compensation>| -> Vec<Kind> {
        let options = HistoryOptions { compensations, ..HistoryOptions::default() };
        analyse(std::slice::from_ref(&one), &options).machines[0].changes.iter().map(|change| change.kind).collect()
    };
    assert_eq!(kinds(vec![other]), kinds(Vec::new()));
}

/// The table in the opposite direction is no explanation, however small it is.
#[test]
fn a_table_in_another_direction_is_no_explanation() {
    let mut random = Pcg64::seed_from_u64(13);
    let value = |parameter: usize, _: f64, session: usize| if parameter == 0 && session >= 15 { 6.0 } else { 0.0 };
    let machines = [machine(0, value, &mut random)];
    let compensations = table(0, 15, |i| if i == 0 { -0.1 } else { 0.0 });
    let history = analyse(&machines, &HistoryOptions { compensations, ..HistoryOptions::default() });
    let kinds: Vec<Kind> = history.machines[0].changes.iter().map(|change| change.kind).collect();
    assert_eq!(kinds, [Kind::Shift]);
}

/// A parameter that only the sessions before or after a change have does not hide the change of the others.
#[test]
fn a_parameter_on_one_side_does_not_hide_a_change() {
    for before in [false, true] {
        let mut random = Pcg64::seed_from_u64(17);
        let value = |_: usize, _: f64, session: usize| if session >= 15 { 8.0 } else { 0.0 };
        let mut one = machine(0, value, &mut random);
        for (session, values) in one.sessions.iter_mut().enumerate() {
            if (session < 15) != before {
                values.values[7] = None;
            }
        }
        let history = &analyse(&[one], &HistoryOptions::default()).machines[0];
        assert_eq!(history.changes.len(), 1, "{:?}", history.changes);
        assert_eq!(history.changes[0].degrees_of_freedom, 7);
        assert_eq!(history.parameters[7].steps, []);
        if before {
            // Its last value is years old: another parameter sets the date of the machine.
            assert_ne!(history.due_parameter.as_deref(), Some("E7"));
        }
    }
}

/// Without a second date there is no bound of a drift.
#[test]
fn one_date_determines_no_next_check() {
    let mut random = Pcg64::seed_from_u64(19);
    let mut one = machine(0, |_, _, _| 0.0, &mut random);
    one.sessions.iter_mut().for_each(|session| session.days = 100.0);
    let mut few = machine(1, |_, _, _| 0.0, &mut random);
    few.sessions.truncate(3);
    for machine in analyse(&[one, few], &HistoryOptions::default()).machines {
        assert_eq!((machine.due, machine.due_days), (Due::NotDetermined, None));
    }
}

/// Sessions that scatter more than their uncertainties say are no changes.
#[test]
fn scatter_is_no_change() {
    let mut random = Pcg64::seed_from_u64(23);
    for scatter in [1.0, 1.2, 1.4, 1.6] {
        let mut any = [0, 0];
        for _ in 0..number_of_fleets(60) {
            let mut quiet: Vec<MachineSessions> = (0..20).map(|one| machine(one, |_, _, _| 0.0, &mut random)).collect();
            let sessions = quiet.iter_mut().flat_map(|machine| &mut machine.sessions);
            for (value, _) in sessions.flat_map(|session| &mut session.values).flatten() {
                *value *= scatter;
            }
            let history = analyse(&quiet, &HistoryOptions::default());
            any[0] += u64::from(history.machines.iter().flat_map(|machine| &machine.parameters).any(has_change));
            any[1] += 1;
        }
        println!("scatter {scatter}: fleets without a change that have a claim {any:?}");
        assert!(consistent(any, false, 0.05), "{scatter}: {any:?}");
    }
}

/// Whether a parameter is claimed to have changed.
pub(super) fn has_change(parameter: &ParameterHistory) -> bool {
    parameter.drift_per_year.is_some() || !parameter.steps.is_empty()
}

/// Half a year of a small fleet: a drift far above the noise is found, although few sessions determine the scatter
/// badly, and a drifting machine does not pass for a scattering one.
#[test]
fn a_large_drift_of_a_small_fleet_is_found() {
    let mut random = Pcg64::seed_from_u64(29);
    let mut small = |drift: f64| {
        let machines = (0..4).map(|number| {
            let value = |parameter: usize, years: f64, _: usize| match (number, parameter) {
                (0, 0) => 12.0 * drift * years,
                _ => 0.0,
            };
            let mut one = machine(number, value, &mut random);
            one.sessions.truncate(6);
            one.parameters.truncate(2);
            one.sessions.iter_mut().for_each(|session| session.values.truncate(2));
            one
        });
        analyse(&machines.collect::<Vec<_>>(), &HistoryOptions::default())
    };
    let (mut found, mut others, mut any) = ([0, 0], [0, 0], [0, 0]);
    for _ in 0..number_of_fleets(200) {
        let changed = |history: &FleetHistory| -> Vec<bool> {
            history.machines.iter().flat_map(|machine| &machine.parameters).map(has_change).collect()
        };
        // 9 standard uncertainties a month.
        let drifting = small(9.0);
        found[0] += u64::from(drifting.machines[0].parameters[0].drift_per_year.is_some());
        found[1] += 1;
        let claims = changed(&drifting);
        others[0] += claims[1..].iter().filter(|claim| **claim).count() as u64;
        others[1] += claims.iter().filter(|claim| **claim).count() as u64;
        any[0] += u64::from(changed(&small(0.0)).contains(&true));
        any[1] += 1;
    }
    println!("small fleets: drifts {found:?}, false of all claims {others:?}, quiet fleets with a claim {any:?}");
    assert!(consistent(found, true, 0.98), "{found:?}");
    assert!(consistent(others, false, 0.05), "{others:?}");
    assert!(consistent(any, false, 0.05), "{any:?}");
}

/// A compensation takes away what its tables say; a collision does not. Both are found as steps of several parameters.
#[test]
fn a_compensation_is_told_from_a_collision_by_its_direction() {
    let mut random = Pcg64::seed_from_u64(7);
    let before = |parameter: usize| [9.0, -7.0, 8.0, 0.0, 6.0, 0.0, -9.0, 5.0][parameter];
    let u = |parameter: usize| 0.5 + 0.2 * parameter as f64;
    let (mut kinds, mut untabled) = (Vec::new(), Vec::new());
    for number in 0..20 {
        let collides = number % 2 == 1;
        let hit = |parameter: usize| if parameter % 3 == number % 3 { 6.0 } else { 0.0 };
        let value = |parameter: usize, _: f64, session: usize| match (session >= 15, collides) {
            (false, _) => before(parameter),
            (true, false) => 0.0,
            (true, true) => before(parameter) + hit(parameter),
        };
        let machines = [machine(number, value, &mut random)];
        let table = table(number, 15, |i| -before(i) * u(i));
        let kind = |compensations: Vec<Compensation>| {
            let options = HistoryOptions { compensations, ..HistoryOptions::default() };
            let changes = &analyse(&machines, &options).machines[0].changes;
            assert_eq!(changes.len(), 1, "{number}: {changes:?}");
            changes[0].kind
        };
        kinds.push(kind(table));
        untabled.push(kind(Vec::new()));
    }
    for number in 0..20 {
        let expected = if number % 2 == 1 { [Kind::Shift; 2] } else { [Kind::Compensation, Kind::Correction] };
        assert_eq!([kinds[number], untabled[number]], expected, "{number}");
    }
}
