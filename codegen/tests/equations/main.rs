//! Integration tests of the crate, one binary.

mod support;

mod chain;
