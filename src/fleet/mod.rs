//! Many sessions of many machines: the analysis of one session as the unit of work, and the folder of results.
//!
//! - [`unit`](mod@unit): fit, trace and validation of one session, with its [`options`]; its key is the SHA-256 of all
//!   inputs and options;
//! - [`record`]: the result of one session, as JSON has it;
//! - [`store`]: a folder of records, each written completely or not at all;
//! - [`pool`]: units of work on several threads; [`run`]: what a run did;
//! - [`study`]: simulated sessions and their analysis;
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
pub mod pool;
pub mod record;
pub mod run;
pub mod store;
pub mod study;
pub mod unit;

/// Version of the program and the first digits of the SHA-256 of the sources that determine results, such as
/// `0.1.0+3fa2b1c9d4e5`. A change of these sources gives other keys.
pub const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("ABBE_SOURCES"));

/// Why the results of a fleet cannot be read or written. A session that cannot be analysed is a record, not an error.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// A file or folder that cannot be read.
    #[error("{path}: cannot be read: {source}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// A file or folder that cannot be written. Records that were written before remain.
    #[error("{path}: cannot be written: {source}; free space and run again: finished results are kept")]
    Write {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The caller ended the work before the session was done.
    #[error("interrupted before the session was done")]
    Interrupted,
    /// A document that cannot be used.
    #[error(transparent)]
    Model(#[from] abbe_model::ModelError),
    /// A folder, a file, or a line of a file that is not what is expected.
    #[error("{place}: {found}; {expected}")]
    Unusable {
        /// The folder, or the file, with the line.
        place: String,
        /// What was found.
        found: String,
        /// What is expected, or what to do.
        expected: String,
    },
    /// No session is named.
    #[error("no session is named; name session files or folders")]
    NoSession,
    /// A machine without sessions.
    #[error(
        "no session of the machine `{id}` among {sessions}: the identifier is `serial_number` of [about], or the name of the \
         machine"
    )]
    UnknownMachine {
        /// The identifier as given.
        id: String,
        /// The number of sessions.
        sessions: usize,
    },
    /// The threads cannot be started.
    #[error("the threads cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl FleetError {
    fn unusable(place: impl std::fmt::Display, found: impl Into<String>, expected: impl Into<String>) -> FleetError {
        FleetError::Unusable { place: place.to_string(), found: found.into(), expected: expected.into() }
    }
}
