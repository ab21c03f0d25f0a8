//! Many sessions and their history.

pub mod conformity;
pub mod history;
mod history_figures;
mod machines;
pub mod run;
mod short_series;
mod simulated;
