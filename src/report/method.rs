//! The errors by a geometric method beside those of the full fit.

use abbe::identify::geometric::{Comparison, ComparisonRow};

use super::number::unit;
use super::table::{Cell, Column, Table, cells, numbers};

/// The errors by the method and by the full fit, one row per error.
pub fn errors(result: &Comparison) -> Table {
    let pair = |value: Option<f64>, u: Option<f64>| match (value, u) {
        (Some(value), Some(u)) => Cell::estimate(value, u),
        _ => ["–", "–"].map(Cell::from),
    };
    let bias = |bias: Option<f64>| Cell::or_dash(bias.map(|bias| Cell::fixed(bias, 4)));
    let rows = result.errors.iter().map(|row: &ComparisonRow| {
        let [value, u] = pair(row.value, row.u);
        let [full, full_u] = pair(row.full_value, row.full_u);
        cells![&row.id, value, u, bias(row.bias), full, full_u, bias(row.full_bias), unit(&row.unit)]
    });
    let mut columns = ["error", ">u", ">bias", ">full fit", ">u", ">bias", "unit"].map(Column::from).to_vec();
    columns.insert(1, numbers(&result.method));
    Table::new(columns, rows).titled(format!(
        "{} beside the full fit, with standard uncertainty u and bias (on noise-free readings with the errors of the full fit)",
        result.method
    ))
}

/// The position of each axis relative to the ball at rest, and the errors that move it.
pub fn centres(result: &Comparison) -> Table {
    let rows = result.centres.iter().flat_map(|centre| {
        centre.offsets.iter().map(move |found| {
            let [offset, u] = Cell::estimate(found.offset_um, found.u_um);
            let shares: Vec<String> = found
                .sensitivities
                .iter()
                .filter(|share| share.value.abs() > 1e-6)
                .map(|share| format!("{:+.3} {}", share.value, share.id))
                .collect();
            let [radius, height] = [centre.radius_mm, centre.height_mm].map(|mm| Cell::fixed(mm, 4));
            let centre_of = format!("{} of {}", found.direction, centre.axis);
            cells![&centre.test, centre_of, offset, u, radius, height, shares.join(" ")]
        })
    });
    let columns =
        ["test", "centre", ">offset, µm", ">u", ">radius, mm", ">cone height, mm", "first-order shares, in µm and ″"];
    Table::new(columns, rows).titled("Offset of each axis at the fixed ball from its nominal position")
}
