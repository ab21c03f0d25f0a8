//! The machines of a fleet over time.

use abbe::document::StatedHistory;
use abbe::fleet::conformity::{DecisionPoint, ItemHistory, MachineConformity};
use abbe::fleet::history::chart::{EWMA_LIMIT, SHEWHART_LIMIT};
use abbe::fleet::history::events::{ChangeEvent, Kind};
use abbe::fleet::history::results::{Due, MachineHistory, ParameterHistory};
use abbe::fleet::history::statements::HistoryStatements;
use abbe::fleet::history::{FleetHistory, NotUsed};
use abbe::identify::results::{MeasuredValue, ParameterChange};
use abbe::identify::tolerance::rule::Decision;
use abbe::model::calendar::date;
use abbe::model::words::{counted, first_of};

use super::block::{KeyFigure, Report, Text};
use super::conformity::limits;
use super::figure::Figure;
use super::figure::lines::{Axis, Lines, Mark, Series};
use super::figure::scale::{Scale, span};
use super::number::{quantity, unit, value_and_u};
use super::statements;
use super::table::{Cell, Table, cells, numbers, words};

/// Method of a history.
const METHOD: &str = "A parameter over time has a level, perhaps a drift, and steps. A drift, a step and a pair of steps \
     compete against the level alone by the p values of their F statistics. The variance is estimated under each of \
     them, about the line or within the segments, beside the scatter of the other parameters of the machine and of \
     the other machines (moderated as by Smyth 2004); p values count all positions (Bonferroni). The procedure of \
     Benjamini and Hochberg (1995) bounds the rate of false claims over all parameters of all machines. The value of \
     a parameter in a session has the standard uncertainty of the fit, enlarged by this scatter where it is above 1. \
     Levels, drifts and steps of one machine are estimated together by generalised least squares with the \
     covariances of its sessions. A change is a compensation if it agrees with the known tables (p at least 0.001, \
     and a cosine of at least 0.9). Control charts: Shewhart with limits of 3 standard deviations, EWMA with weight \
     0.2 and limits of 2.962 (Lucas and Saccucci 1990), about the mean of the first six sessions, and again after \
     each step.";

/// Parameters that a cell names.
const MOST_NAMES: usize = 4;
/// Rows of a table that a terminal shows without `--all`.
const MAX_ROWS: usize = 12;

/// The report of the fleet.
pub fn fleet(stated: &StatedHistory<'_>) -> Report {
    let found = stated.result;
    let all = &found.machines;
    let mut report = Report::new("History of the fleet");
    report.method = METHOD.to_string();
    report.values = values(all);
    let (drifts, changes) = (drifts(all), changes(all));
    report.opening("", std::iter::once(format!("{}.", headline(found))).chain(opening(&stated.statements, all)));
    report.key(vec![
        KeyFigure::new("Machines", all.len().to_string(), ""),
        KeyFigure::new("Drifts", drifts.rows.len().to_string(), ""),
        KeyFigure::new("Changes", changes.rows.len().to_string(), ""),
    ]);
    section(&mut report, "Machines", machines(found), "No machine has a dated session.");
    report.key(Text::List(followed(all)));
    section(&mut report, "Drifts", drifts, "No parameter drifts significantly.");
    section(&mut report, "Changes", changes, "No parameter has a significant step.");
    report.section("Conformity (rule of ISO 14253-1, limits of each session)");
    report.key(conformity(&found.conformity).folded(MAX_ROWS));
    section(&mut report, "Faults", faults(found), "No session has an effect.");
    report.section("Not used");
    report.key(not_used(&found.not_used).folded(MAX_ROWS));
    report
}

/// The report of a machine: a small figure for each parameter and its control chart, and its decisions of conformity.
pub fn machine(machine: &MachineHistory, statements: &HistoryStatements, conformity: &[MachineConformity]) -> Report {
    let own = std::slice::from_ref(machine);
    let changed = machine.parameters.iter().filter(|parameter| has_changed(parameter)).count();
    let mut report = Report::new(format!("History of {}", machine.machine_id));
    report.method = METHOD.to_string();
    report.values = values(own);
    let headline = format!("{changed} of {} parameters have changed.", machine.parameters.len());
    report.opening("", std::iter::once(headline).chain(opening(statements, own)));
    report.key(vec![
        KeyFigure::new("Sessions", machine.sessions.to_string(), format!("since {}", date(machine.first_days))),
        KeyFigure::new("Last session", date(machine.last_days), ""),
        KeyFigure::new(
            "Out of control",
            machine.out_of_control.len().to_string(),
            first_of(&machine.out_of_control, MOST_NAMES, ", ", ""),
        ),
        KeyFigure::new("Next check", next_check(machine), machine.due_parameter.clone().unwrap_or_default()),
    ]);
    report.key(Text::List(followed(own)));
    section(&mut report, "Drifts", drifts(own), "No parameter drifts significantly.");
    section(&mut report, "Changes", changes(own), "No parameter has a significant step.");
    if let Some(own) = conformity.iter().find(|own| own.machine_id == machine.machine_id) {
        report.section("Conformity");
        report.key(decisions(own).folded(MAX_ROWS));
    }
    report.section("Parameters over time");
    report.figures(machine.parameters.iter().map(|parameter| over_time(machine, parameter)));
    report.section("Control charts");
    report.figures(machine.parameters.iter().map(|parameter| control_chart(machine, parameter)));
    report
}

/// The figures of each parameter with all their digits, one row each.
fn values(machines: &[MachineHistory]) -> Table {
    let all = machines.iter().flat_map(|machine| machine.parameters.iter().map(move |one| (machine, one)));
    let rows = all.flat_map(|(machine, one)| {
        let row = move |quantity: &str, days: Option<f64>, value: f64, u: Option<f64>, unit: &str| {
            let u = u.map_or_else(|| Cell::from(""), Cell::exact);
            let day = days.map_or(String::new(), date);
            cells![machine.machine_id.clone(), one.id.clone(), quantity, day, Cell::exact(value), u, unit]
        };
        let term = |quantity, days, value: MeasuredValue| row(quantity, days, value.value, Some(value.u), &one.unit);
        let drift = one
            .drift_per_year
            .map(|drift| row("drift", None, drift.value, Some(drift.u), &format!("{}/year", one.unit)));
        let steps = one.steps.iter().map(|step| term("step", Some(step.before_days), step.change));
        let sessions = one
            .points
            .iter()
            .map(|point| term("session", Some(point.days), MeasuredValue { value: point.value, u: point.u }));
        let mut rows: Vec<Vec<Cell>> =
            one.level.map(|level| term("level", None, level)).into_iter().chain(drift).collect();
        rows.extend(steps.chain(sessions));
        rows.extend(
            [("p-value", one.p_value), ("scatter", one.scatter_ratio), ("enlargement of u", one.enlargement)]
                .map(|(quantity, value)| row(quantity, None, value, None, "1")),
        );
        rows.extend(
            one.due_days
                .map(|days| cells![machine.machine_id.clone(), one.id.clone(), "next check", date(days), "", "", ""]),
        );
        rows
    });
    let columns = ["machine", "parameter", "quantity", "date"].map(words).into_iter();
    Table::new(columns.chain(["value", "u"].map(numbers)).chain([words("unit")]), rows.collect::<Vec<_>>())
}

fn section(report: &mut Report, heading: &str, table: Table, none: &str) {
    report.section(heading);
    match table.rows.is_empty() {
        true => report.key(none),
        false => report.key(table.folded(MAX_ROWS)),
    }
}

/// What was tested, in a sentence.
fn headline(found: &FleetHistory) -> String {
    let sessions: usize = found.machines.iter().map(|machine| machine.sessions).sum();
    let changed = found.machines.iter().flat_map(|machine| &machine.parameters).filter(|one| has_changed(one)).count();
    format!(
        "{}, {}: {} of {} over time changed (false discovery rate {})",
        counted(found.machines.len(), "machine"),
        counted(sessions, "session"),
        changed,
        counted(found.tested_series, "parameter"),
        found.false_discovery_rate
    )
}

/// Is it in control, what to correct, which machine to measure next.
fn opening(statements: &HistoryStatements, machines: &[MachineHistory]) -> Vec<String> {
    let dated = machines.iter().filter_map(|machine| Some((machine, machine.due_days?)));
    let first = dated.min_by(|a, b| a.1.total_cmp(&b.1));
    let check = first.map(|(machine, days)| (machine.machine_id.as_str(), date(days)));
    let beyond_ten_years = machines.iter().any(|machine| machine.due == Due::BeyondTenYears);
    let [followed, determined] = machines
        .iter()
        .fold([0, 0], |[followed, determined], machine| [followed + machine.followed, determined + machine.determined]);
    statements::of_history(statements, check, beyond_ten_years, (followed, determined))
}

/// Whether a parameter has a drift or a step.
fn has_changed(parameter: &ParameterHistory) -> bool {
    parameter.drift_per_year.is_some() || !parameter.steps.is_empty()
}

/// The word of a kind of change.
fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Compensation => "compensation",
        Kind::CompensationAndShift => "compensation and shift",
        Kind::Correction => "towards zero",
        Kind::Shift => "shift",
    }
}

/// When the next check of a machine is due.
fn next_check(machine: &MachineHistory) -> String {
    match (machine.due, machine.due_days) {
        (Due::Date, Some(days)) => date(days),
        (Due::BeyondTenYears, _) => "beyond 10 years".to_string(),
        _ => "not determined".to_string(),
    }
}

/// The machines, those with the earliest due date first.
fn machines(found: &FleetHistory) -> Table {
    let mut sorted: Vec<&MachineHistory> = found.machines.iter().collect();
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
            match machine.validation {
                Some(_) if machine.out_of_control.is_empty() => "its model".to_string(),
                _ => first_of(&machine.out_of_control, MOST_NAMES, ", ", ""),
            },
            next_check(machine),
            machine.due_parameter.clone().unwrap_or_default()
        ]
    });
    let headings =
        ["machine", ">sessions", "last session", ">drifts", ">changes", "out of control", "next check", "due by"];
    Table::new(headings, rows.collect::<Vec<_>>())
}

/// Drifts of all machines, the most significant first.
fn drifts(machines: &[MachineHistory]) -> Table {
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
fn changes(machines: &[MachineHistory]) -> Table {
    let rows = machines.iter().flat_map(|machine| {
        machine.changes.iter().map(|change| {
            cells![
                machine.machine_id.clone(),
                date(change.after_days),
                date(change.before_days),
                kind(change.kind),
                Cell::fixed(change.direction_cosine, 2),
                amounts(machine, change)
            ]
        })
    });
    Table::new(["machine", "after", "before", "change", ">cosine", "parameters"], rows.collect::<Vec<_>>())
}

/// The parameters that have a step, each with its change.
fn amounts(machine: &MachineHistory, change: &ChangeEvent) -> String {
    let found = change.changes.iter().filter(|own| change.parameters.contains(&own.id));
    let amount = |own: &ParameterChange| {
        let MeasuredValue { value, u } = machine.amount(change, &own.id)?;
        let (value, u) = value_and_u(value, u);
        Some(format!("{} {}", own.id, quantity(&format!("{value} ± {u}"), &own.unit)))
    };
    found.filter_map(amount).collect::<Vec<_>>().join(", ")
}

/// How much of what the sessions determine is followed, of machines whose parameters are not all separable.
fn followed(machines: &[MachineHistory]) -> Vec<String> {
    let incomplete = machines.iter().filter(|own| own.followed < own.determined || !own.held_at_nominal.is_empty());
    let sentence = |own: &MachineHistory| {
        let held = match own.held_at_nominal.len() {
            0 => String::new(),
            count => format!(" (base parameters; {} held at nominal)", counted(count, "parameter")),
        };
        let Some(share) = (100 * own.followed).checked_div(own.determined) else { return own.machine_id.clone() };
        format!(
            "{}: {} of {} determined parameters are followed, {share} %{held}",
            own.machine_id, own.followed, own.determined
        )
    };
    let invalid = machines.iter().filter_map(|own| {
        let verdict = own.validation?;
        let words = "its model does not describe the latest session; identify the machine anew";
        Some(format!("{}: validation {verdict}: {words}", own.machine_id))
    });
    incomplete.map(sentence).chain(invalid).collect()
}

/// The decisions of conformity of all machines: the latest one of each quantity, those that fail first.
fn conformity(machines: &[MachineConformity]) -> Table {
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
        let [value, u] = match last.and_then(|point| point.item.value.zip(point.item.u)) {
            Some((value, u)) => Cell::estimate(value, u),
            None => ["–".into(), "–".into()],
        };
        cells![
            machine.machine_id.clone(),
            item.id.clone(),
            value,
            u,
            last.map_or_else(String::new, |point| unit(&point.item.unit)),
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
fn decisions(machine: &MachineConformity) -> Table {
    let rows = machine.items.iter().flat_map(|item| item.points.iter().map(move |point| (item, point)));
    let rows = rows.map(|(item, DecisionPoint { days, item: decided })| {
        let [value, u] = match decided.value.zip(decided.u) {
            Some((value, u)) => Cell::estimate(value, u),
            None => ["–".into(), "–".into()],
        };
        cells![
            item.id.clone(),
            date(*days),
            value,
            u,
            unit(&decided.unit),
            limits(decided.lower, decided.upper),
            decided.decision.word(),
            decided.why.clone().unwrap_or_default()
        ]
    });
    Table::new(["quantity", "session", ">value", ">u", "", "limits", "decision", "why"], rows.collect::<Vec<_>>())
}

/// The most frequent faults.
fn faults(found: &FleetHistory) -> Table {
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
fn not_used(not_used: &[NotUsed]) -> Table {
    let rows = not_used.iter().map(|session| cells![session.file.clone(), session.reason.clone()]);
    Table::new(["not used", "why"], rows.collect::<Vec<_>>())
}

fn time_axis(machine: &MachineHistory) -> Axis {
    let last = machine.last_days.max(machine.first_days + 30.0);
    Axis::new("date", "", Scale { words: Some(date), ..Scale::over([machine.first_days, last], 4) })
}

/// A parameter with its uncertainties, and its model.
fn over_time(machine: &MachineHistory, parameter: &ParameterHistory) -> Figure {
    let values = parameter.points.iter().map(|point| (point.days, point.value)).collect();
    let ranges = parameter
        .points
        .iter()
        .flat_map(|point| [-2.0, 2.0].map(|factor| (point.days, point.value + factor * point.u)))
        .collect();
    let mut series = vec![
        Series::new("expanded uncertainty (k = 2)", "before", Mark::Bars, ranges),
        Series::new("estimate", "before", Mark::Dots, values),
    ];
    series.extend(parameter.level.map(|_| Series::new("model", "after", Mark::Line, parameter.modelled())));
    let [low, high] = span(series.iter().flat_map(|series| series.points.iter().map(|point| point.1)));
    let y = Axis::new(parameter.id.clone(), parameter.unit.clone(), Scale::rounded([low, high], 6));
    Figure::new(
        format!("history-{}", parameter.id),
        parameter.id.clone(),
        parameter.meaning.clone(),
        Lines::new(time_axis(machine), y, series),
    )
}

/// Both control charts of a parameter, each with its limits.
fn control_chart(machine: &MachineHistory, parameter: &ParameterHistory) -> Figure {
    let points = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        let rows = parameter.points.iter().enumerate();
        rows.map(|(k, point)| (point.days, value(k))).collect()
    };
    let limit = |value: f64| vec![(machine.first_days, value), (machine.last_days, value)];
    let series = vec![
        Series::new("session (Shewhart)", "before", Mark::Dots, points(&|k| parameter.points[k].shewhart)),
        Series::new("limit", "before", Mark::Line, limit(SHEWHART_LIMIT)),
        Series::new("", "before", Mark::Line, limit(-SHEWHART_LIMIT)),
        Series::new("moving average (EWMA)", "after", Mark::Line, points(&|k| parameter.points[k].ewma)),
        Series::new("limit of the average", "after", Mark::Line, limit(EWMA_LIMIT)),
        Series::new("", "after", Mark::Line, limit(-EWMA_LIMIT)),
    ];
    let [low, high] = span(series.iter().flat_map(|series| series.points.iter().map(|point| point.1)));
    let y = Axis::new("deviation from the reference, standard deviations", "", Scale::rounded([low, high], 6));
    Figure::new(
        format!("control-{}", parameter.id),
        format!("{}: control charts", parameter.id),
        parameter.meaning.clone(),
        Lines::new(time_axis(machine), y, series),
    )
}
