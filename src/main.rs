//! The command `abbe`.

mod cli;
mod present;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
