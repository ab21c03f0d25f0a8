//! Set-up sheets: an order of work for the operator at the machine. The first page has the datum, the machine and the order
//! of the tests, and each test has one printed page.

mod overview;
mod page;

use abbe::codegen::nc::{Control, Run};
use abbe::model::axis::AxisKind;
use abbe::model::session::Session;
use abbe::plan::sheet::TestSheet;
use maud::{DOCTYPE, Markup, html};

use super::html::head;
use crate::report::figure::svg::{STYLE, variables};
use crate::report::number::with_minus_signs;

const PAGE_STYLE: &str = include_str!("sheet.css");

/// The page loads nothing and has no script.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; form-action 'none'; base-uri 'none'";

/// Width of drawings, SVG units: half a printed page, on which letters of 11 units are 9 points high.
const DRAWING: f64 = 300.0;

/// What the sheets order beside the set-up of the tests.
pub struct Order {
    /// The name of the session file.
    pub source: String,
    /// The control whose programs are named; `None` if none is stated.
    pub control: Option<&'static dyn Control>,
    /// The file of the program that calls the others.
    pub main: Option<String>,
    /// Its number on a control whose programs have numbers.
    pub number: u32,
    /// The programs of the tests; empty if the plan has none.
    pub runs: Vec<Run>,
    /// Length of the bar without an extension, mm.
    pub basic_bar_mm: Option<f64>,
    /// They stand on the first page, those of a test on its page, too.
    pub warnings: Vec<String>,
}

impl Order {
    fn run(&self, test: &str) -> Option<&Run> {
        self.runs.iter().find(|run| run.test == test)
    }

    /// The file and the number of the program of a test.
    fn program(&self, test: &str) -> Option<String> {
        let run = self.run(test).filter(|_| self.control.is_some())?;
        Some(named(&run.file, run.number))
    }

    /// Duration of a test with what precedes it, min.
    fn minutes(&self, sheet: &TestSheet) -> f64 {
        sheet.set_up_min + self.run(&sheet.name).map_or(sheet.moving_min, |run| run.minutes)
    }
}

/// A program and its number.
fn named(file: &str, number: Option<u32>) -> String {
    number.map_or_else(|| file.to_string(), |number| format!("{file}, O{number:04}"))
}

/// The sheets of a session as one HTML page.
pub fn html(session: &Session, sheets: &[TestSheet], order: &Order) -> String {
    let style = format!(":root{{color-scheme:light;{}}}\n{STYLE}{PAGE_STYLE}", variables(false));
    let title = format!("Set-up sheets: {}", session.machine.name);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(POLICY, &title, &style))
            body {
                (overview::overview(session, sheets, order))
                @for (number, sheet) in sheets.iter().enumerate() {
                    (page::page(session, sheet, order, [number + 1, sheets.len()]))
                }
            }
        }
    };
    page.into_string()
}

/// Hours and minutes.
fn clock(minutes: f64) -> String {
    let whole = minutes.round().max(0.0) as u64;
    format!("{}:{:02}", whole / 60, whole % 60)
}

/// The positions of all axes: `X 12.500 mm, C −180.000°`.
fn positions(session: &Session, at: &[f64]) -> String {
    let of = session.machine.axes.iter().zip(at).map(|(axis, q)| {
        let q = (q * 1e3).round() / 1e3 + 0.0;
        // No line ends between a number and its unit.
        let unit = if axis.kind == AxisKind::Rotary { "°" } else { "\u{a0}mm" };
        format!("{}\u{a0}{}{unit}", axis.name, with_minus_signs(&format!("{q:.3}")))
    });
    of.collect::<Vec<_>>().join(", ")
}

/// Lines to write on, and a box.
fn notes(lines: &[&str]) -> Markup {
    html! {
        h2 { "Notes" }
        div class="lines" { @for line in lines { div { (line) } } }
        div class="box" {}
    }
}
