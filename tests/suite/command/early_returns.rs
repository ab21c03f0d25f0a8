//! The tests of the tests: none ends early without a word.
//!
//! A test that returns before its assertions passes whatever the program does. Each `return` of a test stands after a
//! question to `test_needs`, which records that the test is skipped and fails it in CI.

use std::path::{Path, PathBuf};

use crate::suite::workspace;

/// Functions of the tests that ask `test_needs`, by the beginning of their calls.
const ASKING: [&str; 8] = [
    "test_needs::",
    "data(",
    "sample(",
    "samples_exist(",
    "session_on_public_data(",
    "skipped(",
    "ur10(",
    // Programs of `examples/`.
    "output(\"",
];

/// Statements that leave a helper or a part of a loop, and no test.
const HELPERS: [&str; 3] = ["table(page, schema, &[]);", "machine_sign(axis)", "if language == \"text\" {"];

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Whether a line leaves a function without a value.
fn returns(line: &str) -> bool {
    let line = line.trim();
    line.starts_with("return;") || line.starts_with("return println!") || line.contains("else { return }")
}

/// The lines from the statement that decides on a `return`, which is less indented, to the `return`.
fn decision<'a>(lines: &'a [&'a str], at: usize) -> &'a [&'a str] {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let own = indent(lines[at]);
    let should_continue = |line: &str| line.is_empty() || line.starts_with('}') || line == "else {";
    let is_head = |line: &&&str| indent(line) < own && !should_continue(line.trim());
    let head = if lines[at].contains("else { return }") {
        at
    } else {
        at - 1 - lines[..at].iter().rev().position(|line| is_head(&line)).unwrap()
    };
    &lines[head..=at]
}

/// The `return`s of a file that no question to `test_needs` precedes, with their lines.
fn silent(text: &str) -> Vec<usize> {
    let lines: Vec<&str> = text.lines().collect();
    let known = |at: usize| {
        let decided = decision(&lines, at).join("\n");
        let before = lines[at.saturating_sub(1)];
        ASKING.iter().any(|call| decided.contains(call))
            || HELPERS.iter().any(|call| (before.to_string() + &decided).contains(call))
    };
    (0..lines.len()).filter(|at| returns(lines[*at]) && !known(*at)).map(|at| at + 1).collect()
}

#[test]
fn a_silent_return_is_recognised() {
    let body = |statement: &str| format!("#[test]\nfn a() {{\n{statement}\n    assert!(false);\n}}\n");
    for told in [
        "    let Some(tool) = test_needs::browser(\"a\") else { return };",
        "    let Some(tool) = test_needs::program(\"a\", &[\"tool\"], &[]) else {\n        return;\n    };",
        "    let Some(tool) = test_needs::browser(\"a\")\n    else {\n        return;\n    };",
        "    if skipped(\"a\") {\n        return;\n    }",
        "    if !has() {\n        test_needs::skip(\"a\", \"no tool\");\n        return;\n    }",
    ] {
        assert!(silent(&body(told)).is_empty(), "{told}");
    }
    for untold in [
        "    let Ok(tool) = std::env::var(\"TOOL\") else { return };",
        "    let Ok(tool) = std::env::var(\"TOOL\") else {\n        return;\n    };",
        "    if !Path::new(\"/usr/bin/tool\").exists() {\n        println!(\"no tool\");\n        return;\n    }",
    ] {
        assert_eq!(silent(&body(untold)).len(), 1, "{untold}");
    }
}

#[test]
fn no_test_returns_before_its_assertions_without_a_word() {
    let mut files = Vec::new();
    for folder in
        ["tests", "model/tests", "files/tests", "identify/tests", "trace/tests", "apply/tests", "codegen/tests"]
    {
        rust_files(&workspace().join(folder), &mut files);
    }
    assert!(files.len() > 100, "{files:?}");
    let mut found = Vec::new();
    for file in files.iter().filter(|file| !file.ends_with("suite/command/early_returns.rs")) {
        let text = std::fs::read_to_string(file).unwrap();
        found.extend(silent(&text).into_iter().map(|line| format!("{}:{line}", file.display())));
    }
    assert!(found.is_empty(), "tests that end early without `test_needs`: {found:#?}");
}
