//! Errors on standard error: what was found and where, what to do, and an excerpt of the file.

use std::path::Path;

use abbe::identify::error::{IMPLAUSIBLE, NOT_IN_THE_LIBRARY};
use abbe::model::Diagnostic;
use abbe::model::diagnostic::{Area, Code, FILE_ACCESS, FOREIGN_FILE, Location};

use super::excerpt::excerpt;
use super::interrupt;
use super::message::{Kind, lines, tell};

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
