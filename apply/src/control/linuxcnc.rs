//! LinuxCNC.
//!
//! Compensation tables: `COMP_FILE` of type 0 (INI Configuration, `[JOINT_n]`): nominal, actual forward, actual reverse.
//!
//! The control adds nominal less actual. It reads three numbers per line and ignores the rest (`usrmotLoadComp` in
//! `usrmotintf.cc`). The uncertainty follows them.

use std::fmt::Write;

use abbe_model::chain::Machine;

use super::{Control, Kinematics};
use crate::compensation::curves::{Compensation, positions};
use crate::compensation::position::as_position;
use crate::compensation::{FileText, TableFormat};
use crate::export::kinematics::{Entry, KinematicModel, Line};

pub(super) const CONTROL: Control = Control {
    word: "linuxcnc",
    name: "LinuxCNC",
    tables: Some(TableFormat {
        word: "linuxcnc-tables",
        about: "COMP_FILE of type 0",
        import: &[
            "in [JOINT_n] of the INI file: COMP_FILE = the file, COMP_FILE_TYPE = 0; the control then ignores BACKLASH",
        ],
        holds_locations: false,
        files,
    }),
    kinematics: Kinematics::Entries(KinematicModel {
        about: "xyzac-trt-kins and xyzbc-trt-kins (HAL pins)",
        source: "LinuxCNC, src/emc/kinematics/trtfuncs.c, xyzacKinematicsForward and xyzbcKinematicsForward; \
                 man 9 xyzac-trt-kins",
        entries,
    }),
    has_programs: true,
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

/// `tran = Rz(−c)·(Rx(−a)·(J − r − d) + d) + r`: the line of C is at `r`, that of A at `r + d`.
fn entries(first: char) -> Vec<Entry> {
    let across = vec![(1.0, Line::SecondAcross), (1.0, Line::FirstAcross)];
    let along = vec![(1.0, Line::SecondAlong)];
    let offset = vec![(-1.0, Line::SecondAcross)];
    let (x, y, offset) = if first == 'A' {
        (along, across, Entry { field: "y-offset", meaning: "line of A less line of C in Y", terms: offset })
    } else {
        (across, along, Entry { field: "x-offset", meaning: "line of B less line of C in X", terms: offset })
    };
    vec![
        Entry { field: "x-rot-point", meaning: "line of C in X", terms: x },
        Entry { field: "y-rot-point", meaning: "line of C in Y", terms: y },
        Entry { field: "z-rot-point", meaning: "line of the tilting axis in Z", terms: vec![(1.0, Line::FirstHeight)] },
        offset,
    ]
}
