//! Files of machines, sessions and readings: reading into the domain of [`session`](crate::session), and writing it.
//!
//! - [`toml`]: machine and session files; [`table`]: data files, one module per data format;
//! - [`schema`]: JSON Schema of machine and session files; [`stamp`]: state of the files that were read; [`whole`]: files written as a whole.

mod quantity;
pub mod schema;
mod spelling;
pub mod stamp;
pub mod table;
pub mod toml;
pub mod whole;

pub use self::toml::{ReadOptions, machine, session, text};
