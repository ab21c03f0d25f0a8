//! Report of `abbe fit --method circle|cone|two-plane`.

use abbe::identify::geometric::Comparison;
use abbe::identify::problem::Problem;
use maud::{Markup, html};

use super::document::{Document, table};
use super::format::{noise_sentence, typeset, um, unit, units, value_and_u};
use super::plot::Plot;
use super::plot::bars::{Row, Value, values};
use super::readings;
use crate::present::method::{error_header, error_rows};

/// Method of the comparison.
pub fn method(result: &Comparison) -> Markup {
    html! {
        p {
            "The " (result.method) " method of the literature and the full least-squares fit, applied to the same readings. "
            (noise_sentence(result.noise_um, &result.noise_source))
            ". Bias: both methods are applied to noise-free readings that are simulated with the errors of the full fit; these errors are subtracted."
        }
    }
}

/// The report.
pub fn document(problem: &Problem, result: &Comparison) -> Document {
    let mut document = Document {
        title: format!("{}: {} method and full fit", problem.session.machine.name, result.method),
        verdict: format!(
            "The {} method reduces the rms residual of its tests from {2} to {1}. The rms residual of the full fit in all tests is {3}.",
            result.method,
            um(result.method_rms_um),
            um(result.nominal_rms_um),
            um(result.rms_um)
        ),
        warnings: result.warnings.clone(),
        ..Document::default()
    };
    let shown = document.show(plots(result));
    document.section(
        "Errors by both methods",
        html! {
            (errors(result))
            (shown)
        },
    );
    document.section("Axis positions", centres(result));
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    document
}

fn plots(result: &Comparison) -> Vec<Plot> {
    let value = |value: Option<f64>, u: Option<f64>| Some(Value { value: value?, u: u? });
    units(result.errors.iter().map(|row| row.unit.as_str()))
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
                format!("Errors by both methods, {}", unit(name)),
                "Whiskers: ± 2 u. An error that a method does not identify has no mark.".to_string(),
                &format!("value, {}", unit(name)),
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
        p { "Position of each axis relative to the stationary ball, as deviation from nominal." }
        (table(&["test", "centre", "µm", "u (k\u{a0}=\u{a0}1)", "radius, mm", "cone height, mm"], &rows))
    }
}
