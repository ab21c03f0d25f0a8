//! Exported descriptions as tables, and the standard uncertainty of each point of compensation tables.

use std::path::PathBuf;

use abbe::apply::compare::workspace::AxisRange;
use abbe::apply::compensation::PointUncertainty;
use abbe::apply::export::dh::{DhTables, PARAMETERS};
use abbe::apply::export::kinematics::{EntryChoice, KinematicTable};
use abbe::apply::export::neutral::AxisPlace;
use abbe::exports::ExportResult;
use abbe::files::robot::dh::Convention;
use abbe::model::frames::FixedPose;

use super::block::Report;
use super::table::{Cell, Column, Table, cells, numbers};

/// The report of an exported machine, in these files.
pub fn report(machine: &str, files: &[PathBuf], table: Option<Table>, result: &ExportResult) -> Report {
    let mut report = Report::new(format!("Export of {machine}"));
    report.method = match result.import.is_empty() {
        true => "A fixed geometry holds location errors only.".to_string(),
        false => "A table over the position of an axis holds errors that depend on it; `u` is k = 1.".to_string(),
    };
    report.opening("", files.iter().map(|file| format!("{}: written", file.display())));
    table.into_iter().for_each(|table| report.key(table));
    result.import.iter().for_each(|line| report.key(line.clone()));
    result.left_out.iter().for_each(|missing| report.key(format!("left out: {missing}")));
    if let Some(remaining) = &result.remaining {
        report.key(remaining.words());
    }
    report
}

/// Where each axis is, one row for each coordinate.
pub fn places(axes: &[AxisPlace]) -> Table {
    let columns = ["axis", "kind", "entry", "unit"].map(Column::from).into_iter();
    let columns = columns.chain(["nominal", "identified", "change", "u"].map(numbers));
    let mut rows: Vec<Vec<Cell>> = Vec::new();
    for axis in axes {
        let points = axis.point_mm.iter().map(|place| ("point", "mm", 6, place));
        let directions = axis.direction.iter().map(|place| ("direction", "1", 9, place));
        for (number, (entry, unit, places, place)) in points.chain(directions).enumerate() {
            let coordinate = ["x", "y", "z"][number % 3];
            let value = |value: Option<f64>| Cell::or_dash(value.map(|value| Cell::fixed(value, places)));
            let mut row = cells![&axis.axis, axis.kind.to_string(), format!("{entry} {coordinate}"), unit];
            row.extend([value(Some(place.nominal)), value(place.identified), value(place.change), value(place.u)]);
            rows.push(row);
        }
    }
    Table::new(columns, rows)
}

/// What the file of the places states about itself, as comments.
pub fn places_header() -> String {
    "# Where each axis is, in the frame R of the bed with all axes at zero. A rotary axis has a point and a direction, a linear\n\
     # axis a direction. The point is the one nearest to the nominal point. u is one standard uncertainty of the change.\n\
     # A dash: the readings do not determine the coordinate.\n"
        .into()
}

/// The parameters of each joint, calibrated, with u, and nominal, between the poses of base and tool.
pub fn dh(found: &DhTables) -> Table {
    let columns = std::iter::once(Column::from("axis"))
        .chain(PARAMETERS.map(numbers))
        .chain(PARAMETERS.map(|name| numbers(format!("u_{name}"))))
        .chain(PARAMETERS.map(|name| numbers(format!("nominal_{name}"))));
    let joints = found.calibrated.joints.iter().zip(&found.u).zip(&found.nominal.joints).map(|((own, u), design)| {
        let five = |values: [f64; 5]| values.map(|value| Cell::fixed(value, 9));
        let u = [u.a_mm, u.alpha_deg, u.beta_deg, u.theta_deg, u.d_mm];
        let u = u.map(|u| Cell::or_dash(u.map(|u| Cell::fixed(u, 9))));
        std::iter::once(Cell::from(&own.axis)).chain(five(own.five())).chain(u).chain(five(design.five())).collect()
    });
    let mut table = Table::new(columns, joints);
    table.notes.push(
        match found.convention {
            Convention::Modified => "T = B · Π Tx(a)·Rx(alpha)·Ry(beta)·Rz(theta + q)·Tz(d) · F",
            Convention::Standard => "T = B · Π Rz(theta + q)·Tz(d)·Tx(a)·Rx(alpha)·Ry(beta) · F",
        }
        .into(),
    );
    let pose = |name: &str, pose: &FixedPose| {
        let list = |values: [f64; 3]| values.map(|value| format!("{value:.9}")).join(" ");
        format!("{name}: xyz {} mm, rpy {} deg (Rz(yaw)·Ry(pitch)·Rx(roll))", list(pose.xyz_mm), list(pose.rpy_deg))
    };
    table.notes.push(pose("B", &found.calibrated.base));
    table.notes.push(pose("F", &found.calibrated.tool));
    table.notes.push(pose("nominal B", &found.nominal.base));
    table.notes.push(pose("nominal F", &found.nominal.tool));
    table.notes.push("u is one standard uncertainty; a dash: the readings do not determine the parameter".into());
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

/// One row per point: position, error and u, with their units.
pub fn uncertainties(points: &[PointUncertainty]) -> Table {
    let rows = points.iter().map(|point| {
        let direction = point.direction.map_or("both", |direction| if direction > 0.0 { "+" } else { "-" });
        let [position, value, u] = [point.position, point.value, point.u].map(|number| Cell::fixed(number, 6));
        cells![point.error.to_string(), position, point.axis.unit().name(), direction, value, u, point.unit]
    });
    let columns = ["error", ">position", "position_unit", "direction", ">value", ">u", "unit"];
    Table::new(columns, rows)
}

#[cfg(test)]
mod tests {
    use abbe::apply::export::dh::DhTable;

    use super::*;

    /// Without the poses at the ends of the product the joints give no position of the tool.
    #[test]
    fn the_file_of_a_robot_holds_the_poses_of_base_and_tool() {
        let base = FixedPose { xyz_mm: [0.0, 0.0, 127.3], ..FixedPose::default() };
        let calibrated = DhTable { base, ..DhTable::default() };
        let (nominal, u, covariance) = (DhTable::default(), Vec::new(), Vec::new());
        let found = DhTables { convention: Convention::Modified, calibrated, nominal, u, covariance };
        let header = dh_header(&dh(&found));
        assert!(header.contains("# B: xyz 0.000000000 0.000000000 127.300000000 mm"), "{header}");
        assert!(header.contains("# nominal F: xyz"), "{header}");
        assert!(header.lines().all(|line| line.starts_with("# ")), "{header}");
    }
}
