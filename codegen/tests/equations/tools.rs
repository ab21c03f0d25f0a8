//! Compilers and interpreters that may be missing on a machine.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Whether a missing tool fails a test: on a build server, which installs the tools.
fn required() -> bool {
    std::env::var("CI").is_ok_and(|value| value == "true")
}

/// The first program that runs with these arguments.
pub fn first(programs: &[&str], probe: &[&str]) -> Option<PathBuf> {
    let named = programs.iter().filter(|program| !program.is_empty());
    let mut running = named.filter(|program| {
        let ran = Command::new(program).args(probe).output();
        ran.is_ok_and(|output| output.status.success())
    });
    running.next().map(PathBuf::from)
}

/// The first program that runs with these arguments. Without one, the test is skipped with a message, or fails if tools
/// are required.
pub fn find(test: &str, programs: &[&str], probe: &[&str]) -> Option<PathBuf> {
    let found = first(programs, probe);
    if found.is_none() {
        assert!(!required(), "{test}: none of {programs:?} runs");
        eprintln!("skipped {test}: none of {programs:?} runs");
    }
    found
}

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
