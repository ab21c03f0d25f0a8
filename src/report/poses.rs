//! Selected poses.

use abbe::model::session::Session;
use abbe::model::words::counted;
use abbe::plan::poses::PoseSelection;

use super::block::Report;
use super::number::{three_digits, unit};
use super::quality::{efficiency, noise};
use super::table::{Cell, Table, cells, numbers, words};

/// The report of selected poses.
pub fn report(session: &Session, found: &PoseSelection) -> Report {
    let mut report = Report::new(format!("Poses for {}", session.machine.name));
    report.warnings.clone_from(&found.warnings);
    report.method =
        "Poses are exchanged with candidates within the travel of the axes until none lowers the criterion.".into();
    let bound = found.bound.map(|bound| efficiency(found.value, bound, "as many candidates"));
    report.opening("", [format!("{}.", sentence(found))].into_iter().chain(bound));
    report.section("Predicted uncertainty");
    report.key(uncertainties(found));
    report.section("Poses");
    report.key(poses(found));
    report
}

/// The criterion of the poses and of random sets.
fn sentence(found: &PoseSelection) -> String {
    format!(
        "{} of {}: {} {}; median of 100 random sets {}; {}",
        counted(found.poses.len(), "pose"),
        counted(found.candidates, "candidate"),
        unit(&found.criterion),
        three_digits(found.value),
        three_digits(found.random_median),
        noise(found.noise)
    )
}

/// The errors with their predicted uncertainties.
fn uncertainties(found: &PoseSelection) -> Table {
    let rows = found.uncertainties.iter().map(|error| cells![&error.id, three_digits(error.u), unit(&error.unit)]);
    let mut table = Table::new(["error", ">u", "unit"], rows).titled("Predicted standard uncertainty u");
    if !found.held.is_empty() {
        table.notes.push(format!(
            "held at nominal, because as many candidate poses do not separate them from the others: {}",
            found.held.join(", ")
        ));
    }
    table
}

/// The positions of all axes, and the sockets.
fn poses(found: &PoseSelection) -> Table {
    table(found, |q| Cell::fixed(q, 3)).titled("Poses")
}

/// The positions of all axes with all digits, for a file.
pub fn exact_poses(found: &PoseSelection) -> Table {
    let mut table = table(found, Cell::exact);
    table.columns.remove(0);
    table.rows.iter_mut().for_each(|row| drop(row.remove(0)));
    table
}

fn table(found: &PoseSelection, cell: fn(f64) -> Cell) -> Table {
    let columns = std::iter::once(numbers("pose")).chain(found.columns.iter().map(|name| numbers(name.clone())));
    let rows = found.poses.iter().enumerate().map(|(number, pose)| {
        let mut row = cells![(number + 1).to_string()];
        row.extend(pose.iter().map(|q| cell(*q)));
        row
    });
    let mut table = Table::new(columns, rows);
    if !found.sockets.is_empty() {
        table.push(words("socket"), found.sockets.iter().map(Cell::from));
    }
    table
}
