//! The errors by a geometric method and by the full fit, as a table.

use abbe::identify::geometric::{Comparison, ComparisonRow};

use crate::cli::table;

/// Header of [`error_rows`].
pub fn error_header(result: &Comparison) -> [&str; 8] {
    let method = result.method.as_str();
    ["error", method, "u", "bias", "full fit", "u", "bias", "unit"]
}

/// The errors by the method and by the full fit, one row per error.
pub fn error_rows(result: &Comparison) -> Vec<Vec<String>> {
    let pair = |value: Option<f64>, u: Option<f64>| match (value, u) {
        (Some(value), Some(u)) => table::value_and_u(value, u),
        _ => ("–".to_string(), "–".to_string()),
    };
    // A bias that rounds to zero has no sign.
    let rounded = |bias: f64| (bias * 1e4).round() / 1e4 + 0.0;
    let bias = |bias: Option<f64>| bias.map_or("–".to_string(), |bias| format!("{:.4}", rounded(bias)));
    let row = |row: &ComparisonRow| {
        let (value, u) = pair(row.value, row.u);
        let (full, full_u) = pair(row.full_value, row.full_u);
        let [of_method, of_full] = [bias(row.bias), bias(row.full_bias)];
        vec![row.id.clone(), value, u, of_method, full, full_u, of_full, table::unit(&row.unit)]
    };
    result.errors.iter().map(row).collect()
}
