//! Heidenhain.
//!
//! Compensation tables: `.COM` (Technical Manual MANUALplus 620, 6.10.3): columns AXISPOS, BACKLASH, and one for each axis.
//!
//! Points of the error curve (Technical Manual TNC 406/306, 4-21), positive where the travel is too long (TNC 407,
//! 1.6.3). The frame of the file is not publicly documented.

use std::fmt::Write;

use abbe_model::chain::Machine;

use super::{Control, Kinematics};
use crate::compensation::curves::{Compensation, positions};
use crate::compensation::position::{as_position, without_direction};
use crate::compensation::{FileText, TableFormat};

pub(super) const CONTROL: Control = Control {
    word: "heidenhain",
    name: "Heidenhain",
    tables: Some(TableFormat {
        word: "heidenhain-tables",
        about: "columns of a .COM table",
        import: &[
            "columns of a .COM table; the frame of the file is not publicly documented: enter or import the \
             columns in the table editor",
            "values are points of the error curve, positive where the travel is too long; check the sign on one axis first",
        ],
        holds_locations: false,
        files,
    }),
    kinematics: Kinematics::NotDocumented(
        "the kinematics tables of TNC controls belong to the machine manufacturer; the public manuals list their columns without \
         the sign of a transformation",
    ),
    has_programs: true,
};

fn files(machine: &Machine, compensation: &Compensation, points: usize, left_out: &mut Vec<String>) -> Vec<FileText> {
    let mut files = Vec::new();
    for axis in 0..machine.axes.len() {
        let mut columns = Vec::new();
        for curve in compensation.curves.iter().filter(|curve| curve.axis == axis) {
            match as_position(machine, curve) {
                Some((column, factor)) => columns.push((curve, column, factor)),
                None => left_out
                    .push(format!("{}: a column of a .COM table compensates the position of an axis", curve.error)),
            }
        }
        if columns.is_empty() {
            continue;
        }
        let kind = machine.axes[axis].kind;
        let own = columns.iter().find(|(_, column, _)| *column == axis);
        let backlash = own.filter(|(curve, ..)| curve.is_directional());
        for (curve, column, _) in &columns {
            if *column != axis && curve.is_directional() {
                left_out.push(without_direction(curve));
            }
        }
        let mut text = format!("{:>12}", "AXISPOS");
        if backlash.is_some() {
            let _ = write!(text, " {:>12}", "BACKLASH");
        }
        for (_, column, _) in &columns {
            let _ = write!(text, " {:>12}", machine.axes[*column].name);
        }
        text.push('\n');
        for q in positions(columns.iter().map(|(curve, ..)| *curve), points) {
            let _ = write!(text, "{:>12.5}", kind.to_display(q));
            if let Some((curve, _, factor)) = backlash {
                let _ = write!(text, " {:>12.6}", kind.to_display(factor * curve.at(q, -1.0)));
            }
            for (curve, column, factor) in &columns {
                let value = if *column == axis { curve.at(q, 1.0) } else { curve.mean_at(q) };
                let _ = write!(text, " {:>12.6}", machine.axes[*column].kind.to_display(factor * value));
            }
            text.push('\n');
        }
        files.push((format!("{}.COM", machine.axes[axis].name), text));
    }
    files
}
