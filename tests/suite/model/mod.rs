//! Files, sessions, machines and instruments: what is read, and what is said about bad input.

pub mod bad_input;
pub mod bodies;
pub mod effect_description;
pub mod field_files;
pub mod import;
pub mod input_checksums;
pub mod limits;
pub mod long_input;
pub mod messages;
pub mod mutated_inputs;
pub mod properties;
pub mod robot_files;
pub mod schema;
pub mod schema_limits;
pub mod unknowns;
