//! The sheet of one test.

use abbe::model::session::Session;
use abbe::model::words::counted;
use abbe::plan::sheet::{AxisRange, PlacedPoint, TestSheet};
use maud::{Markup, html};

use super::super::html::table;
use super::{DRAWING, Order, notes, positions};
use crate::report::figure::Figure;
use crate::report::figure::space::set_ups;
use crate::report::figure::svg::element;
use crate::report::number::{unit, with_minus_signs};
use crate::report::table::{Cell, Table, cells, numbers};

/// Extensions are longer, mm: calibration changes a length by less.
const LEAST_EXTENSION_MM: f64 = 1.0;

/// The page of a test, by its number and the number of tests.
pub(super) fn page(session: &Session, sheet: &TestSheet, order: &Order, [number, count]: [usize; 2]) -> Markup {
    let figure = Figure::new(
        format!("set-up-{}", sheet.name),
        "Set-up",
        "in the reference frame R, seen along (1, 1, 1).",
        set_ups(std::slice::from_ref(&sheet.path), 1, DRAWING),
    );
    let (_, drawing) = element(&figure);
    let own = format!("test \"{}\":", sheet.name);
    let warnings: Vec<&str> = order.warnings.iter().filter_map(|warning| warning.strip_prefix(&own)).collect();
    html! {
        section class="sheet" {
            header {
                h1 { "Test " (sheet.name) }
                p { (session.machine.name) ", page " (number) " of " (count) }
            }
            (work(session, sheet, order))
            div class="halves" {
                div {
                    h2 { "Mount" }
                    ul { @for mount in &sheet.mounts { li { (mount) } } }
                    (points(sheet))
                    (centring(session, sheet, order))
                }
                div { (drawing) }
            }
            h2 { "Positions of the axes" }
            (table(&axes(&sheet.axes)))
            (clearance(sheet))
            @if !warnings.is_empty() {
                ul class="warnings" { @for warning in &warnings { li { (warning.trim()) } } }
            }
            @if !sheet.poses.is_empty() { (poses(sheet)) }
            (notes(&["Began", "Ended", "Temperature, °C", "Data file"]))
        }
    }
}

/// Program, bar, start, feed and time.
fn work(session: &Session, sheet: &TestSheet, order: &Order) -> Markup {
    let run = order.run(&sheet.name);
    let what = if sheet.poses.is_empty() { "traversal" } else { "sequence of poses" };
    html! {
        dl class="work" {
            @if let Some(program) = order.program(&sheet.name) { dt { "Program" } dd { strong { (program) } } }
            @if let Some(bar) = sheet.bar_mm {
                dt { "Bar" }
                dd { strong { (bar) " mm" } " calibrated, " (extension(bar, order.basic_bar_mm)) }
            }
            @if let Some(run) = run {
                dt { @if sheet.bar_mm.is_some() { "Mount the bar at" } @else { "Start" } }
                dd { strong { (positions(session, &run.mounted_at)) } }
                @if run.mounted_at != run.start { dt { "Motion begins at" } dd { (positions(session, &run.start)) } }
                dt { "Feed" }
                dd { (format!("{:.0}", run.feed.0)) " " (run.feed.1) }
            }
            dt { "Time" }
            dd {
                "about " strong { (format!("{:.0}", order.minutes(sheet).ceil())) " min" } ", "
                (format!("{:.0}", sheet.set_up_min.ceil())) " min of them before the motion; "
                (counted(sheet.traversals, what)) ", " (counted(sheet.readings, "reading"))
            }
        }
    }
}

/// The extension of the bar, in words.
fn extension(bar_mm: f64, basic_bar_mm: Option<f64>) -> String {
    match basic_bar_mm.map(|basic| bar_mm - basic).filter(|extension| *extension > LEAST_EXTENSION_MM) {
        Some(extension) => format!("with an extension of {extension:.0} mm"),
        None => "without an extension".into(),
    }
}

/// Coordinates of the instrument's points.
fn points(sheet: &TestSheet) -> Markup {
    let row = |point: &PlacedPoint| {
        let mut row: Vec<Cell> = vec![format!("{}, from {}", point.name, point.body).into()];
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
    let rows: Vec<Vec<Cell>> = sheet.table_point.iter().chain(&sheet.tool_point).map(row).collect();
    if rows.is_empty() {
        return html! {};
    }
    html! {
        (table(&Table::new(["centre, mm", ">X", ">Y", ">Z", ">u, µm"], rows).without_empty_columns()))
        p class="note" { "Table frame and tool frame are R with all axes at zero." }
    }
}

/// Where the spindle cup takes the workpiece ball.
fn centring(session: &Session, sheet: &TestSheet, order: &Order) -> Markup {
    // The program centres where its motion begins, with overshoot.
    let at = order.run(&sheet.name).map_or(&sheet.centring, |run| &run.centring);
    let Some(at) = at else {
        return html! {
            @if sheet.bar_mm.is_some() {
                p { "The spindle does not reach the centre of the workpiece ball: place it by measurement." }
            }
        };
    };
    html! { p { "Both balls coincide at " (positions(session, at)) "." } }
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
    Table::new(["axis", ">first reading", ">measured path", "unit", ">travel", ">least distance from its end"], rows)
}

/// The least clearance and where it is.
fn clearance(sheet: &TestSheet) -> Markup {
    html! {
        @match &sheet.clearance {
            None => p { "Clearance is not checked: the machine states no body that can collide." },
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
