//! The WebAssembly module of the page: a folder of files in memory, and what the command does with it. Results are the
//! JSON documents and the reports of the command.
//!
//! - [`folder`]: files, and the sessions in them; [`mod@import`]: foreign files as a session; [`analysis`]: results;
//! - [`plan`]: a plan that changes while it is looked at;
//! - [`pool`]: the threads of the module;
//! - [`failed`]: errors with file, line and column.

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

mod analysis;
mod failed;
mod folder;
mod import;
mod plan;
mod pool;
