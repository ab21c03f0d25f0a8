//! Residuals of each test, affected tests first, and the residual of the whole session.

use abbe::identify::series::spectrum::Spectrum;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::curves;
use super::document::{Document, folded, table};
use super::format::{integer, um};
use super::plot::Plot;
use super::plots::{MAX_TESTS, SessionPlots};

/// Tables of tests with more rows are folded.
const MAX_ROWS: usize = 20;

/// Residuals of every test before and after, by the names of the two models. Tests that do not change are folded.
pub fn section(
    document: &mut Document,
    session: &SessionPlots<'_>,
    spectra: &[Spectrum],
    models: [&str; 2],
) -> Markup {
    let is_polar = session.is_polar() && session.tests().any(|(_, test)| test.way.is_angle);
    let maximum = spectra
        .iter()
        .flat_map(|spectrum| spectrum.before_um.iter().chain(&spectrum.after_um))
        .copied()
        .fold(0.0, f64::max);
    let mut open = Vec::new();
    let mut unaffected = Vec::new();
    for (number, test) in session.tests() {
        let block = block(document, session, number, spectra, maximum, models);
        if session.is_affected(number) {
            open.push(block);
        } else {
            unaffected.push((test.name.clone(), block));
        }
    }
    let mut overview: Vec<Plot> = Vec::new();
    if !is_polar {
        overview.push(curves::histogram(session, models));
    }
    overview.push(curves::over_time(session));
    let overview = document.show(overview);
    html! {
        @for block in &open { (block) }
        @if !unaffected.is_empty() {
            (folded(&unaffected_heading(&unaffected), &html! { @for (_, block) in &unaffected { (block) } }))
        }
        (omitted_tests(session))
        h3 { "All tests" }
        div class="halves" { div { (test_table(session, models)) } div { (overview) } }
    }
}

/// Heading of the folded tests: their number and names.
pub fn unaffected_heading<T>(tests: &[(String, T)]) -> String {
    let names: Vec<&str> = tests.iter().map(|(name, _)| name.as_str()).collect();
    format!(
        "{} without a change of the residual: {}",
        counted(tests.len(), "test"),
        names.join(", ")
    )
}

/// Plots of one test: polar plots on the left, plots with straight axes on the right.
fn block(
    document: &mut Document,
    session: &SessionPlots<'_>,
    number: usize,
    spectra: &[Spectrum],
    maximum_um: f64,
    models: [&str; 2],
) -> Markup {
    let name = &session.series.tests[number].name;
    let effects = &session.problem.parameters.effects;
    let mut straight = session.residuals(number);
    straight.extend(
        spectra
            .iter()
            .filter(|spectrum| &spectrum.of == name)
            .map(|spectrum| curves::spectrum_plot(spectrum, maximum_um, effects)),
    );
    let shown = match session.polar_residuals(number, models) {
        Some(polar) => document.show_beside(polar, straight),
        None => document.show(straight),
    };
    html! { h3 { (name) } (shown) }
}

/// Readings and RMS residuals of every test.
fn test_table(session: &SessionPlots<'_>, models: [&str; 2]) -> Markup {
    let coordinates = session.series.coordinates;
    let rows: Vec<Vec<String>> = session
        .series
        .tests
        .iter()
        .enumerate()
        .map(|(number, test)| {
            let [before, after] = session.rms_um(number);
            let readings = integer(test.after_um.len() / coordinates);
            vec![test.name.clone(), readings, um(before), um(after)]
        })
        .collect();
    let table = table(
        &[
            "test",
            "readings",
            &format!("rms, {}", models[0]),
            &format!("rms, {}", models[1]),
        ],
        &rows,
    );
    if rows.len() > MAX_ROWS {
        folded(
            &format!("RMS residual of {}", counted(rows.len(), "test")),
            &table,
        )
    } else {
        table
    }
}

/// A note about tests without plots of their own.
pub fn omitted_tests(session: &SessionPlots<'_>) -> Markup {
    let tests = session.series.tests.len();
    html! {
        @if tests > MAX_TESTS {
            p class="note" { "Plots are shown for the first " (MAX_TESTS) " of " (tests) " tests. The data contain all tests." }
        }
    }
}
