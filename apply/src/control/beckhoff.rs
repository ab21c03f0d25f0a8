//! Beckhoff TF5280 (and ISG kernel) ISG CSV format: the errors by their names of ISO 230, in mm and rad over mm and
//! degrees.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;

use super::{Control, Kinematics};
use crate::compensation::curves::{Compensation, ErrorCurve, positions};
use crate::compensation::position::without_direction;
use crate::compensation::{FileText, TableFormat};

pub(super) const CONTROL: Control = Control {
    word: "beckhoff",
    name: "Beckhoff TwinCAT CNC TF5280",
    tables: Some(TableFormat {
        word: "beckhoff-tables",
        about: "ISG CSV format",
        import: &[
            "file_format[0] ISG_CSV; values are errors (actual less nominal), which the control subtracts; `negate` reverses the sign",
        ],
        holds_locations: true,
        files,
    }),
    kinematics: Kinematics::Locations,
    has_programs: false,
};

fn files(machine: &Machine, compensation: &Compensation, points: usize, left_out: &mut Vec<String>) -> Vec<FileText> {
    let letter = |name: &str| matches!(name, "X" | "Y" | "Z" | "A" | "B" | "C");
    let mut blocks = Vec::new();
    let named: Vec<_> = compensation
        .locations
        .iter()
        .filter(|(name, _)| {
            let is_known = letter(&name.axis);
            if !is_known {
                left_out.push(format!("{name}: the format has axes X, Y, Z, A, B, C only"));
            }
            is_known
        })
        .collect();
    if !named.is_empty() {
        let names: Vec<String> = named.iter().map(|(name, _)| format!("{name}")[1..].to_string()).collect();
        let values: Vec<String> = named.iter().map(|(_, value)| format!("{value:.9}")).collect();
        blocks.push(format!("// Position errors, mm and rad\n{}\n", table(&[names, values])));
    }
    for (index, axis) in machine.axes.iter().enumerate() {
        let curves: Vec<&ErrorCurve> = compensation.curves.iter().filter(|curve| curve.axis == index).collect();
        if curves.is_empty() {
            continue;
        }
        if !letter(&axis.name) {
            left_out.push(format!("error motions of {}: the format has axes X, Y, Z, A, B, C only", axis.name));
            continue;
        }
        for curve in curves.iter().filter(|curve| curve.is_directional()) {
            left_out.push(without_direction(curve));
        }
        let mut rows = vec![
            std::iter::once(axis.name.clone())
                .chain(curves.iter().map(|curve| curve.error.to_string()))
                .collect::<Vec<_>>(),
        ];
        for q in positions(curves.iter().copied(), points) {
            let position = format!("{:.5}", axis.kind.to_display(q));
            rows.push(
                std::iter::once(position)
                    .chain(curves.iter().map(|curve| format!("{:.9}", curve.mean_at(q))))
                    .collect(),
            );
        }
        blocks.push(format!(
            "// Component errors of {}, mm and rad\n{}\n{}\n",
            axis.name,
            table(&rows),
            uncertainties(axis.kind, &curves, points)
        ));
    }
    if blocks.is_empty() {
        return Vec::new();
    }
    vec![("volcomp.csv".to_string(), blocks.join("#\n"))]
}

/// Comments below a block: position, then u of the mean of each error over both directions, mm or rad.
fn uncertainties(kind: AxisKind, curves: &[&ErrorCurve], points: usize) -> String {
    let names: Vec<String> = curves.iter().map(|curve| curve.error.to_string()).collect();
    let mut lines = vec![format!("// standard uncertainty (k = 1), mm and rad: position, {}", names.join(", "))];
    lines.extend(positions(curves.iter().copied(), points).map(|q| {
        let values: Vec<String> = curves.iter().map(|curve| format!("{:.9}", curve.u_of_mean_at(q))).collect();
        format!("// {:.5} {}", kind.to_display(q), values.join(" "))
    }));
    lines.join("\n")
}

/// Cells aligned by spaces, as in the examples of the manual.
fn table(rows: &[Vec<String>]) -> String {
    let lines = rows.iter().map(|row| {
        let cells: Vec<String> = row.iter().map(|cell| format!("{cell:<14}")).collect();
        cells.join(" ").trim_end().to_string()
    });
    lines.collect::<Vec<_>>().join("\n")
}
