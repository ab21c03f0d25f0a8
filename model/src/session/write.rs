//! Writer for tables of readings, and for sessions with additional effects or data.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::document::Source;
use super::readings::Readings;
use super::table::r_test_columns;
use crate::chain::Machine;
use crate::effect::Effect;
use crate::effect::keys::KeyWriter;
use crate::error::ModelError;
use crate::instrument::Station;

/// Writes readings as a CSV file with our column names, atomically.
///
/// Numbers have up to twelve decimals of mm, degree or s, so that the rounding is far below any resolution.
///
/// # Errors
/// If the file cannot be written; the previous file then remains.
pub fn readings(
    path: &Path,
    machine: &Machine,
    station: &Station<f64>,
    readings: &Readings,
) -> Result<(), ModelError> {
    whole_file(path, &readings_text(machine, station, readings))
}

/// The text of [`readings`].
pub fn readings_text(machine: &Machine, station: &Station<f64>, readings: &Readings) -> String {
    let mut header = Vec::new();
    if !readings.time_s.is_empty() {
        header.push("time_s".to_string());
    }
    if !readings.run.is_empty() {
        header.push("run".into());
    }
    for axis in &machine.axes {
        header.push(axis.column(""));
    }
    if !readings.temperature_c.is_empty() {
        header.push("temperature_c".into());
    }
    match station {
        Station::BallBar(_) => header.push("length_mm".into()),
        Station::Tracker(_) => header.extend(["px_mm", "py_mm", "pz_mm"].map(String::from)),
        // A pose of a socket consists of axis positions only.
        Station::Socket(_) => {}
        Station::Probe(_) => header.push("distance_mm".into()),
        Station::RTest(rtest) => {
            header.extend(r_test_columns(rtest.sensors.is_some()).map(|name| format!("{name}_mm")));
        }
    }
    let mut text = header.join(",");
    text.push('\n');
    for row in 0..readings.rows() {
        let mut cells = Vec::with_capacity(header.len());
        if let Some(time) = readings.time_s.get(row) {
            cells.push(decimal(*time));
        }
        if let Some(run) = readings.run.get(row) {
            cells.push(run.to_string());
        }
        for (axis, column) in machine.axes.iter().zip(&readings.positions) {
            cells.push(decimal(axis.kind.to_display(column[row])));
        }
        if let Some(temperature) = readings.temperature_c.get(row) {
            cells.push(decimal(*temperature));
        }
        if !matches!(station, Station::Socket(_)) {
            let start = row * readings.coordinates;
            for k in start..start + readings.coordinates {
                cells.push(readings.observed.get(k).map_or(String::new(), |mm| decimal(*mm)));
            }
        }
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// A number with the necessary decimals, at most twelve.
fn decimal(value: f64) -> String {
    let text = format!("{value:.12}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Writes a file atomically: a temporary file in the same folder is renamed.
///
/// # Errors
/// If it cannot be written; the previous file then remains.
pub fn whole_file(path: &Path, text: &str) -> Result<(), ModelError> {
    let fault = |cause: std::io::Error| ModelError::Output {
        file: path.to_path_buf(),
        cause: cause.to_string(),
    };
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    let part: PathBuf = path.with_file_name(name);
    let written = std::fs::File::create(&part).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        file.sync_all()
    });
    let renamed = written.and_then(|()| std::fs::rename(&part, path));
    renamed.map_err(|cause| {
        // Remove the incomplete file; a failure to remove it is not reported.
        let _ = std::fs::remove_file(&part);
        fault(cause)
    })
}

/// A session's text with additional effects at its end; the existing text and its comments are unchanged.
///
/// ```
/// use abbe_model::chain::Machine;
/// use abbe_model::driver::Driver;
/// use abbe_model::effect::shape::Harmonic;
/// use abbe_model::effect::{Component, Effect, Shape};
/// use abbe_model::session::write;
///
/// let machine = Machine::from_code("wCAbYXZt")?;
/// let effect = Effect {
///     component: Component::parse("EZC").unwrap(),
///     driver: Driver::parse("C"),
///     shape: Shape::Harmonic(Harmonic { order: 2.0 }),
///     tests: Vec::new(),
/// };
/// let text = write::with_effects("# a session\n", &[effect], &machine);
/// assert_eq!(
///     text,
///     "# a session\n\n[[effect]]\ncomponent = \"EZC\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = 2\n"
/// );
/// # Ok::<(), abbe_model::ModelError>(())
/// ```
pub fn with_effects(original: &str, effects: &[Effect], machine: &Machine) -> String {
    let mut text = original.to_string();
    if !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    for effect in effects {
        text.push('\n');
        text.push_str(&effect_table(effect, machine));
    }
    text
}

/// One `[[effect]]`.
fn effect_table(effect: &Effect, machine: &Machine) -> String {
    let mut keys = KeyWriter::new("[[effect]]", effect.driver_unit(machine));
    keys.line("component", quoted(&effect.component.to_string()));
    keys.line("driver", quoted(&effect.driver.to_string()));
    keys.line("shape", quoted(effect.shape.entry().word));
    effect.shape.write(&mut keys);
    if !effect.tests.is_empty() {
        let names: Vec<String> = effect.tests.iter().map(|name| quoted(name)).collect();
        keys.line("tests", format!("[{}]", names.join(", ")));
    }
    keys.finish()
}

/// A TOML string: JSON escapes are valid in TOML.
pub(super) fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", c as u32);
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// A plan's text with a data file for each named test, otherwise unchanged. An existing data file of a test is replaced.
///
/// # Errors
/// If the text is not a session, or has its tests in inline tables.
pub fn with_data(original: &str, file: &Path, data: &[(String, String)]) -> Result<String, ModelError> {
    let source = Source::new(file, original);
    // Edits: the bytes to replace and their new text.
    let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    if let Some(tests) = source.parse()?.take("test") {
        for item in tests.list("tables [[test]]")? {
            let mut table = item.table("[[test]]".into())?;
            let name = table.require("name", "a name")?;
            let text = name.text()?;
            let Some((_, data)) = data.iter().find(|(test, _)| *test == text) else {
                continue;
            };
            match table.take("data") {
                Some(old) => edits.push((old.span.clone(), quoted(data))),
                None => {
                    let rest = &source.text[name.span.end..];
                    let end = name.span.end + rest.find('\n').unwrap_or(rest.len());
                    let between = source.text[name.span.end..end].trim_start();
                    if !(between.is_empty() || between.starts_with('#')) {
                        let help = "write each test as its own [[test]]";
                        return Err(name.error("a test in an inline table", Some(help.into())));
                    }
                    edits.push((end..end, format!("\ndata = {}", quoted(data))));
                }
            }
        }
    }
    edits.sort_by_key(|(range, _)| range.start);
    let mut text = source.text.clone();
    for (range, new) in edits.into_iter().rev() {
        text.replace_range(range, &new);
    }
    Ok(text)
}
