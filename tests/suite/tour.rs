//! The guided tour prints what it says it prints.
//!
//! In each `console` block of docs/guide/tour.md a line after `$ ` is a command, lines after `> ` go on with it, and what follows is
//! what a reader sees; `…` alone in a line stands for any lines.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Stdio};

use super::workspace;

const LEFT_OUT: &str = "…";

/// A command of the tour and what it says that it prints.
struct Step {
    line: usize,
    command: String,
    shown: Vec<String>,
}

/// The commands of all `console` blocks, in order.
fn steps(document: &str) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
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
            steps.push(Step {
                line: index + 1,
                command: command.to_string(),
                shown: Vec::new(),
            });
            continue;
        }
        let step = steps.last_mut().expect("a block begins with a command");
        // An empty line of a here-document is `>` without its space.
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

/// Whether `printed` is what is `shown`, any lines standing for `…`.
fn agrees(shown: &[String], printed: &[String]) -> bool {
    match shown.split_first() {
        None => printed.is_empty(),
        Some((first, rest)) if first == LEFT_OUT => {
            (0..=printed.len()).any(|skipped| agrees(rest, &printed[skipped..]))
        }
        Some((first, rest)) => printed.first() == Some(first) && agrees(rest, &printed[1..]),
    }
}

/// What a reader sees who types the command in `folder`, and whether it succeeded.
fn typed(command: &str, folder: &Path) -> (Vec<String>, bool) {
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
fn the_tour_prints_what_it_shows() {
    let document = std::fs::read_to_string(workspace().join("docs/guide/tour.md")).unwrap();
    let steps = steps(&document);
    let commands = ["new", "plan", "simulate", "fit", "trace"];
    for command in commands.map(|command| format!("abbe {command} ")) {
        assert!(
            steps.iter().any(|step| step.command.starts_with(&command)),
            "{command}"
        );
    }
    let folder = tempfile::tempdir().unwrap();
    for Step { line, command, shown } in steps {
        let (printed, success) = typed(&command, folder.path());
        assert!(
            agrees(&shown, &printed),
            "docs/guide/tour.md:{line}: {command}\nprints\n{}\nand not\n{}",
            printed.join("\n"),
            shown.join("\n")
        );
        let fails = shown.iter().any(|line| line.to_lowercase().starts_with("error:"));
        assert_eq!(success, !fails, "docs/guide/tour.md:{line}: {command}");
    }
    for file in ["trace.html", "export/next.toml"] {
        assert!(folder.path().join(file).exists(), "{file}");
    }
}

#[test]
fn left_out_lines_are_any_and_no_others() {
    let lines = |text: &str| text.lines().map(str::to_string).collect::<Vec<_>>();
    let printed = lines("a\nb\nc\nd");
    for shown in ["a\nb\nc\nd", "a\n…\nd", "…\nc\n…", "a\nb\n…\nc\nd", "…"] {
        assert!(agrees(&lines(shown), &printed), "{shown}");
    }
    for shown in ["a\nb\nc", "a\n…\nc", "…\nb\nd", "", "a\n…\nd\n…\nd"] {
        assert!(!agrees(&lines(shown), &printed), "{shown}");
    }
}
