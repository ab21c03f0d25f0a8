//! The functions of the fuzz targets: readers of `abbe-files` and of `abbe-identify`.

pub mod errors;
mod harness;

pub use harness::*;
