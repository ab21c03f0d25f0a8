//! The clearance of a device whose sizes the command line of `abbe plan` states.

use abbe::model::Diagnostic;
use abbe::model::instrument::rtest::Setting;
use abbe::model::session::Session;
use abbe::plan::clearance::Clearance;

use crate::cli::values;

/// Collisions, with the device where the R-tests of the session have it, else both on the table and in the spindle.
pub fn faults(session: &Session, sizes: &str) -> Result<Vec<String>, Diagnostic> {
    let numbers: Vec<f64> = sizes.split(',').filter_map(|size| size.trim().parse().ok()).collect();
    let &[spindle_mm, table_mm, device_height_mm, device_width_mm, shaft_mm, jig_mm] = numbers.as_slice() else {
        return Err(Diagnostic::other(format!(
            "`--device-mm {sizes}`: six lengths are expected: diameters of spindle and table, height and width of the device, shaft, jig"
        )));
    };
    values::SIZE_MM.all("--device-mm", &numbers)?;
    let settings: Vec<Setting> = session.tests.iter().filter_map(|test| Some(test.station.rtest()?.setting)).collect();
    let faults = [(Setting::Table, "device on the table"), (Setting::Spindle, "device in the spindle")]
        .into_iter()
        .filter(|(setting, _)| settings.is_empty() || settings.contains(setting))
        .flat_map(|(setting, words)| {
            let device_on_table = setting == Setting::Table;
            let clearance = Clearance {
                spindle_mm,
                table_mm,
                device_height_mm,
                device_width_mm,
                shaft_mm,
                jig_mm,
                device_on_table,
            };
            clearance.faults().into_iter().map(move |fault| format!("{words}: {fault}"))
        });
    Ok(faults.collect())
}
