//! Sections of readings, shared by several reports: traces, correlations and the machine.

use abbe::identify::fit::Fit;
use abbe::identify::parameters::Role;
use abbe::identify::problem::Problem;
use abbe::identify::results::ParameterResult;
use abbe::identify::series::{Cause, correlation};
use maud::{Markup, html};
use serde_json::json;

use super::document::Document;
use super::embed;
use super::plots::SessionPlots;
use super::residuals::{omitted_tests, unaffected_heading};
use crate::printers::html::{folded, with_minus_signs};
use crate::report::figure::matrix::Matrix;
use crate::report::figure::{Chart, Figure, chain};
use crate::report::number::{unit, value_and_u};

/// Maximum number of rows of a correlation map.
const MAX_CORRELATED: usize = 40;

/// Adds the data of the interactive plots, with one slider per error and effect, and all readings as CSV.
pub fn add_data(document: &mut Document, session: &SessionPlots<'_>, parameters: &[ParameterResult]) {
    let mut data = embed::data(session);
    let sliders: Vec<serde_json::Value> = embed::sliders(session)
        .into_iter()
        .map(|k| {
            let share = &session.series.shares[k];
            let is_same = |p: &&ParameterResult| {
                p.id == share.id || p.id.strip_prefix(&share.id).is_some_and(|rest| rest.starts_with('.'))
            };
            let value = parameters.iter().find(is_same).map(|p| {
                let (value, u) = value_and_u(p.value, p.u);
                with_minus_signs(&format!(" {value} ± {u} {}", unit(&p.unit)))
            });
            let label = match share.cause {
                Cause::Setup => "set-up: balls and bar".to_string(),
                Cause::Unseen => "confounded parameters".to_string(),
                Cause::Error | Cause::Effect => format!("{}{}", share.id, value.unwrap_or_default()),
            };
            json!({"id": share.id, "label": label})
        })
        .collect();
    data["sliders"] = sliders.into();
    document.data = data;
    document.readings = embed::readings(session);
}

/// Deviations from nominal with switches and sliders. Tests that the model does not change are folded.
pub fn traces(document: &mut Document, session: &SessionPlots<'_>) -> Markup {
    let (affected, unaffected): (Vec<usize>, Vec<usize>) =
        session.tests().map(|(number, _)| number).partition(|number| session.is_affected(*number));
    let mut of_tests = |numbers: &[usize]| {
        let plots: Vec<Vec<Figure>> = numbers
            .iter()
            .map(|number| {
                let polar = session.polar_deviation(*number).into_iter();
                polar.chain(session.deviations(*number)).collect()
            })
            .collect();
        if session.is_polar() {
            let rows: Vec<Markup> = plots.into_iter().map(|plots| document.show(plots)).collect();
            html! { @for row in &rows { (row) } }
        } else {
            document.show(plots.into_iter().flatten())
        }
    };
    let [open, folded_tests] = [of_tests(&affected), of_tests(&unaffected)];
    let reference = if session.series.coordinates == 3 {
        "the nominal machine with the fitted set-up"
    } else {
        "the nominal machine and set-up"
    };
    html! {
        div class="controls needs-script" id="controls" hidden {}
        p class="note" {
            "Deviation: observed reading minus the reading of " (reference) ". A slider scales the contribution J·β of one error or effect to the readings. \
             The contributions are linearised at the solution; the linearisation error is at most "
            (format!("{:.3}", session.series.second_order_um)) " µm. "
            @if session.series.shares.len() > embed::MAX_SLIDERS { "The " (embed::MAX_SLIDERS) " largest contributions have a slider. " }
            "The plots show a part of the readings; all extremes are included."
        }
        (open)
        @if !unaffected.is_empty() { (folded(&unaffected_heading(session, &unaffected), &folded_tests)) }
        (omitted_tests(session))
    }
}

/// Correlation map of the errors and effects of a fit.
pub fn correlations(document: &mut Document, problem: &Problem, fit: &Fit) -> Markup {
    let (mut ids, mut matrix) = correlation(problem, fit);
    let all = ids.len();
    ids.truncate(MAX_CORRELATED);
    matrix.truncate(MAX_CORRELATED);
    let matrix: Vec<Vec<Option<f64>>> =
        matrix.into_iter().map(|row| row.into_iter().take(MAX_CORRELATED).map(Some).collect()).collect();
    if ids.len() < 2 {
        return html! { p { "Fewer than two errors are identifiable, so that there is no correlation." } };
    }
    let shown = document.show([correlation_map(ids, matrix)]);
    html! {
        p { "Strongly correlated errors are poorly separable. A confounded parameter has no value of its own." }
        (shown)
        @if all > MAX_CORRELATED { p class="note" { "The map shows the first " (MAX_CORRELATED) " of " (all) " parameters." } }
    }
}

/// A correlation map.
pub fn correlation_map(ids: Vec<String>, rows: Vec<Vec<Option<f64>>>) -> Figure {
    Figure::new(
        "correlation",
        "Correlation",
        "Below the diagonal: the area of a symbol is the magnitude. Above the diagonal: the value, if it fits.",
        Chart::Matrix(Matrix { quantity: "correlation", ids, rows }),
    )
}

/// The kinematic chain with the estimated errors.
pub fn machine(document: &mut Document, problem: &Problem) -> Markup {
    let list = problem.parameters.list.iter();
    let mut errors: Vec<String> =
        list.filter(|parameter| parameter.role == Role::Error).map(|parameter| parameter.id.clone()).collect();
    errors.extend(problem.parameters.effect_ids.iter().cloned());
    document.show([chain::figure(&problem.session.machine, &errors)])
}
