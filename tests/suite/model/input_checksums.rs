//! Checksums in results are those of the bytes that were read: each input is read once, a pipe too.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::suite::command::faults::TestFolder;
use crate::suite::fleet::run;

fn sha256(path: &Path) -> String {
    Sha256::digest(fs::read(path).unwrap()).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Runs a line of bash in the folder, for at most a minute: a program that reads a pipe twice waits for ever.
fn bash(place: &TestFolder, line: &str) -> Output {
    let path = std::env::var("PATH").unwrap_or_default();
    let program = Path::new(env!("CARGO_BIN_EXE_abbe"));
    Command::new("timeout")
        .args(["60", "bash", "-c", line])
        .current_dir(place.0.path())
        .env("PATH", format!("{}:{path}", program.parent().unwrap().display()))
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

#[track_caller]
fn document(place: &TestFolder, line: &str) -> Value {
    let output = bash(place, line);
    assert!(output.status.success(), "{line}: {:?}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&fs::read_to_string(place.at("out.json")).unwrap()).unwrap()
}

/// The checksums of all inputs of a document.
fn checksums(document: &Value) -> Vec<String> {
    let lists = [&document["session"]["inputs"], &document["inputs"]];
    let inputs = lists.iter().filter_map(|list| list.as_array()).flatten();
    inputs.map(|input| input["sha256"].as_str().expect("a checksum").to_string()).collect()
}

/// A session, its model, and commands.
fn test_folder() -> TestFolder {
    let place = TestFolder::new();
    assert!(place.shell("abbe fit session.toml --save model.json --quiet").status.success());
    place.put("commands.csv", "x_mm,y_mm\n0,0\n10,20\n");
    place.put("later.toml", &format!("# Another run\n{}", fs::read_to_string(place.at("session.toml")).unwrap()));
    place
}

#[test]
fn a_pipe_has_the_checksum_of_what_was_read() {
    let place = test_folder();
    let sum = |name: &str| sha256(&place.at(name));
    let data = sum("circle.csv");
    for (line, expected) in [
        (
            "abbe validate <(cat model.json) session.toml --json out.json",
            vec![sum("session.toml"), data.clone(), sum("model.json")],
        ),
        (
            "abbe compare <(cat model.json) later.toml --json out.json --allow-outside",
            vec![sum("later.toml"), data.clone(), sum("model.json")],
        ),
        (
            "abbe compensate <(cat model.json) <(cat commands.csv) --out out.csv --json out.json",
            vec![sum("model.json"), sum("commands.csv")],
        ),
        ("abbe export <(cat model.json) --as urdf --out out.urdf --json out.json", vec![sum("model.json")]),
        (
            "abbe fit <(cat session.toml) --data . --json out.json --report out.html",
            vec![sum("session.toml"), data.clone()],
        ),
        ("abbe trace <(cat session.toml) --only EXY --data . --json out.json", vec![sum("session.toml"), data.clone()]),
        (
            "mkfifo pipe; cat model.json > pipe & abbe validate pipe session.toml --json out.json",
            vec![sum("session.toml"), data.clone(), sum("model.json")],
        ),
    ] {
        // A model in the form of a URDF needs no robot; a machine that has none says so.
        let output = bash(&place, line);
        assert!(output.status.success(), "{line}: {:?}: {}", output.status, String::from_utf8_lossy(&output.stderr));
        let text = fs::read_to_string(place.at("out.json")).unwrap();
        assert_eq!(checksums(&serde_json::from_str(&text).unwrap()), expected, "{line}");
        let _ = fs::remove_file(place.at("pipe"));
    }
    // The data of a session.
    let session = fs::read_to_string(place.at("session.toml")).unwrap();
    place.put("piped.toml", &session.replace("circle.csv", "pipe.csv"));
    let line = "mkfifo pipe.csv; cat circle.csv > pipe.csv & abbe fit piped.toml --json out.json --report out.html";
    assert_eq!(checksums(&document(&place, line)), [sum("piped.toml"), data.clone()]);
    assert!(fs::read_to_string(place.at("out.html")).unwrap().contains(&data), "the report states the checksum");
}

#[test]
fn known_compensations_are_read_once() {
    let place = run::fleet(6, run::monthly);
    run::run(&place, "--no-trace");
    place.put("known.csv", "machine_id,date,parameter,change,unit\nM0,2020-02-01,EC0Y,1,arcsec\n");
    let line =
        "mkfifo pipe; cat known.csv > pipe & abbe fleet history results --known-changes pipe --json out.json --quiet";
    assert_eq!(checksums(&document(&place, line)), [sha256(&place.at("known.csv"))]);
}

/// The record of a run holds the checksums of what was read, and a session from a pipe is no longer read a second time.
#[test]
fn a_record_has_the_checksums_of_its_files() {
    let place = run::fleet(2, run::monthly);
    run::run(&place, "--no-trace");
    let mut found = 0;
    for text in run::files(&place.at("results/results")).values() {
        let record: Value = serde_json::from_str(text).unwrap();
        let sums: Vec<&str> =
            record["inputs"].as_array().unwrap().iter().map(|i| i["sha256"].as_str().unwrap()).collect();
        let of = |k: usize, name: &str| sha256(&place.at(&format!("fleet/s{k:02}/{name}")));
        found += (0..2).filter(|k| sums == [of(*k, "session.toml"), of(*k, "circle.csv")]).count();
    }
    assert_eq!(found, 2);
    // No session, and a pipe: the run ends.
    let output = bash(&place, "mkfifo pipe; (echo '[machine]' > pipe &) ; abbe fleet run pipe --out others --no-trace");
    assert!(output.status.success(), "{:?}", output.status);
}
