//! Models compared, exported and compensated.

pub mod compare_figures;
pub mod compare_judged;
pub mod compensation;
pub mod model_commands;
pub mod volumetric;
