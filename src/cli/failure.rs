//! Errors on standard error: what was found and where, what to do, and an excerpt of the file.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use abbe::identify::error::{IMPLAUSIBLE, NOT_IN_THE_LIBRARY};
use abbe::model::Diagnostic;
use abbe::model::diagnostic::{Area, Code, FILE_ACCESS, FOREIGN_FILE, Location};
use abbe::model::words::{MAX_QUOTED, around};
use ariadne::{Color, Config, IndexType, Label, Report, ReportKind, Source};

use super::interrupt;
use super::message::{Kind, lines, tell, visible};

const COMMAND_LINE: Code = Code { area: Area::Other, word: "command-line" };
const STOPPED: Code = Code { area: Area::Other, word: "stopped" };

/// Options that contradict each other.
pub fn command_line(message: impl Into<String>) -> Diagnostic {
    Diagnostic::coded(COMMAND_LINE, message)
}

/// The user interrupted the work. The results found until then have been written.
pub fn stopped(message: impl Into<String>) -> Diagnostic {
    Diagnostic::coded(STOPPED, message)
}

/// A file that cannot be written.
pub fn unwritable(path: &Path, cause: std::io::Error) -> Diagnostic {
    Diagnostic::other(format!("cannot be written: {cause}")).at(Location::file(path))
}

/// The exit status: 1 for input that cannot be used, 2 for a wrong command line, 130 or 143 for an interruption.
pub fn status(error: &Diagnostic) -> u8 {
    match error.code {
        COMMAND_LINE => 2,
        STOPPED => interrupt::status(),
        _ => 1,
    }
}

/// Writes an error to standard error.
pub fn show(error: &Diagnostic) {
    match error.code {
        STOPPED => return eprintln!("{}", error.message),
        NOT_IN_THE_LIBRARY => tell(Kind::Error, &format!("{error}; `abbe trace --list` lists all candidates")),
        _ => tell(Kind::Error, &error.to_string()),
    }
    if let Some(excerpt) = error.location().and_then(excerpt) {
        lines(&excerpt);
    }
    let options = match error.code {
        FILE_ACCESS => " (`--data DIR` names the data folder, `--allow-outside` allows files outside)",
        FOREIGN_FILE => " (`--column OWN=THEIRS` says what a column holds and its unit, `--kind` names the instrument)",
        IMPLAUSIBLE => "`--allow-implausible` accepts it: for a machine that really is that far from its drawing",
        _ => "",
    };
    let help = error.help().unwrap_or_default();
    if !(help.is_empty() && options.is_empty()) {
        tell(Kind::Help, &format!("{help}{options}"));
    }
}

/// Bytes of a line before and after the beginning of the place that are read: they hold as many characters as are shown.
const WINDOW: u64 = 4 * MAX_QUOTED as u64;

/// The line with its number and a mark below the place. `None` if the location has no place in a file of text that can
/// be read again: a pipe is read once.
pub fn excerpt(location: &Location) -> Option<Vec<u8>> {
    let span = location.span.as_ref().filter(|_| location.line > 0)?;
    let (line, place) = line(location, span)?;
    let name = location.file.display().to_string();
    let column = line[..place.start].chars().count() + 1;
    let is_cut = line.starts_with('…');
    // Empty lines before it give the line its number.
    let lead = location.line - 1;
    let place = place.start + lead..place.end + lead;
    let config = Config::default().with_index_type(IndexType::Byte);
    let label = Label::new((name.clone(), place.clone())).with_message("here").with_color(Color::Red);
    let report = Report::build(ReportKind::Error, (name.clone(), place)).with_config(config).with_label(label).finish();
    let source = Source::from("\n".repeat(lead) + &visible(&line));
    let mut written = Vec::new();
    report.write((name, source), &mut written).ok()?;
    // The first line is another `Error:`.
    let first = written.iter().position(|byte| *byte == b'\n')?;
    let excerpt = written.split_off(first + 1);
    if !is_cut {
        return Some(excerpt);
    }
    // The column in the cut text is not that in the file.
    let place = format!("{}:{}", location.file.display(), location.line);
    Some(String::from_utf8_lossy(&excerpt).replacen(&format!("{place}:{column}"), &place, 1).into_bytes())
}

/// The text of the line at the beginning of the span, at most [`MAX_QUOTED`] characters around it, and the span in it.
fn line(location: &Location, span: &Range<usize>) -> Option<(String, Range<usize>)> {
    // A device or a pipe would block, or hold something else now.
    if !std::fs::metadata(&location.file).ok()?.is_file() {
        return None;
    }
    let mut file = File::open(&location.file).ok()?;
    let start = span.start as u64;
    let from = start.saturating_sub(WINDOW);
    file.seek(SeekFrom::Start(from)).ok()?;
    let mut bytes = Vec::new();
    file.take(start - from + WINDOW).read_to_end(&mut bytes).ok()?;
    let start = usize::try_from(start - from).ok().filter(|start| *start <= bytes.len())?;
    let is_end = |byte: &u8| *byte == b'\n';
    let begin = bytes[..start].iter().rposition(is_end).map_or(0, |before| before + 1);
    let end = bytes[start..].iter().position(is_end).map_or(bytes.len(), |after| start + after);
    // The window may begin or end within a character.
    let (before, after) = (whole(&bytes[begin..start], from > 0 && begin == 0)?, whole(&bytes[start..end], false)?);
    let text = format!("{before}{}", after.trim_end());
    let length = span.len().min(after.trim_end().len());
    let length = (0..=length).rev().find(|length| after.is_char_boundary(*length)).unwrap_or(0);
    Some(around(&text, before.len()..before.len() + length, MAX_QUOTED))
}

/// The text without an incomplete character at its limits. `None` if it is no UTF-8.
fn whole(bytes: &[u8], cut_before: bool) -> Option<&str> {
    let is_within = |byte: &u8| *byte & 0xC0 == 0x80;
    let skipped = if cut_before { bytes.iter().take(3).take_while(|byte| is_within(byte)).count() } else { 0 };
    let bytes = &bytes[skipped..];
    match std::str::from_utf8(bytes) {
        Ok(text) => Some(text),
        Err(fault) if fault.error_len().is_none() => std::str::from_utf8(&bytes[..fault.valid_up_to()]).ok(),
        Err(_) => None,
    }
}
