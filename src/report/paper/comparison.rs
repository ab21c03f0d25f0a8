//! Several plans side by side: predicted uncertainties, ranks and observability indices.

use super::contents::Study;
use super::{Part, Subject};
use crate::report::block::Report;
use crate::report::number::{three_digits, unit};
use crate::report::table::{Align, Cell, Column, Table, cells};

/// The part, for two plans or more.
pub fn part(studies: &[Study]) -> Part {
    let text = "The predicted standard uncertainties of the plans, the ranks of their parameters and their observability \
                indices are compared. A dash marks an error that a plan does not identify. The indices refer to the errors \
                that each plan identifies, so that they compare only plans of the same errors.";
    let mut report = Report::new("Comparison of plans");
    report.key(text);
    report.key(uncertainties(studies).named("comparison-uncertainty"));
    report.key(indices(studies).named("comparison-indices"));
    Part { subject: Subject::Comparison, report }
}

fn column(study: &Study) -> Column {
    Column { heading: study.label.clone(), align: Align::Right }
}

fn uncertainties(studies: &[Study]) -> Table {
    let mut errors: Vec<(&str, &str)> = Vec::new();
    for error in studies.iter().flat_map(|study| &study.analysis.errors) {
        if !errors.contains(&(&error.id, &error.unit)) {
            errors.push((&error.id, &error.unit));
        }
    }
    let rows = errors.iter().map(|(id, name)| {
        let mut row = cells![*id, unit(name)];
        row.extend(studies.iter().map(|study| {
            let error = study.analysis.errors.iter().find(|error| error.id == *id);
            Cell::from(error.and_then(|error| error.u).map_or("–".to_string(), three_digits))
        }));
        row
    });
    let columns = ["error", "unit"].map(Column::from).into_iter().chain(studies.iter().map(column));
    Table::new(columns, rows).titled("Predicted standard uncertainty of each error by each plan")
}

fn indices(studies: &[Study]) -> Table {
    let figure = |name: &str, of: &dyn Fn(&Study) -> String| {
        let mut row = cells![name];
        row.extend(studies.iter().map(|study| Cell::from(of(study))));
        row
    };
    let rows = [
        figure("tests", &|study| study.analysis.tests.len().to_string()),
        figure("readings", &|study| study.analysis.readings.to_string()),
        figure("set-ups", &|study| study.analysis.setup_count.to_string()),
        figure("parameters", &|study| study.structure.parameter_count.to_string()),
        figure("rank", &|study| study.structure.rank.to_string()),
        figure("identifiable errors", &|study| study.analysis.indices.identifiable_count.to_string()),
        figure("condition number", &|study| three_digits(study.analysis.indices.condition_number)),
        figure("O1", &|study| three_digits(study.analysis.indices.o1)),
        figure("O2", &|study| three_digits(study.analysis.indices.o2)),
        figure("O3", &|study| three_digits(study.analysis.indices.o3)),
        figure("O4", &|study| three_digits(study.analysis.indices.o4)),
        figure("O5", &|study| three_digits(study.analysis.indices.o5)),
        figure("D-efficiency", &|study| three_digits(study.analysis.indices.d_efficiency)),
    ];
    let columns = [Column::from("figure")].into_iter().chain(studies.iter().map(column));
    Table::new(columns, rows).titled("Ranks and observability indices of the plans")
}
