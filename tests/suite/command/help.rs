//! Every example of the help texts runs.

use std::path::Path;
use std::process::Command;

use crate::suite::{abbe, workspace};

/// The lines of a help that begin with `abbe`.
fn examples(help: &str) -> Vec<String> {
    // A backslash at the end of a line continues it, as in a shell.
    help.replace("\\\n", "")
        .lines()
        .filter_map(|line| line.strip_prefix("  "))
        .filter(|line| line.starts_with("abbe ") && !line.contains("COMMAND"))
        .map(str::to_string)
        .collect()
}

/// Arguments separated as by a shell: at spaces outside quotes.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for letter in line.chars() {
        match letter {
            '"' => quoted = !quoted,
            ' ' if !quoted && words.last().unwrap().is_empty() => {}
            ' ' if !quoted => words.push(String::new()),
            letter => words.last_mut().unwrap().push(letter),
        }
    }
    words
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, &target).unwrap();
        }
    }
}

/// The commands that the help of `abbe` lists, each with its line.
fn listed(whole: &str) -> Vec<(&str, &str)> {
    let tasks = whole.lines().skip_while(|line| !line.starts_with("Usage:")).skip(1);
    let tasks = tasks.take_while(|line| !line.starts_with("Options:"));
    tasks.filter_map(|line| line.strip_prefix("  ")?.split_once(' ')).collect()
}

#[test]
fn the_help_lists_every_command_once_on_one_screen() {
    let whole = String::from_utf8(abbe(&["--help"]).stdout).unwrap();
    assert!(whole.lines().count() <= 50, "{} lines:\n{whole}", whole.lines().count());
    assert!(whole.lines().all(|line| line.chars().count() <= 110), "{whole}");
    let mut known: Vec<&str> = listed(&whole).iter().map(|(command, _)| *command).collect();
    assert!(listed(&whole).iter().all(|(_, about)| about.trim().len() > 20), "{whole}");
    // The completions name all commands, by clap itself.
    let script = String::from_utf8(abbe(&["completions", "fish"]).stdout).unwrap();
    let mut all: Vec<&str> = script
        .lines()
        .filter(|line| line.contains("__fish_abbe_needs_command") && line.contains(" -a \""))
        .filter_map(|line| line.split(" -a \"").nth(1)?.split('"').next())
        .filter(|command| *command != "help")
        .collect();
    known.sort_unstable();
    all.sort_unstable();
    assert_eq!(known, all);
}

#[test]
fn every_example_of_the_help_runs() {
    let help = |arguments: &[&str]| String::from_utf8(abbe(arguments).stdout).unwrap();
    let whole = help(&["--help"]);
    let commands: Vec<&str> = listed(&whole).into_iter().map(|(command, _)| command).collect();
    assert!(commands.len() >= 9, "{commands:?}");
    let mut lines = examples(&whole);
    assert!(lines.len() >= 6, "{whole}");
    // Some examples read the outputs of others: simulated readings come first.
    let mut later = Vec::new();
    for command in commands {
        let mut of_command = examples(&help(&[command, "--help"]));
        if command == "fleet" {
            of_command.extend(["run", "history"].iter().flat_map(|own| examples(&help(&["fleet", own, "--help"]))));
        }
        assert!(
            of_command.iter().any(|line| line.starts_with(&format!("abbe {command}"))),
            "abbe {command} --help has no example"
        );
        if ["new", "simulate"].contains(&command) {
            lines.extend(of_command);
        } else {
            later.extend(of_command);
        }
    }
    lines.extend(later);
    let folder = tempfile::tempdir().unwrap();
    copy(&workspace().join("sessions"), &folder.path().join("sessions"));
    // Files of the user that examples read.
    std::fs::write(folder.path().join("program.csv"), "x_mm,y_mm,z_mm,a_deg,c_deg\n10,20,30,40,50\n").unwrap();
    std::fs::write(folder.path().join("poses.csv"), "px_mm,py_mm,pz_mm,i,j,k\n10,20,30,0,0.6,0.8\n").unwrap();
    std::fs::copy(workspace().join("tests/robots/ur5e.urdf"), folder.path().join("robot.urdf")).unwrap();
    // A UR5e: a ball in sockets needs as many joints.
    let table = "a_mm,alpha_deg,d_mm,theta_deg\n0,90,162.5,0\n-425,0,0,0\n-392.2,0,0,0\n0,90,133.3,0\n0,-90,99.7,0\n0,0,99.6,0\n";
    std::fs::write(folder.path().join("robot.csv"), table).unwrap();
    std::fs::write(folder.path().join("laboratory.toml"), abbe::certificate::EXAMPLE).unwrap();
    for line in lines {
        let run = Command::new(env!("CARGO_BIN_EXE_abbe"))
            .args(&words(&line)[1..])
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(run.status.success(), "{line}: {}", String::from_utf8_lossy(&run.stderr));
    }
}

#[test]
fn completions_are_written_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = String::from_utf8(abbe(&["completions", shell]).stdout).unwrap();
        for word in ["volumetric", "template", "abbe"] {
            assert!(script.contains(word), "{shell} does not complete {word}");
        }
    }
    // bash accepts its completion script.
    let mut bash = Command::new("bash").arg("-n").stdin(std::process::Stdio::piped()).spawn().unwrap();
    std::io::Write::write_all(bash.stdin.as_mut().unwrap(), &abbe(&["completions", "bash"]).stdout).unwrap();
    assert!(bash.wait().unwrap().success());
}

/// A command is arguments, a call of the library, a report and its outputs. What all commands share is longer.
#[test]
fn the_file_of_a_command_has_at_most_400_lines() {
    // With the tests of all commands.
    const SHARED: [&str; 7] =
        ["failure.rs", "interrupt.rs", "mod.rs", "output.rs", "results.rs", "tests.rs", "values.rs"];
    let commands = workspace().join("src/cli");
    let shared: Vec<_> = SHARED.iter().map(|name| commands.join(name)).collect();
    let (mut folders, mut count) = (vec![commands], 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") && !shared.contains(&path) {
                let lines = std::fs::read_to_string(&path).unwrap().lines().count();
                assert!(lines <= 400, "{}: {lines} lines", path.display());
                count += 1;
            }
        }
    }
    assert!(count > 25, "{count} files");
}
