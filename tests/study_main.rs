//! The plant and the study of trace on it.

mod plant;
mod study;
