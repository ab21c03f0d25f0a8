//! Residuals of each test, affected tests first, and the residual of the whole session.

use abbe::identify::series::spectrum::Spectrum;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::curves;
use super::document::Document;
use super::plots::{MAX_TESTS, SessionPlots};
use crate::printers::html::{folded, folded_beyond, integer, table};
use crate::report::figure::Figure;
use crate::report::number::micrometres;
use crate::report::table::{Table, cells, numbers, words};

/// Tables of tests with more rows are folded.
const MAX_ROWS: usize = 20;

/// Residuals of every test before and after, by the names of the two models. Tests that do not change are folded.
pub fn section(document: &mut Document, session: &SessionPlots<'_>, spectra: &[Spectrum], models: [&str; 2]) -> Markup {
    let maximum = spectra
        .iter()
        .flat_map(|spectrum| spectrum.before_um.iter().chain(&spectrum.after_um))
        .copied()
        .fold(0.0, f64::max);
    let (affected, unaffected): (Vec<usize>, Vec<usize>) =
        session.tests().map(|(number, _)| number).partition(|number| session.is_affected(*number));
    let is_polar = session.is_polar() && session.tests().any(|(_, test)| test.way.is_angle);
    let mut of_tests = |numbers: &[usize]| {
        if is_polar {
            let blocks: Vec<Markup> =
                numbers.iter().map(|number| block(document, session, *number, spectra, maximum, models)).collect();
            html! { @for block in &blocks { (block) } }
        } else {
            let plots = numbers.iter().flat_map(|number| straight(session, *number, spectra, maximum));
            document.show(plots.collect::<Vec<_>>())
        }
    };
    let [open, folded_tests] = [of_tests(&affected), of_tests(&unaffected)];
    let over_time = curves::over_time(session);
    html! {
        (open)
        @if !unaffected.is_empty() { (folded(&unaffected_heading(session, &unaffected), &folded_tests)) }
        (omitted_tests(session))
        h3 { "All tests" }
        @if is_polar {
            div class="halves" { div { (test_table(session, models)) } div { (document.show([over_time])) } }
        } @else {
            (test_table(session, models))
            (document.show([curves::histogram(session, models), over_time]))
        }
    }
}

/// Heading of the folded tests: their number and names.
pub fn unaffected_heading(session: &SessionPlots<'_>, numbers: &[usize]) -> String {
    let names: Vec<&str> = numbers.iter().map(|number| session.series.tests[*number].name.as_str()).collect();
    format!("{} without a change of the residual: {}", counted(names.len(), "test"), names.join(", "))
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
    let straight = straight(session, number, spectra, maximum_um);
    let shown = match session.polar_residuals(number, models) {
        Some(polar) => document.show_beside(polar, straight),
        None => document.show(straight),
    };
    html! { h3 { (session.series.tests[number].name) } (shown) }
}

/// Plots of one test with straight axes: residuals, and their spectra on one scale.
fn straight(session: &SessionPlots<'_>, number: usize, spectra: &[Spectrum], maximum_um: f64) -> Vec<Figure> {
    let name = &session.series.tests[number].name;
    let effects = &session.problem.parameters.effects;
    let mut plots = session.residuals(number);
    plots.extend(
        spectra
            .iter()
            .filter(|spectrum| &spectrum.of == name)
            .map(|spectrum| curves::spectrum_plot(spectrum, maximum_um, effects)),
    );
    plots
}

/// Readings and RMS residuals of every test.
fn test_table(session: &SessionPlots<'_>, models: [&str; 2]) -> Markup {
    let coordinates = session.series.coordinates;
    let has_change = session.has_change();
    let rows = session.series.tests.iter().enumerate().map(|(number, test)| {
        let [before, after] = session.rms_um(number).map(micrometres);
        let mut row = cells![&test.name, integer(test.after_um.len() / coordinates), after];
        if has_change {
            row.insert(2, before.into());
        }
        row
    });
    let [before, after] = models.map(|model| numbers(format!("rms, {model}")));
    let mut columns = vec![words("test"), numbers("readings"), after];
    if has_change {
        columns.insert(2, before);
    }
    let residuals = Table::new(columns, rows);
    let summary = format!("RMS residual of {}", counted(residuals.rows.len(), "test"));
    folded_beyond(MAX_ROWS, residuals.rows.len(), &summary, table(&residuals))
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
