//! Base parameters: a minimal set of numbers that predicts the same readings.

use abbe::identify::fit::base::BaseResult;
use abbe::model::words::{counted, with_exponent};

use super::number::unit;
use super::table::{Cell, Table, cells};

/// The base parameters with u.
pub fn base_parameters(base: &BaseResult) -> Table {
    let rows = base.parameters.iter().map(|parameter| {
        let [value, u] = Cell::estimate(parameter.value, parameter.u);
        cells![&parameter.id, value, u, unit(&parameter.unit), &parameter.meaning]
    });
    Table::new(["parameter", ">value", ">u", "unit", "meaning"], rows)
        .titled("Base parameters with standard uncertainty u")
}

/// What is held at nominal, and what does not depend on it.
pub fn base_statement(base: &BaseResult) -> String {
    let held = match base.held_at_nominal.as_slice() {
        [] => "No parameter is held at nominal: all are separable.".to_string(),
        names => format!(
            "Held at nominal ({}): {}. Predictions do not depend on this choice (largest change {} µm).",
            counted(names.len(), "parameter"),
            names.join(", "),
            with_exponent(base.prediction_change_um, 0)
        ),
    };
    match base.combinations_at_nominal {
        0 => held,
        count => format!(
            "{held} {} of the base parameters {} at nominal too: the readings determine {} by less than their noise.",
            counted(count, "combination"),
            if count == 1 { "stays" } else { "stay" },
            if count == 1 { "it" } else { "them" }
        ),
    }
}
