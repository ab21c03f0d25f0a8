//! The command as a program: help, files, signals, faults, kept answers.

pub mod analyses;
pub mod another_build;
pub mod early_returns;
pub mod examples;
pub mod faults;
pub mod help;
pub mod interrupted;
pub mod kept;
pub mod kill;
pub mod new;
pub mod printed_commands;
pub mod repeatability;
pub mod standard_output;
pub mod supply_chain;
pub mod tour;
