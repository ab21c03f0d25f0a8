//! Many sessions, histories and studies.

pub mod conformity;
pub mod history;
pub mod run;
pub mod study;
