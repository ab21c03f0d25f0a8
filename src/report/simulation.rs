//! A simulated session and the true values of its parameters.

use abbe::identify::simulate::Simulated;
use abbe::model::session::Session;
use abbe::model::unit::{ARCSEC_PER_RAD, UM_PER_MM, Unit};
use abbe::model::words::counted;

use super::block::Report;
use super::number::{of_readings, unit};
use super::table::{Cell, Table, cells};

/// The report of a simulation that was written to this session file.
pub fn report(session: &Session, file: &str, simulated: &Simulated, seed: u64) -> Report {
    let mut report = Report::new(format!("Simulation of {}", session.machine.name));
    report.warnings.clone_from(&simulated.warnings);
    report.method = "Readings of the machine with the stated errors, with Gaussian noise.".to_string();
    let readings: usize = simulated.readings.iter().map(|readings| readings.rows()).sum();
    let units = session.units();
    let lengths = of_readings(simulated.noise_mm * UM_PER_MM, Unit::Micrometre);
    let angles = of_readings(simulated.noise_rad * ARCSEC_PER_RAD, Unit::Arcsecond);
    let noise = match (units.lengths, units.angles) {
        (true, true) => format!("{lengths} and {angles}"),
        (false, true) => angles,
        _ => lengths,
    };
    report.opening(
        "",
        [format!(
            "{file}: {} of {}, noise {noise}, seed {seed}",
            counted(readings, "reading"),
            counted(session.tests.len(), "test"),
        )],
    );
    report.section("True values");
    match simulated.truth.is_empty() {
        true => report.key("No error is given: the readings are those of the nominal machine."),
        false => report.key(truth(simulated)),
    }
    report
}

/// The parameters that are not zero.
fn truth(simulated: &Simulated) -> Table {
    let rows = simulated.truth.iter().map(|own| cells![&own.id, Cell::fixed(own.value, 4), unit(&own.unit)]);
    Table::new(["parameter", ">value", "unit"], rows)
}
