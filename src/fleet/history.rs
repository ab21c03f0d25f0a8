//! The history of the machines of a folder of records.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use abbe_apply::history::events::{ChangeEvent, Compensation, Kind};
use abbe_apply::history::faults::{Fault, FoundEffect, faults};
use abbe_apply::history::results::{History, MachineHistory, ParameterHistory};
use abbe_apply::history::{HistoryOptions, MachineSessions, SessionValues, analyse};
use abbe_identify::results::{Estimate, MeasuredValue, NextStep, Statements};
use abbe_model::Diagnostic;
use abbe_model::parameter_id::ParameterId;
use abbe_trace::validate::ValidationVerdict;
use schemars::JsonSchema;
use serde::Serialize;

use super::conformity::MachineConformity;
use super::date;
use super::record::Record;
use super::store::{Pointer, Store};
use super::unusable;

/// The machines of a folder over time, and their faults.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FleetHistory {
    /// Drifts, steps and control charts.
    #[serde(flatten)]
    pub history: History,
    /// The effects of all sessions, by alias set, the most frequent first.
    pub faults: Vec<Fault>,
    /// Decisions of conformity over time, of the machines whose sessions state limits.
    pub conformity: Vec<MachineConformity>,
    /// Sessions, notes and rows of known compensations that the history does not use.
    pub not_used: Vec<NotUsed>,
}

/// Whether the machines of a history are in control.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct HistoryStatement {
    /// Number of machines.
    pub machines: usize,
    /// The machines with a parameter that is out of control in the latest session, or whose model does not hold there.
    pub out_of_control: Vec<String>,
}

/// A parameter of a machine that drifts or has shifted.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ChangedInHistory {
    /// Identifier of the machine.
    pub machine_id: String,
    /// The parameter.
    pub id: String,
    /// Its drift, in `unit` a year; absent if it has shifted only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift_per_year: Option<MeasuredValue>,
    /// Its last such step, in `unit`; absent if it drifts only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<MeasuredValue>,
    /// Unit of the parameter.
    pub unit: String,
}

/// The statements of a history.
pub type HistoryStatements = Statements<HistoryStatement, ChangedInHistory>;

/// Are these machines in control, what to correct, what to measure next.
pub fn statements(machines: &[MachineHistory]) -> HistoryStatements {
    let out = machines.iter().filter(|machine| !machine.out_of_control.is_empty() || machine.validation.is_some());
    let changed = |machine: &MachineHistory, is_explained: bool| -> Vec<ChangedInHistory> {
        let is_wanted = |change: &ChangeEvent| match change.kind {
            Kind::Shift | Kind::CompensationAndShift => !is_explained,
            Kind::Compensation | Kind::Correction => is_explained,
        };
        // The last step of this kind.
        let shift_of = |one: &ParameterHistory| -> Option<MeasuredValue> {
            let is_own = |change: &&ChangeEvent| change.parameters.contains(&one.id) && is_wanted(change);
            machine.amount(machine.changes.iter().rfind(is_own)?, &one.id)
        };
        let own = machine.parameters.iter().map(|one| ChangedInHistory {
            machine_id: machine.machine_id.clone(),
            id: one.id.clone(),
            drift_per_year: one.drift_per_year.filter(|drift| !is_explained && exceeds_u(drift)),
            shift: shift_of(one).filter(exceeds_u),
            unit: one.unit.clone(),
        });
        own.filter(|one| one.drift_per_year.is_some() || one.shift.is_some()).collect()
    };
    let step = if machines.is_empty() { NextStep::Nothing } else { NextStep::NextCheck };
    Statements {
        good: HistoryStatement {
            machines: machines.len(),
            out_of_control: out.map(|machine| machine.machine_id.clone()).collect(),
        },
        correct: machines.iter().flat_map(|machine| changed(machine, false)).collect(),
        // Steps that a known compensation or a way to zero explains.
        changed: machines.iter().flat_map(|machine| changed(machine, true)).collect(),
        further: Vec::new(),
        measure: step.into(),
    }
}

/// Whether a change exceeds its standard uncertainty. Sessions that repeat each other to a fraction of it, such as computed ones,
/// show changes that mean nothing.
fn exceeds_u(change: &MeasuredValue) -> bool {
    change.value.abs() > change.u
}

/// A session, a note or a row of known compensations that the history does not use.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NotUsed {
    /// Identifier of the machine; `null` if it is not known.
    pub machine_id: Option<String>,
    /// The session file, the damaged note, or the file of compensations with the line.
    pub file: String,
    /// Why, and what to do.
    pub reason: String,
}

/// A usable session.
struct Dated {
    days: f64,
    until_days: f64,
    number: Option<f64>,
    pointer: Pointer,
    record: Record,
}

/// The history of all machines of a folder, or of one of them. The statistics are those of all machines either way.
///
/// # Errors
/// If the folder cannot be read, or has no session of the machine.
pub fn history(store: &Store, machine_id: Option<&str>, options: &HistoryOptions) -> Result<FleetHistory, Diagnostic> {
    let (records, missing) = store.records()?;
    let mut not_used: Vec<NotUsed> = missing
        .into_iter()
        .map(|(machine_id, file)| NotUsed {
            machine_id,
            file,
            reason: "its result is missing or of another version of the schema: run `abbe fleet run` again".to_string(),
        })
        .collect();
    let all = records.len();
    let known: BTreeSet<String> = records.iter().map(|(_, record)| record.machine_id.clone()).collect();
    if let Some(id) = machine_id.filter(|id| !known.contains(*id)) {
        return Err(Diagnostic::other(format!(
            "no session of the machine `{id}` among {all}: the identifier is `serial_number` of [about], or the name of the \
             machine"
        )));
    }
    let mut machines: BTreeMap<String, Vec<Dated>> = BTreeMap::new();
    for dated in usable(records, &mut not_used) {
        machines.entry(dated.record.machine_id.clone()).or_default().push(dated);
    }
    let mut series = Vec::new();
    let mut effects = Vec::new();
    let mut conformity = Vec::new();
    for (id, sessions) in machines {
        let sessions = of_one_machine(in_order(by_time(sessions), &mut not_used), &mut not_used);
        effects.extend(sessions.iter().flat_map(found_effects));
        let decided = sessions.iter().map(|dated| {
            let Dated { days, pointer, record, .. } = dated;
            (*days, pointer.file.as_str(), record.conformity.as_ref())
        });
        conformity.extend(MachineConformity::of(&id, decided));
        series.push(machine_sessions(id, &sessions));
    }
    not_used.sort_by(|a, b| a.file.cmp(&b.file));
    check_units(&series, &options.compensations)?;
    not_used.extend(unknown_rows(&known, &series, &options.compensations));
    let mut history = analyse(&series, options);
    if let Some(id) = machine_id {
        history.machines.retain(|machine| machine.machine_id == id);
        effects.retain(|effect| effect.machine_id == id);
        conformity.retain(|machine| machine.machine_id == id);
        not_used.retain(|not_used| not_used.machine_id.as_deref().is_none_or(|own| own == id));
    }
    Ok(FleetHistory { history, faults: faults(&effects), conformity, not_used })
}

/// # Errors
/// If a compensation states a change in another unit than the parameter has.
fn check_units(machines: &[MachineSessions], compensations: &[Compensation]) -> Result<(), Diagnostic> {
    for known in compensations {
        let of_machine = machines.iter().filter(|machine| machine.machine_id == known.machine_id);
        for (id, unit, _) in of_machine.flat_map(|machine| &machine.parameters) {
            if let Some(stated) = known.changes.iter().find(|known| known.id == *id && known.unit != *unit) {
                let (machine, stated_in) = (&known.machine_id, &stated.unit);
                let found = format!("compensation of {machine}: the change of {id} is stated in `{stated_in}`");
                return Err(unusable(&stated.source, found, format!("state it in {unit}")));
            }
        }
    }
    Ok(())
}

/// The rows of compensations whose machine or parameter no session has.
fn unknown_rows(
    known: &BTreeSet<String>,
    machines: &[MachineSessions],
    compensations: &[Compensation],
) -> Vec<NotUsed> {
    let mut unknown = Vec::new();
    for compensation in compensations {
        let id = &compensation.machine_id;
        let machine = machines.iter().find(|machine| machine.machine_id == *id);
        for row in &compensation.changes {
            let reason = match machine {
                None if !known.contains(id) => format!("no session is of the machine `{id}`: correct `machine_id`"),
                Some(machine) if machine.parameters.iter().all(|(name, ..)| *name != row.id) => {
                    format!("no session of `{id}` identifies the parameter `{}`: correct `parameter`", row.id)
                }
                _ => continue,
            };
            unknown.push(NotUsed { machine_id: Some(id.clone()), file: row.source.clone(), reason });
        }
    }
    unknown
}

/// The sessions with a result, a date and an identifier of their own. A copy of a session counts once.
fn usable(records: Vec<(Pointer, Record)>, not_used: &mut Vec<NotUsed>) -> Vec<Dated> {
    // Sessions of other machines may have the same numbers.
    let identifier = |record: &Record| record.session_id.clone().map(|id| (record.machine_id.clone(), id));
    let mut keys_of: HashMap<(String, String), HashSet<String>> = HashMap::new();
    for (_, record) in &records {
        if let Some(id) = identifier(record) {
            keys_of.entry(id).or_default().insert(record.key.clone());
        }
    }
    let mut known = HashSet::new();
    let mut found = Vec::new();
    for (pointer, record) in records {
        let shared = identifier(&record).filter(|id| keys_of.get(id).is_some_and(|keys| keys.len() > 1));
        let text = record.date.as_deref();
        let machine_id = Some(record.machine_id.clone()).filter(|id| !id.is_empty());
        // The estimates do not depend on the validation of a model.
        let reason = if let Some(error) = record.error.as_ref().filter(|error| error.stage != "validate") {
            Some(format!("it has no result: {}", error.message.lines().next().unwrap_or_default()))
        } else if let Some((_, id)) = shared {
            Some(format!(
                "several sessions of different content have its identifier `{id}`: give each a `session_id` of its own"
            ))
        } else if !known.insert(record.key.clone()) {
            Some("it is a copy of another session".to_string())
        } else {
            match (text, text.and_then(date::interval)) {
                (None, _) => Some("it has no date: state `date` in [about]".to_string()),
                (Some(text), None) => Some(format!("its date `{text}` has another form than 2026-11-23T08:00:00")),
                (Some(_), Some([days, until_days])) => {
                    let number = record.about.get("session_number").and_then(|text| text.trim().parse().ok());
                    found.push(Dated { days, until_days, number, pointer: pointer.clone(), record });
                    None
                }
            }
        };
        not_used.extend(reason.map(|reason| NotUsed { machine_id, file: pointer.file, reason }));
    }
    found
}

fn by_time(mut sessions: Vec<Dated>) -> Vec<Dated> {
    sessions.sort_by(|a, b| a.days.total_cmp(&b.days).then_with(|| a.pointer.file.cmp(&b.pointer.file)));
    sessions
}

/// The sessions of a machine with the axes of its latest session.
fn of_one_machine(sessions: Vec<Dated>, not_used: &mut Vec<NotUsed>) -> Vec<Dated> {
    let axes = |dated: &Dated| dated.record.machine.as_ref().map(|machine| machine.sha256.clone());
    let latest = sessions.last().and_then(axes);
    let (kept, others): (Vec<Dated>, Vec<Dated>) = sessions.into_iter().partition(|dated| axes(dated) == latest);
    not_used.extend(others.into_iter().map(|dated| NotUsed {
        machine_id: Some(dated.record.machine_id),
        file: dated.pointer.file,
        reason: "the axes of the machine differ from those of its latest session: parameters are not comparable".into(),
    }));
    kept
}

/// The sessions whose dates agree with their numbers: the longest part in which both increase.
fn in_order(sessions: Vec<Dated>, not_used: &mut Vec<NotUsed>) -> Vec<Dated> {
    let numbers: Vec<f64> = sessions.iter().filter_map(|dated| dated.number).collect();
    let keeps = longest_increasing(&numbers);
    let mut next = 0;
    let mut kept = Vec::with_capacity(sessions.len());
    for dated in sessions {
        let keep = dated.number.is_none_or(|_| {
            next += 1;
            keeps[next - 1]
        });
        if keep {
            kept.push(dated);
        } else {
            not_used.push(NotUsed {
                reason: format!(
                    "its date {} contradicts its `session_number`: correct the clock or the date",
                    dated.record.date.as_deref().unwrap_or_default()
                ),
                machine_id: Some(dated.record.machine_id),
                file: dated.pointer.file,
            });
        }
    }
    kept
}

/// Which numbers belong to the longest part that does not decrease.
fn longest_increasing(numbers: &[f64]) -> Vec<bool> {
    // Length of the longest part that ends with each number, and the number before it.
    let mut ends: Vec<(usize, Option<usize>)> = Vec::with_capacity(numbers.len());
    for (i, number) in numbers.iter().enumerate() {
        let before = (0..i).filter(|j| numbers[*j] <= *number).max_by_key(|j| (ends[*j].0, std::cmp::Reverse(*j)));
        ends.push((1 + before.map_or(0, |j| ends[j].0), before));
    }
    let mut keeps = vec![false; numbers.len()];
    let mut at = (0..numbers.len()).max_by_key(|i| (ends[*i].0, std::cmp::Reverse(*i)));
    while let Some(i) = at {
        keeps[i] = true;
        at = ends[i].1;
    }
    keeps
}

/// Whether a parameter belongs to the machine, not to the set-up of a test, and has a value without a jump: a phase
/// has one at a full turn.
fn is_of_machine(id: &str) -> bool {
    !id.parse::<ParameterId>().is_ok_and(|id| id.group().is_some() || id.is_phase())
}

fn machine_sessions(machine_id: String, sessions: &[Dated]) -> MachineSessions {
    let last = sessions.last().map(|dated| &dated.record);
    let base = last.and_then(|record| record.base.as_ref());
    // Base parameters are the same numbers in all sessions only if the same ones are held.
    let held = |record: &Record| record.base.as_ref().map(|base| base.held.clone());
    let by_base =
        base.is_some() && sessions.iter().all(|dated| held(&dated.record) == base.map(|base| base.held.clone()));
    let mut parameters: Vec<(String, String, String)> = Vec::new();
    let mut place: HashMap<String, usize> = HashMap::new();
    for dated in sessions {
        for Estimate { id, unit, meaning, .. } in dated.record.followed(by_base).0 {
            if is_of_machine(id) && !place.contains_key(id) {
                place.insert(id.clone(), parameters.len());
                parameters.push((id.clone(), unit.clone(), meaning.clone()));
            }
        }
    }
    let count = parameters.len();
    let values = sessions.iter().map(|dated| {
        let mut values = vec![None; count];
        let mut covariance = vec![vec![0.0; count]; count];
        let (followed, matrix) = dated.record.followed(by_base);
        let known: Vec<(usize, usize)> =
            (followed.iter().enumerate()).filter_map(|(own, found)| Some((own, *place.get(&found.id)?))).collect();
        for (own, at) in &known {
            values[*at] = Some((followed[*own].value, followed[*own].u));
            for (other, across) in &known {
                covariance[*at][*across] = matrix.get(*own).and_then(|row| row.get(*other)).copied().unwrap_or(0.0);
            }
        }
        SessionValues {
            days: dated.days,
            until_days: dated.until_days,
            file: dated.pointer.file.clone(),
            values,
            covariance,
        }
    });
    let values = values.collect();
    let machine = sessions.last().and_then(|dated| dated.record.machine.clone());
    let (name, code) = machine.map_or((String::new(), String::new()), |machine| (machine.name, machine.code));
    let determined = last.map_or(0, |record| match &record.base {
        Some(base) => base.determined(),
        None => record.followed(false).0.iter().filter(|found| is_of_machine(&found.id)).count(),
    });
    let validation = last.and_then(|record| record.validation.as_ref()).map(|validation| validation.verdict);
    MachineSessions {
        machine_id,
        name,
        code,
        parameters,
        held_at_nominal: base.filter(|_| by_base).map_or_else(Vec::new, |base| base.held.clone()),
        determined,
        validation: validation
            .filter(|verdict| !matches!(verdict, ValidationVerdict::Holds | ValidationVerdict::HoldsInRange)),
        sessions: values,
    }
}

fn found_effects(dated: &Dated) -> impl Iterator<Item = FoundEffect> {
    dated.record.effects.iter().map(|effect| FoundEffect {
        machine_id: dated.record.machine_id.clone(),
        kind: dated.record.machine.as_ref().map_or(String::new(), |machine| machine.code.clone()),
        session: dated.record.key.clone(),
        days: dated.days,
        id: effect.id.clone(),
        family: (effect.family.clone(), effect.name.component.clone(), effect.name.driver.clone()),
        meaning: effect.name.meaning.clone(),
        rms_gain_um: effect.rms_gain_um,
        aliases: effect.aliases.clone(),
    })
}

#[cfg(test)]
mod tests {
    use abbe_apply::history::events::KnownChange;

    use super::*;

    #[test]
    fn rows_of_unknown_machines_and_parameters_are_named() {
        let row = |id: &str, line: usize| KnownChange {
            id: id.into(),
            source: format!("c.csv:{line}"),
            ..KnownChange::default()
        };
        let table = |machine: &str, changes: Vec<KnownChange>| Compensation {
            machine_id: machine.into(),
            days: [0.0; 2],
            changes,
        };
        let parameters = vec![("EX0C".to_string(), String::new(), String::new())];
        let machine = MachineSessions { machine_id: "M".into(), parameters, ..MachineSessions::default() };
        let known = BTreeSet::from(["M".to_string(), "OTHER".to_string()]);
        let tables = [
            table("M", vec![row("EX0C", 2), row("EX0B", 3)]),
            table("MM", vec![row("EX0C", 4)]),
            table("OTHER", vec![row("EX0C", 5)]),
        ];
        let found: Vec<String> = unknown_rows(&known, &[machine], &tables).into_iter().map(|row| row.file).collect();
        assert_eq!(found, ["c.csv:3", "c.csv:4"]);
    }

    #[test]
    fn a_clock_that_runs_backwards_takes_out_the_fewest_sessions() {
        assert_eq!(longest_increasing(&[1.0, 2.0, 9.0, 3.0, 4.0]), [true, true, false, true, true]);
        assert_eq!(longest_increasing(&[1.0, 1.0, 2.0]), [true; 3]);
        assert!(longest_increasing(&[]).is_empty());
    }

    /// What is stated of 30 sessions of a machine with these values of EX0C, each with u = 0.6.
    fn stated_of(value: impl Fn(usize) -> f64) -> HistoryStatements {
        let session = |k: usize| {
            let days = 30.0 * k as f64;
            SessionValues {
                days,
                until_days: days,
                file: format!("{k}"),
                values: vec![Some((value(k), 0.6))],
                covariance: vec![vec![0.36]],
            }
        };
        let machine = MachineSessions {
            machine_id: "M".into(),
            parameters: vec![("EX0C".into(), "um".into(), String::new())],
            determined: 1,
            sessions: (0..30).map(session).collect(),
            ..MachineSessions::default()
        };
        statements(&analyse(&[machine], &HistoryOptions::default()).machines)
    }

    /// Deviations of known size in place of noise.
    const DEVIATIONS: [f64; 7] = [0.4, -0.7, 0.1, 0.9, -0.5, -0.2, 0.6];

    /// Sessions that repeat each other to a thousandth of their uncertainty show a step that means nothing.
    #[test]
    fn a_step_below_its_uncertainty_is_not_stated() {
        let step = |k: usize| if k < 15 { 0.0 } else { 10.0 };
        let scaled = |scale: f64| stated_of(|k| scale * (step(k) + DEVIATIONS[k % 7]));
        assert_eq!(scaled(1.0).correct.len() + scaled(1.0).changed.len(), 1);
        let small = scaled(1e-3);
        assert!(small.correct.is_empty() && small.changed.is_empty(), "{small:?}");
    }

    /// A correction by 30 and a shift by 20 after it: each is stated with its own amount, whichever is the later.
    #[test]
    fn a_step_is_stated_where_its_event_belongs() {
        for (levels, corrected, shifted) in [([30.0, 0.0, 20.0], -30.0, 20.0), ([10.0, 30.0, 0.0], -30.0, 20.0)] {
            let stated = stated_of(|k| levels[k / 10] + DEVIATIONS[k % 7]);
            let amounts = |list: &[ChangedInHistory]| -> Vec<f64> {
                list.iter().map(|own| own.shift.map_or(f64::NAN, |shift| shift.value)).collect()
            };
            let [explained, others] = [amounts(&stated.changed), amounts(&stated.correct)];
            assert!(explained.len() == 1 && (explained[0] - corrected).abs() < 1.0, "{levels:?}: {stated:?}");
            assert!(others.len() == 1 && (others[0] - shifted).abs() < 1.0, "{levels:?}: {stated:?}");
            assert!(stated.changed[0].drift_per_year.is_none());
        }
    }

    #[test]
    fn set_up_parameters_and_phases_have_no_history() {
        for (id, is) in [("EX0C", true), ("bar[A100]", false), ("EZC~C:h2.amplitude", true), ("EZC~C:h2.phase", false)]
        {
            assert_eq!(is_of_machine(id), is, "{id}");
        }
    }
}
