//! Integration tests of the crate, one binary.

mod sessions;
mod support;

mod chain;
mod compiled;
mod effects;
mod forms;
mod held;
mod instruments;
mod julia;
mod named;
mod nc;
mod operators;
mod pages;
mod probe;
mod programs;
mod second;
mod seed000;
mod seed003;
mod tools;
mod topologies;
mod typeset;
