//! The command `abbe`.

mod cli;
mod present;
mod report;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
