//! Exported descriptions as tables.

use abbe::identify::export::control::KinematicTable;
use abbe::identify::export::dh::{DhTable, FixedPose};

use super::table::{Cell, Column, Table, cells, numbers};

/// The parameters of each joint, calibrated and nominal, between the poses of base and tool.
pub fn dh(calibrated: &DhTable, nominal: &DhTable) -> Table {
    let names = ["a_mm", "alpha_deg", "beta_deg", "theta_deg", "d_mm"];
    let columns = std::iter::once(Column::from("axis"))
        .chain(names.map(numbers))
        .chain(names.iter().map(|name| numbers(format!("nominal_{name}"))));
    let joints = calibrated.joints.iter().zip(&nominal.joints).map(|(own, design)| {
        let five = |row: &abbe::identify::export::dh::DhRow| {
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
    for missing in &table.left_out {
        text += &format!("# left out: {missing}\n");
    }
    text
}

/// The changes of a control's parameters.
pub fn kinematics(table: &KinematicTable) -> Table {
    let rows = table.parameters.iter().map(|parameter| {
        cells![
            parameter.field.clone(),
            parameter.meaning.clone(),
            Cell::fixed(parameter.change_mm, 6),
            Cell::fixed(parameter.u_mm, 6)
        ]
    });
    Table::new([Column::from("field"), Column::from("meaning"), numbers("change_mm"), numbers("u_mm")], rows)
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
