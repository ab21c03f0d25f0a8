//! The report of `abbe fit --method circle|cone|two-plane`.

use abbe::identify::geometric::Comparison;
use abbe::identify::problem::Problem;
use maud::{Markup, html};

use super::document::{Document, list, table};
use super::plot::Plot;
use super::plot::bars::{Row, Value, values};
use super::readings::{self, sentence_of_noise, typeset, um, unit, value_and_u};
use crate::cli::geometric::{error_header, error_rows};

/// How the errors were found.
pub fn method(result: &Comparison) -> Markup {
    html! {
        p {
            "The method of the literature (" (result.method) ") and the full least-squares fit on the same readings. "
            (sentence_of_noise(result.noise_um, &result.noise_source)) ". Bias: both on noise-free readings that were simulated with the full fit's errors, less those errors."
        }
    }
}

/// The report.
pub fn document(problem: &Problem<'_>, result: &Comparison) -> Document {
    let mut document = Document {
        title: format!(
            "{}: {} beside the full fit",
            problem.session.machine.name, result.method
        ),
        verdict: format!(
            "The errors of the {} method leave {} of {} in the tests that it takes; the full fit leaves {} in all tests.",
            result.method,
            um(result.method_rms_um),
            um(result.nominal_rms_um),
            um(result.rms_um)
        ),
        ..Document::default()
    };
    let shown = document.show(plots(result));
    document.section(
        "Errors by both ways",
        html! {
            (shown)
            (errors(result))
        },
    );
    document.section("Where the axes pass the standing ball", centres(result));
    if !result.warnings.is_empty() {
        document.section("Warnings", list(result.warnings.iter().cloned()));
    }
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    document
}

fn plots(result: &Comparison) -> Vec<Plot> {
    let value = |value: Option<f64>, u: Option<f64>| Some(Value { value: value?, u: u? });
    let mut units: Vec<&str> = result.errors.iter().map(|row| row.unit.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    units
        .into_iter()
        .map(|name| {
            let rows: Vec<Row> = result
                .errors
                .iter()
                .filter(|row| row.unit == name)
                .map(|row| Row {
                    name: row.id.clone(),
                    before: value(row.value, row.u),
                    after: value(row.full_value, row.full_u),
                })
                .collect();
            values(
                format!("errors-{name}"),
                format!("Errors by both ways, {}", unit(name)),
                "What a method does not tell has no mark.".to_string(),
                &unit(name),
                [&result.method, "full fit"],
                &rows,
            )
        })
        .collect()
}

fn errors(result: &Comparison) -> Markup {
    let mut rows = typeset(error_rows(result));
    for row in &mut rows {
        if let Some(name) = row.last_mut() {
            *name = unit(name);
        }
    }
    table(&error_header(result), &rows)
}

fn centres(result: &Comparison) -> Markup {
    let rows: Vec<Vec<String>> = result
        .centres
        .iter()
        .flat_map(|centre| {
            centre.offsets.iter().map(move |found| {
                let (offset, u) = value_and_u(found.offset_um, found.u_um);
                vec![
                    centre.test.clone(),
                    format!("{} of {}", found.direction, centre.axis),
                    offset,
                    u,
                    format!("{:.4}", centre.radius_mm),
                    format!("{:.4}", centre.height_mm).replace('-', "\u{2212}"),
                ]
            })
        })
        .collect();
    html! {
        p { "From their nominal places." }
        (table(&["test", "centre", "µm", "u (k=1)", "radius, mm", "height of the cone, mm"], &rows))
    }
}
