//! Killed at any time, `abbe` leaves the old file or the complete new one.
//!
//! `ABBE_KILLS` is the number of kills (24 by default). Half of them occur at a random time of the run, half within a
//! few milliseconds after the first output file appears.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::suite::command::faults::TestFolder;

/// The commands, with the files and folders that each writes.
const COMMANDS: [(&str, &[&str]); 3] = [
    (
        "fit session.toml --json out.json --csv out.csv --report out.html --plots plots --quiet",
        &["out.json", "out.csv", "out.html"],
    ),
    (
        "trace session.toml --json out.json --write session.next.toml --csv out.csv --report out.html --quiet",
        &["out.json", "session.next.toml", "out.csv", "out.html"],
    ),
    (
        "simulate session.toml --out run --force --seed 2 --json out.json",
        &["out.json", "run/session.toml", "run/XY.csv"],
    ),
];

type Files = BTreeMap<String, Vec<u8>>;

/// Every file below a folder, by its relative name.
fn files(folder: &Path) -> Files {
    fn add(folder: &Path, before: &str, files: &mut Files) {
        for entry in fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{before}{}", entry.file_name().to_str().unwrap());
            if entry.path().is_dir() {
                add(&entry.path(), &format!("{name}/"), files);
            } else {
                files.insert(name, fs::read(entry.path()).unwrap());
            }
        }
    }
    let mut found = Files::new();
    add(folder, "", &mut found);
    found
}

/// The folder before the command.
fn prepared(outputs: &[&str]) -> TestFolder {
    let place = TestFolder::new();
    for name in outputs {
        if name.starts_with("run/") {
            fs::create_dir_all(place.at("run")).unwrap();
        }
        place.put(name, &format!("old {name}"));
    }
    place
}

fn start(place: &TestFolder, command: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_abbe"))
        .args(command.split(' '))
        .current_dir(place.0.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Whether a name is that of a temporary file or folder that a killed program leaves behind.
fn is_temporary(name: &str) -> bool {
    name.split('/').any(|part| part.starts_with(".tmp") || part.starts_with(".abbe-"))
}

/// Asserts that each file is the old or the complete new one. Returns the number of new files.
fn whole(found: &Files, old: &Files, new: &Files, command: &str) -> usize {
    for (name, bytes) in found.iter().filter(|(name, _)| !is_temporary(name)) {
        assert!(
            old.get(name) == Some(bytes) || new.get(name) == Some(bytes),
            "{command}: {name} is neither the old file nor the whole new one ({} bytes)",
            bytes.len()
        );
    }
    assert!(old.keys().all(|name| found.contains_key(name)), "{command}: a file is gone");
    // The folder of plots appears in one step.
    let plots = |files: &Files| files.keys().filter(|name| name.starts_with("plots/")).count();
    assert!([0, plots(new)].contains(&plots(found)), "{command}: {} plots", plots(found));
    found.iter().filter(|(name, bytes)| new.get(*name) == Some(*bytes) && old.get(*name) != Some(*bytes)).count()
}

#[test]
fn a_killed_program_leaves_old_files_or_complete_new_ones() {
    let kills: usize = std::env::var("ABBE_KILLS").map_or(24, |text| text.parse().expect("ABBE_KILLS is a number"));
    let mut random = Pcg64Mcg::seed_from_u64(9);
    let (mut before, mut between, mut after) = (0, 0, 0);
    for (index, (command, outputs)) in COMMANDS.into_iter().enumerate() {
        let untouched = prepared(outputs);
        let old = files(untouched.0.path());
        let began = Instant::now();
        assert!(start(&untouched, command).wait().unwrap().success(), "{command}");
        let whole_run = began.elapsed();
        let new = files(untouched.0.path());
        let written = new.iter().filter(|(name, bytes)| old.get(*name) != Some(*bytes)).count();
        assert!(written >= outputs.len() && !new.keys().any(|name| is_temporary(name)), "{command}: {:?}", new.keys());
        for number in (index..kills).step_by(COMMANDS.len()) {
            let place = prepared(outputs);
            let names = place.names();
            let mut child = start(&place, command);
            if number % 2 == 0 {
                std::thread::sleep(whole_run.mul_f64(random.random_range(0.0..1.1)));
            } else {
                while place.names() == names && child.try_wait().unwrap().is_none() {
                    std::thread::sleep(Duration::from_micros(100));
                }
                std::thread::sleep(Duration::from_micros(random.random_range(0..5000)));
            }
            child.kill().unwrap();
            child.wait().unwrap();
            match whole(&files(place.0.path()), &old, &new, command) {
                0 => before += 1,
                all if all == written => after += 1,
                _ => between += 1,
            }
        }
    }
    println!("{kills} kills: {before} before the first file was there, {between} between, {after} after the last");
}
