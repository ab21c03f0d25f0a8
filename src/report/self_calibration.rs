//! The functions of a self-calibration, and their coverage intervals.

use abbe::identify::results::Interval;
use abbe::identify::self_calibration::{FunctionResult, MonteCarloResult};

use super::number::{fixed, places, value_and_u};
use super::table::{Cell, Table, cells, numbers, words};

/// Functions side by side, one row per angle.
pub fn functions(functions: &[FunctionResult]) -> Table {
    let mut angles: Vec<f64> = Vec::new();
    for point in functions.iter().flat_map(|function| &function.points) {
        if !angles.contains(&point.at_deg) {
            angles.push(point.at_deg);
        }
    }
    angles.sort_by(f64::total_cmp);
    let cell = |function: &FunctionResult, angle: f64| {
        let point = function.points.iter().find(|point| point.at_deg == angle);
        let Some((value, u)) = point.and_then(|point| Some((point.value_um?, point.u_um?))) else {
            return Cell::from("–");
        };
        if u < 1e-9 {
            return Cell::fixed(value, 2);
        }
        let (value, u) = value_and_u(value, u);
        format!("{value} ± {u}").into()
    };
    let rows = angles.iter().map(|angle| {
        let cells = functions.iter().map(|function| cell(function, *angle));
        std::iter::once(format!("{angle}°").into()).chain(cells).collect()
    });
    let columns = [words("angle")].into_iter().chain(functions.iter().map(|function| numbers(&function.id)));
    Table::new(columns, rows)
}

/// Coverage intervals of the quantities, µm.
pub fn intervals(drawn: &MonteCarloResult) -> Table {
    let rows = drawn.quantities.iter().map(|quantity| {
        let [mean, u] = Cell::estimate(quantity.mean_um, quantity.u_um);
        let interval = |Interval { low, high }: Interval| {
            let [low, high] = [low, high].map(|end| fixed(end, places(quantity.u_um)));
            format!("{low} to {high}")
        };
        let shortest = interval(quantity.shortest_interval_um);
        cells![&quantity.id, mean, u, shortest, interval(quantity.symmetric_interval_um)]
    });
    let columns = ["quantity", ">mean", ">u", ">shortest", ">symmetric"];
    Table::new(columns, rows)
}
