//! JSON Schema of machine and session files, for editors and programs that write them.
//!
//! The readers take keys one by one, so that a message can point at each; no type of theirs could derive a schema. What is written here
//! is held to the readers by a test that asks every table which keys it knows.

/// Schema of `machine.toml` (JSON Schema, draft 2020-12).
pub const MACHINE: &str = include_str!("schema/machine.json");

/// Schema of `session.toml`. Its `#/$defs/machine` is [`MACHINE`], to be put in by who prints it.
pub const SESSION: &str = include_str!("schema/session.json");
