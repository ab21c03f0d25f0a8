//! Tables and figures of a result as the command prints them, and its report.

use abbe::files::SourceMap;
use abbe::model::session::Session;
use abbe::printers::{csv, html, page, terminal};
use abbe::report::block::Report;
use abbe::report::figure;
use abbe::report::figure::svg;
use abbe::report::provenance::Provenance;
use abbe::report::table::{self, Cell};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

use crate::failed::Failed;

/// A table.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Table(pub table::Table);

#[pymethods]
impl Table {
    #[getter]
    fn title(&self) -> &str {
        &self.0.title
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes.clone()
    }

    /// The headings with the cells below each: numbers as numbers, with all digits.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Vec<Bound<'py, PyAny>>)>> {
        let cell = |cell: Option<&Cell>| match cell {
            Some(Cell::Text(text)) => text.into_bound_py_any(py),
            Some(Cell::Number(value, _)) => value.into_bound_py_any(py),
            None => "".into_bound_py_any(py),
        };
        let column = |(place, column): (usize, &table::Column)| {
            let cells = self.0.rows.iter().map(|row| cell(row.get(place)));
            Ok((column.heading.clone(), cells.collect::<PyResult<_>>()?))
        };
        self.0.columns.iter().enumerate().map(column).collect()
    }

    fn html(&self) -> String {
        html::table(&self.0).into_string()
    }

    fn text(&self) -> String {
        let title = if self.0.title.is_empty() { String::new() } else { format!("{}:\n", self.0.title) };
        title + &terminal::text(&self.0)
    }

    fn csv(&self) -> Result<Vec<u8>, Failed> {
        Ok(csv::text(&self.0)?)
    }
}

/// A figure of a report.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Figure(figure::Figure);

#[pymethods]
impl Figure {
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn title(&self) -> &str {
        &self.0.title
    }

    #[getter]
    fn caption(&self) -> &str {
        &self.0.caption
    }

    /// The kind of chart.
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.chart.kind
    }

    fn table(&self) -> Table {
        Table(self.0.chart.table.clone())
    }

    fn svg(&self) -> String {
        svg::file(&self.0)
    }
}

/// The figures of a report.
pub fn figures(report: &Report) -> Vec<Figure> {
    report.drawn().cloned().map(Figure).collect()
}

/// A report as `print` and a notebook show it: text and HTML.
pub fn shown(report: &Report) -> (String, String) {
    (terminal::report(report, Some("`report` writes them")), html::notebook(report))
}

/// The page of a report; `called` is what was called in Python.
///
/// # Errors
/// If a table of the report cannot be written.
pub fn page<'s>(
    report: &Report,
    sessions: impl Iterator<Item = (&'s Session, &'s SourceMap)>,
    called: &str,
    seed: u64,
) -> Result<String, Failed> {
    let mut provenance = Provenance { command: called.to_string(), ..Provenance::of_command(Some(seed)) };
    sessions.for_each(|read| provenance.add(read));
    Ok(page::html(report, &provenance)?)
}
