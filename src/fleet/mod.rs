//! Many sessions of many machines: the analysis of one session as the unit of work, and the folder of results.
//!
//! - [`unit`](mod@unit): fit, trace and validation of one session, with its [`options`]; its key is the SHA-256 of all
//!   inputs and options;
//! - [`record`]: the result of one session, as JSON has it;
//! - [`store`]: a folder of records, each written completely or not at all;
//! - [`run`]: units of work on several threads, and what was done;
//! - [`list`]: session files from files, folders and lists;
//! - [`history`]: the machines of a folder over time; [`conformity`]: their decisions; [`compensations`]: the file of
//!   known ones; [`date`]: the date of a session.
//!
//! The unit of work depends on nothing but its inputs: any process may do it, at any time and in any order.

pub mod compensations;
pub mod conformity;
pub mod date;
pub mod history;
pub mod list;
pub mod options;
pub mod record;
pub mod run;
pub mod store;
pub mod unit;

use std::fmt::Display;
use std::path::Path;

use abbe_model::Diagnostic;
use abbe_model::diagnostic::{Area, Code, Location};

/// Version of the program and the first digits of the SHA-256 of the sources that determine results, such as
/// `0.1.0+3fa2b1c9d4e5`. A change of these sources gives other keys.
pub const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("ABBE_SOURCES"));

/// The caller ended the work.
pub const INTERRUPTED: Code = Code { area: Area::Other, word: "interrupted" };

/// What the analysis of a session asks before each of its steps: whether to go on.
pub type ShouldContinue<'g> = &'g (dyn Fn() -> bool + Sync);

/// The caller ended the work before the session was done.
fn interrupted() -> Diagnostic {
    Diagnostic::coded(INTERRUPTED, "interrupted before the session was done")
}

fn unreadable(path: &Path, cause: std::io::Error) -> Diagnostic {
    Diagnostic::other(format!("cannot be read: {cause}")).at(Location::file(path))
}

fn unwritable(path: &Path, cause: std::io::Error) -> Diagnostic {
    let remedy = "free space and run again: finished results are kept";
    Diagnostic::other(format!("cannot be written: {cause}; {remedy}")).at(Location::file(path))
}

/// A folder, a file, or a line of a file that is not what is expected.
fn unusable(place: impl Display, found: impl Display, expected: impl Display) -> Diagnostic {
    Diagnostic::other(format!("{place}: {found}; {expected}"))
}
