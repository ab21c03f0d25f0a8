//! `abbe completions`: what a shell completes.

use abbe::model::Diagnostic;
use clap::Args;

use super::{Global, output, parser};

/// An example of `abbe completions`.
pub const HELP: &str = "Example:
  abbe completions bash

Save the output where the shell finds it: ~/.local/share/bash-completion/completions/abbe (bash), a folder of $fpath as _abbe (zsh),
~/.config/fish/completions/abbe.fish (fish).";

/// `abbe completions SHELL`
#[derive(Args)]
pub struct CompletionArguments {
    /// The shell.
    shell: clap_complete::Shell,
}

/// Runs `abbe completions`.
pub fn run(arguments: &CompletionArguments, _: Global) -> Result<(), Diagnostic> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut parser(), "abbe", &mut script);
    output::whole(String::from_utf8_lossy(&script).trim_end());
    Ok(())
}
