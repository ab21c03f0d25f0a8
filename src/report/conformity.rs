//! Decisions of conformity by the rule of ISO 14253-1.

use abbe::identify::tolerance::rule::Decision;
use abbe::identify::tolerance::{Conformity, ConformityItem};
use abbe::model::words::{counted, first_of};

use super::block::Report;
use super::number::{places, quantity, unit, value_and_u};
use super::table::{Cell, Table, cells};

/// Items that the opening names.
const MAX_NAMED: usize = 4;

/// The section of the decisions, if the session states limits.
pub fn section(report: &mut Report, found: Option<&Conformity>) {
    if let Some(found) = found {
        report.section("Conformity");
        report.key(format!("Conformity: {}", sentence(found)));
        report.key(table(found));
    }
}

/// The items that fail, in a sentence of the opening; none without one.
pub fn failed(found: Option<&Conformity>) -> Option<String> {
    let items = &found?.items;
    let failed: Vec<String> = items.iter().filter(|item| item.decision == Decision::Fail).map(beyond).collect();
    (!failed.is_empty()).then(|| format!("Out of limits: {}.", first_of(&failed, MAX_NAMED, "; ", "")))
}

/// An item with its value and limits.
fn beyond(item: &ConformityItem) -> String {
    let value = match (item.value, item.u) {
        (Some(value), Some(u)) => {
            let (value, u) = value_and_u(value, u);
            format!(" {}", quantity(&format!("{value} ± {u}"), &item.unit))
        }
        _ => String::new(),
    };
    format!("{}{value} (limits {})", item.id, limits(item.lower, item.upper))
}

/// The verdict and its rule in one sentence.
pub fn sentence(conformity: &Conformity) -> String {
    let count = |decision: Decision| conformity.items.iter().filter(|item| item.decision == decision).count();
    format!(
        "{}: {} of {} pass, {} fail, {} undecided (rule of ISO 14253-1, probability {} %)",
        conformity.verdict.word(),
        count(Decision::Pass),
        counted(conformity.items.len(), "item"),
        count(Decision::Fail),
        count(Decision::Undecided),
        100.0 * conformity.probability
    )
}

/// One row per item.
pub fn table(conformity: &Conformity) -> Table {
    let columns = ["item", ">value", ">u", "unit", ">limits", ">passes within", ">P(within limits)", "decision", "why"];
    Table::new(columns, conformity.items.iter().map(row)).without_empty_columns()
}

fn row(item: &ConformityItem) -> Vec<Cell> {
    let [value, u] = match (item.value, item.u) {
        (Some(value), Some(u)) => Cell::estimate(value, u),
        _ => ["–".into(), "–".into()],
    };
    let digits = item.u.map_or(1, places);
    let zone = item.acceptance_zone.map_or_else(
        || "–".to_string(),
        |zone| format!("{:.digits$} to {:.digits$}", if item.lower.is_some() { zone.low } else { 0.0 }, zone.high),
    );
    let probability = item.conformance_probability.map(|p| Cell::from(format!("{:.1} %", 100.0 * p)));
    cells![
        &item.id,
        value,
        u,
        unit(&item.unit),
        limits(item.lower, item.upper),
        zone,
        Cell::or_dash(probability),
        item.decision.word(),
        item.why.clone().unwrap_or_default()
    ]
}

/// Limits as they are stated.
pub(super) fn limits(lower: Option<f64>, upper: f64) -> String {
    match lower {
        None => format!("≤ {}", limit(upper)),
        Some(lower) if lower == -upper => format!("±{}", limit(upper)),
        Some(lower) => format!("{} to {}", limit(lower), limit(upper)),
    }
}

/// A limit with the digits that were stated; of a converted one four.
fn limit(value: f64) -> String {
    let text = value.to_string();
    if text.len() <= 8 { text } else { format!("{value:.4}") }
}
