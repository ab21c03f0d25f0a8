//! Observations of TPOINT: a caption, options, the latitude, then one star per line, up to `END`.
//!
//! A star of an alt-azimuth mount (option `: ALTAZ`) is its true azimuth and elevation, the azimuth and elevation of the
//! encoders, and the angle of a rotator if there is one, all in degrees. `;` starts a comment. The columns of the
//! encoders are those of the first and the second rotary axis from the bed; the rotator is `driver.rotator_deg`.

use std::path::Path;

use abbe_model::axis::AxisKind;
use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::words::counted;

use super::format::{Content, DataFormat, has_extension, starts_with};
use super::lines::Lines;
use super::request::Request;
use super::row::{Row, Rows};
use crate::stamp::FileStamp;
use crate::store::Store;

/// The format, recognised by its extension and an option in its second line.
pub(super) struct TPoint;

impl DataFormat for TPoint {
    fn reads(&self, file: &Path, store: &Store) -> bool {
        has_extension(file, &["dat"]) && starts_with(file, store, |start| second_line(start).starts_with(':'))
    }

    fn open(&self, file: &Path, request: &Request<'_>) -> Result<(FileStamp, Content), Diagnostic> {
        let header = columns(file, request)?;
        let lines = Lines::open(request.store, file, &request.format)?;
        let stamp = lines.stamp().clone();
        let rows = Box::new(StarRows { lines, header, first: None, is_in_stars: false });
        Ok((stamp, Content::Table { rows, has_header: true }))
    }
}

fn second_line(start: &str) -> &str {
    start.lines().nth(1).unwrap_or_default().trim_start()
}

/// The names of the columns of a star: true azimuth and elevation, those of the encoders, the rotator.
///
/// # Errors
/// If the instrument of the test does not observe directions, or the machine has not two rotary axes.
pub(super) fn columns(file: &Path, request: &Request<'_>) -> Result<Vec<String>, Diagnostic> {
    let fault = |message: String, help: &str| Diagnostic::input(Location::file(file), message, help);
    if request.test.station.columns().iter().all(|column| column.stem != "true_azimuth") {
        let message = format!("a file of pointing observations for a test of kind `{}`", request.instrument().word());
        return Err(fault(message, "state `kind = \"pointing\"` in `[instrument]`"));
    }
    let rotary = request.machine.axes.iter().filter(|axis| axis.kind == AxisKind::Rotary);
    let axes: Vec<String> = rotary.map(|axis| axis.column("")).collect();
    let [azimuth, elevation] = &axes[..] else {
        let message = format!("observations with two encoders, but the machine has {} rotary axes", axes.len());
        return Err(fault(message, "a mount has two rotary axes: `chain = \"w b AZ EL t\"`"));
    };
    let names = ["true_azimuth_deg", "true_elevation_deg", azimuth, elevation, "driver.rotator_deg"];
    Ok(names.map(str::to_string).to_vec())
}

/// The stars of a file, after a row of the names of their columns.
struct StarRows {
    lines: Lines,
    /// All columns that a star can have.
    header: Vec<String>,
    /// The first star, after the header.
    first: Option<Row>,
    is_in_stars: bool,
}

const STAR: &str = "a star is four numbers in degrees: true azimuth, true elevation, azimuth and elevation of the \
                    encoders; or five, with the rotator";

impl StarRows {
    /// The lines in front of the stars: the caption, options, the latitude. Returns whether the mount is alt-azimuth.
    fn skip_head(&mut self) -> Result<(), Diagnostic> {
        let mut is_alt_azimuth = false;
        self.lines.next_line()?;
        while let Some(line) = self.lines.next_line()? {
            match content(&line.text).strip_prefix(':') {
                Some(option) => is_alt_azimuth |= option.trim().eq_ignore_ascii_case("ALTAZ"),
                None if content(&line.text).is_empty() => {}
                None if is_alt_azimuth => return Ok(()),
                None => {
                    let help = "only observations of alt-azimuth mounts are read";
                    return Err(self.lines.fault("no option `: ALTAZ` above the latitude".into(), help));
                }
            }
        }
        Err(self.lines.fault("the file ends before the latitude".into(), STAR))
    }

    /// The next star.
    fn star(&mut self) -> Result<Option<Row>, Diagnostic> {
        while let Some(line) = self.lines.next_line()? {
            let text = content(&line.text);
            if text.is_empty() {
                continue;
            }
            if text.eq_ignore_ascii_case("END") {
                return Ok(None);
            }
            let cells: Vec<String> = text.split_whitespace().map(str::to_string).collect();
            if !matches!(cells.len(), 4 | 5) {
                let message = format!("a line with {}", counted(cells.len(), "number"));
                return Err(self.lines.fault(message, STAR));
            }
            self.lines.count_row()?;
            return Ok(Some(Row::of_line(line, cells)));
        }
        Ok(None)
    }
}

/// A line without its comment.
fn content(text: &str) -> &str {
    text.split(';').next().unwrap_or_default().trim()
}

impl Rows for StarRows {
    fn next_row(&mut self) -> Result<Option<Row>, Diagnostic> {
        if let Some(row) = self.first.take() {
            return Ok(Some(row));
        }
        if self.is_in_stars {
            return self.star();
        }
        self.is_in_stars = true;
        self.skip_head()?;
        let Some(first) = self.star()? else {
            return Ok(None);
        };
        let header = Row::of_cells(first.line, self.header[..first.cells.len()].to_vec());
        self.first = Some(first);
        Ok(Some(header))
    }
}
