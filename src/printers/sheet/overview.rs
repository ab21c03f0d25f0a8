//! The first sheet: datum, tool, machine, tests in their order, warnings.

use abbe::model::session::Session;
use abbe::model::words::{counted, listed};
use abbe::plan::sheet::{Datum, TestSheet, datum};
use maud::{Markup, html};

use super::super::html::table;
use super::{DRAWING, Order, clock, named, notes};
use crate::report::figure::svg::element;
use crate::report::figure::{Figure, space};
use crate::report::table::{Cell, Table, cells};

/// The first page.
pub(super) fn overview(session: &Session, sheets: &[TestSheet], order: &Order) -> Markup {
    let total: f64 = sheets.iter().map(|sheet| order.minutes(sheet)).sum();
    let datum = datum(session);
    let arrows = match datum.shows_coordinates {
        true => " Arrows show where the body of a linear axis moves.",
        false => "",
    };
    let figure = Figure::new(
        "machine",
        "Machine",
        format!("in R with all axes at zero, seen along (1, 1, 1).{arrows}"),
        space::machine(&session.machine, DRAWING),
    );
    let (_, drawing) = element(&figure);
    let each = |of: fn(&TestSheet) -> Option<&'static str>| -> Vec<&'static str> {
        let mut found: Vec<&str> = sheets.iter().filter_map(of).collect();
        found.sort_unstable();
        found.dedup();
        found
    };
    let changes: String = each(|sheet| sheet.handling.changes).iter().map(|change| format!("{change}, ")).collect();
    let without = match &each(|sheet| sheet.handling.taken_off)[..] {
        [] => String::new(),
        taken_off => format!(" and without {}", listed(taken_off, "and")),
    };
    html! {
        section class="sheet" {
            h1 { (session.machine.name) ": set-up sheets" }
            p {
                "Session " code { (order.source) } ". " (counted(sheets.len(), "test")) ", " (clock(total))
                " h with mounting, " (changes) "motion and pauses."
            }
            div class="halves" {
                div { (before(order, &datum)) }
                div { (drawing) }
            }
            h2 { "Tests in their order" }
            (table(&tests(sheets, order)))
            (programs(order))
            @if !order.warnings.is_empty() {
                h2 { "Warnings" }
                ul class="warnings" { @for warning in &order.warnings { li { (warning) } } }
            }
            @if !session.about.is_empty() {
                dl { @for (name, note) in &session.about { dt { (name.replace('_', " ")) } dd { (note) } } }
            }
            @if !order.runs.is_empty() {
                p { "Run each program in single block" (without) " before it is trusted." }
            }
            (notes(&["Operator", "Date", "Instrument, serial number", "Temperature at start and end, °C"]))
        }
    }
}

/// What the control has to be told.
fn before(order: &Order, Datum { origin, probing, tool, shows_coordinates }: &Datum) -> Markup {
    let offset = match order.control {
        Some(control) => format!("Set {}, and leave it active", control.work_offset()),
        None => {
            "Set the work offset that is active when the programs run, such as G54, and leave it active".to_string()
        }
    };
    html! {
        h2 { "Datum" }
        ul {
            @for line in origin { li { (line) } }
            @for line in probing { li { (line) } }
            @if *shows_coordinates {
                li { (offset) ": positions count from the origin of R. The programs change no offset." }
            }
        }
        @if !tool.is_empty() {
            h2 { "Tool" }
            ul { @for line in tool { li { (line) } } }
        }
    }
}

/// One row per test.
fn tests(sheets: &[TestSheet], order: &Order) -> Table {
    let mut clock_min = 0.0;
    let rows = sheets.iter().enumerate().map(|(number, sheet)| {
        let minutes = order.minutes(sheet);
        clock_min += minutes;
        cells![
            (number + 1).to_string(),
            &sheet.name,
            order.program(&sheet.name).unwrap_or_default(),
            to_do(sheet),
            Cell::fixed(minutes, 1),
            clock(clock_min)
        ]
    });
    let columns = [">order", "test", "program", "to do before", ">duration, min", ">ends after, h:min"];
    Table::new(columns, rows.collect::<Vec<_>>()).without_empty_columns()
}

/// What does not stay as it is.
fn to_do(sheet: &TestSheet) -> String {
    let changes = sheet.mounts.iter().filter(|mount| !mount.contains(": stays "));
    let words: Vec<String> = changes.map(|mount| mount.replacen(": ", ", ", 1)).collect();
    if words.is_empty() { "nothing".into() } else { words.join("; ") }
}

/// Which programs there are.
fn programs(order: &Order) -> Markup {
    html! {
        @match (order.control, &order.main) {
            (Some(control), Some(main)) => p {
                "Programs of " code { "abbe nc --control " (control.word()) } ": "
                strong { (named(main, control.has_numbers().then_some(order.number))) } " calls them in this order."
            },
            _ if !order.runs.is_empty() => p { "Programs are not named: no control is stated (" code { "--control" } ")." },
            _ => {}
        }
    }
}
