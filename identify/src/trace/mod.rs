//! Close the loop.

pub mod columns;
pub mod library;
pub mod moments;
pub mod score;
pub mod search;
pub mod null;
pub mod alias;
