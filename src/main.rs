//! The command `abbe`.

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

mod cli;

use std::process::ExitCode;

use abbe::{printers, report};

fn main() -> ExitCode {
    cli::run()
}
