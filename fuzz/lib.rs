//! What the targets call: the readers of `abbe-model` and those of `abbe-identify`.

pub mod errors;
mod harness;

pub use harness::*;
