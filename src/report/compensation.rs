//! The standard uncertainty of each point of compensation tables.

use abbe::apply::compensation::PointUncertainty;

use super::table::{Cell, Table, cells};

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
