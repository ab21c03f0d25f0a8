//! The integration tests of the workspace, in one binary. The independent machine that they measure is in `plant`.

mod plant;
mod study;
mod suite;
