//! Reader of ball-bar files in XML (`.b5r` and others), within the limits of public knowledge.
//!
//! There is no public description of the format. Programs that read such files rely on three facts: an element
//! `READINGS` with numbers for each run, a `RUN_DIRECTION` beside or around it (element or attribute), and an element
//! `PLANE` with `TEST_PLANE="XY"`. The unit of the readings and the angles at which they were taken are unknown, so
//! nothing is assumed. `[columns]` states the unit, as `deviation_um = "READINGS"`. The test's `path` states the
//! circle, over which the readings of a run are evenly distributed from one end to the other. A warning names
//! everything else in the file; it is not interpreted.

mod contents;

use std::path::Path;

use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::instrument::column::Quantity;
use abbe_model::session::motion::{Course, Motion, Moved};
use abbe_model::session::readings::{Origin, Readings};
use abbe_model::session::trajectory;
use contents::{READINGS, Run};

use super::columns::Role;
use super::fill::Filling;
use super::format::{Content, DataFormat, has_extension};
use super::number::number;
use super::request::{ForeignColumn, Request};
use crate::stamp::FileStamp;
use crate::store::Store;

/// The format, recognised by the extension of the file.
pub(super) struct BallBarXml;

impl DataFormat for BallBarXml {
    fn reads(&self, file: &Path, _: &Store) -> bool {
        has_extension(file, &["xml", "b5r"])
    }

    fn open(&self, file: &Path, request: &Request<'_>) -> Result<(FileStamp, Content), Diagnostic> {
        let (stamp, filling) = read(file, request)?;
        Ok((stamp, Content::Readings(filling)))
    }
}

/// Reads a file for a test, with warnings about the elements that were not read.
///
/// # Errors
/// If it is not XML, contains no readings, or lacks information for their use, with the line and what to do.
fn read(file: &Path, request: &Request<'_>) -> Result<(FileStamp, Filling), Diagnostic> {
    let test = request.test;
    let role = value_role(file, request)?;
    let (stamp, contents) = contents::parse(request.store, file, request.format.encoding)?;
    let fault = |line: usize, message: String, help: String| {
        Diagnostic::input(if line == 0 { Location::file(file) } else { Location::line(file, line) }, message, help)
    };
    if contents.runs.is_empty() {
        let help = "only ball-bar files with runs of READINGS are read; export the readings as CSV and map its columns";
        return Err(fault(0, "it has no element READINGS".into(), help.into()));
    }
    let Some(Motion { moved: Moved::Circle { axes, .. }, course: Course { from, to, .. } }) = &test.motion else {
        let help = "state the circle: `path = { kind = \"circle\", plane = \"XY\", radius_mm = …, from_deg = …, to_deg = …, step_deg = 1 }`; \
                    readings are evenly distributed from one end to the other";
        return Err(fault(0, "READINGS have no angles, and the test has no `path`".into(), help.into()));
    };
    let plane = axes.map(|axis| request.machine.axes[axis].name.clone()).concat();
    if let Some((stated, line)) = &contents.plane {
        let letters = |text: &str| {
            let mut letters: Vec<char> = text.to_uppercase().chars().collect();
            letters.sort_unstable();
            letters
        };
        if letters(stated) != letters(&plane) {
            let message = format!("TEST_PLANE is `{stated}`, but the test's `path` is in {plane}");
            return Err(fault(*line, message, "name the file that belongs to the test".into()));
        }
    }
    let mut readings =
        Readings { positions: vec![Vec::new(); request.machine.axes.len()], channels: 1, ..Readings::default() };
    let mut line = Vec::new();
    let directions = of_runs(&contents.runs, request.format.anticlockwise.as_deref())
        .map_err(|(line, message, help)| fault(line, message, help))?;
    for (index, (run, forward)) in contents.runs.iter().zip(directions).enumerate() {
        let part = |c: char| c.is_whitespace() || c == ';' || (c == ',' && request.format.decimal != b',');
        let numbers: Vec<&str> = run.text.split(part).filter(|word| !word.is_empty()).collect();
        let count = numbers.len();
        if count < 2 {
            let message = format!("READINGS with {count} number{}", if count == 1 { "" } else { "s" });
            return Err(fault(run.line, message, "a run has one for each point of the circle".into()));
        }
        let (start, end) = if forward { (*from, *to) } else { (*to, *from) };
        let angles: Vec<f64> = (0..count).map(|k| start + (end - start) * k as f64 / (count - 1) as f64).collect();
        let Some(states) = trajectory::on_circle(request.machine, test, &angles) else {
            continue;
        };
        let states = states.map_err(|(message, help)| fault(0, message, help))?;
        for (state, cell) in states.iter().zip(&numbers) {
            let value = number(cell, &request.format)
                .map_err(|(message, help)| fault(run.line, format!("READINGS: {message}"), help.to_string()))?;
            for (column, at) in readings.positions.iter_mut().zip(state) {
                column.push(*at);
            }
            readings.observed.push(match role {
                Role::Reading(Quantity::Deviation, unit) => request.bar_mm() + unit.to_internal(value),
                Role::Reading(Quantity::Length, unit) => unit.to_internal(value),
                _ => value,
            });
            line.push(run.line);
            readings.run.push(index as i64 + 1);
        }
    }
    let mut warnings = Vec::new();
    if !contents.unread.is_empty() {
        let names: Vec<String> = contents
            .unread
            .iter()
            .map(|(name, count)| if *count > 1 { format!("{name} ({count})") } else { name.clone() })
            .collect();
        warnings.push(format!(
            "{}: {} runs read; not read, since their meaning is not publicly known: {}",
            file.display(),
            contents.runs.len(),
            names.join(", ")
        ));
    }
    readings.origin = Some(Origin { file: file.to_path_buf(), line });
    Ok((stamp, Filling { by_socket: vec![(None, readings)], quantities: Vec::new(), warnings }))
}

/// The column of ours that READINGS contains, as `[columns]` states.
fn value_role(file: &Path, request: &Request<'_>) -> Result<Role, Diagnostic> {
    let help = "state their unit: `[columns]` with `deviation_um = \"READINGS\"` (from `bar_mm`), or `length_mm = \"READINGS\"`";
    let mapped = request.columns.unwrap_or(&[]);
    let fault = |location: Location, message: String| Diagnostic::input(location, message, help);
    let Some(entry) = mapped.iter().find(|entry| entry.foreign == ForeignColumn::Name(READINGS.into())) else {
        return Err(fault(Location::file(file), "the file does not state the unit of its READINGS".into()));
    };
    if let Some(other) = mapped.iter().find(|other| other.own != entry.own) {
        let message = format!("a ball-bar file in XML has no column for `{}`", other.own);
        return Err(fault(other.location.clone(), message));
    }
    match Role::of(&entry.own, request) {
        Some(role @ Role::Reading(Quantity::Deviation | Quantity::Length, _)) => Ok(role),
        _ => Err(fault(entry.location.clone(), format!("READINGS cannot be `{}`", entry.own))),
    }
}

const CLOCKWISE: [&str; 3] = ["CW", "CLOCKWISE", "CLOCK_WISE"];
const ANTICLOCKWISE: [&str; 6] =
    ["CCW", "ACW", "ANTICLOCKWISE", "COUNTERCLOCKWISE", "ANTI_CLOCKWISE", "COUNTER_CLOCKWISE"];
const KNOWN: &str = "known words are CW, CCW, CLOCKWISE, ANTICLOCKWISE, COUNTERCLOCKWISE; for others use \
                     `[format] anticlockwise = \"…\"`, the word for the direction from the first axis of the plane towards the second";

/// Whether each run goes from the first axis of the plane towards the second. If that is unknown, the error is a line,
/// a message and what to do.
///
/// Known words keep their meaning whatever is stated, except that a stated clockwise word reverses them. Of other
/// words, the stated one means forward and one other backward. Case is ignored; `1`, `true` and `yes` are one value,
/// and so are `0`, `false` and `no`.
fn of_runs(runs: &[Run], stated: Option<&str>) -> Result<Vec<bool>, (usize, String, String)> {
    // Seen from below, the direction from the first axis to the second is clockwise, and a file may call it so.
    let turned = stated.and_then(known_meaning) == Some(false);
    let stated = stated.map(normalised);
    let mut other: Option<String> = None;
    runs.iter()
        .map(|run| {
            let fault = |message: String| Err((run.line, message, KNOWN.to_string()));
            let Some(direction) = &run.direction else {
                return fault("READINGS without a RUN_DIRECTION".into());
            };
            if let Some(anticlockwise) = known_meaning(direction) {
                return Ok(anticlockwise != turned);
            }
            let word = normalised(direction);
            match &stated {
                Some(stated) if *stated == word => Ok(true),
                Some(_) if other.get_or_insert_with(|| word.clone()) == &word => Ok(false),
                Some(_) => fault(format!(
                    "RUN_DIRECTION is `{direction}`: neither the word stated by `anticlockwise`, nor `{}`, the other word in this file",
                    other.as_deref().unwrap_or("")
                )),
                None => fault(format!("RUN_DIRECTION is `{direction}`, which is not known")),
            }
        })
        .collect()
}

/// The meaning of a known word: whether it is anticlockwise.
fn known_meaning(word: &str) -> Option<bool> {
    let word = word.trim().to_uppercase().replace([' ', '-'], "_");
    if ANTICLOCKWISE.contains(&word.as_str()) {
        Some(true)
    } else if CLOCKWISE.contains(&word.as_str()) {
        Some(false)
    } else {
        None
    }
}

/// The word in normalised form.
fn normalised(word: &str) -> String {
    let word = word.trim().to_uppercase();
    match word.as_str() {
        "TRUE" | "YES" => "1".into(),
        "FALSE" | "NO" => "0".into(),
        _ => word,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(directions: &[&str], stated: Option<&str>) -> Result<Vec<bool>, String> {
        let runs: Vec<Run> = directions
            .iter()
            .map(|direction| Run { line: 1, direction: Some(direction.to_string()), text: String::new() })
            .collect();
        of_runs(&runs, stated).map_err(|(_, message, _)| message)
    }

    #[test]
    fn known_words_keep_their_meaning_whatever_is_stated() {
        for stated in [None, Some("0"), Some("true"), Some("CCW"), Some("ccw"), Some("anti-clockwise")] {
            for words in [["CCW", "CW"], ["ccw", "cw"], ["Counter-Clockwise", "clockwise"]] {
                assert_eq!(of(&words, stated), Ok(vec![true, false]), "{words:?} {stated:?}");
            }
        }
        assert_eq!(of(&["CW", "CCW"], Some("cw")), Ok(vec![true, false]));
    }

    #[test]
    fn the_stated_word_means_forward_and_one_other_backward() {
        assert_eq!(of(&["0", "1", "0"], Some("0")), Ok(vec![true, false, true]));
        assert_eq!(of(&["FALSE", "True"], Some("0")), Ok(vec![true, false]));
        assert_eq!(of(&["0", "1"], Some("true")), Ok(vec![false, true]));
        assert_eq!(of(&["Links", "rechts"], Some("links")), Ok(vec![true, false]));
        assert!(of(&["0"], None).unwrap_err().contains("`0`, which is not known"));
        let third = of(&["0", "1", "2"], Some("0")).unwrap_err();
        assert!(third.contains("`2`") && third.contains("`1`"), "{third}");
    }
}
