//! Abbe: a modelling workspace for the geometric errors of machine tools and other serial chains.
//!
//! The facade of three crates: [`model`] (chain, effects, instruments, sessions), [`identify`] (fit, trace, simulate) and [`codegen`] (closed
//! forms). The command `abbe` is built on the same.

pub use abbe_codegen as codegen;
pub use abbe_identify as identify;
pub use abbe_model as model;
