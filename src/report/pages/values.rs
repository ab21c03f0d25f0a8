//! Estimated values with their uncertainties: tables and plots with error bars.

use abbe::identify::results::ParameterResult;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::Document;
use crate::printers::html::{folded, table};
use crate::report::figure::bars::{Row, Value, Values};
use crate::report::figure::{Chart, Figure, Quantity};
use crate::report::number::{unit, units};
use crate::report::parameters::{self, Estimates};

/// Maximum number of rows of a plot.
const MAX_ROWS: usize = 30;

/// Values of the errors and effects as a table with plots. The set-up parameters are folded.
pub fn section(document: &mut Document, estimates: &Estimates<'_>, before: Option<&[ParameterResult]>) -> Markup {
    let Estimates { errors, setup, .. } = estimates;
    let shown = plots(document, errors, before, "parameters", "Values");
    let shown_setup = plots(document, setup, before, "setup", "Set-up parameters");
    html! {
        @if errors.is_empty() { p { "No error is identifiable." } } @else { (table(&parameters::table(errors, before))) }
        (shown)
        @if !setup.is_empty() {
            (folded(
                &format!("{} (balls, bar, poses)", counted(setup.len(), "set-up parameter")),
                &html! { (table(&estimates.setup_table(before))) (shown_setup) },
            ))
        }
    }
}

/// Finds the value of the same parameter in another model.
fn same<'p>(before: Option<&'p [ParameterResult]>, id: &str) -> Option<&'p ParameterResult> {
    before?.iter().find(|value| value.id == id)
}

/// Plots with error bars of ± 2 u, one for each unit.
fn plots(
    document: &mut Document,
    values: &[&ParameterResult],
    before: Option<&[ParameterResult]>,
    name: &str,
    title: &str,
) -> Markup {
    let bar = |parameter: &ParameterResult| Value { value: parameter.value, u: parameter.u };
    let mut plots: Vec<Figure> = Vec::new();
    for unit_name in units(values.iter().map(|value| value.unit.as_str())) {
        let rows: Vec<Row> = values
            .iter()
            .filter(|parameter| parameter.unit == unit_name)
            .map(|parameter| Row {
                name: parameter.id.clone(),
                before: same(before, &parameter.id).map(bar),
                after: Some(bar(parameter)),
            })
            .collect();
        let parts = rows.len().div_ceil(MAX_ROWS);
        for (number, rows) in rows.chunks(MAX_ROWS).enumerate() {
            let part = if parts > 1 { format!(" ({} of {parts})", number + 1) } else { String::new() };
            plots.push(Figure::new(
                format!("{name}-{}-{}", unit_name.replace('/', "-per-"), number + 1),
                format!("{title} in {}{part}", unit(unit_name)),
                "Whiskers: ± 2 u.",
                Chart::Values(Values {
                    quantity: Quantity::new("value", unit_name),
                    labels: ["before", "after"].map(str::to_string),
                    rows: rows.to_vec(),
                }),
            ));
        }
    }
    document.show(plots)
}
