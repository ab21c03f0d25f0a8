//! The integration tests of the workspace, in one binary. `plant` is the independent simulator whose sessions they
//! read.

mod plant;
mod study;
mod suite;
