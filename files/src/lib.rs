//! Files of machines, sessions and readings: reading into the domain of [`abbe_model::session`], and writing it.
//!
//! - [`mod@read`]: machine and session files; [`table`]: data files, one module per data format;
//! - [`with_readings()`]: a copy of a session with other readings;
//! - [`import`]: the layout of foreign tables, and sessions that read them;
//! - [`robot`]: machines and sessions from the files of robots: URDF, Denavit–Hartenberg parameters;
//! - [`template`]: files of a new machine from its structural code; [`commands`]: files of commanded poses;
//! - [`store`]: files on the disk or in memory; `stl`: surfaces of bodies;
//! - [`source`]: the text of a document, and the place of a fault in it; [`spelling`]: suggestions for misspelt names;
//! - [`SourceMap`]: the files and texts of a session that was read; [`stamp`]: the bytes of the files that were read.
//!
//! The keys of machine and session files are in [`abbe_model::document`]. `lower` turns a document into the domain, and
//! `check` compares the tests and readings of a session with each other.
//!
//! A session read from its file:
//!
//! ```
//! use std::path::Path;
//!
//! use abbe_files::ReadOptions;
//!
//! let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
//! let session = abbe_files::session(&file, &ReadOptions::default())?;
//! assert_eq!(session.machine.code(), "w C A b Y X Z t");
//! let names: Vec<&str> = session.tests.iter().map(|test| test.name.as_str()).collect();
//! assert_eq!(names, ["A100", "A150", "C100", "C150"]);
//! let readings = session.tests.iter().filter_map(|test| test.readings.as_ref());
//! assert_eq!(readings.map(|readings| readings.rows()).sum::<usize>(), 2416);
//! # Ok::<(), abbe_model::Diagnostic>(())
//! ```

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

pub(crate) mod access;
pub(crate) mod axes;
mod check;
pub mod commands;
pub mod import;
mod lower;
mod node;
pub mod read;
pub mod robot;
pub mod source;
pub mod source_map;
pub mod spelling;
pub mod stamp;
pub(crate) mod stl;
pub mod store;
pub mod table;
pub mod template;
mod with_readings;

pub use self::access::ReadOptions;
pub use self::read::{foreign_text, machine, machine_of, session, session_of, session_with_sources, text};
pub use self::source::Source;
pub use self::source_map::SourceMap;
pub use self::with_readings::{Changes, with_readings};
