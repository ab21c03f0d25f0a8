//! Set-up sheets: one printed page for each test, for the operator at the machine.

use abbe::model::session::Session;
use abbe::model::words::counted;
use abbe::plan::sheet::{AxisRange, PlacedPoint, TestSheet};
use maud::{DOCTYPE, Markup, html};

use super::html::{head, table};
use crate::report::figure::set_up::SetUps;
use crate::report::figure::svg::{LIGHT, STYLE, element};
use crate::report::figure::{Chart, Figure};
use crate::report::number::{unit, with_minus_signs};
use crate::report::table::{Cell, Table, cells, numbers};

const PAGE_STYLE: &str = include_str!("sheet.css");

/// The page loads nothing and has no script.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; form-action 'none'; base-uri 'none'";

/// The sheets of a session as one HTML page. `basic_bar_mm` is the length of the bar without an extension; the warnings
/// stand on the first page.
pub fn html(
    session: &Session,
    sheets: &[TestSheet],
    basic_bar_mm: Option<f64>,
    source: &str,
    warnings: &[String],
) -> String {
    let colours: String = LIGHT.iter().map(|(name, colour)| format!("--{name}:{colour};")).collect();
    let style = format!(":root{{color-scheme:light;{colours}}}\n{STYLE}{PAGE_STYLE}");
    let title = format!("Set-up sheets: {}", session.machine.name);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(POLICY, &title, &style))
            body {
                (overview(session, sheets, source, warnings))
                @for (number, sheet) in sheets.iter().enumerate() {
                    (page_of(session, sheet, number + 1, sheets.len(), basic_bar_mm))
                }
            }
        }
    };
    page.into_string()
}

/// The first page: the tests in their order with what is mounted, and the time.
fn overview(session: &Session, sheets: &[TestSheet], source: &str, warnings: &[String]) -> Markup {
    let mut clock_min = 0.0;
    let rows: Vec<Vec<Cell>> = sheets
        .iter()
        .enumerate()
        .map(|(number, sheet)| {
            clock_min += sheet.minutes;
            let mounted: Vec<&str> = sheet
                .mounts
                .iter()
                .filter_map(|mount| mount.strip_suffix(": mount it").or(mount.strip_suffix(": assemble it")))
                .collect();
            cells![
                (number + 1).to_string(),
                &sheet.name,
                if mounted.is_empty() { "nothing".to_string() } else { mounted.join(", ").to_lowercase() },
                sheet.readings.to_string(),
                Cell::fixed(sheet.minutes, 1),
                clock(clock_min)
            ]
        })
        .collect();
    let columns = [">order", "test", "to mount", ">readings", ">duration, min", ">ends after, h:min"];
    html! {
        section class="sheet" {
            h1 { (session.machine.name) ": set-up sheets" }
            p { "Session " code { (source) } ". " (counted(sheets.len(), "test")) ", " (clock(clock_min)) " h with set-up." }
            (table(&Table::new(columns, rows)))
            @if !warnings.is_empty() {
                h2 { "Warnings" }
                ul { @for warning in warnings { li { (warning) } } }
            }
            @if !session.about.is_empty() {
                dl { @for (name, note) in &session.about { dt { (name.replace('_', " ")) } dd { (note) } } }
            }
            p {
                "Positions are those of the axes in the session, from the reference frame R. Check travel, table and fixtures \
                 without the bar before each test."
            }
            (notes(&["Operator", "Date", "Instrument, serial number", "Temperature at start and end, °C"]))
        }
    }
}

/// Hours and minutes.
fn clock(minutes: f64) -> String {
    let whole = minutes.round().max(0.0) as u64;
    format!("{}:{:02}", whole / 60, whole % 60)
}

/// The page of a test.
fn page_of(session: &Session, sheet: &TestSheet, number: usize, count: usize, basic_bar_mm: Option<f64>) -> Markup {
    let figure = Figure::new(
        format!("set-up-{}", sheet.name),
        "Set-up",
        "in the reference frame R, seen along (1, 1, 1).",
        Chart::SetUps(SetUps { panels: vec![sheet.path.clone()], per_row: 1 }),
    );
    let (_, drawing) = element(&figure);
    html! {
        section class="sheet" {
            header {
                h1 { "Test " (sheet.name) }
                p { (session.machine.name) ", page " (number) " of " (count) }
            }
            div class="halves" {
                div {
                    h2 { "Mount" }
                    ul { @for mount in &sheet.mounts { li { (mount) } } }
                    (points(sheet))
                    @if let Some(bar) = sheet.bar_mm { (bar_lines(bar, basic_bar_mm)) }
                    (centring(session, sheet))
                }
                div { (drawing) }
            }
            h2 { "Positions of the axes" }
            (table(&axes(&sheet.axes)))
            p {
                (counted(sheet.traversals, if sheet.poses.is_empty() { "traversal" } else { "sequence of poses" })) ", "
                (counted(sheet.readings, "reading")) ", about " (format!("{:.0}", sheet.minutes.ceil())) " min with set-up."
            }
            (clearance(sheet))
            @if !sheet.poses.is_empty() { (poses(sheet)) }
            (notes(&["Began", "Ended", "Temperature, °C", "Data file"]))
        }
    }
}

/// Coordinates of the instrument's points.
fn points(sheet: &TestSheet) -> Markup {
    let row = |frame: &str, point: &PlacedPoint| {
        let mut row: Vec<Cell> = vec![format!("{}, from the {frame}", point.name).into()];
        row.extend(point.own_mm.map(|mm| Cell::fixed(mm, 3)));
        let u = point.u_mm.map_or(String::new(), |u| {
            let um = |mm: &f64| {
                if mm.is_finite() {
                    let text = format!("{:.3}", mm * 1e3);
                    text.trim_end_matches('0').trim_end_matches('.').to_string()
                } else {
                    "–".into()
                }
            };
            u.iter().map(um).collect::<Vec<_>>().join(", ")
        });
        row.push(u.into());
        row
    };
    let on_table = sheet.table_point.iter().map(|point| row("table", point));
    let rows: Vec<Vec<Cell>> = on_table.chain(sheet.tool_point.iter().map(|point| row("tool", point))).collect();
    if rows.is_empty() {
        return html! {};
    }
    html! {
        (table(&Table::new(["centre, mm", ">X", ">Y", ">Z", ">u, µm"], rows).without_empty_columns()))
        p class="note" { "Table frame and tool frame are R with all axes at zero." }
    }
}

/// The bar and its extension.
fn bar_lines(bar_mm: f64, basic_bar_mm: Option<f64>) -> Markup {
    let extension = basic_bar_mm.map(|basic| bar_mm - basic).filter(|extension| *extension > 1.0);
    html! {
        p {
            "Bar, calibrated length: " strong { (bar_mm) " mm" }
            @if let Some(extension) = extension { ", with an extension of " (format!("{extension:.0}")) " mm" }
        }
    }
}

/// Where the spindle cup takes the workpiece ball.
fn centring(session: &Session, sheet: &TestSheet) -> Markup {
    let Some(at) = &sheet.centring else {
        return html! {
            @if sheet.bar_mm.is_some() {
                p { "The spindle does not reach the centre of the workpiece ball: place it by measurement." }
            }
        };
    };
    let positions: Vec<String> = session
        .machine
        .axes
        .iter()
        .zip(at)
        .map(|(axis, q)| with_minus_signs(&format!("{} {q:.3} {}", axis.name, unit(axis.kind.unit()))))
        .collect();
    html! { p { "Both balls coincide at " (positions.join(", ")) "." } }
}

/// One row per axis.
fn axes(axes: &[AxisRange]) -> Table {
    let rows = axes.iter().map(|axis| {
        let travel = axis.travel.map_or("not stated".to_string(), |[low, high]| format!("{low:.0} to {high:.0}"));
        let span = if axis.moves() { format!("{:.3} to {:.3}", axis.least, axis.greatest) } else { "stays".into() };
        cells![
            &axis.name,
            Cell::fixed(axis.start, 3),
            span,
            unit(axis.unit),
            travel,
            Cell::or_dash(axis.room().map(|room| Cell::fixed(room, 1)))
        ]
    });
    Table::new(["axis", ">start", ">measured path", "unit", ">travel", ">least distance from its end"], rows)
}

/// The least clearance and where it is.
fn clearance(sheet: &TestSheet) -> Markup {
    html! {
        @match &sheet.clearance {
            None => p { "Clearance is not checked: neither machine nor session states what can collide." },
            Some(found) => p {
                "Least clearance: " strong { (with_minus_signs(&format!("{:.1} mm", found.clearance_mm))) } " between "
                (found.between[0]) " and " (found.between[1]) ", at "
                (with_minus_signs(&found.at.iter().map(|(name, q)| format!("{name} {q:.1}")).collect::<Vec<_>>().join(", "))) "."
            },
        }
    }
}

/// The positions of all axes at each pose.
fn poses(sheet: &TestSheet) -> Markup {
    let mut columns = vec![numbers("pose")];
    columns.extend(sheet.axes.iter().map(|axis| numbers(format!("{}, {}", axis.name, unit(axis.unit)))));
    let rows = sheet.poses.iter().enumerate().map(|(number, pose)| {
        let mut row: Vec<Cell> = vec![(number + 1).to_string().into()];
        row.extend(pose.iter().map(|q| Cell::fixed(*q, 3)));
        row
    });
    html! { div class="poses" { (table(&Table::new(columns, rows))) } }
}

/// Lines to write on, and a box.
fn notes(lines: &[&str]) -> Markup {
    html! {
        h2 { "Notes" }
        div class="lines" { @for line in lines { div { (line) } } }
        div class="box" {}
    }
}
