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

/// A file of tests that no module declares is not compiled: its tests are switched off without a word.
#[test]
fn every_file_is_a_module() {
    let mut folders = vec![workspace().join("tests/suite")];
    while let Some(folder) = folders.pop() {
        let beside = std::fs::read_to_string(folder.with_extension("rs")).unwrap_or_default();
        let declared = std::fs::read_to_string(folder.join("mod.rs")).unwrap_or_default() + &beside;
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap().to_string();
            let is_source = path.extension().is_some_and(|own| own == "rs") && name != "mod";
            assert!(!is_source || declared.contains(&format!("mod {name};")), "no module declares {}", path.display());
            if path.is_dir() {
                folders.push(path);
            }
        }
    }
}
