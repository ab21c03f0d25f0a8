//! The command `abbe`.

mod cli;

use std::process::ExitCode;

use abbe::present;

fn main() -> ExitCode {
    cli::run()
}
