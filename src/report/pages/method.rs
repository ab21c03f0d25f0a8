//! Report of `abbe fit --method circle|cone|two-plane`.

use abbe::identify::geometric::Comparison;
use abbe::identify::problem::Problem;
use maud::html;

use super::document::Document;
use super::readings;
use super::summary::noise_sentence;
use crate::printers::html::table;
use crate::report::figure::bars::{Row, Value, Values};
use crate::report::figure::{Chart, Figure, Quantity};
use crate::report::method::{centres, errors};
use crate::report::number::{micrometres, unit, units};

/// Method of the comparison.
fn method(result: &Comparison) -> String {
    format!(
        "The {} method of the literature and the full least-squares fit, applied to the same readings. {}. Bias: both \
         methods are applied to noise-free readings that are simulated with the errors of the full fit; these errors \
         are subtracted.",
        result.method,
        noise_sentence(result.noise_um, result.noise_source)
    )
}

/// The report.
pub fn document(problem: &Problem, result: &Comparison) -> Document {
    let mut document = Document {
        title: format!("{}: {} method and full fit", problem.session.machine.name, result.method),
        verdict: format!(
            "The {} method reduces the rms residual of its tests from {2} to {1}. The rms residual of the full fit in all tests is {3}.",
            result.method,
            micrometres(result.method_rms_um),
            micrometres(result.nominal_rms_um),
            micrometres(result.rms_um)
        ),
        warnings: result.warnings.clone(),
        method: method(result),
        ..Document::default()
    };
    let shown = document.show(plots(result));
    document.section(
        "Errors by both methods",
        html! {
            (table(&errors(result)))
            (shown)
        },
    );
    document.section("Axis positions", table(&centres(result)));
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    document
}

fn plots(result: &Comparison) -> Vec<Figure> {
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
            Figure::new(
                format!("errors-{name}"),
                format!("Errors by both methods, {}", unit(name)),
                "Whiskers: ± 2 u. An error that a method does not identify has no mark.",
                Chart::Values(Values {
                    quantity: Quantity::new("value", name),
                    labels: [result.method.clone(), "full fit".to_string()],
                    rows,
                }),
            )
        })
        .collect()
}
