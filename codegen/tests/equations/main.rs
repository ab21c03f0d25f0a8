//! Integration tests of the crate, one binary.

mod support;

mod chain;
mod seed000;
mod seed003;
