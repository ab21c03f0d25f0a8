//! Exported descriptions as tables.

use std::path::Path;

use abbe::apply::compare::workspace::AxisRange;
use abbe::apply::export::control::{EntryChoice, KinematicTable};
use abbe::apply::export::dh::{DhTable, FixedPose};

use super::block::Report;
use super::table::{Cell, Column, Table, cells, numbers};

/// The report of an exported machine, in this file.
pub fn report(machine: &str, file: &Path, table: Option<Table>, left_out: &[String]) -> Report {
    let mut report = Report::new(format!("Export of {machine}"));
    report.method = "A fixed geometry holds location errors only.".to_string();
    report.opening("", [format!("{}: written", file.display())]);
    table.into_iter().for_each(|table| report.key(table));
    left_out.iter().for_each(|missing| report.key(format!("left out: {missing}")));
    report
}

/// The parameters of each joint, calibrated and nominal, between the poses of base and tool.
pub fn dh(calibrated: &DhTable, nominal: &DhTable) -> Table {
    let names = ["a_mm", "alpha_deg", "beta_deg", "theta_deg", "d_mm"];
    let columns = std::iter::once(Column::from("axis"))
        .chain(names.map(numbers))
        .chain(names.iter().map(|name| numbers(format!("nominal_{name}"))));
    let joints = calibrated.joints.iter().zip(&nominal.joints).map(|(own, design)| {
        let five = |row: &abbe::apply::export::dh::DhRow| {
            [row.a_mm, row.alpha_deg, row.beta_deg, row.theta_deg, row.d_mm].map(|value| Cell::fixed(value, 9))
        };
        std::iter::once(Cell::from(own.axis.clone())).chain(five(own)).chain(five(design)).collect()
    });
    let mut table = Table::new(columns, joints);
    table.notes.push("T = B · Π Tx(a)·Rx(alpha)·Ry(beta)·Rz(theta + q)·Tz(d) · F".into());
    let pose = |name: &str, pose: &FixedPose| {
        let list = |values: [f64; 3]| values.map(|value| format!("{value:.9}")).join(" ");
        format!("{name}: xyz {} mm, rpy {} deg (Rz(yaw)·Ry(pitch)·Rx(roll))", list(pose.xyz_mm), list(pose.rpy_deg))
    };
    table.notes.push(pose("B", &calibrated.base));
    table.notes.push(pose("F", &calibrated.tool));
    table.notes.push(pose("nominal B", &nominal.base));
    table.notes.push(pose("nominal F", &nominal.tool));
    table
}

/// What the file of the parameters states beside the joints, as comments: the product, and the poses at its ends.
pub fn dh_header(table: &Table) -> String {
    table.notes.iter().map(|note| format!("# {note}\n")).collect()
}

/// What the file of a control's parameters states about itself, as comments.
pub fn kinematics_header(table: &KinematicTable) -> String {
    let mut text = format!(
        "# {}\n# Source of the model: {}\n# Add each change to the present entry. u is one standard uncertainty.\n",
        table.control, table.source
    );
    for note in notes(table) {
        text += &format!("# {note}\n");
    }
    for missing in &table.left_out {
        text += &format!("# left out: {missing}\n");
    }
    text
}

/// A position to a thousandth, without zeros at its end.
fn short(value: f64) -> f64 {
    (value * 1e3).round() / 1e3 + 0.0
}

/// Which entries are written, over what travel, and what remains.
fn notes(table: &KinematicTable) -> Vec<String> {
    let entries = match table.entries {
        EntryChoice::Best => "Entries: those of the least rms of the volumetric error over the travel.",
        EntryChoice::Plain => "Entries: plain, the displacements of the axis lines.",
    };
    let range = |axis: &AxisRange| match axis.from < axis.to {
        true => format!("{} {} to {} {}", axis.axis, short(axis.from), short(axis.to), axis.unit),
        false => format!("{} at {} {}", axis.axis, short(axis.from), axis.unit),
    };
    let source = if table.is_measured_travel { "the measured range" } else { "as requested" };
    let travel: Vec<String> = table.travel.iter().map(range).collect();
    let [x, y, z] = table.tool_mm.map(short);
    let mut notes = vec![
        entries.to_string(),
        format!("Travel, {source}: {}. Tool point {x}, {y}, {z} mm.", travel.join(", ")),
        "Volumetric error over the travel, the zero of the workpiece measured on the table:".to_string(),
    ];
    let remaining = &table.remaining;
    let sizes = [
        ("without entries", remaining.without),
        ("plain entries", remaining.plain),
        ("these entries", remaining.written),
    ];
    notes.extend(
        sizes
            .iter()
            .map(|(what, size)| format!("  {what}: rms {:.2} um, largest {:.2} um", size.rms_um, size.largest_um)),
    );
    if !table.not_represented.is_empty() {
        let each = table.not_represented.iter().map(|one| format!("{} {:.2} um", one.id, one.rms_um));
        notes.push(format!(
            "Not represented by the control's model, rms of each alone: {}",
            each.collect::<Vec<String>>().join(", ")
        ));
    }
    notes
}

/// The changes of a control's parameters.
pub fn kinematics(table: &KinematicTable) -> Table {
    let rows = table.parameters.iter().map(|parameter| {
        cells![
            parameter.field.clone(),
            parameter.meaning.clone(),
            Cell::fixed(parameter.change_mm, 6),
            Cell::fixed(parameter.u_mm, 6),
            Cell::fixed(parameter.plain_change_mm, 6)
        ]
    });
    let columns = ["change_mm", "u_mm", "plain_change_mm"].map(numbers);
    let columns = [Column::from("field"), Column::from("meaning")].into_iter().chain(columns);
    let mut printed = Table::new(columns, rows);
    printed.notes = notes(table);
    printed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without the poses at the ends of the product the joints give no position of the tool.
    #[test]
    fn the_file_of_a_robot_holds_the_poses_of_base_and_tool() {
        let base = FixedPose { xyz_mm: [0.0, 0.0, 127.3], ..FixedPose::default() };
        let header = dh_header(&dh(&DhTable { base, ..DhTable::default() }, &DhTable::default()));
        assert!(header.contains("# B: xyz 0.000000000 0.000000000 127.300000000 mm"), "{header}");
        assert!(header.contains("# nominal F: xyz"), "{header}");
        assert!(header.lines().all(|line| line.starts_with("# ")), "{header}");
    }
}
