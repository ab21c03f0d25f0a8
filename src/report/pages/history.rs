//! Report of `abbe history`: a page for the fleet, and one for each machine.

use abbe::fleet::conformity::MachineConformity;
use abbe::fleet::date::date;
use abbe::fleet::history::FleetHistory;
use abbe::identify::history::chart::{EWMA_LIMIT, SHEWHART_LIMIT};
use abbe::identify::history::results::{MachineHistory, ParameterHistory};
use maud::html;

use super::document::{Document, KeyFigure};
use crate::printers::html::table;
use crate::report::figure::lines::{Axis, Lines, Mark, Series};
use crate::report::figure::scale::{Scale, span};
use crate::report::figure::{Chart, Figure};
use crate::report::history as present;
use crate::report::table::Table;

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

/// Days of a year in the figures.
const DAYS_PER_YEAR: f64 = 365.25;

/// The page of the fleet.
pub fn fleet(found: &FleetHistory) -> Document {
    let machines = &found.history.machines;
    let drifts = present::drifts(machines);
    let changes = present::changes(machines);
    let mut document = Document {
        title: "History of the fleet".to_string(),
        verdict: format!("{}.", present::headline(found)),
        key_figures: vec![
            KeyFigure::new("Machines", machines.len().to_string(), ""),
            KeyFigure::new("Drifts", drifts.rows.len().to_string(), ""),
            KeyFigure::new("Changes", changes.rows.len().to_string(), ""),
        ],
        method: METHOD.to_string(),
        ..Document::default()
    };
    document.section("Machines", table(&present::machines(found)));
    section(&mut document, "Drifts", &drifts, "No parameter drifts significantly.");
    section(&mut document, "Changes", &changes, "No parameter has a significant step.");
    if !found.conformity.is_empty() {
        document.section("Conformity", table(&present::conformity(&found.conformity)));
    }
    section(&mut document, "Faults", &present::faults(found), "No session has an effect.");
    if !found.not_used.is_empty() {
        document.section("Not used", table(&present::not_used(&found.not_used)));
    }
    document
}

/// The page of a machine: a small figure for each parameter and its control chart, and its decisions of conformity.
pub fn machine(machine: &MachineHistory, conformity: &[MachineConformity]) -> Document {
    let own = std::slice::from_ref(machine);
    let changed = machine.parameters.iter().filter(|parameter| present::has_changed(parameter)).count();
    let mut document = Document {
        title: format!("History of {}", machine.machine_id),
        verdict: format!("{changed} of {} parameters have changed.", machine.parameters.len()),
        key_figures: vec![
            KeyFigure::new("Sessions", machine.sessions.to_string(), date(machine.first_days)),
            KeyFigure::new("Last session", date(machine.last_days), ""),
            KeyFigure::new(
                "Out of control",
                machine.out_of_control.len().to_string(),
                present::named(&machine.out_of_control),
            ),
            KeyFigure::new(
                "Next check",
                present::next_check(machine),
                machine.due_parameter.clone().unwrap_or_default(),
            ),
        ],
        method: METHOD.to_string(),
        ..Document::default()
    };
    section(&mut document, "Drifts", &present::drifts(own), "No parameter drifts significantly.");
    section(&mut document, "Changes", &present::changes(own), "No parameter has a significant step.");
    if let Some(own) = conformity.iter().find(|own| own.machine_id == machine.machine_id) {
        document.section("Conformity", table(&present::decisions(own)));
    }
    let shown = document.show(machine.parameters.iter().map(|parameter| over_time(machine, parameter)));
    document.section("Parameters over time", shown);
    let shown = document.show(machine.parameters.iter().map(|parameter| control_chart(machine, parameter)));
    document.section("Control charts", shown);
    document
}

fn section(document: &mut Document, heading: &str, rows: &Table, none: &str) {
    let empty = rows.rows.is_empty();
    document.section(heading, html! { @if empty { p { (none) } } @else { (table(rows)) } });
}

/// Years since the first session of a machine.
fn years(machine: &MachineHistory, days: f64) -> f64 {
    (days - machine.first_days) / DAYS_PER_YEAR
}

fn time_axis(machine: &MachineHistory) -> Axis {
    let last = years(machine, machine.last_days).max(0.1);
    Axis::new(format!("years since {}", date(machine.first_days)), "", Scale::rounded([0.0, last], 6))
}

/// A parameter with its uncertainties, and its model.
fn over_time(machine: &MachineHistory, parameter: &ParameterHistory) -> Figure {
    let at = |days: f64| years(machine, days);
    let values = parameter.points.iter().map(|point| (at(point.days), point.value)).collect();
    let ranges = parameter
        .points
        .iter()
        .flat_map(|point| [-2.0, 2.0].map(|factor| (at(point.days), point.value + factor * point.u)))
        .collect();
    let mut series = vec![
        Series::new("expanded uncertainty (k = 2)", "before", Mark::Bars, ranges),
        Series::new("estimate", "before", Mark::Dots, values),
    ];
    series.extend(parameter.level.map(|_| Series::new("model", "after", Mark::Line, model(machine, parameter))));
    let [low, high] = span(series.iter().flat_map(|series| series.points.iter().map(|point| point.1)));
    let y = Axis::new(parameter.id.clone(), parameter.unit.clone(), Scale::rounded([low, high], 6));
    Figure::new(
        format!("history-{}", parameter.id),
        parameter.id.clone(),
        parameter.meaning.clone(),
        Chart::Lines(Lines::new(time_axis(machine), y, series)),
    )
}

/// The model of a parameter at its sessions, with two points at each step.
fn model(machine: &MachineHistory, parameter: &ParameterHistory) -> Vec<(f64, f64)> {
    let middle = parameter.points.iter().map(|point| years(machine, point.days)).sum::<f64>()
        / parameter.points.len().max(1) as f64;
    let level = parameter.level.map_or(0.0, |level| level.value);
    let drift = parameter.drift_per_year.map_or(0.0, |drift| drift.value);
    let value = |days: f64| {
        let steps = parameter.steps.iter().filter(|step| step.before_days <= days).map(|step| step.value);
        level + drift * (years(machine, days) - middle) + steps.sum::<f64>()
    };
    let mut points = Vec::with_capacity(parameter.points.len());
    for (k, point) in parameter.points.iter().enumerate() {
        let step = parameter.steps.iter().find(|step| step.before_days == point.days);
        if let (Some(step), true) = (step, k > 0) {
            points.push((years(machine, point.days), value(point.days) - step.value));
        }
        points.push((years(machine, point.days), value(point.days)));
    }
    points
}

/// Both control charts of a parameter, each with its limits.
fn control_chart(machine: &MachineHistory, parameter: &ParameterHistory) -> Figure {
    let points = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        let rows = parameter.points.iter().enumerate();
        rows.map(|(k, point)| (years(machine, point.days), value(k))).collect()
    };
    let last = years(machine, machine.last_days).max(0.1);
    let limit = |value: f64| vec![(0.0, value), (last, value)];
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
        Chart::Lines(Lines::new(time_axis(machine), y, series)),
    )
}
