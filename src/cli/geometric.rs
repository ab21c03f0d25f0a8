//! `abbe fit --method circle|cone|two-plane`: a geometric method beside the full fit.

use abbe::identify::geometric::{self, Comparison, ComparisonRow, Method};
use abbe::model::files::SourceMap;
use abbe::model::session::Session;
use abbe::model::words::counted;

use super::failure::Failure;
use super::report::ReportArguments;
use super::{CommonArguments, fit, output, table};

/// Runs a geometric method and the full fit on the same readings.
pub fn run(
    (session, sources): (&Session, &SourceMap),
    method: Method,
    common: &CommonArguments,
    faces: &ReportArguments,
    tables: bool,
) -> Result<(), Failure> {
    let result = geometric::compare(session, method, common.seed)?;
    if tables {
        print(&result);
    }
    fit::print_warnings(&result.warnings);
    if let Some(path) = &common.json {
        output::write_json(path, &result)?;
    }
    if faces.asked() {
        let (problem, _) = abbe::identify::fit::prepare(session, common.seed)?;
        let document = crate::report::method::document(&problem, &result);
        let method = crate::report::method::method(&result);
        faces.write(&document, &method, (session, sources), common.seed)?;
    }
    Ok(())
}

fn print(result: &Comparison) {
    say!(
        "{}, {}",
        counted(result.readings, "reading"),
        fit::noise(result.noise_um, &result.noise_source)
    );
    say!("\nWhere the axes pass the standing ball, from their nominal places:");
    let rows: Vec<Vec<String>> = result
        .centres
        .iter()
        .flat_map(|centre| {
            centre.offsets.iter().map(move |found| {
                let (offset, u) = table::value_and_u(found.offset_um, found.u_um);
                let shares: Vec<String> = found
                    .sensitivities
                    .iter()
                    .filter(|share| share.value.abs() > 1e-6)
                    .map(|share| format!("{:+.3} {}", share.value, share.id))
                    .collect();
                vec![
                    centre.test.clone(),
                    format!("{} of {}", found.direction, centre.axis),
                    offset,
                    u,
                    shares.join(" "),
                ]
            })
        })
        .collect();
    table::print(
        &[
            "test",
            "centre",
            "µm",
            "u (k=1)",
            "in µm and arcsec, to first order",
        ],
        &rows,
    );
    say!(
        "\n{} beside the full fit; bias on noise-free readings with the full fit's errors:",
        result.method
    );
    table::print(&error_header(result), &error_rows(result));
    say!(
        "\nResidual of the tests that the method takes: {} nominal, {} with its errors; of all tests {} with the full fit",
        table::micrometres(result.nominal_rms_um),
        table::micrometres(result.method_rms_um),
        table::micrometres(result.rms_um)
    );
}

/// Header of [`error_rows`].
pub fn error_header(result: &Comparison) -> [&str; 8] {
    let method = result.method.as_str();
    [
        "error", method, "u (k=1)", "bias", "full fit", "u (k=1)", "bias", "unit",
    ]
}

/// The errors by the method and by the full fit, a row an error.
pub fn error_rows(result: &Comparison) -> Vec<Vec<String>> {
    let pair = |value: Option<f64>, u: Option<f64>| match (value, u) {
        (Some(value), Some(u)) => table::value_and_u(value, u),
        _ => ("–".to_string(), "–".to_string()),
    };
    // Without the sign of what is rounded to nothing.
    let rounded = |bias: f64| (bias * 1e4).round() / 1e4 + 0.0;
    let bias = |bias: Option<f64>| bias.map_or("–".to_string(), |bias| format!("{:.4}", rounded(bias)));
    let row = |row: &ComparisonRow| {
        let (value, u) = pair(row.value, row.u);
        let (full, full_u) = pair(row.full_value, row.full_u);
        let [of_method, of_full] = [bias(row.bias), bias(row.full_bias)];
        vec![
            row.id.clone(),
            value,
            u,
            of_method,
            full,
            full_u,
            of_full,
            row.unit.clone(),
        ]
    };
    result.errors.iter().map(row).collect()
}
