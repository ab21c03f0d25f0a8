//! `abbe fit --method circle|cone|two-plane`: a geometric method compared with the full fit.

use abbe::identify::geometric::{self, Comparison, Method};
use abbe::model::files::SourceMap;
use abbe::model::session::Session;
use abbe::model::words::counted;

use super::failure::Failure;
use super::report::ReportArguments;
use super::{CommonArguments, message, output};
use crate::report::fit::noise;
use crate::report::method::{centres, errors};
use crate::report::number::micrometres;

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
    common.write_json(sources, &result)?;
    if report.asked() {
        let (problem, _) = abbe::identify::fit::prepare(session, common.seed)?;
        let document = crate::report::pages::method::document(&problem, &result);
        report.write(&document, (session, sources), common.seed)?;
    }
    Ok(())
}

fn print(result: &Comparison) {
    say!("{}, {}", counted(result.readings, "reading"), noise(result.noise_um, result.noise_source));
    output::print(&centres(result));
    output::print(&errors(result));
    say!(
        "\nResidual rms of the tests of the method: {} nominal, {} with its errors. Of all tests with the full fit: {}",
        micrometres(result.nominal_rms_um),
        micrometres(result.method_rms_um),
        micrometres(result.rms_um)
    );
}
