//! LinuxCNC `COMP_FILE` of type 0 (INI Configuration, `[JOINT_n]`): nominal, actual forward, actual reverse.
//!
//! The control adds nominal less actual. It reads three numbers per line and ignores the rest (`usrmotLoadComp` in
//! `usrmotintf.cc`). The uncertainty follows them.

use std::fmt::Write;

use abbe_model::chain::Machine;

use super::control::{Control, FileText};
use super::curves::{Compensation, positions};
use super::position::as_position;

/// The format.
pub(super) const CONTROL: Control = Control {
    word: "linuxcnc",
    about: "LinuxCNC, COMP_FILE of type 0",
    import: &[
        "in [JOINT_n] of the INI file: COMP_FILE = the file, COMP_FILE_TYPE = 0; the control then ignores BACKLASH",
    ],
    holds_locations: false,
    files,
};

fn files(machine: &Machine, compensation: &Compensation, points: usize, left_out: &mut Vec<String>) -> Vec<FileText> {
    let mut files = Vec::new();
    for curve in &compensation.curves {
        let Some((axis, factor)) = as_position(machine, curve).filter(|(axis, _)| *axis == curve.axis) else {
            left_out.push(format!("{}: COMP_FILE compensates the positioning of a joint only", curve.error));
            continue;
        };
        let kind = machine.axes[axis].kind;
        let mut text = String::new();
        for q in positions([curve], points) {
            let actual = |direction: f64| kind.to_display(q + factor * curve.at(q, direction));
            let u = curve.u_at(q, 1.0).max(curve.u_at(q, -1.0));
            let _ = writeln!(
                text,
                "{:.6} {:.6} {:.6} # u {:.6}",
                kind.to_display(q),
                actual(1.0),
                actual(-1.0),
                kind.to_display(u)
            );
        }
        files.push((format!("{}.comp", machine.axes[axis].name), text));
    }
    files
}
