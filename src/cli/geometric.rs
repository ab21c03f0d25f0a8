//! `abbe fit --method circle|cone|two-plane`: a geometric method compared with the full fit.

use abbe::identify::geometric::{self, Comparison, Method};
use abbe::model::files::SourceMap;
use abbe::model::session::Session;
use abbe::model::words::counted;

use super::failure::Failure;
use super::report::ReportArguments;
use super::{CommonArguments, json, message, screen, table};
use crate::present::method::{error_header, error_rows};

/// Runs a geometric method and the full fit on the same readings.
pub fn run(
    (session, sources): (&Session, &SourceMap),
    method: Method,
    common: &CommonArguments,
    report: &ReportArguments,
    tables: bool,
) -> Result<(), Failure> {
    let result = geometric::compare(session, method, common.seed)?;
    if tables {
        print(&result);
    }
    message::print_warnings(&result.warnings);
    if let Some(path) = &common.json {
        json::write_of_session(path, sources, common.seed, &result)?;
    }
    if report.asked() {
        let (problem, _) = abbe::identify::fit::prepare(session, common.seed)?;
        let document = crate::report::method::document(&problem, &result);
        let method = crate::report::method::method(&result);
        report.write(&document, &method, (session, sources), common.seed)?;
    }
    Ok(())
}

fn print(result: &Comparison) {
    say!("{}, {}", counted(result.readings, "reading"), screen::noise(result.noise_um, &result.noise_source));
    say!("\nOffset of each axis at the fixed ball from its nominal position:");
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
    table::print(&["test", "centre", "offset, µm", "u", "first-order shares, in µm and ″"], &rows);
    say!(
        "\n{} beside the full fit, with standard uncertainty u and bias (on noise-free readings with the errors of the full fit):",
        result.method
    );
    table::print(&error_header(result), &error_rows(result));
    say!(
        "\nResidual rms of the tests of the method: {} nominal, {} with its errors. Of all tests with the full fit: {}",
        table::micrometres(result.nominal_rms_um),
        table::micrometres(result.method_rms_um),
        table::micrometres(result.rms_um)
    );
}
