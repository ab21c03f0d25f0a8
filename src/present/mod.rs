//! Results as tables and texts that the terminal and the reports share.

pub mod effect;
pub mod method;
