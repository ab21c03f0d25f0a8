//! Type A evaluation over repeated sessions beside the Type B evaluation of each fit.

use abbe::identify::repeated::{Repeated, Scatter};
use abbe::model::words::counted;

use super::block::Report;
use super::number::{places, unit};
use super::table::{Cell, Table, cells};

/// The report of repeated sessions of a machine.
pub fn report(machine: &str, result: &Repeated) -> Report {
    let mut report = Report::new(format!("Repeated sessions of {machine}"));
    report.method = "Type A: from the scatter of the sessions, s/√n of their mean, s of one session. Type B: standard \
                     uncertainty u of one fit. p: probability of such a ratio s/u by chance."
        .to_string();
    report.opening("", [format!("{} of one plan, each fitted separately.", counted(result.sessions.len(), "session"))]);
    report.section("Parameters");
    report.key(parameters(result));
    report.key(report.method.clone());
    report.section("Deviations");
    report.key(deviating(result));
    if result.deviating.is_empty() && result.sessions.len() > 2 {
        report.key("No session deviates significantly from the others.");
    }
    report
}

/// Mean and scatter of each parameter.
fn parameters(result: &Repeated) -> Table {
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
fn deviating(result: &Repeated) -> Table {
    let rows = result.deviating.iter().map(|deviation| {
        let [difference, u] = Cell::estimate(deviation.deviation, deviation.u);
        let ratio = Cell::fixed((deviation.deviation / deviation.u).abs(), 1);
        cells![&deviation.session, &deviation.id, difference, u, unit(&deviation.unit), ratio]
    });
    let columns = ["session", "parameter", ">deviation", ">u", "unit", ">deviation/u"];
    Table::new(columns, rows).titled("Significant deviations of a session from the mean of the others")
}
