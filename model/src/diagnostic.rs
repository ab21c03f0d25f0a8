//! What is wrong: the error of every crate, with its place in the user's files and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::words::shortened;

/// A location in the user's files.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Location {
    /// The file as the user named it.
    pub file: PathBuf,
    /// Line, from 1; 0 for the whole file.
    pub line: usize,
    /// The bytes of the file to which the message refers, if known.
    pub span: Option<std::ops::Range<usize>>,
}

impl Location {
    /// The whole file.
    pub fn file(file: &Path) -> Location {
        Location { file: file.to_path_buf(), ..Location::default() }
    }

    /// A line of the file.
    pub fn line(file: &Path, line: usize) -> Location {
        Location { line, ..Location::file(file) }
    }

    /// The column, from 1, in the content of the file: characters from the start of the line.
    pub fn column(&self, contents: &[u8]) -> Option<usize> {
        let before = contents.get(..self.span.as_ref()?.start)?;
        let line = before.rsplit(|byte| *byte == b'\n').next().unwrap_or(before);
        Some(String::from_utf8_lossy(line).chars().count() + 1)
    }
}

impl fmt::Display for Location {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.file.display())?;
        if self.line > 0 {
            write!(formatter, ":{}", self.line)?;
        }
        Ok(())
    }
}

/// What is concerned. Python has a class of exceptions for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Area {
    /// A machine, a session, its readings, another input.
    Session,
    /// A fit, and what is derived from one.
    Identification,
    /// An equation or a program.
    Equation,
    /// Anything else, such as a folder of results.
    Other,
}

/// What a diagnostic says, for a caller that treats it otherwise than the rest. A crate declares its own codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// What is concerned.
    pub area: Area,
    /// A word; empty if no caller treats it otherwise.
    pub word: &'static str,
}

/// A file that does not exist in the searched folders, or lies outside the folders that a session may read. Other options
/// for reading (a data folder, files outside allowed) may remedy it.
pub const FILE_ACCESS: Code = Code { area: Area::Session, word: "file-access" };
/// A foreign file of readings that is not understood. What the caller says of its columns or of the instrument may remedy
/// it.
pub const FOREIGN_FILE: Code = Code { area: Area::Session, word: "foreign-file" };

/// What is wrong, where, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// What it says, for callers.
    pub code: Code,
    /// The place in the user's files.
    pub place: Option<Box<Location>>,
    /// What was found and what was expected.
    pub message: String,
    /// What to do, if the message does not say it.
    pub help: Option<String>,
}

impl Diagnostic {
    /// Something wrong that a caller recognises by its code.
    pub fn coded(code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic { code, place: None, message: message.into(), help: None }
    }

    fn of(area: Area, message: impl Into<String>) -> Diagnostic {
        Diagnostic::coded(Code { area, word: "" }, message)
    }

    /// Unusable input at a place, and what to do.
    pub fn input(place: Location, message: impl Into<String>, help: impl Into<Help>) -> Diagnostic {
        Diagnostic::session(message, help).at(place)
    }

    /// An invalid machine, session or plan without a place in a file, and what to do.
    pub fn session(message: impl Into<String>, help: impl Into<Help>) -> Diagnostic {
        Diagnostic { help: help.into().0, ..Diagnostic::of(Area::Session, message) }
    }

    /// A computation that has no result.
    pub fn identification(message: impl Into<String>) -> Diagnostic {
        Diagnostic::of(Area::Identification, message)
    }

    /// An equation that cannot be written.
    pub fn equation(message: impl Into<String>) -> Diagnostic {
        Diagnostic::of(Area::Equation, message)
    }

    /// Anything else.
    pub fn other(message: impl Into<String>) -> Diagnostic {
        Diagnostic::of(Area::Other, message)
    }

    /// The same, at a place.
    #[must_use]
    pub fn at(self, place: Location) -> Diagnostic {
        Diagnostic { place: Some(Box::new(place)), ..self }
    }

    /// The place in the user's files, if it is known.
    pub fn location(&self) -> Option<&Location> {
        self.place.as_deref()
    }

    /// What to do, if the message does not say it.
    pub fn help(&self) -> Option<&str> {
        self.help.as_deref()
    }
}

impl From<String> for Diagnostic {
    fn from(message: String) -> Diagnostic {
        Diagnostic::other(message)
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(formatter, "{place}: ")?;
        }
        formatter.write_str(&shortened(&self.message))
    }
}

impl std::error::Error for Diagnostic {}

/// What to do about a fault, if there is anything to say.
pub struct Help(pub(crate) Option<String>);

impl From<&str> for Help {
    fn from(help: &str) -> Help {
        help.to_string().into()
    }
}

impl From<String> for Help {
    fn from(help: String) -> Help {
        Some(help).into()
    }
}

impl From<Option<String>> for Help {
    fn from(help: Option<String>) -> Help {
        Help(help.filter(|help| !help.is_empty()))
    }
}
