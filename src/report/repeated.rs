//! Type A evaluation over repeated sessions beside the Type B evaluation of each fit.

use abbe::identify::repeated::{Repeated, Scatter};

use super::number::{places, unit};
use super::table::{Cell, Table, cells};

/// Mean and scatter of each parameter.
pub fn parameters(result: &Repeated) -> Table {
    let rows = result.parameters.iter().map(|parameter| {
        let [mean, u_type_a] = Cell::estimate(parameter.mean, parameter.u_type_a);
        let [s, u_type_b] = [parameter.s, parameter.u_type_b].map(|u| Cell::fixed(u, places(u)));
        let number = |value: Option<f64>, digits: usize| Cell::or_dash(value.map(|value| Cell::fixed(value, digits)));
        cells![
            &parameter.id,
            mean,
            u_type_a,
            s,
            u_type_b,
            unit(&parameter.unit),
            number(parameter.ratio, 2),
            number(parameter.p_value, 3),
            match parameter.scatter {
                Scatter::AsStated => "",
                Scatter::More => "scatters more than u states",
                Scatter::Less => "scatters less than u states",
            },
        ]
    });
    let columns = ["parameter", ">mean", ">s/√n (A)", ">s (A)", ">u (B)", "unit", ">s/u", ">p", ""];
    Table::new(columns, rows)
}

/// Sessions that deviate significantly from the mean of the others.
pub fn deviating(result: &Repeated) -> Table {
    let rows = result.deviating.iter().map(|deviation| {
        let [difference, u] = Cell::estimate(deviation.deviation, deviation.u);
        let ratio = Cell::fixed((deviation.deviation / deviation.u).abs(), 1);
        cells![&deviation.session, &deviation.id, difference, u, unit(&deviation.unit), ratio]
    });
    let columns = ["session", "parameter", ">deviation", ">u", "unit", ">deviation/u"];
    Table::new(columns, rows).titled("Significant deviations of a session from the mean of the others")
}
