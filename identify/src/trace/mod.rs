//! Close the loop.

pub mod columns;
pub mod library;
pub mod moments;
