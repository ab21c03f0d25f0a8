//! JSON Schema of machine and session files, for editors and other programs.
//!
//! The readers take keys one by one, so that a message can point at each; a schema cannot be derived from their types.
//! A test compares the schema with the keys that every reader knows.

/// Schema of `machine.toml` (JSON Schema, draft 2020-12).
pub const MACHINE: &str = include_str!("schema/machine.json");

/// Schema of `session.toml`. The caller inserts [`MACHINE`] at `#/$defs/machine`.
pub const SESSION: &str = include_str!("schema/session.json");
