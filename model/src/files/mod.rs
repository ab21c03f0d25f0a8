//! Files of machines, sessions and readings: reading into the domain of [`session`](crate::session), and writing it.
//!
//! - [`toml`]: machine and session files; [`table`]: data files, one module per data format;
//! - [`with_readings()`]: a copy of a session with other readings;
//! - [`template`]: files of a new machine from its structural code;
//! - [`store`]: files on the disk or in memory; `stl`: surfaces of bodies;
//! - [`SourceMap`]: the files and texts of a session that was read;
//! - [`schema`]: JSON Schema of machine and session files; [`stamp`]: the bytes of the files that were read.

pub mod commands;
mod quantity;
pub mod schema;
pub mod source_map;
mod spelling;
pub mod stamp;
mod stl;
pub mod store;
pub mod table;
pub mod template;
pub mod toml;
mod with_readings;

pub use self::source_map::SourceMap;
pub use self::toml::{ReadOptions, Source, machine, machine_of, session, session_of, session_with_sources, text};
pub use self::with_readings::{Changes, with_readings};
