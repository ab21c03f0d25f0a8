//! The standard uncertainty of each point of the compensation tables.

use abbe::identify::compensation::{Compensation, ErrorCurve};
use abbe::identify::unit::ARCSEC;
use abbe::model::axis::AxisKind;
use abbe::model::chain::Machine;

use super::{in_file_unit, positions};
use crate::cli::failure::Failure;
use crate::cli::folder::NewFile;
use crate::cli::output;

/// The file name of the table.
pub(super) const FILE: &str = "uncertainty.csv";

/// One row per point of each curve, and per direction if the curve depends on it: position, error and u, with their
/// units.
pub(super) fn table(machine: &Machine, compensation: &Compensation, points: usize) -> Result<NewFile, Failure> {
    let header = ["error", "position", "position_unit", "direction", "value", "u", "unit"];
    let mut rows = Vec::new();
    for curve in &compensation.curves {
        let kind = machine.axes[curve.axis].kind;
        let (unit, display_per_internal) =
            if curve.error.freedom.is_angle() { ("arcsec", ARCSEC) } else { ("um", 1e3) };
        let directions: &[(&str, f64)] =
            if curve.is_directional() { &[("+", 1.0), ("-", -1.0)] } else { &[("both", 1.0)] };
        for (word, direction) in directions {
            for q in positions([curve], points) {
                rows.push(vec![
                    curve.error.to_string(),
                    format!("{:.6}", in_file_unit(kind, q)),
                    kind.unit().to_string(),
                    word.to_string(),
                    format!("{:.6}", curve.at(q, *direction) * display_per_internal),
                    format!("{:.6}", curve.u_at(q, *direction) * display_per_internal),
                    unit.to_string(),
                ]);
            }
        }
    }
    let text = output::csv(&header.map(str::to_string), rows)?;
    let text = String::from_utf8(text).map_err(|fault| Failure::Other(fault.to_string()))?;
    Ok((FILE.to_string(), text))
}

/// The same as comments below a block of an ISG CSV file: position, then u of the mean of each error over both
/// directions, mm or rad.
pub(super) fn comments(kind: AxisKind, curves: &[&ErrorCurve], points: usize) -> String {
    let names: Vec<String> = curves.iter().map(|curve| curve.error.to_string()).collect();
    let mut lines = vec![format!("// standard uncertainty (k = 1), mm and rad: position, {}", names.join(", "))];
    lines.extend(positions(curves.iter().copied(), points).map(|q| {
        let values: Vec<String> = curves.iter().map(|curve| format!("{:.9}", curve.u_of_mean_at(q))).collect();
        format!("// {:.5} {}", in_file_unit(kind, q), values.join(" "))
    }));
    lines.join("\n")
}
