//! Robots from the files of their makers: a serial chain, its machine file and a session to start from.
//!
//! - [`urdf`]: the Unified Robot Description Format of ROS; [`dh`]: tables of Denavit–Hartenberg parameters;
//! - [`chain`]: what both describe; `files`: `machine.toml` and `plan.toml`.

pub mod chain;
pub mod dh;
mod files;
pub mod urdf;

pub use files::{Measured, files};
