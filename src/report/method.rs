//! The errors by a geometric method beside those of the full fit.

use abbe::apply::geometric::{Comparison, ComparisonRow};
use abbe::identify::problem::Problem;
use abbe::identify::results::MeasuredValue;
use abbe::model::words::counted;

use super::block::Report;
use super::figure::bars::{self, Row};
use super::figure::{Figure, Quantity};
use super::fit::Figures;
use super::number::{micrometres, unit, units};
use super::quality::noise;
use super::quality::noise_sentence;
use super::session;
use super::table::{Cell, Column, Table, cells, numbers};

/// The report of a method, compared with the full fit.
pub fn report(problem: &Problem, result: &Comparison) -> Report {
    let mut report = Report::new(format!("{}: {} method and full fit", problem.session.machine.name, result.method));
    report.warnings.clone_from(&result.warnings);
    report.method = format!(
        "The {} method of the literature and the full least-squares fit, applied to the same readings. {}. Bias: both \
         methods are applied to noise-free readings that are simulated with the errors of the full fit; these errors \
         are subtracted.",
        result.method,
        noise_sentence(result.noise)
    );
    report.values = values(result);
    report.opening(
        "",
        [
            format!(
                "The {} method {}. The rms residual of the full fit in all tests is {}.",
                result.method,
                change(result),
                micrometres(result.rms_um)
            ),
            format!("{}, {}.", counted(result.readings, "reading"), noise(result.noise)),
        ],
    );
    report.section("Errors by both methods");
    report.key(errors(result));
    report.figures(figures(result));
    report.section("Axis positions");
    report.key(centres(result));
    session::machine(&mut report, problem);
    report
}

/// What the method makes of the rms residual of its tests.
fn change(result: &Comparison) -> String {
    let [nominal, own] = [result.nominal_rms_um, result.method_rms_um].map(micrometres);
    match result.method_rms_um < result.nominal_rms_um {
        true => format!("reduces the rms residual of its tests from {nominal} to {own}"),
        false => format!(
            "does not reduce the rms residual of its tests: {nominal} of the nominal machine, {own} with its errors"
        ),
    }
}

/// Every figure with all its digits, one row each.
fn values(result: &Comparison) -> Table {
    let mut figures = Figures::default();
    for (id, rms_um) in
        [("nominal", result.nominal_rms_um), ("method", result.method_rms_um), ("full fit", result.rms_um)]
    {
        figures.figure("residual", id, "rms", rms_um, "um");
    }
    for row in &result.errors {
        figures.estimate("method", &row.id, "", row.value.zip(row.u), &row.unit);
        figures.estimate("full fit", &row.id, "", row.full_value.zip(row.full_u), &row.unit);
        for (section, bias) in [("bias of the method", row.bias), ("bias of the full fit", row.full_bias)] {
            bias.into_iter().for_each(|bias| figures.figure(section, &row.id, "", bias, &row.unit));
        }
    }
    for centre in &result.centres {
        for found in &centre.offsets {
            let id = format!("{} of {} in {}", found.direction, centre.axis, centre.test);
            figures.estimate("offset", &id, "", Some((found.offset_um, found.u_um)), "um");
        }
        figures.figure("radius", &centre.test, "", centre.radius_mm, "mm");
        figures.figure("cone height", &centre.test, "", centre.height_mm, "mm");
    }
    figures.table()
}

fn figures(result: &Comparison) -> Vec<Figure> {
    let value = |value: Option<f64>, u: Option<f64>| Some(MeasuredValue { value: value?, u: u? });
    let figure = |name: &str| {
        let own = result.errors.iter().filter(|row| row.unit == name);
        let row = |row: &ComparisonRow| (row.id.clone(), [value(row.value, row.u), value(row.full_value, row.full_u)]);
        let rows: Vec<Row> = own.map(row).collect();
        Figure::new(
            format!("errors-{name}"),
            format!("Errors by both methods, {}", unit(name)),
            "Whiskers: ± 2 u. An error that a method does not identify has no mark.",
            bars::values(&Quantity::new("value", name), [&result.method, "full fit"], &rows),
        )
    };
    units(result.errors.iter().map(|row| row.unit.as_str())).into_iter().map(figure).collect()
}

/// The errors by the method and by the full fit, one row per error.
fn errors(result: &Comparison) -> Table {
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
fn centres(result: &Comparison) -> Table {
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

#[cfg(test)]
mod tests {
    use abbe::identify::noise::{NoiseSource, ReadingNoise};

    use super::*;

    /// A residual that grows is no reduction.
    #[test]
    fn only_a_smaller_residual_is_reduced() {
        let said = |nominal_rms_um: f64, method_rms_um: f64| {
            change(&Comparison {
                method: "circle".to_string(),
                readings: 100,
                noise: ReadingNoise { value: 0.3, source: NoiseSource::Stated, ..ReadingNoise::default() },
                rms_um: 0.3,
                method_rms_um,
                nominal_rms_um,
                centres: Vec::new(),
                errors: Vec::new(),
                warnings: Vec::new(),
            })
        };
        assert!(said(18.7, 36.3).starts_with("does not reduce the rms residual of its tests: 18.700 µm"));
        assert_eq!(said(36.3, 18.7), "reduces the rms residual of its tests from 36.300 µm to 18.700 µm");
    }
}
