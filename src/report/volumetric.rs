//! A map of the volumetric error over the workspace.

use std::path::Path;

use abbe::apply::volumetric::{Size, Summary, VolumetricPoint};
use abbe::model::chain::Machine;
use abbe::model::words::{counted, with_exponent};

use super::block::Report;
use super::table::{Cell, Column, Table, cells, numbers};

/// The report of a map in this file.
pub fn report(machine: &Machine, file: &Path, summary: &Summary, functions: usize) -> Report {
    let mut report = Report::new(format!("Volumetric error of {}", machine.name));
    report.method = "The error vector of the tool point, by the exact chain.".to_string();
    let at: Vec<String> = summary.largest_at.iter().map(|at| format!("{} {:.1}", at.axis, at.position)).collect();
    report.opening(
        "",
        [
            format!(
                "{}: {}, {}",
                file.display(),
                counted(summary.points, "place"),
                counted(functions, "error function")
            ),
            format!("largest at {}", at.join(", ")),
        ],
    );
    report.section("Sizes");
    report.key(sizes(summary));
    report
}

/// The size of the error: in total, by coordinate, by axis, after compensation.
fn sizes(summary: &Summary) -> Table {
    let row = |name: String, size: &Size| cells![name, Cell::fixed(size.largest_um, 3), Cell::fixed(size.rms_um, 3)];
    let mut rows = vec![row("error vector".into(), &summary.error)];
    let coordinates = &summary.coordinates;
    for (name, size) in [("X", &coordinates.x), ("Y", &coordinates.y), ("Z", &coordinates.z)] {
        rows.push(row(format!("its {name}"), size));
    }
    rows.extend(summary.by_axis.iter().map(|share| row(format!("from axis {} alone", share.axis), &share.size)));
    rows.extend(summary.residual.iter().map(|residual| {
        let [largest, rms] = [residual.largest_um, residual.rms_um].map(|um| with_exponent(um, 1));
        cells!["after compensation", largest, rms]
    }));
    Table::new(["µm", ">largest", ">rms"], rows)
}

/// One row per place: positions, the nominal point, the error; with compensation the commands and what they leave.
pub fn places(machine: &Machine, places: &[VolumetricPoint]) -> Table {
    let named = |suffix: &'static str| machine.axes.iter().map(move |axis| numbers(axis.column(suffix)));
    let mut columns: Vec<Column> = named("").collect();
    columns.extend(["px_mm", "py_mm", "pz_mm", "ex_um", "ey_um", "ez_um", "e_um"].map(numbers));
    if places.iter().any(|place| place.compensated.is_some()) {
        columns.extend(named("_command"));
        columns.push(numbers("left_um"));
    }
    let norm = |e: [f64; 3]| e.iter().map(|x| x * x).sum::<f64>().sqrt() * 1e3;
    let rows = places.iter().map(|place| {
        let at = machine.axes.iter().zip(&place.positions);
        let mut cells: Vec<Cell> = at.map(|(axis, q)| Cell::fixed(axis.kind.to_display(*q), 6)).collect();
        cells.extend(place.nominal_mm.iter().map(|p| Cell::fixed(*p, 6)));
        cells.extend(place.error_mm.iter().map(|e| Cell::fixed(e * 1e3, 6)));
        cells.push(Cell::fixed(norm(place.error_mm), 6));
        if let Some(compensated) = &place.compensated {
            let at = machine.axes.iter().zip(&compensated.positions);
            cells.extend(at.map(|(axis, q)| Cell::fixed(axis.kind.to_display(*q), 9)));
            cells.push(Cell::fixed(norm(compensated.error_mm), 9));
        }
        cells
    });
    Table::new(columns, rows)
}
