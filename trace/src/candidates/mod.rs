//! Candidate effects: the members of the library that a session permits, their columns in the readings, and their gain
//! in addition to a model. A plan and a trace use them.

pub(crate) mod candidate;
pub mod columns;
pub(crate) mod gain;
pub(crate) mod gram;
pub mod library;
pub mod named;
mod null_scores;
pub(crate) mod sampling;
pub(crate) mod step_table;
pub(crate) mod tuned;

#[cfg(test)]
mod tests;
