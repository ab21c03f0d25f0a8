//! `abbe fleet history`: decisions of conformity over time, in every output.
#![cfg(unix)]

use std::fs;

use serde_json::Value;

use crate::suite::abbe;
use crate::suite::fleet::run::{fleet, monthly, read, run};

/// The limits of one machine's sessions are narrow from the third on: its decision changes from pass to fail. The other
/// machine states none.
#[test]
fn decisions_of_conformity_are_shown_over_time() {
    let place = fleet(6, monthly);
    for k in [0, 2, 4] {
        let file = place.at(&format!("fleet/s{k:02}/session.toml"));
        let limit = if k < 4 { 1000.0 } else { 1e-3 };
        let tests = "[tolerance.tests.XY]\ncircular_deviation_um";
        let test = read(&file).lines().find_map(|line| line.strip_prefix("name = ").map(str::to_string)).unwrap();
        let limits = tests.replace("XY", &test);
        fs::write(&file, format!("{}\n{limits} = {limit}\n", read(&file))).unwrap();
    }
    run(&place, "--no-trace -q");
    let line = "abbe fleet history results --json history.json --report report.html --pages pages";
    let output = place.shell(line);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let shown = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(shown.contains("Conformity (rule of ISO 14253-1, limits of each session)"), "{shown}");
    let history: Value = serde_json::from_str(&read(&place.at("history.json"))).unwrap();
    let machines = history["conformity"].as_array().unwrap();
    assert_eq!(machines.len(), 1);
    assert_eq!(machines[0]["machine_id"], "M0");
    let verdicts = |list: &Value, key: &str| -> Vec<String> {
        list.as_array().unwrap().iter().map(|one| one[key].as_str().unwrap().to_string()).collect()
    };
    assert_eq!(verdicts(&machines[0]["sessions"], "verdict"), ["pass", "pass", "fail"]);
    let item = &machines[0]["items"][0];
    assert_eq!(verdicts(&item["points"], "decision"), ["pass", "pass", "fail"]);
    assert_eq!(item["points"][2]["upper"], 1e-3);
    let schema: Value = serde_json::from_slice(&abbe(&["schema", "history"]).stdout).unwrap();
    assert!(jsonschema::is_valid(&schema, &history));
    for page in ["report.html", "pages/index.html"] {
        assert!(read(&place.at(page)).contains("circular_deviation["), "{page}");
    }
    // Of the machine with limits only.
    let page = |start: &str| {
        let names = fs::read_dir(place.at("pages")).unwrap().map(|file| file.unwrap().path());
        read(&names.into_iter().find(|path| path.file_name().unwrap().to_str().unwrap().starts_with(start)).unwrap())
    };
    assert!(page("0001-M0").contains("circular_deviation["));
    assert!(!page("0002-M1").contains("circular_deviation["));
}
