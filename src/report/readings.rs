//! Sections that the reports of a fit and of a trace share.

use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use abbe::identify::results::{ModelResult, Outlier, ParameterResult, Unobservable};
use abbe::identify::series::spectrum::Spectrum;
use abbe::identify::series::{Cause, SessionSeries, correlation};
use maud::{Markup, html};
use serde_json::json;

use super::curves;
use super::document::{Document, list, table};
use super::embed;
use super::plot::bars::{self, Row, Value};
use super::plot::{Plot, chain, heat};
use super::plots::{Drawn, MAX_TESTS};

/// The most unknowns of one unit in one plot.
const MAX_ROWS: usize = 30;
/// The most rows of a map of correlations.
const MAX_CORRELATED: usize = 40;

/// What a result calls its noise, in words: the residual of a model is not called noise.
pub fn sentence_of_noise(noise_um: f64, source: &str) -> String {
    match source {
        "residual" => format!(
            "No noise is stated and no repeats show it: uncertainties follow from the residual of the model, {}",
            um(noise_um)
        ),
        other => format!("Noise {} ({other})", um(noise_um)),
    }
}

/// A residual figure as words.
pub fn um(value: f64) -> String {
    crate::cli::table::micrometres(value)
}

/// A unit as people write it.
pub fn unit(name: &str) -> String {
    name.replace("um", "µm")
        .replace("deg", "°")
        .replace("^2", "²")
        .replace("^3", "³")
}

/// Cells as they are printed, with a minus that is one before numbers.
pub fn typeset(rows: Vec<Vec<String>>) -> Vec<Vec<String>> {
    let word = |word: &str| match word.strip_prefix('-') {
        Some(number) if number.starts_with(|c: char| c.is_ascii_digit()) => format!("\u{2212}{number}"),
        _ => word.to_string(),
    };
    let cell = |cell: String| cell.split(' ').map(word).collect::<Vec<_>>().join(" ");
    rows.into_iter()
        .map(|row| row.into_iter().map(cell).collect())
        .collect()
}

/// A value and its uncertainty, rounded alike, with a minus that is one.
pub fn value_and_u(value: f64, u: f64) -> (String, String) {
    let (value, u) = crate::cli::table::value_and_u(value, u);
    (value.replace('-', "\u{2212}"), u)
}

/// What the page moves: the data, and a slider for each error and effect.
pub fn live(document: &mut Document, drawn: &Drawn<'_>, parameters: &[ParameterResult]) {
    let mut data = embed::data(drawn);
    let slider_parameters: Vec<serde_json::Value> = embed::slider_parameters(drawn)
        .into_iter()
        .map(|k| {
            let share = &drawn.views.shares[k];
            let of = |p: &&ParameterResult| {
                p.id == share.id
                    || p.id
                        .strip_prefix(&share.id)
                        .is_some_and(|rest| rest.starts_with('.'))
            };
            let value = parameters.iter().find(of).map(|p| {
                let (value, u) = value_and_u(p.value, p.u);
                format!(" {value} ± {u} {}", unit(&p.unit))
            });
            let words = match share.cause {
                Cause::Setup => "set-up: balls and bar".to_string(),
                Cause::Unseen => "confounded, together".to_string(),
                Cause::Error | Cause::Effect => format!("{}{}", share.id, value.unwrap_or_default()),
            };
            json!({"id": share.id, "words": words})
        })
        .collect();
    data["sliders"] = slider_parameters.into();
    document.data = data;
    document.table = embed::table(drawn);
}

/// Table of residuals before and after, and the residuals of each test beside one another.
pub fn before_and_after(
    document: &mut Document,
    drawn: &Drawn<'_>,
    rows: &[(&str, &ModelResult)],
    words: [&str; 2],
) -> Markup {
    let three = drawn.views.coordinates == 3;
    let figures: Vec<Vec<String>> = rows
        .iter()
        .map(|(name, model)| {
            let mut row = vec![name.to_string(), um(model.rms_um), um(model.heldout_rms_um)];
            if let (Some(rms), Some(held)) = (model.rms_3d_um, model.heldout_rms_3d_um) {
                row.extend([um(rms), um(held)]);
            }
            row
        })
        .collect();
    let mut header = vec!["residual", "rms", "held out"];
    if three {
        header.extend(["length rms", "length held out"]);
    }
    let pairs: Vec<Plot> = drawn
        .tests()
        .filter_map(|(number, _)| drawn.residual_circles(number, words))
        .flatten()
        .collect();
    let shown = if pairs.is_empty() {
        document.show([curves::histogram(drawn, words)])
    } else {
        document.show(pairs)
    };
    html! { (table(&header, &figures)) (shown) (left_out_note(drawn.views)) }
}

/// What is said where tests are not drawn one by one.
pub fn left_out_note(views: &SessionSeries) -> Markup {
    html! {
        @if views.tests.len() > MAX_TESTS {
            p class="note" { "The first " (MAX_TESTS) " of " (views.tests.len()) " tests are drawn one by one; the readings of all are in the data." }
        }
    }
}

/// Traces with their controls.
pub fn traces(document: &mut Document, drawn: &Drawn<'_>) -> Markup {
    let plots: Vec<Plot> = drawn
        .tests()
        .flat_map(|(number, _)| drawn.trace(number).into_iter().chain(drawn.deviations(number)))
        .collect();
    let shown = document.show(plots);
    let three = drawn.views.coordinates == 3;
    html! {
        div class="controls needs-script" id="controls" hidden {}
        p class="note" {
            @if three {
                "Observed less what the nominal machine would read with the fitted set-up. "
            } @else {
                "Observed less what the nominal machine and set-up would read. "
            }
            "The slider_parameters take each error and effect out of the readings by its share J·β, which was computed beforehand and is linear; all shares and the \
             residual together miss the readings by at most " (format!("{:.3}", drawn.views.second_order_um)) " µm. "
            @if drawn.views.shares.len() > embed::MAX_SLIDERS { "Only the " (embed::MAX_SLIDERS) " with the largest shares have one. " }
            "Points are thinned for drawing so that no peak is lost."
        }
        (shown)
    }
}

/// Parameters with bars of uncertainty, by unit; and as a table.
pub fn parameters(
    document: &mut Document,
    after: &[ParameterResult],
    before: Option<&[ParameterResult]>,
) -> Markup {
    let mut units: Vec<&str> = after.iter().map(|p| p.unit.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    let value = |p: &ParameterResult| Value {
        value: p.value,
        u: p.u,
    };
    let mut plots = Vec::new();
    for unit_name in units {
        let rows: Vec<Row> = after
            .iter()
            .filter(|p| p.unit == unit_name)
            .map(|p| Row {
                name: p.id.clone(),
                before: before
                    .and_then(|list| list.iter().find(|b| b.id == p.id))
                    .map(value),
                after: Some(value(p)),
            })
            .collect();
        let parts = rows.len().div_ceil(MAX_ROWS);
        for (number, rows) in rows.chunks(MAX_ROWS).enumerate() {
            let of = if parts > 1 {
                format!(" ({} of {parts})", number + 1)
            } else {
                String::new()
            };
            plots.push(bars::values(
                format!("parameters-{}-{}", unit_name.replace('/', "-per-"), number + 1),
                format!("Parameters in {}{of}", unit(unit_name)),
                "Whiskers are two standard uncertainties either way.".to_string(),
                &unit(unit_name),
                ["before", "after"],
                rows,
            ));
        }
    }
    let rows: Vec<Vec<String>> = after
        .iter()
        .map(|p| {
            let (value, u) = value_and_u(p.value, p.u);
            let was = before
                .and_then(|list| list.iter().find(|b| b.id == p.id))
                .map(|b| {
                    let (value, u) = value_and_u(b.value, b.u);
                    format!("{value} ± {u}")
                });
            let mut row = vec![p.id.clone(), value, u, unit(&p.unit)];
            if before.is_some() {
                row.push(was.unwrap_or_default());
            }
            row
        })
        .collect();
    let mut header = vec!["parameter", "value", "u (k=1)", "unit"];
    if before.is_some() {
        header.push("before");
    }
    let shown = document.show(plots);
    html! { (shown) details open[rows.len() <= 40] { summary { "As a table" } (table(&header, &rows)) } }
}

/// Residual plots: along each test, over time, and by order.
pub fn residuals(document: &mut Document, drawn: &Drawn<'_>, spectra: &[Spectrum]) -> Markup {
    let mut plots: Vec<Plot> = drawn
        .tests()
        .flat_map(|(number, _)| drawn.residuals(number))
        .collect();
    plots.push(curves::over_time(drawn));
    let effects = &drawn.problem.parameters.effects;
    // One height for all, so that a wave in one test stands out against the others.
    let highest = spectra
        .iter()
        .flat_map(|spectrum| spectrum.before_um.iter().chain(&spectrum.after_um))
        .copied()
        .fold(0.0, f64::max);
    plots.extend(
        spectra
            .iter()
            .take(2 * MAX_TESTS)
            .map(|spectrum| curves::spectrum_plot(spectrum, highest, effects)),
    );
    document.show(plots)
}

/// The map of correlations of a fit.
pub fn correlations(document: &mut Document, problem: &Problem<'_>, fit: &Fit) -> Markup {
    let (mut ids, mut matrix) = correlation(problem, fit);
    let all = ids.len();
    ids.truncate(MAX_CORRELATED);
    matrix.truncate(MAX_CORRELATED);
    let matrix: Vec<Vec<Option<f64>>> = matrix
        .into_iter()
        .map(|row| row.into_iter().take(MAX_CORRELATED).map(Some).collect())
        .collect();
    if ids.len() < 2 {
        return html! { p { "Fewer than two errors are identified." } };
    }
    let shown = document.show([map(&ids, &matrix)]);
    html! {
        (shown)
        @if all > MAX_CORRELATED { p class="note" { "The first " (MAX_CORRELATED) " of " (all) " are drawn." } }
    }
}

/// A map of correlations.
pub fn map(ids: &[String], matrix: &[Vec<Option<f64>>]) -> Plot {
    heat::map(
        "correlation".to_string(),
        "Correlation".to_string(),
        "The area of a sign is the size of the correlation; above the diagonal its value, where there is room.".to_string(),
        ids,
        matrix,
    )
}

/// The machine with what is identified.
pub fn machine(document: &mut Document, problem: &Problem<'_>) -> Markup {
    let list = problem.parameters.list.iter();
    let mut errors: Vec<String> = list
        .filter(|p| p.role == abbe::identify::parameters::Role::Error)
        .map(|p| p.id.clone())
        .collect();
    errors.extend(problem.parameters.effect_ids.iter().cloned());
    document.show([chain::plot(&problem.session.machine, &errors)])
}

/// What is confounded.
pub fn unobservable(items: &[Unobservable]) -> Markup {
    html! {
        @if !items.is_empty() {
            h3 { "Not seen by these readings" }
            (list(items.iter().map(|item| item.why.clone())))
        }
    }
}

/// What was left out, and what a user should know.
pub fn warnings(rejected: &[Outlier], warnings: &[String]) -> Markup {
    let rows: Vec<Vec<String>> = rejected
        .iter()
        .map(|r| {
            vec![
                r.test.clone(),
                r.file.clone(),
                r.line.to_string(),
                um(r.residual_um),
            ]
        })
        .collect();
    html! {
        @if !rows.is_empty() { h3 { "Excluded as outliers" } (table(&["test", "file", "line", "residual"], &rows)) }
        @if !warnings.is_empty() { h3 { "Warnings" } (list(warnings.iter().cloned())) }
    }
}
