//! Proposed tests, and the smallest ranges of sweeps.

use abbe::identify::plan::improve::Improvement;
use abbe::identify::plan::range::Shrinkage;
use abbe::identify::results::Interval;

use super::number::{quantity, three_digits, unit};
use super::table::{Cell, Column, Table, cells, numbers};

/// The figure of merit with the symbols of its units.
pub fn criterion(found: &Improvement) -> String {
    unit(&found.criterion)
}

/// The proposed tests, one after another.
pub fn proposed(found: &Improvement) -> Table {
    let point = |mm: [f64; 3]| mm.map(|x| format!("{x:.1}")).join(", ");
    let rows = found.steps.iter().enumerate().map(|(number, step)| {
        cells![
            (number + 1).to_string(),
            three_digits(step.after),
            format!("{:.1}{}", step.duration_min, if step.new_setup { " with set-up" } else { "" }),
            point(step.workpiece_ball_mm),
            point(step.spindle_ball_mm),
            step.bar_mm.to_string(),
            step.makes_identifiable.join(", "),
            &step.test
        ]
    });
    let columns = [
        ">number",
        ">figure of merit",
        ">duration, min",
        ">workpiece ball, mm",
        ">spindle ball, mm",
        ">bar, mm",
        "makes identifiable",
        "test",
    ];
    Table::new(columns, rows)
}

/// The predicted standard uncertainty of each error with the plan and with each proposed test.
pub fn uncertainties(found: &Improvement) -> Table {
    let rows = found.uncertainties_before.iter().enumerate().map(|(k, before)| {
        let with = found.steps.iter().map(|step| Cell::from(three_digits(step.uncertainties[k].u)));
        cells![&before.id, three_digits(before.u)].into_iter().chain(with).collect()
    });
    let with = (1..=found.steps.len()).map(|number| numbers(format!("with test {number}")));
    let columns = ["error", ">plan"].map(Column::from).into_iter().chain(with);
    Table::new(columns, rows).titled("Predicted standard uncertainty u, µm or ″ (∞: not identifiable)")
}

/// The best single tests.
pub fn alternatives(found: &Improvement) -> Table {
    let rows = found
        .alternatives
        .iter()
        .map(|other| cells![three_digits(other.after), Cell::fixed(other.duration_min, 1), &other.test]);
    let columns = [">figure of merit", ">duration, min", "test"];
    Table::new(columns, rows).titled("Best single tests")
}

/// The smallest range of each sweep.
pub fn ranges(ranges: &[Shrinkage]) -> Table {
    let rows = ranges.iter().map(|range| {
        let span = |Interval { low, high }: Interval| quantity(&format!("{low:.0} to {high:.0}"), &range.unit);
        cells![
            &range.test,
            &range.axis,
            span(range.range),
            range.minimum_range.map_or("can be omitted".into(), span),
            range.first_to_double.clone().unwrap_or("–".into()),
        ]
    });
    let columns = ["test", "axis", ">planned", ">smallest", "doubles first"];
    Table::new(columns, rows).titled("Smallest range of each sweep about its middle before an uncertainty doubles")
}
