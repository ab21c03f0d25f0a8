//! Sobol' indices of the estimates of a plan, beside the linear prediction.

use abbe::model::session::Session;
use abbe::plan::global::GlobalAnalysis;

use crate::report::block::Report;
use crate::report::number::{three_digits, unit};
use crate::report::quality::noise;
use crate::report::table::{Cell, Table, cells};

/// Total indices below this value are not listed, unless the linear share is above it; the JSON lists all.
const MIN_LISTED: f64 = 0.01;

/// The report of a global sensitivity analysis.
pub fn report(session: &Session, found: &GlobalAnalysis) -> Report {
    let mut report = Report::new(format!("Global sensitivity of the plan for {}", session.machine.name));
    report.method =
        "Sobol' indices by quasi-random samples of the inputs, with the full fit of each sample, beside the \
                     shares by linear propagation."
            .to_string();
    let noise = noise(found.noise);
    report.opening(
        "",
        [format!("{} samples, {} fits, {} inputs, {noise}.", found.samples, found.evaluations, found.inputs.len(),)],
    );
    report.section("Errors");
    report.key(errors(found));
    report.section("Indices");
    report.key(indices(found));
    report.section("Convergence");
    report.key(convergence(found));
    report
}

/// Standard deviation of each estimate over the samples and by linear propagation.
fn errors(found: &GlobalAnalysis) -> Table {
    let rows = found.errors.iter().map(|error| {
        let interactions = 1.0 - error.indices.iter().map(|index| index.sobol.first).sum::<f64>();
        cells![
            &error.id,
            three_digits(error.standard_deviation),
            three_digits(error.linear_standard_deviation),
            unit(&error.unit),
            Cell::fixed(interactions, 3),
        ]
    });
    Table::new(["error", ">s", ">linear", "unit", ">interactions"], rows).titled(
        "Standard deviation s of each estimate over the samples and by linear propagation; share of the variance by\n\
         interactions (1 less the sum of first-order indices)",
    )
}

/// The indices of each error by each input.
fn indices(found: &GlobalAnalysis) -> Table {
    let rows = found.errors.iter().flat_map(|error| {
        let inputs = found.inputs.iter().zip(&error.indices);
        let listed = inputs.filter(|(_, index)| index.sobol.total.max(index.linear) >= MIN_LISTED);
        listed.map(|(input, index)| {
            let sobol = &index.sobol;
            cells![
                &error.id,
                &input.id,
                format!("{} {} {}", input.distribution, three_digits(input.size), unit(&input.unit)),
                Cell::fixed(sobol.first, 3),
                Cell::fixed(sobol.first_half_width, 3),
                Cell::fixed(sobol.total, 3),
                Cell::fixed(sobol.total_half_width, 3),
                Cell::fixed(index.linear, 3),
            ]
        })
    });
    let columns = ["error", "input", "size", ">first", ">±", ">total", ">±", ">linear"];
    Table::new(columns, rows)
        .titled("Sobol' indices, first order and total, with 95 % confidence intervals; share by linear propagation")
}

/// Change of the total indices with the number of samples.
fn convergence(found: &GlobalAnalysis) -> Table {
    let rows = found.convergence.iter().map(|one| cells![one.samples.to_string(), Cell::fixed(one.largest_change, 3)]);
    Table::new([">samples", ">largest change"], rows)
        .titled(format!("Convergence: largest change of a total index up to {} samples", found.samples))
}
