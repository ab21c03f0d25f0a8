//! `abbe fleet run`: results of many sessions are kept, whatever happens to some of them or to the program.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use abbe::fleet::record::Record;
use serde_json::Value;

use crate::suite::abbe;
use crate::suite::command::faults::TestFolder;

/// Small sessions in folders of one place, each with its machine, date and a bar of its own.
pub(in crate::suite) fn fleet(count: usize, about: impl Fn(usize) -> String) -> TestFolder {
    let place = TestFolder::new();
    let (session, data) = (read(&place.at("session.toml")), read(&place.at("circle.csv")));
    fs::remove_file(place.at("session.toml")).unwrap();
    for k in 0..count {
        let folder = place.at(&format!("fleet/s{k:02}"));
        fs::create_dir_all(&folder).unwrap();
        let own = session.replace("bar_mm = 100.0", &format!("bar_mm = 100.00{k:02}"));
        fs::write(folder.join("session.toml"), format!("[about]\n{}\n{own}", about(k))).unwrap();
        fs::write(folder.join("circle.csv"), &data).unwrap();
    }
    place
}

pub(in crate::suite) fn monthly(k: usize) -> String {
    format!("serial_number = \"M{}\"\ndate = 20{:02}-{:02}-05", k % 2, 20 + k / 24, k / 2 % 12 + 1)
}

pub(in crate::suite) fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

/// Runs `abbe fleet run` in the place; returns its summary.
pub(in crate::suite) fn run(place: &TestFolder, arguments: &str) -> Value {
    let output = place.shell(&format!("abbe fleet run fleet --out results --json summary.json {arguments}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&read(&place.at("summary.json"))).unwrap()
}

/// Every file below a folder with its contents.
pub(in crate::suite) fn files(folder: &Path) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().display().to_string(), read(&path));
            }
        }
    }
    found
}

#[test]
fn a_second_run_computes_what_is_missing_or_changed() {
    let place = fleet(6, monthly);
    let first = run(&place, "--no-trace");
    assert_eq!((&first["computed"], &first["kept"]), (&6.into(), &0.into()));
    let results = files(&place.at("results"));
    let second = run(&place, "--no-trace");
    assert_eq!((&second["computed"], &second["kept"]), (&0.into(), &6.into()));
    assert_eq!(files(&place.at("results")), results);

    // A missing, a damaged and a changed one.
    let names: Vec<&String> = results.keys().filter(|name| name.starts_with("results/")).collect();
    fs::remove_file(place.at("results").join(names[0])).unwrap();
    fs::write(place.at("results").join(names[1]), &results[names[1]][..40]).unwrap();
    let third = run(&place, "--no-trace");
    assert_eq!(third["computed"], 2);
    assert_eq!(files(&place.at("results")), results);
    let data = place.at("fleet/s03/circle.csv");
    fs::write(&data, read(&data).replacen("100.0", "100.1", 1)).unwrap();
    assert_eq!(run(&place, "--no-trace")["computed"], 1);
    // Other options are other results; the first ones remain.
    assert_eq!(run(&place, "--max-effects 1 --only EC")["computed"], 6);
    assert_eq!(run(&place, "--no-trace")["computed"], 0);
}

#[test]
fn results_do_not_depend_on_threads_or_order() {
    let place = fleet(6, monthly);
    run(&place, "--only EX --threads 2");
    let own = place.shell(
        "abbe fleet run fleet/s05 fleet/s01/session.toml fleet/s00 fleet/s04 fleet/s03 fleet/s02 --only EX --out other",
    );
    assert!(own.status.success());
    let keys = |folder: &str| -> BTreeMap<String, String> { files(&place.at(folder).join("results")) };
    assert_eq!(keys("results"), keys("other"));
    assert_eq!(keys("results").len(), 6);
    // The parts of an array of jobs are disjoint and complete.
    for (part, count) in [("1/4", 2), ("2/4", 2), ("3/4", 1), ("4/4", 1)] {
        let output = place.shell(&format!("abbe fleet run fleet --only EX --part {part} --out parts --json part.json"));
        assert!(output.status.success());
        let summary: Value = serde_json::from_str(&read(&place.at("part.json"))).unwrap();
        assert_eq!(summary["computed"], count, "{part}");
    }
    assert_eq!(keys("results"), keys("parts"));
}

#[test]
fn a_session_that_fails_is_a_row() {
    let place = fleet(4, monthly);
    fs::write(place.at("fleet/s01/circle.csv"), "run,x_mm,y_mm,length_mm\n1,0,0,many\n").unwrap();
    fs::remove_file(place.at("fleet/s02/circle.csv")).unwrap();
    let summary = run(&place, "--no-trace");
    assert_eq!((&summary["sessions"], &summary["computed"]), (&4.into(), &4.into()));
    let failed: Vec<&str> =
        summary["failed"].as_array().unwrap().iter().map(|one| one["message"].as_str().unwrap()).collect();
    assert!(failed[0].contains("circle.csv:2") && failed[0].contains("many"), "{failed:?}");
    assert!(failed[1].contains("circle.csv"), "{failed:?}");
    // The file comes back: only its session is computed.
    fs::copy(place.at("fleet/s00/circle.csv"), place.at("fleet/s02/circle.csv")).unwrap();
    let summary = run(&place, "--no-trace");
    assert_eq!((&summary["computed"], summary["failed"].as_array().unwrap().len()), (&1.into(), 1));
}

#[test]
fn every_record_is_described_by_its_schema() {
    let place = fleet(3, monthly);
    fs::remove_file(place.at("fleet/s02/circle.csv")).unwrap();
    run(&place, "");
    let printed = abbe(&["schema", "record"]);
    let schema: Value = serde_json::from_slice(&printed.stdout).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    for (name, contents) in files(&place.at("results/results")) {
        let record: Value = serde_json::from_str(&contents).unwrap();
        let faults: Vec<String> = validator.iter_errors(&record).map(|fault| fault.to_string()).collect();
        assert!(faults.is_empty(), "{name}: {faults:?}");
        assert_eq!(name, format!("{}/{}.json", &record["key"].as_str().unwrap()[..2], record["key"].as_str().unwrap()));
        assert_eq!(record["tool_version"], abbe::fleet::BUILD);
        // Nothing is lost where a history reads it again.
        let read: Record = serde_json::from_str(&contents).unwrap();
        assert_eq!(serde_json::to_value(&read).unwrap(), record);
        assert_eq!(record["model"].is_null(), !record["error"].is_null());
    }
}

/// The checksum of the sources, by the tools of the system: names and contents of the files in the order of the names,
/// after the crates of the registry.
#[test]
#[cfg(target_os = "linux")]
fn the_build_is_known_by_its_sources() {
    let script = r#"
        awk 'BEGIN { RS = "\\[\\[package\\]\\]"; ORS = "" } /\nchecksum = / { print }' Cargo.lock
        find model/src files/src identify/src trace/src src/fleet -type f ! -name '.*' | LC_ALL=C sort | while read -r name; do
            printf '%s\n' "$name"
            printf "$(sha256sum "$name" | cut -c1-64 | sed 's/../\\x&/g')"
        done"#;
    let line = format!("({script}) | sha256sum | cut -c1-12");
    let output = Command::new("bash").args(["-c", &line]).current_dir(crate::suite::workspace()).output().unwrap();
    let digits = String::from_utf8(output.stdout).unwrap();
    assert_eq!(abbe::fleet::BUILD, format!("{}+{}", env!("CARGO_PKG_VERSION"), digits.trim()));
}

/// The number of results below a folder, by their names alone: a temporary file may be gone before it is read.
fn results_below(folder: &Path) -> usize {
    let paths = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_result = |path: &Path| path.extension().is_some_and(|extension| extension == "json");
    paths.map(|path| if path.is_dir() { results_below(&path) } else { usize::from(is_result(&path)) }).sum()
}

#[test]
fn a_killed_run_is_continued() {
    let place = fleet(12, monthly);
    let count = || results_below(&place.at("results/results"));
    for _ in 0..2 {
        let before = count();
        let mut child = Command::new(env!("CARGO_BIN_EXE_abbe"))
            .args(["fleet", "run", "fleet", "--out", "results", "--only", "EX", "--quiet"])
            .current_dir(place.0.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        while count() <= before && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!((1..12).contains(&count()), "{} of 12 sessions done", count());
    let whole = |name: &String| name.ends_with(".json");
    let done = if place.at("results/results").is_dir() { files(&place.at("results/results")) } else { BTreeMap::new() };
    let done = done.keys().filter(|name| whole(name)).count();
    let summary = run(&place, "--only EX");
    assert_eq!(summary["computed"], 12 - done, "only what was missing is computed");
    let results = files(&place.at("results"));
    for (name, contents) in results.iter().filter(|(name, _)| whole(name)) {
        assert!(serde_json::from_str::<Value>(contents).is_ok(), "{name} is half");
    }
    let count = |kind: &str| results.keys().filter(|name| whole(name) && name.starts_with(kind)).count();
    assert_eq!([count("results/"), count("sessions/")], [12, 12]);
}

/// Starts `abbe fleet run` on the folder.
fn start(place: &TestFolder, summary: &str) -> std::process::Child {
    Command::new(env!("CARGO_BIN_EXE_abbe"))
        .args(["fleet", "run", "fleet", "--out", "results", "--only", "EX", "--quiet", "--json", summary])
        .current_dir(place.0.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Two processes share the sessions: each is analysed once, both summaries list all, and the results are those of one
/// process.
#[test]
fn two_runs_on_one_folder_share_the_work() {
    let place = fleet(16, monthly);
    let mut children = [start(&place, "a.json"), start(&place, "b.json")];
    assert!(children.iter_mut().all(|child| child.wait().unwrap().success()));
    let summaries: Vec<Value> =
        ["a.json", "b.json"].map(|name| serde_json::from_str(&read(&place.at(name))).unwrap()).into();
    let number = |summary: &Value, key: &str| summary[key].as_u64().unwrap();
    assert_eq!(summaries.iter().map(|summary| number(summary, "computed")).sum::<u64>(), 16, "{summaries:?}");
    for summary in &summaries {
        assert_eq!(number(summary, "computed") + number(summary, "kept"), 16, "{summary}");
    }
    let shared = files(&place.at("results"));
    fs::rename(place.at("results"), place.at("shared")).unwrap();
    assert!(start(&place, "one.json").wait().unwrap().success());
    assert_eq!(files(&place.at("results")), shared);
}

/// A claim is a lock. While another process holds it, a run waits; without its process it holds no longer.
#[test]
fn a_claim_ends_with_its_process() {
    let place = fleet(1, monthly);
    assert!(start(&place, "one.json").wait().unwrap().success());
    let record = files(&place.at("results/results")).into_keys().next().unwrap();
    let record = place.at("results/results").join(record);
    let whole = read(&record);
    fs::remove_file(&record).unwrap();
    let claim = record.with_file_name(format!(".{}.claim", record.file_stem().unwrap().to_str().unwrap()));
    let held = fs::File::create(&claim).unwrap();
    held.lock().unwrap();
    let mut child = start(&place, "two.json");
    // The progress of the waiting process cannot be seen from outside; it must not end.
    std::thread::sleep(Duration::from_millis(1500));
    assert!(child.try_wait().unwrap().is_none() && !record.exists(), "the run did not wait");
    drop(held);
    assert!(child.wait().unwrap().success());
    assert_eq!(read(&record), whole);
    assert!(!claim.exists());
    // The claim of a process that was killed, and its temporary file.
    fs::remove_file(&record).unwrap();
    fs::write(&claim, "").unwrap();
    fs::write(record.with_file_name(".abbe-aBcD12aBcD12aBcD.tmp"), "half").unwrap();
    assert!(start(&place, "three.json").wait().unwrap().success());
    assert_eq!(files(&place.at("results/results")).len(), 1);
    assert_eq!(read(&record), whole);
}

/// Records that no `abbe` wrote: a device without an end, a pipe, a folder. They count as missing.
#[test]
#[cfg(target_os = "linux")]
fn an_endless_record_counts_as_missing() {
    let place = fleet(3, monthly);
    run(&place, "--no-trace");
    let results = files(&place.at("results"));
    let names: Vec<&String> = results.keys().filter(|name| name.starts_with("results/")).collect();
    for (name, line) in names.iter().zip(["ln -s /dev/zero", "mkfifo", "ln -s ."]) {
        fs::remove_file(place.at("results").join(name)).unwrap();
        assert!(place.shell(&format!("{line} results/{name}")).status.success());
    }
    let output = place.shell("ulimit -v 1500000; timeout 60 abbe fleet history results");
    assert!(output.status.success(), "{:?}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    let output = place.shell(
        "rm results/results/*/*.json; ulimit -v 1500000; timeout 60 abbe fleet run fleet --out results --no-trace",
    );
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(files(&place.at("results")), results);
}

#[test]
fn a_full_disk_ends_the_run_and_keeps_results() {
    let place = fleet(4, monthly);
    run(&place, "--no-trace");
    let results = files(&place.at("results"));
    let output =
        place.shell("trap '' XFSZ; ulimit -f 0; exec abbe fleet run fleet --out results --max-effects 1 --quiet");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(message.contains("cannot be written") && message.contains("finished results are kept"), "{message}");
    assert_eq!(files(&place.at("results")), results);
}

#[test]
fn unusable_requests_are_named() {
    let place = fleet(1, monthly);
    for (line, expected) in [
        ("abbe fleet run --out results", "SESSION"),
        ("abbe fleet run missing.toml --out session.csv --threads 0", "--threads"),
        ("mkdir empty; abbe fleet run empty --out results", "no session.toml lies in this folder"),
        ("abbe fleet run fleet flet --out results", "flet: neither a session file nor a folder is there"),
        ("abbe fleet run fleet --out results --part 5/4", "expected a part"),
        ("abbe fleet run fleet --out results --models nowhere", "name the folder of the saved models"),
        ("abbe fleet run --sessions nowhere.txt --out results", "nowhere.txt: cannot be read"),
        ("abbe fleet history nowhere", "no results of `abbe fleet run` are there"),
        (
            "abbe fleet run fleet --out results --no-trace -q; abbe fleet history results --machine-id X",
            "no session of the machine `X`",
        ),
        (
            "echo 'a,b' > c.csv; echo '1,2' >> c.csv; abbe fleet history results --known-changes c.csv",
            "c.csv:1: no column `machine_id`",
        ),
        (
            "printf '# tables\nmachine_id,date,parameter,change,unit\n\nM0,2024-01-05,EX0C,many,um' > c.csv; \
             abbe fleet history results --known-changes c.csv",
            "c.csv:4",
        ),
        (
            "printf 'machine_id,date,parameter,change,unit\nM,2024-01-05,E,1,um\nM,2024-01-05,E,1,um\n' > c.csv; \
             abbe fleet history results --known-changes c.csv",
            "c.csv:3: the change of E on 2024-01-05 is stated twice",
        ),
    ] {
        let output = place.shell(line);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && message.contains(expected), "{line}: {message}");
    }
}

/// A folder names its sessions: one that is deleted or renamed leaves the history, and its result stays.
#[test]
fn sessions_that_are_gone_leave_history() {
    let place = fleet(6, monthly);
    run(&place, "--no-trace");
    let results = files(&place.at("results/results"));
    fs::remove_dir_all(place.at("fleet/s05")).unwrap();
    fs::rename(place.at("fleet/s03"), place.at("fleet/t03")).unwrap();
    let second = run(&place, "--no-trace");
    assert_eq!((&second["computed"], &second["kept"]), (&0.into(), &5.into()));
    let forgotten: Vec<&str> =
        second["forgotten"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    assert_eq!(forgotten, ["fleet/s03/session.toml", "fleet/s05/session.toml"]);
    assert_eq!(files(&place.at("results/results")), results);
    assert_eq!(files(&place.at("results/sessions")).len(), 5);
    // Other folders are not asked.
    fs::create_dir_all(place.at("other")).unwrap();
    fs::rename(place.at("fleet/s00"), place.at("other/s00")).unwrap();
    assert!(place.shell("abbe fleet run other --out results --no-trace").status.success());
    assert_eq!(files(&place.at("results/sessions")).len(), 6);
}
