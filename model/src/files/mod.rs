//! Files of machines, sessions and readings: reading into the domain of [`session`](crate::session), and writing it.
//!
//! - [`mod@read`]: machine and session files; [`table`]: data files, one module per data format;
//! - [`with_readings()`]: a copy of a session with other readings;
//! - [`import`]: the layout of foreign tables, and sessions that read them;
//! - [`robot`]: machines and sessions from the files of robots: URDF, Denavit–Hartenberg parameters;
//! - [`template`]: files of a new machine from its structural code;
//! - [`store`]: files on the disk or in memory; `stl`: surfaces of bodies;
//! - [`SourceMap`]: the files and texts of a session that was read; [`stamp`]: the bytes of the files that were read.
//!
//! The keys of machine and session files are in [`document`](crate::document).

pub(crate) mod access;
pub mod commands;
pub mod import;
pub(crate) mod quantity;
pub mod read;
pub mod robot;
pub mod source_map;
pub mod spelling;
pub mod stamp;
pub(crate) mod stl;
pub mod store;
pub mod table;
pub mod template;
mod with_readings;

pub use self::access::ReadOptions;
pub use self::read::{machine, machine_of, session, session_of, session_with_sources, text};
pub use self::source_map::SourceMap;
pub use self::with_readings::{Changes, with_readings};
pub use crate::document::source::Source;
