//! Tests of the command and of the library, in folders as the crates are.

mod apply;
mod codegen;
mod command;
mod fleet;
mod identify;
mod model;
mod plan;
mod report;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The workspace.
pub fn workspace() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A ready session of the workspace.
pub fn ready(name: &str) -> PathBuf {
    workspace().join("sessions").join(name)
}

/// Runs the command `abbe`.
pub fn abbe(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_abbe")).args(arguments).output().expect("the command starts")
}

/// Number of characters of the longest line, without the folder of a session, which printed commands name, and without the
/// spaces that align what they do.
pub fn widest(screen: &str, folder: &Path) -> usize {
    let screen = screen.replace(&format!("{}/", text(folder)), "");
    let width =
        |line: &str| line.split("  ").filter(|words| !words.is_empty()).map(|words| words.chars().count() + 2).sum();
    screen.lines().map(width).max().unwrap_or(0)
}

/// A path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().expect("a path of plain letters")
}
