//! `abbe run` and `abbe history`: results of many sessions are kept, whatever happens to some of them or to the
//! program.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use abbe::fleet::record::SCHEMA_VERSION;
use serde_json::Value;

use super::abbe;
use super::faults::TestFolder;

/// Small sessions in folders of one place, each with its machine, date and a bar of its own.
pub(super) fn fleet(count: usize, about: impl Fn(usize) -> String) -> TestFolder {
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

pub(super) fn monthly(k: usize) -> String {
    format!("serial_number = \"M{}\"\ndate = 20{:02}-{:02}-05", k % 2, 20 + k / 24, k / 2 % 12 + 1)
}

pub(super) fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

/// Runs `abbe run` in the place; returns its summary.
pub(super) fn run(place: &TestFolder, arguments: &str) -> Value {
    let output = place.shell(&format!("abbe run fleet --out results --json summary.json {arguments}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&read(&place.at("summary.json"))).unwrap()
}

/// Every file below a folder with its contents.
fn files(folder: &Path) -> BTreeMap<String, String> {
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
        "abbe run fleet/s05 fleet/s01/session.toml fleet/s00 fleet/s04 fleet/s03 fleet/s02 --only EX --out other",
    );
    assert!(own.status.success());
    let keys = |folder: &str| -> BTreeMap<String, String> { files(&place.at(folder).join("results")) };
    assert_eq!(keys("results"), keys("other"));
    assert_eq!(keys("results").len(), 6);
    // The parts of an array of jobs are disjoint and complete.
    for (part, count) in [("1/4", 2), ("2/4", 2), ("3/4", 1), ("4/4", 1)] {
        let output = place.shell(&format!("abbe run fleet --only EX --part {part} --out parts --json part.json"));
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
    }
}

#[test]
fn a_killed_run_is_continued() {
    let place = fleet(12, monthly);
    for kill in 0..4_u64 {
        let mut child = Command::new(env!("CARGO_BIN_EXE_abbe"))
            .args(["run", "fleet", "--out", "results", "--only", "EX", "--quiet"])
            .current_dir(place.0.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while start.elapsed() < Duration::from_millis(30 + 70 * kill) && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        child.kill().unwrap();
        child.wait().unwrap();
    }
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

#[test]
fn a_full_disk_ends_the_run_and_keeps_results() {
    let place = fleet(4, monthly);
    run(&place, "--no-trace");
    let results = files(&place.at("results"));
    let output = place.shell("trap '' XFSZ; ulimit -f 0; exec abbe run fleet --out results --max-effects 1 --quiet");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(message.contains("cannot be written") && message.contains("finished results are kept"), "{message}");
    assert_eq!(files(&place.at("results")), results);
}

#[test]
fn sessions_that_have_one_identifier_are_named() {
    let place = fleet(3, |k| format!("session_id = \"A{}\"\nserial_number = \"M\"\ndate = 2026-01-0{}", k / 2, k + 1));
    let output = place.shell("abbe run fleet --out results --no-trace");
    assert!(output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("`A0`") && message.contains("s00") && message.contains("s01"), "{message}");
    let history = place.shell("abbe history results --json -");
    let history: Value = serde_json::from_slice(&history.stdout).unwrap();
    assert_eq!(history["not_used"].as_array().unwrap().len(), 2);
    assert!(history["not_used"][0]["reason"].as_str().unwrap().contains("`A0`"));
}

#[test]
fn sessions_that_do_not_fit_together_are_named_and_isolated() {
    let place = fleet(12, |k| {
        let date = match k {
            3 => "date = \"last week\"".to_string(),
            // A clock that runs backwards: the fifth session claims to be the first.
            4 => "date = 2019-01-01".to_string(),
            5 => String::new(),
            _ => format!("date = 2026-01-{:02}", k + 1),
        };
        format!("serial_number = \"M\"\nsession_number = {k}\n{date}")
    });
    // The axes of the machine change.
    let changed = place.at("fleet/s02/session.toml");
    fs::write(&changed, read(&changed).replace("w X b Y t", "w Y b X t")).unwrap();
    run(&place, "--no-trace");
    // A result of another schema.
    let results = files(&place.at("results/results"));
    let (name, contents) = results.iter().find(|(_, contents)| contents.contains("2026-01-08")).unwrap();
    let other = contents.replacen(&format!("\"schema_version\":{SCHEMA_VERSION}"), "\"schema_version\":99", 1);
    fs::write(place.at("results/results").join(name), other).unwrap();

    let output = place.shell("abbe history results --json history.json");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let history: Value = serde_json::from_str(&read(&place.at("history.json"))).unwrap();
    let reasons: BTreeMap<&str, &str> = history["not_used"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| (one["file"].as_str().unwrap(), one["reason"].as_str().unwrap()))
        .collect();
    let expected = [
        ("s02", "axes"),
        ("s03", "last week"),
        ("s04", "session_number"),
        ("s05", "no date"),
        ("s07", "another version of the schema"),
    ];
    assert_eq!(reasons.len(), expected.len(), "{reasons:?}");
    for (session, reason) in expected {
        let file = format!("fleet/{session}/session.toml");
        let found = reasons.get(file.as_str()).or(reasons.get(format!("./{file}").as_str()));
        assert!(found.is_some_and(|found| found.contains(reason)), "{session}: {reasons:?}");
    }
    assert_eq!(history["machines"][0]["sessions"], 7);
}

#[test]
fn unusable_requests_are_named() {
    let place = fleet(1, monthly);
    for (line, expected) in [
        ("abbe run --out results", "SESSION"),
        ("abbe run missing.toml --out session.csv --threads 0", "--threads"),
        ("mkdir empty; abbe run empty --out results", "no session.toml lies in this folder"),
        ("abbe run fleet --out results --part 5/4", "expected a part"),
        ("abbe run fleet --out results --models nowhere", "name the folder of the saved models"),
        ("abbe run --list nowhere.txt --out results", "nowhere.txt: cannot be read"),
        ("abbe history nowhere", "no results of `abbe run` are there"),
        (
            "abbe run fleet --out results --no-trace -q; abbe history results --machine X",
            "no session of the machine `X`",
        ),
        ("echo 'a,b' > c.csv; echo '1,2' >> c.csv; abbe history results --compensations c.csv", "c.csv:2"),
    ] {
        let output = place.shell(line);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && message.contains(expected), "{line}: {message}");
    }
}

/// One machine with a step that a table explains.
#[test]
fn a_history_has_pages_and_names_a_compensation() {
    let place = fleet(20, |k| format!("serial_number = \"M\"\ndate = 20{:02}-{:02}-05", 24 + k / 12, k % 12 + 1));
    let table = read(&place.at("fleet/s00/circle.csv"));
    for k in 0..20 {
        // A squareness of 20″ before the compensation; the bar measures the change along the diagonals.
        let squareness = if k < 10 { 20.0 / 206_264.8 } else { 0.0 };
        let rows = table.lines().enumerate().map(|(row, line)| {
            let cells: Vec<&str> = line.split(',').collect();
            let Ok(length) = cells[3].parse::<f64>() else { return line.to_string() };
            let (x, y): (f64, f64) = (cells[1].parse().unwrap(), cells[2].parse().unwrap());
            let noise = 1e-4 * ((row * 7919 + k * 104_729) % 13) as f64 - 6e-4;
            format!("1,{},{},{:.6}", cells[1], cells[2], length - x * y / 100.0 * squareness + noise)
        });
        let contents = rows.collect::<Vec<_>>().join("\n") + "\n";
        fs::write(place.at(&format!("fleet/s{k:02}/circle.csv")), contents).unwrap();
    }
    run(&place, "--no-trace");
    let plain = place.shell("abbe history results --json -");
    let plain: Value = serde_json::from_slice(&plain.stdout).unwrap();
    let change = &plain["machines"][0]["changes"][0];
    assert_eq!(change["kind"], "correction", "{change:#}");
    let value = change["changes"][0]["value"].as_f64().unwrap();
    assert!((value.abs() - 20.0).abs() < 1.0, "{change:#}");
    place.put("table.csv", &format!("machine_id,date,parameter,change,unit\nM,2024-10-20,EC0Y,{value:.1},arcsec\n"));
    let line = "abbe history results --compensations table.csv --json history.json --pages pages --report report.html";
    let output = place.shell(line);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let history: Value = serde_json::from_str(&read(&place.at("history.json"))).unwrap();
    assert_eq!(history["machines"][0]["changes"][0]["kind"], "compensation");
    let schema: Value = serde_json::from_slice(&abbe(&["schema", "history"]).stdout).unwrap();
    assert!(jsonschema::is_valid(&schema, &history));
    for page in ["pages/index.html", "pages/0001-M.html", "report.html"] {
        let page = read(&place.at(page));
        assert!(page.contains("compensation") && page.contains("</html>"));
    }
    // A table in another unit is no table.
    place.put("table.csv", "machine_id,date,parameter,change,unit\nM,2024-10-20,EC0Y,-20,um\n");
    let wrong = place.shell("abbe history results --compensations table.csv");
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("state it in arcsec"));
}

/// A study of fits: 95 % intervals of simulated sessions contain the true values as often as they should.
#[test]
fn a_study_has_its_nominal_coverage() {
    let place = TestFolder::new();
    let plan = super::ready("hermle-c600u/chapter4.toml");
    let study = |draws: usize| {
        let file = format!(
            "[study]\nanalysis = \"fit\"\ndraws = {draws}\nlocation_um = 20\nlocation_arcsec = 8\n\
             [[plan]]\nname = \"four\"\nsession = {plan:?}\n[[noise]]\nname = \"white\"\num = 0.3\n[[effect]]\nname = \"none\"\n"
        );
        place.put("study.toml", &file);
        let output = place.shell("abbe study study.toml --out study --threads 2 --json study.json --csv study.csv");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_str::<Value>(&read(&place.at("study.json"))).unwrap()
    };
    let found = study(60);
    let cell = &found["cells"][0];
    assert_eq!((&cell["draws"], &cell["failed"]), (&60.into(), &0.into()));
    let (rate, of) = (cell["coverage"]["rate"].as_f64().unwrap(), cell["coverage"]["of"].as_f64().unwrap());
    // Eight location errors of a session share its set-up: as many independent intervals as sessions, at worst.
    assert!(of >= 240.0 && (rate - 0.95).abs() < 4.0 * (0.95 * 0.05 / 60.0_f64).sqrt(), "{cell:#}");
    let schema: Value = serde_json::from_slice(&abbe(&["schema", "study"]).stdout).unwrap();
    assert!(jsonschema::is_valid(&schema, &found));
    // Finished draws are kept, byte by byte.
    let draws = files(&place.at("study"));
    assert_eq!(draws.len(), 60);
    study(60);
    assert_eq!(files(&place.at("study")), draws);
}

#[test]
fn a_study_finds_a_large_effect_and_claims_no_other() {
    let place = TestFolder::new();
    let plan = super::ready("hermle-c600u/chapter4.toml");
    let file = format!(
        "[study]\nanalysis = \"trace\"\ndraws = 3\nlocation_um = 20\n[[plan]]\nname = \"four\"\nsession = {plan:?}\n\
         [[noise]]\nname = \"serial\"\num = 0.3\nautocorrelation = 0.5\noutlier_share = 0.01\n\
         [[effect]]\nname = \"axial\"\nsize = 20\n\
         effect = {{ component = \"EZC\", driver = \"C\", shape = \"harmonic\", order = 2 }}\n"
    );
    place.put("study.toml", &file);
    let output = place.shell("abbe study study.toml --out study --threads 2 --json -");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["effects"][0]["found"]["count"], 3, "{found:#}");
}

#[test]
fn unusable_study_files_are_named() {
    let place = TestFolder::new();
    let file = "[study]\nanalysis = \"fit\"\ndraws = 1\n[[plan]]\nname = \"a\"\nsession = \"session.toml\"\n\
                [[noise]]\nname = \"n\"\num = 0.3\n[[effect]]\nname = \"none\"\n";
    for (from, to, expected) in [
        ("draws = 1", "draws = 0", "draws = 0"),
        ("draws = 1", "draws = 1\nfoo = 2", "foo"),
        ("um = 0.3", "um = 0.3\nautocorrelation = 1", "noise `n`"),
        ("name = \"none\"", "name = \"none\"\nsize = 5", "effect `none`"),
        (
            "name = \"none\"",
            "name = \"x\"\nsize = 5\neffect = { component = \"EZQ\", shape = \"constant\" }",
            "effect `x`",
        ),
        ("session = \"session.toml\"", "session = \"nowhere.toml\"", "nowhere.toml"),
    ] {
        assert!(file.contains(from));
        place.put("study.toml", &file.replacen(from, to, 1));
        let output = place.shell("abbe study study.toml --out study");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && message.contains(expected), "{to}: {message}");
    }
}
