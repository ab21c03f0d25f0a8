//! Files and runs of compilers and interpreters.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A new folder for a test's files.
pub fn folder(test: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("abbe-codegen-{}-{test}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    folder
}

/// Writes a file.
pub fn write(path: &Path, text: &str) {
    std::fs::write(path, text).expect("a file in a temporary folder");
}

/// Runs a command that must succeed without output on standard error, and returns its output.
pub fn run(command: &mut Command) -> String {
    let output = command.output().expect("a command that starts");
    let error = String::from_utf8_lossy(&output.stderr);
    // Octave without a terminal prints this message at exit, whatever the script.
    let error: String = error.lines().filter(|line| !line.contains("while preparing to exit")).collect();
    assert!(output.status.success(), "{command:?}: {error}");
    assert!(error.trim().is_empty(), "{command:?}: {error}");
    String::from_utf8(output.stdout).expect("text")
}

/// Rows of numbers.
pub fn rows(text: &str) -> Vec<Vec<f64>> {
    let number = |word: &str| word.parse::<f64>().expect("a number");
    text.lines()
        .filter(|line| !line.trim().is_empty())
        .map(|line| line.split_whitespace().map(number).collect())
        .collect()
}

/// Numbers on a line, exact to the last bit.
pub fn line(numbers: impl IntoIterator<Item = f64>) -> String {
    let words: Vec<String> = numbers.into_iter().map(|number| format!("{number:?}")).collect();
    words.join(" ")
}
