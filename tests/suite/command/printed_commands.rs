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

/// Runs a screen in a folder, and every command that it prints in a copy of it: what the commands of another screen write is
/// not there. Returns their number, `None` if the session has no readings.
fn printed_commands_run(line: &str, folder: &Path) -> Option<usize> {
    let screen = shell(line, folder);
    let said = String::from_utf8(screen.stderr).unwrap();
    if said.contains("has no readings") {
        return None;
    }
    assert!(screen.status.success(), "{line}: {said}");
    let screen = String::from_utf8(screen.stdout).unwrap() + &said;
    let commands = commands(&screen);
    let place = tempfile::tempdir().unwrap();
    copy(folder, place.path());
    let mut meaning: BTreeMap<String, &str> = BTreeMap::new();
    for command in &commands {
        for file in written(command) {
            let other = meaning.insert(file.clone(), command);
            assert!(other.is_none(), "{file} of {line}: `{command}` and `{}`", other.unwrap_or_default());
            assert!(!place.path().join(&file).exists(), "{file} of {line} exists before `{command}`");
        }
        let run = shell(command, place.path());
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{line} prints `{command}`, which fails: {said}\n{screen}");
        for file in written(command) {
            assert!(place.path().join(&file).exists(), "`{command}` of {line} writes no {file}: {said}");
        }
    }
    Some(commands.len())
}

/// The screens of a session in a folder, and every command that they print. Returns their number.
fn every_printed_command_runs(folder: &Path, session: &str, of_trace: &str) -> usize {
    let lines = ["plan", "fit", "trace"].map(|verb| match verb {
        "trace" => format!("abbe trace {session} {of_trace}"),
        verb => format!("abbe {verb} {session}"),
    });
    let counts = lines.iter().filter_map(|line| {
        let count = printed_commands_run(line, folder)?;
        assert!(count > 0, "{line} prints no command");
        Some(count)
    });
    counts.sum()
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

/// The commands in the comments of a session file. One may continue on the next line; a name alone, as `abbe trace`, is none.
fn in_comments(file: &Path) -> Vec<String> {
    let contents = std::fs::read_to_string(file).unwrap();
    let comments: Vec<&str> = contents.lines().filter_map(|line| line.strip_prefix("# ")).collect();
    let commands = commands(&comments.join(" ")).into_iter().filter(|command| command.contains(".toml"));
    commands.map(|command| command.replace(" --error …", "")).collect()
}

/// The screens that compare, validate, prepare, correct and show machines over time, and the comments of sessions: each
/// command runs with the options that its session needs, and two of one screen do not write one file.
#[test]
fn commands_of_further_screens_run() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let edit = |name: &str, old: &str, new: &str| {
        let contents = std::fs::read_to_string(place(name)).unwrap();
        assert!(contents.contains(old), "{old} in {contents}");
        std::fs::write(place(name), contents.replacen(old, new, 1)).unwrap();
    };
    let run = |lines: &[&str]| -> usize {
        lines.iter().map(|line| printed_commands_run(line, folder.path()).expect("the screen")).sum()
    };
    copy(&workspace().join("sessions"), folder.path());
    copy(&workspace().join("tests/foreign"), &place("foreign"));
    std::fs::copy(workspace().join("tests/robots/iiwa14.urdf"), place("robot.urdf")).unwrap();
    std::fs::write(place("program.csv"), "x_mm,y_mm,z_mm,a_deg,c_deg\n10,20,0,-5,90\n").unwrap();
    let effect = "[[effect]]\ncomponent = \"EY0A\"\ndriver = \"time\"\nshape = \"drift\"\n";
    copy(&place("hermle-c600u/measured"), &place("mill"));
    edit("mill/session.toml", "\n[[test]]", &format!("\n[about]\ndate = \"2024-01-01\"\n\n{effect}\n[[test]]"));
    run(&[
        "abbe simulate mill/session.toml --out before --hide-effects --draw-setups",
        "abbe simulate mill/session.toml --out after --hide-effects --draw-setups --seed 2 --error EY0A=20um",
        "abbe simulate mill/session.toml --out drift --hide-effects --effect EY0A~time:drift=10um/h",
        "abbe import foreign/units-line.txt --machine ur10/machine.toml --out arm",
        "abbe new mine --from-code '[wCXbYZAt]'",
        "abbe new robot --from-urdf robot.urdf",
        "abbe simulate robot/plan.toml --out poses",
    ]);
    // A second session beside another, one without its readings, and a robot of which a joint turns in the other sense.
    std::fs::copy(place("drift/session.toml"), place("drift/second.toml")).unwrap();
    std::fs::create_dir(place("apart")).unwrap();
    for name in ["session.toml", "machine.toml"] {
        std::fs::copy(place("drift").join(name), place("apart").join(name)).unwrap();
    }
    edit("arm/session.toml", "kind = \"tracker\"", "kind = \"tracker\"\nnoise_um = 50");
    let machine = std::fs::read_to_string(place("arm/machine.toml")).unwrap();
    let joint = &machine[machine.find("[axis.J4]").unwrap()..];
    edit("arm/machine.toml", joint, &joint.replacen("[0, -1, 0]", "[0, 1, 0]", 1));
    // Measured poses have the name that the comments of a plan give them.
    std::fs::rename(place("poses/J1.csv"), place("robot/poses.csv")).unwrap();
    std::fs::remove_dir_all(place("poses")).unwrap();
    let count = run(&[
        "abbe fit before/session.toml --save before.json",
        "abbe fit drift/session.toml --save drift.json",
        "abbe compare before/session.toml after/session.toml",
        "abbe compare before/session.toml drift/session.toml",
        "abbe compare before.json drift.json",
        "abbe compare drift/session.toml drift/second.toml",
        "abbe compare apart/session.toml after/session.toml --data drift",
        "abbe validate before.json after/session.toml",
        "abbe validate before.json apart/session.toml --data drift",
        "abbe compensate before.json program.csv --out corrected.csv",
        "abbe export before.json --as linuxcnc --out kinematics.csv",
        "abbe nc hermle-c600u/chapter4.toml --control linuxcnc --out linuxcnc",
        "abbe nc hermle-c600u/chapter4.toml --control siemens --out siemens",
        "abbe sheet hermle-c600u/chapter4.toml --control siemens --out sheets.html",
        "abbe fit arm/session.toml --allow-implausible",
        "abbe new",
        "abbe plan mine/plan.toml",
        "abbe plan robot/plan.toml",
        "abbe fleet run before after drift --out results --no-trace",
        "abbe fleet history results",
    ]);
    assert!(count >= 20, "{count}");
    for file in sessions(folder.path()) {
        for command in in_comments(&file) {
            let there = tempfile::tempdir().unwrap();
            copy(file.parent().unwrap(), there.path());
            let output = shell(&command, there.path());
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "`{command}` in {}: {said}", file.display());
        }
    }
}
