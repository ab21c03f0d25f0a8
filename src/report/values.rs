//! Estimated values with their uncertainties: tables and plots with error bars.

use abbe::identify::parameters::Role;
use abbe::identify::problem::Problem;
use abbe::identify::results::ParameterResult;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::{Document, folded, table};
use super::format::{unit, units, value_and_u};
use super::plot::Plot;
use super::plot::bars::{self, Row, Value};

/// Maximum number of rows of a plot.
const MAX_ROWS: usize = 30;

/// Values of the errors and effects as a table with plots. The set-up parameters are folded.
pub fn section(
    document: &mut Document,
    problem: &Problem,
    after: &[ParameterResult],
    before: Option<&[ParameterResult]>,
) -> Markup {
    let (setup, values): (Vec<&ParameterResult>, Vec<&ParameterResult>) =
        after.iter().partition(|value| is_setup(problem, &value.id));
    let shown = plots(document, &values, before, "parameters", "Values");
    let shown_setup = plots(document, &setup, before, "setup", "Set-up parameters");
    html! {
        @if values.is_empty() { p { "No error is identifiable." } } @else { (value_table(&values, before)) }
        (shown)
        @if !setup.is_empty() {
            (folded(
                &format!("{} (balls, bar, poses)", counted(setup.len(), "set-up parameter")),
                &html! { (value_table(&setup, before)) (shown_setup) },
            ))
        }
    }
}

/// Whether a parameter belongs to the set-up.
pub fn is_setup(problem: &Problem, id: &str) -> bool {
    let list = &problem.parameters.list;
    list.iter().any(|parameter| parameter.role == Role::Setup && parameter.id == id)
}

/// Finds the value of the same parameter in another model.
fn same<'p>(before: Option<&'p [ParameterResult]>, id: &str) -> Option<&'p ParameterResult> {
    before?.iter().find(|value| value.id == id)
}

fn value_table(values: &[&ParameterResult], before: Option<&[ParameterResult]>) -> Markup {
    let rows: Vec<Vec<String>> = values
        .iter()
        .map(|parameter| {
            let (value, u) = value_and_u(parameter.value, parameter.u);
            let (_, expanded_u) = value_and_u(parameter.value, parameter.expanded_u);
            let significant = if parameter.significant { "yes" } else { "no" };
            let mut row = vec![
                parameter.id.clone(),
                value,
                u,
                expanded_u,
                unit(&parameter.unit),
                significant.to_string(),
                parameter.meaning.clone(),
            ];
            if before.is_some() {
                row.push(same(before, &parameter.id).map_or(String::new(), |earlier| {
                    let (value, u) = value_and_u(earlier.value, earlier.u);
                    format!("{value} ± {u}")
                }));
            }
            row
        })
        .collect();
    let mut header =
        vec!["parameter", "value", "u (k\u{a0}=\u{a0}1)", "U\u{a0}=\u{a0}2u", "unit", "significant", "meaning"];
    if before.is_some() {
        header.push("before, ± u");
    }
    table(&header, &rows)
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
    let mut plots: Vec<Plot> = Vec::new();
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
            plots.push(bars::values(
                format!("{name}-{}-{}", unit_name.replace('/', "-per-"), number + 1),
                format!("{title} in {}{part}", unit(unit_name)),
                "Whiskers: ± 2 u.".to_string(),
                &format!("value, {}", unit(unit_name)),
                ["before", "after"],
                rows,
            ));
        }
    }
    document.show(plots)
}
