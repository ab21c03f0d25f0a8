//! The machines of a fleet over time.

use abbe::fleet::conformity::{ItemHistory, MachineConformity};
use abbe::fleet::date::date;
use abbe::fleet::history::{FleetHistory, NotUsed};
use abbe::identify::history::events::Kind;
use abbe::identify::history::results::{Due, MachineHistory, ParameterHistory};
use abbe::identify::tolerance::rule::Decision;
use abbe::model::words::counted;

use super::conformity::limits;
use super::number::unit;
use super::table::{Cell, Table, cells};

/// Parameters that a cell names.
const MOST_NAMES: usize = 4;

/// What was tested, in a sentence.
pub fn headline(found: &FleetHistory) -> String {
    let history = &found.history;
    let sessions: usize = history.machines.iter().map(|machine| machine.sessions).sum();
    let changed =
        history.machines.iter().flat_map(|machine| &machine.parameters).filter(|one| has_changed(one)).count();
    format!(
        "{}, {}: {} of {} parameters over time have changed (false discovery rate {})",
        counted(history.machines.len(), "machine"),
        counted(sessions, "session"),
        changed,
        history.tested_series,
        history.false_discovery_rate
    )
}

/// Whether a parameter has a drift or a step.
pub fn has_changed(parameter: &ParameterHistory) -> bool {
    parameter.drift_per_year.is_some() || !parameter.steps.is_empty()
}

/// The word of a kind of change.
pub fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Compensation => "compensation",
        Kind::CompensationAndShift => "compensation and shift",
        Kind::Correction => "towards zero",
        Kind::Shift => "shift",
    }
}

/// When the next check of a machine is due.
pub fn next_check(machine: &MachineHistory) -> String {
    match (machine.due, machine.due_days) {
        (Due::Date, Some(days)) => date(days),
        (Due::BeyondTenYears, _) => "beyond 10 years".to_string(),
        _ => "not determined".to_string(),
    }
}

/// The first names of a list, and the number of the others.
pub fn named(names: &[String]) -> String {
    let more = names.len().saturating_sub(MOST_NAMES);
    let first = names[..names.len() - more].join(", ");
    if more > 0 { format!("{first} and {more} more") } else { first }
}

/// The machines, those with the earliest due date first.
pub fn machines(found: &FleetHistory) -> Table {
    let mut sorted: Vec<&MachineHistory> = found.history.machines.iter().collect();
    let due = |machine: &MachineHistory| machine.due_days.unwrap_or(f64::INFINITY);
    sorted.sort_by(|a, b| due(a).total_cmp(&due(b)).then_with(|| a.machine_id.cmp(&b.machine_id)));
    let rows = sorted.into_iter().map(|machine| {
        let drifting = machine.parameters.iter().filter(|one| one.drift_per_year.is_some()).count();
        cells![
            machine.machine_id.clone(),
            machine.sessions.to_string(),
            date(machine.last_days),
            drifting.to_string(),
            machine.changes.len().to_string(),
            named(&machine.out_of_control),
            next_check(machine),
            machine.due_parameter.clone().unwrap_or_default()
        ]
    });
    let headings =
        ["machine", ">sessions", "last session", ">drifts", ">changes", "out of control", "next check", "due by"];
    Table::new(headings, rows.collect::<Vec<_>>())
}

/// Drifts of all machines, the most significant first.
pub fn drifts(machines: &[MachineHistory]) -> Table {
    let mut found: Vec<(&MachineHistory, &ParameterHistory, f64, f64)> = machines
        .iter()
        .flat_map(|machine| machine.parameters.iter().map(move |parameter| (machine, parameter)))
        .filter_map(|(machine, one)| one.drift_per_year.map(|drift| (machine, one, drift.value, drift.u)))
        .collect();
    found.sort_by(|a, b| (b.2 / b.3).abs().total_cmp(&(a.2 / a.3).abs()));
    let rows = found.into_iter().map(|(machine, parameter, value, u)| {
        let [value, u] = Cell::estimate(value, u);
        cells![machine.machine_id.clone(), parameter.id.clone(), value, u, format!("{} a year", unit(&parameter.unit))]
    });
    Table::new(["machine", "parameter", ">drift", ">u", ""], rows.collect::<Vec<_>>())
}

/// Changes of all machines between sessions.
pub fn changes(machines: &[MachineHistory]) -> Table {
    let rows = machines.iter().flat_map(|machine| {
        machine.changes.iter().map(|change| {
            cells![
                machine.machine_id.clone(),
                date(change.after_days),
                date(change.before_days),
                kind(change.kind),
                Cell::fixed(change.direction_cosine, 2),
                change.parameters.join(", ")
            ]
        })
    });
    Table::new(["machine", "after", "before", "change", ">cosine", "parameters"], rows.collect::<Vec<_>>())
}

/// The decisions of conformity of all machines: the latest one of each quantity, those that fail first.
pub fn conformity(machines: &[MachineConformity]) -> Table {
    let items = machines.iter().flat_map(|machine| machine.items.iter().map(move |item| (machine, item)));
    let mut latest: Vec<(&MachineConformity, &ItemHistory, Decision, f64)> = items
        .filter_map(|(machine, item)| item.latest().map(|(decision, since)| (machine, item, decision, since)))
        .collect();
    let urgency = |decision: Decision| match decision {
        Decision::Fail => 0,
        Decision::Undecided => 1,
        Decision::Pass => 2,
    };
    latest.sort_by_key(|(.., decision, _)| urgency(*decision));
    let rows = latest.into_iter().map(|(machine, item, decision, since)| {
        let last = item.points.last();
        let [value, u] = match last.and_then(|point| point.value.zip(point.u)) {
            Some((value, u)) => Cell::estimate(value, u),
            None => ["–".into(), "–".into()],
        };
        cells![
            machine.machine_id.clone(),
            item.id.clone(),
            value,
            u,
            last.map_or_else(String::new, |point| unit(&point.unit)),
            decision.word(),
            date(since),
            item.count(Decision::Pass).to_string(),
            item.count(Decision::Fail).to_string(),
            item.count(Decision::Undecided).to_string()
        ]
    });
    let headings = ["machine", "quantity", ">latest", ">u", "", "decision", "since", ">pass", ">fail", ">undecided"];
    Table::new(headings, rows.collect::<Vec<_>>())
}

/// The decisions about one machine, session by session.
pub fn decisions(machine: &MachineConformity) -> Table {
    let rows = machine.items.iter().flat_map(|item| item.points.iter().map(move |point| (item, point)));
    let rows = rows.map(|(item, point)| {
        let [value, u] = match point.value.zip(point.u) {
            Some((value, u)) => Cell::estimate(value, u),
            None => ["–".into(), "–".into()],
        };
        cells![
            item.id.clone(),
            date(point.days),
            value,
            u,
            unit(&point.unit),
            limits(point.lower, point.upper),
            point.decision.word(),
            point.why.clone().unwrap_or_default()
        ]
    });
    Table::new(["quantity", "session", ">value", ">u", "", "limits", "decision", "why"], rows.collect::<Vec<_>>())
}

/// The most frequent faults.
pub fn faults(found: &FleetHistory) -> Table {
    let rows = found.faults.iter().map(|fault| {
        let names: Vec<&str> = fault.names.keys().map(String::as_str).filter(|name| *name != fault.id).collect();
        cells![
            fault.id.clone(),
            fault.meaning.clone(),
            fault.machines.len().to_string(),
            fault.sessions.to_string(),
            names.join(", ")
        ]
    });
    Table::new(["fault", "what it is", ">machines", ">sessions", "other names"], rows.collect::<Vec<_>>())
}

/// The sessions and rows of compensations that the history does not use.
pub fn not_used(not_used: &[NotUsed]) -> Table {
    let rows = not_used.iter().map(|session| cells![session.file.clone(), session.reason.clone()]);
    Table::new(["not used", "why"], rows.collect::<Vec<_>>())
}
