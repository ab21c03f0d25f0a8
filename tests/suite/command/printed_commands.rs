//! Every command that a screen prints runs, and one file name has one meaning on one screen.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::suite::{abbe, text, workspace};

/// Runs a command line in a folder, as a shell does.
fn shell(line: &str, folder: &Path) -> Output {
    let words = line.strip_prefix("abbe ").unwrap_or(line);
    let line = format!("{} {}", env!("CARGO_BIN_EXE_abbe"), words.replace("CONTROL", "linuxcnc"));
    Command::new("sh").arg("-c").arg(line).current_dir(folder).output().unwrap()
}

/// The commands of a screen, in order: at the beginning of a line, in backquotes, and after `nothing before`.
fn commands(screen: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for line in screen.lines() {
        let whole = line.trim_start().strip_prefix("abbe ").map(|rest| format!("abbe {rest}"));
        found.extend(whole.map(|line| line.split("  ").next().unwrap_or_default().to_string()));
        found.extend(line.split('`').skip(1).step_by(2).filter(|code| code.starts_with("abbe ")).map(str::to_string));
        let before = line.split_once("nothing before ").map(|(_, rest)| rest);
        found.extend(
            before.and_then(|rest| rest.split(',').next()).filter(|rest| rest.starts_with("abbe ")).map(str::to_string),
        );
    }
    let mut seen = std::collections::BTreeSet::new();
    found.retain(|command| seen.insert(command.clone()));
    found
}

/// The files that a command writes.
fn written(command: &str) -> Vec<String> {
    let words: Vec<&str> = command.split(' ').collect();
    let files = words.windows(2).filter(|pair| ["--write", "--out", "--next", "--report"].contains(&pair[0]));
    files.map(|pair| pair[1].to_string()).collect()
}

/// The screens of a session in a folder, and every command that they print. Returns their number.
fn every_printed_command_runs(folder: &Path, session: &str, of_trace: &str) -> usize {
    let mut count = 0;
    for verb in ["plan", "fit", "trace"] {
        // Each screen stands alone: what another one writes is not there.
        let own = tempfile::tempdir().unwrap();
        copy(folder, own.path());
        let more = if verb == "trace" { of_trace } else { "" };
        let screen = shell(&format!("abbe {verb} {session} {more}"), own.path());
        let said = String::from_utf8(screen.stderr).unwrap();
        if said.contains("has no readings") {
            continue;
        }
        assert!(screen.status.success(), "{verb} {session}: {said}");
        let screen = String::from_utf8(screen.stdout).unwrap() + &said;
        let commands = commands(&screen);
        assert!(!commands.is_empty(), "{verb} {session}: {screen}");
        let mut meaning: BTreeMap<String, &str> = BTreeMap::new();
        for command in &commands {
            for file in written(command) {
                let other = meaning.insert(file.clone(), command);
                assert!(other.is_none(), "{file}: `{command}` and `{}`", other.unwrap_or_default());
                assert!(!own.path().join(&file).exists(), "{file} exists before `{command}`");
            }
            let run = shell(command, own.path());
            let said = String::from_utf8_lossy(&run.stderr);
            assert!(run.status.success(), "{verb} {session} prints `{command}`, which fails: {said}\n{screen}");
            for file in written(command) {
                assert!(own.path().join(&file).exists(), "`{command}` of {verb} {session} writes no {file}: {said}");
            }
            count += 1;
        }
    }
    count
}

/// Copies a folder.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let there = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &there);
        } else {
            std::fs::copy(&path, &there).unwrap();
        }
    }
}

/// The session files below a folder, with their data.
fn sessions(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sessions(&path));
        } else if path.extension().is_some_and(|end| end == "toml") {
            let contents = std::fs::read_to_string(&path).unwrap();
            let data = contents.lines().filter_map(|line| line.trim().strip_prefix("data = \""));
            let has_data = |file: &str| path.with_file_name(file.split('"').next().unwrap()).exists();
            if contents.contains("[[test]]") && data.into_iter().all(has_data) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Of each bundled session, from a folder that is not its own. A search of some families takes less time than that of all.
fn of_bundled(name: &str, of_trace: &str) -> usize {
    let root = workspace().join("sessions").join(name);
    let folder = tempfile::tempdir().unwrap();
    copy(&root, &folder.path().join(name));
    let of = |path: &PathBuf| {
        let session = Path::new(name).join(path.strip_prefix(&root).unwrap());
        every_printed_command_runs(folder.path(), text(&session), of_trace)
    };
    sessions(&root).iter().map(of).sum()
}

#[test]
fn every_command_that_a_screen_of_a_bundled_session_prints_runs() {
    let root = workspace().join("sessions");
    let mut names: Vec<String> =
        std::fs::read_dir(&root).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let mut count = 0;
    for name in names.iter().filter(|name| root.join(name).is_dir()) {
        let only =
            if ["hermle-c600u", "r-test"].contains(&name.as_str()) { "--only EZC~C:h --only EAC~C:h" } else { "" };
        count += of_bundled(name, only);
    }
    println!("{count} commands");
    assert!(count > 100, "{count}");
}

/// A session without declared errors: what a trace finds is what a plan needs.
#[test]
fn a_plan_after_a_trace_knows_what_the_trace_found() {
    let folder = tempfile::tempdir().unwrap();
    let plan = workspace().join("sessions/laser/plan.toml");
    let run = folder.path().join("run");
    let truth = ["--effect", "EXX~X:p2.1=20um", "--effect", "EXX~X:p2.2=5um", "--seed", "3"];
    let made =
        abbe(&[&["simulate", text(&plan), "--out", text(&run), "--hide-effects", "--quiet"][..], &truth].concat());
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let only = "--only EXX~X:power --only EBX~X:power";
    let screen = String::from_utf8(shell(&format!("abbe trace session.toml {only}"), &run).stdout).unwrap();
    assert!(screen.contains("EXX~X"), "{screen}");
    let planned: Vec<String> = commands(&screen).into_iter().filter(|line| line.starts_with("abbe plan ")).collect();
    assert!(planned.iter().all(|line| line.contains("traced.toml")), "{screen}");
    assert!(every_printed_command_runs(&run, "session.toml", only) > 3);
}
