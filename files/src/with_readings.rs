//! A copy of a session with other readings: the files of a folder that can be read as a session.

use std::path::{Component, Path};

use abbe_model::Diagnostic;
use abbe_model::session::Session;
use abbe_model::session::readings::Readings;

use super::source_map::{BodyFile, SourceMap};
use super::table::csv;

/// What the copy changes beside the readings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Changes {
    /// The noise of lengths to state, µm; `None` keeps the session's.
    pub noise_um: Option<f64>,
    /// The noise of angles to state, arcsec; `None` keeps the session's.
    pub noise_arcsec: Option<f64>,
    /// Whether the declared effects are omitted.
    pub hide_effects: bool,
}

/// The names and contents of the files: one data file per test, the machine if it has a file of its own, the files of its
/// bodies, and `session.toml` as the last.
///
/// # Errors
/// If the text of the session cannot be rewritten, or a body has its file outside the folder of the machine.
pub fn with_readings(
    (session, sources): (&Session, &SourceMap),
    readings: &[Readings],
    changes: Changes,
) -> Result<Vec<(String, Vec<u8>)>, Diagnostic> {
    let mut files = Vec::new();
    let mut data: Vec<(String, String)> = Vec::new();
    for (test, readings) in session.tests.iter().zip(readings) {
        let name = data_name(&test.name, &data);
        let text = csv::text(&session.machine, &test.station, readings);
        data.push((test.name.clone(), name.clone()));
        files.push((name, text.into_bytes()));
    }
    if let Some(machine) = &sources.machine_text {
        files.push(("machine.toml".into(), machine.clone().into_bytes()));
    }
    for BodyFile { name, contents, .. } in &sources.bodies {
        if !Path::new(name).components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(Diagnostic::session(
                format!("the body in {name} cannot be copied with the session"),
                "put the STL file beside the machine file, or below",
            ));
        }
        files.push((name.clone(), contents.to_vec()));
    }
    let mut text = sources.text.clone();
    text.set_data(&data);
    text.set_machine_file("machine.toml");
    if let Some(noise_um) = changes.noise_um {
        text.set_of_instrument("noise_um", noise_um);
    }
    if let Some(noise_arcsec) = changes.noise_arcsec {
        text.set_of_instrument("noise_arcsec", noise_arcsec);
    }
    // The data files have the standard columns, whatever the columns of the original.
    text.remove(&["format", "columns"]);
    if changes.hide_effects {
        text.remove(&["effect"]);
    }
    files.push(("session.toml".into(), text.to_string().into_bytes()));
    Ok(files)
}

/// A portable file name for the data of a test, different from those of other tests.
fn data_name(test: &str, taken: &[(String, String)]) -> String {
    let plain: String =
        test.chars().map(|c| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' }).collect();
    let plain = plain.trim_start_matches('.');
    let mut name = format!("{plain}.csv");
    let mut number = 2;
    while taken.iter().any(|(_, other)| other.eq_ignore_ascii_case(&name)) {
        name = format!("{plain}-{number}.csv");
        number += 1;
    }
    name
}
