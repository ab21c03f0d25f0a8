//! Equations and programs, run by other languages and interpreters.

pub mod codes;
pub mod equation_command;
pub mod equation_effects;
pub mod generated;
pub mod nc;
