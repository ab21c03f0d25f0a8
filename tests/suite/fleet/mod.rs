//! Many sessions and their history.

pub mod conformity;
pub mod history;
pub mod run;
