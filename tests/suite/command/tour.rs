//! The commands of docs/guide/tour.md print the output that the page shows.
//!
//! In each `console` block a line after `$ ` is a command, lines after `> ` continue it, and the following lines are
//! its output. A line `…` stands for any lines.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Stdio};

use crate::suite::workspace;

const ELLIPSIS: &str = "…";

/// A command of the tour and the output that the page shows.
struct TourCommand {
    line: usize,
    command: String,
    shown: Vec<String>,
}

/// The commands of all `console` blocks, in order.
fn steps(document: &str) -> Vec<TourCommand> {
    let mut steps: Vec<TourCommand> = Vec::new();
    let mut inside = false;
    for (index, line) in document.lines().enumerate() {
        if line.starts_with("```") {
            inside = line == "```console";
            continue;
        }
        if !inside {
            continue;
        }
        if let Some(command) = line.strip_prefix("$ ") {
            steps.push(TourCommand { line: index + 1, command: command.to_string(), shown: Vec::new() });
            continue;
        }
        let step = steps.last_mut().expect("a block begins with a command");
        // An empty line of a here-document is `>` without a space.
        match line.strip_prefix('>') {
            Some(more) if step.shown.is_empty() => {
                step.command.push('\n');
                step.command.push_str(more.strip_prefix(' ').unwrap_or(more));
            }
            _ => step.shown.push(line.trim_end().to_string()),
        }
    }
    steps
}

/// Whether `printed` equals `shown`, where `…` stands for any lines.
fn matches_output(shown: &[String], printed: &[String]) -> bool {
    match shown.split_first() {
        None => printed.is_empty(),
        Some((first, rest)) if first == ELLIPSIS => {
            (0..=printed.len()).any(|skipped| matches_output(rest, &printed[skipped..]))
        }
        Some((first, rest)) => printed.first() == Some(first) && matches_output(rest, &printed[1..]),
    }
}

/// The output of a command in `folder`, and whether it succeeded.
fn run_in(command: &str, folder: &Path) -> (Vec<String>, bool) {
    let program = Path::new(env!("CARGO_BIN_EXE_abbe"));
    let path = std::env::var("PATH").unwrap_or_default();
    let run = Command::new("sh")
        .arg("-c")
        .arg(format!("exec 2>&1\n{command}"))
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", program.parent().unwrap().display()))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let printed = String::from_utf8(run.stdout).unwrap();
    let lines = printed.lines().map(|line| line.trim_end().to_string());
    (lines.collect(), run.status.success())
}

#[test]
fn the_tour_shows_the_output_of_its_commands() {
    let document = std::fs::read_to_string(workspace().join("docs/guide/tour.md")).unwrap();
    let steps = steps(&document);
    let commands = ["new", "plan", "nc", "sheet", "simulate", "fit", "trace"];
    for command in commands.map(|command| format!("abbe {command} ")) {
        assert!(steps.iter().any(|step| step.command.starts_with(&command)), "{command}");
    }
    let folder = tempfile::tempdir().unwrap();
    for TourCommand { line, command, shown } in steps {
        let (printed, success) = run_in(&command, folder.path());
        assert!(
            matches_output(&shown, &printed),
            "docs/guide/tour.md:{line}: {command}\nprints\n{}\nand not\n{}",
            printed.join("\n"),
            shown.join("\n")
        );
        let fails = shown.iter().any(|line| line.to_lowercase().starts_with("error:"));
        assert_eq!(success, !fails, "docs/guide/tour.md:{line}: {command}");
    }
    for file in ["programs/main.ngc", "sheets.html", "trace.html", "export/next.toml"] {
        assert!(folder.path().join(file).exists(), "{file}");
    }
}

#[test]
fn an_ellipsis_matches_any_lines_and_nothing_else_does() {
    let lines = |text: &str| text.lines().map(str::to_string).collect::<Vec<_>>();
    let printed = lines("a\nb\nc\nd");
    for shown in ["a\nb\nc\nd", "a\n…\nd", "…\nc\n…", "a\nb\n…\nc\nd", "…"] {
        assert!(matches_output(&lines(shown), &printed), "{shown}");
    }
    for shown in ["a\nb\nc", "a\n…\nc", "…\nb\nd", "", "a\n…\nd\n…\nd"] {
        assert!(!matches_output(&lines(shown), &printed), "{shown}");
    }
}
