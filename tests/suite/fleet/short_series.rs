//! Simulated machines with few sessions: steps that are found, and claims of machines without a change.

use abbe::fleet::history::HistoryOptions;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::machines::{MachineSessions, analyse};
use super::simulated::{PARAMETERS, consistent, has_change, machine, machine_of, number_of_fleets};

/// Ten sessions with a step of 600 u, of one parameter or of all, in a fleet of one machine with one or eight
/// parameters. It stood as scatter once.
#[test]
fn a_large_step_is_no_scatter() {
    let mut random = Pcg64::seed_from_u64(37);
    let mut further = [0, 0];
    for (parameters, stepping) in [(1, 1), (8, 1), (8, 8)] {
        for at in 1..10 {
            let value = |one: usize, _: f64, session: usize| if one < stepping && session >= at { 600.0 } else { 0.0 };
            let mut one = machine_of(10, 0, value, &mut random);
            one.parameters.truncate(parameters);
            one.sessions.iter_mut().for_each(|session| session.values.truncate(parameters));
            let history = &analyse(&[one], &HistoryOptions::default()).machines[0];
            for parameter in &history.parameters[..stepping] {
                let is_true = |days: f64| (days / 30.4375 - at as f64).abs() < 0.1;
                let step = parameter.steps.iter().find(|step| is_true(step.before_days));
                assert!(step.is_some_and(|step| step.p_value < 1e-6), "{parameters} {at}: {parameter:?}");
                assert!(parameter.enlargement < 2.5, "{parameter:?}");
                further[0] += parameter.steps.len() as u64 - 1 + u64::from(parameter.drift_per_year.is_some());
                further[1] += 1;
            }
        }
    }
    // Beside a certain step a term counts by itself.
    assert!(consistent(further, false, 0.05), "{further:?}");
}

/// A step and its repair in a series alone, and steps of every year in all series of a fleet, are no scatter either.
#[test]
fn several_steps_are_no_scatter() {
    let mut random = Pcg64::seed_from_u64(43);
    let excursion = |_: usize, _: f64, session: usize| if (12..24).contains(&session) { 15.0 } else { 0.0 };
    let mut one = machine(0, excursion, &mut random);
    one.parameters.truncate(1);
    one.sessions.iter_mut().for_each(|session| session.values.truncate(1));
    let history = analyse(&[one], &HistoryOptions::default());
    assert_eq!(history.machines[0].parameters[0].steps.len(), 2, "{:?}", history.machines[0].parameters[0]);
    let yearly = |_: usize, _: f64, session: usize| [0.0, 8.0, 2.0, 12.0][(session + 3) / 10];
    let fleet: Vec<MachineSessions> = (0..5).map(|number| machine(number, yearly, &mut random)).collect();
    let history = analyse(&fleet, &HistoryOptions::default());
    let mut steps = [0, 0];
    for parameter in history.machines.iter().flat_map(|machine| &machine.parameters) {
        steps[0] += parameter.steps.len().min(3) as u64;
        steps[1] += 3;
        assert!(parameter.enlargement < 1.3, "{parameter:?}");
    }
    assert!(consistent(steps, true, 0.98), "{steps:?}");
}

/// Machines with a few sessions, each with a step of one parameter.
#[derive(Default)]
struct Short {
    /// Steps that are claimed as a change of the parameter.
    changed: [u64; 2],
    /// Steps that are claimed as a step, ± 1 session.
    named: [u64; 2],
    /// Claims of other parameters, of all claims.
    other: [u64; 2],
}

impl Short {
    /// Fleets of so many machines, in all at least so many, with a step of so many u in front of a session that leaves
    /// so many on either side.
    fn of(machines: [usize; 2], sessions: usize, step: f64, sides: usize, random: &mut Pcg64) -> Short {
        let mut counts = Short::default();
        for _ in 0..machines[1].div_ceil(machines[0]) {
            let places: Vec<(usize, usize)> = (0..machines[0])
                .map(|_| (random.random_range(0..PARAMETERS), random.random_range(sides..=sessions - sides)))
                .collect();
            let fleet: Vec<MachineSessions> = places
                .iter()
                .enumerate()
                .map(|(number, (place, at))| {
                    let value = |one: usize, _: f64, session: usize| {
                        step * f64::from(u8::from(one == *place && session >= *at))
                    };
                    machine_of(sessions, number, value, random)
                })
                .collect();
            let history = analyse(&fleet, &HistoryOptions::default());
            for (machine, (place, at)) in history.machines.iter().zip(&places) {
                for (number, parameter) in machine.parameters.iter().enumerate() {
                    let claimed = u64::from(has_change(parameter));
                    counts.other[1] += claimed;
                    if number == *place {
                        let near = |days: f64| (days / 30.4375 - *at as f64).abs() < 1.5;
                        let named = parameter.steps.iter().any(|step| near(step.before_days));
                        counts.changed = [counts.changed[0] + claimed, counts.changed[1] + 1];
                        counts.named = [counts.named[0] + u64::from(named), counts.named[1] + 1];
                    } else {
                        counts.other[0] += claimed;
                    }
                }
            }
        }
        counts
    }
}

/// 200 machines with a step of 5 u of one parameter, at least two sessions from either end.
#[test]
fn steps_of_short_series_are_found() {
    let mut random = Pcg64::seed_from_u64(47);
    for sessions in [8, 10, 24] {
        for sides in [2, 1] {
            let found = Short::of([200, 200 * number_of_fleets(1) as usize], sessions, 5.0, sides, &mut random);
            println!(
                "{sessions} sessions, {sides} on either side at least: changed {:?}, named {:?}, others {:?}",
                found.changed, found.named, found.other
            );
            assert!(consistent(found.changed, true, 0.95), "{sessions}: {:?}", found.changed);
            assert!(sides == 1 || consistent(found.named, true, 0.95), "{sessions}: {:?}", found.named);
            assert!(consistent(found.other, false, 0.05), "{sessions}: {:?}", found.other);
        }
    }
}

/// Fleets of short series without a change, whose sessions scatter as the uncertainties say, by a factor, or by a factor
/// of each machine.
#[test]
fn short_series_without_a_change_have_few_claims() {
    let mut random = Pcg64::seed_from_u64(53);
    for machines in [1, 4, 20] {
        for sessions in [5, 8, 10, 24] {
            for (scatter, of_machines) in [(1.0, 0.0), (1.3, 0.0), (1.6, 0.0), (1.2, 0.2)] {
                let mut any = [0, 0];
                for _ in 0..number_of_fleets(2) * (40 / machines as u64) {
                    let mut quiet: Vec<MachineSessions> =
                        (0..machines).map(|one| machine_of(sessions, one, |_, _, _| 0.0, &mut random)).collect();
                    for machine in &mut quiet {
                        let normal: f64 = StandardNormal.sample(&mut random);
                        let values = machine.sessions.iter_mut().flat_map(|session| &mut session.values).flatten();
                        values.for_each(|(value, _)| *value *= scatter * (of_machines * normal).exp());
                    }
                    let history = analyse(&quiet, &HistoryOptions::default());
                    any[0] += u64::from(history.machines.iter().flat_map(|one| &one.parameters).any(has_change));
                    any[1] += 1;
                }
                println!(
                    "{machines} machines, {sessions} sessions, scatter {scatter}, of machines {of_machines}: claims {any:?}"
                );
                assert!(consistent(any, false, 0.05), "{machines} {sessions} {scatter}: {any:?}");
            }
        }
    }
}

/// The smallest step, in halves of u, that is found in 95 % of the machines; printed for the documentation. A step of
/// one parameter of eight, with at least two sessions on either side.
#[test]
fn the_smallest_steps_that_are_found() {
    let mut random = Pcg64::seed_from_u64(59);
    let (study, least) = (number_of_fleets(0) > 0, 4 * number_of_fleets(0) as usize);
    for machines in [1, 4, 20, 200] {
        for sessions in [5, 8, 10, 24] {
            let found = |step: f64, random: &mut Pcg64| {
                let counts = Short::of([machines, least.max(40)], sessions, step, 2, random);
                let share = |count: [u64; 2]| count[0] as f64 / count[1] as f64;
                [share(counts.changed), share(counts.named)]
            };
            if !study {
                // The step of the table and a half more.
                let largest = if sessions == 5 { 14.0 } else { 8.0 };
                assert!(found(largest, &mut random)[0] >= 0.85, "{machines} {sessions}");
                continue;
            }
            let smallest = |which: usize, random: &mut Pcg64| {
                (4..60).map(|half| 0.5 * f64::from(half)).find(|step| found(*step, random)[which] >= 0.95)
            };
            let [changed, named] = [0, 1].map(|which| smallest(which, &mut random));
            println!("{machines} machines, {sessions} sessions: changed {changed:?} u, named {named:?} u");
        }
    }
}
