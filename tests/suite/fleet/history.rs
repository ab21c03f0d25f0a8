//! `abbe fleet history`: the machines of many sessions over time.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;

use abbe::fleet::record::SCHEMA_VERSION;
use serde_json::{Value, json};

use crate::suite::abbe;
use crate::suite::command::faults::TestFolder;
use crate::suite::fleet::run::{files, fleet, read, run};

/// The history of the results of a place.
fn history(place: &TestFolder, arguments: &str) -> Value {
    let output = place.shell(&format!("abbe fleet history results --json history.json {arguments}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&read(&place.at("history.json"))).unwrap()
}

/// The statistics of one machine are those of the fleet; numbers of sessions are those of a machine.
#[test]
fn one_machine_has_the_history_that_it_has_in_the_fleet() {
    let place = fleet(12, |k| {
        format!("serial_number = \"M{}\"\nsession_id = \"{}\"\ndate = 2026-{:02}-05", k % 2, k / 2, k / 2 + 1)
    });
    run(&place, "--no-trace");
    let (all, one) = (history(&place, "--csv all.csv"), history(&place, "--machine-id M1"));
    // A history without a change has its figures in CSV too, with all their digits.
    let csv = read(&place.at("all.csv"));
    assert!(csv.starts_with("machine,parameter,quantity,date,value,u,unit\n"), "{csv}");
    for machine in all["machines"].as_array().unwrap() {
        for parameter in machine["parameters"].as_array().unwrap() {
            let start = format!("{},{},", machine["machine_id"].as_str().unwrap(), parameter["id"].as_str().unwrap());
            let unit = parameter["unit"].as_str().unwrap();
            for (k, point) in parameter["points"].as_array().unwrap().iter().enumerate() {
                let date = format!("2026-{:02}-05", k + 1);
                let row = format!("{start}session,{date},{},{},{unit}", point["value"], point["u"]);
                assert!(csv.lines().any(|line| line == row), "{row}\n{csv}");
            }
            let level = &parameter["level"];
            assert!(csv.contains(&format!("{start}level,,{},{},{unit}\n", level["value"], level["u"])), "{csv}");
        }
    }
    assert_eq!(all["not_used"], Value::Array(Vec::new()));
    assert_eq!(all["machines"].as_array().unwrap().len(), 2);
    assert_eq!(all["machines"][1], one["machines"][0]);
    assert_eq!([&all["tested_series"], &all["p_value_threshold"]], [&one["tested_series"], &one["p_value_threshold"]]);
}

/// Neither stated travels nor a damaged model change what was measured.
#[test]
fn travels_and_damaged_models_leave_the_history() {
    let place = fleet(6, |k| format!("serial_number = \"M\"\ndate = 2026-{:02}-05", k + 1));
    let latest = place.at("fleet/s05/session.toml");
    let text = read(&latest);
    let travelled = text.replacen("[machine.axis.X]", "[machine.axis.X]\ntravel_mm = [-500, 500]", 1);
    assert_ne!(travelled, text);
    fs::write(&latest, travelled).unwrap();
    fs::create_dir_all(place.at("models")).unwrap();
    fs::write(place.at("models/M.json"), "{ \"half").unwrap();
    let summary = run(&place, "--no-trace --models models");
    assert_eq!(summary["failed"].as_array().unwrap().len(), 6, "the model is named");
    assert_eq!(history(&place, "")["machines"][0]["sessions"], 6);
    // A folder in place of the model is named too.
    fs::remove_file(place.at("models/M.json")).unwrap();
    fs::create_dir_all(place.at("models/M.json")).unwrap();
    let summary = run(&place, "--no-trace --models models");
    assert!(summary["failed"][0]["message"].as_str().unwrap().contains("M.json"), "{summary:#}");
    assert_eq!(history(&place, "")["machines"][0]["sessions"], 6);
}

#[test]
fn sessions_that_have_one_identifier_are_named() {
    let place = fleet(3, |k| format!("session_id = \"A{}\"\nserial_number = \"M\"\ndate = 2026-01-0{}", k / 2, k + 1));
    let output = place.shell("abbe fleet run fleet --out results --no-trace");
    assert!(output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("`A0`") && message.contains("s00") && message.contains("s01"), "{message}");
    let history = place.shell("abbe fleet history results --json -");
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

    let output = place.shell("abbe fleet history results --json history.json");
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

/// Sessions of one machine, one a month, with a squareness of 20″ before one of them.
fn sessions_with_a_step(count: usize, at: usize) -> TestFolder {
    let place = fleet(count, |k| format!("serial_number = \"M\"\ndate = 20{:02}-{:02}-05", 24 + k / 12, k % 12 + 1));
    let table = read(&place.at("fleet/s00/circle.csv"));
    for k in 0..count {
        // The bar measures the change of a squareness along the diagonals.
        let squareness = if k < at { 20.0 / 206_264.8 } else { 0.0 };
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
    place
}

/// Ten sessions of one machine are enough for a step far above the uncertainty, and the screen names the parameter.
#[test]
fn a_step_of_a_short_series_is_found_and_named() {
    let place = sessions_with_a_step(10, 5);
    run(&place, "--no-trace");
    let found = history(&place, "");
    let parameters = found["machines"][0]["parameters"].as_array().unwrap();
    let squareness = parameters.iter().find(|one| one["id"] == "EC0Y").unwrap();
    let steps = squareness["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 1, "{squareness:#}");
    assert!((steps[0]["value"].as_f64().unwrap().abs() - 20.0).abs() < 1.0, "{squareness:#}");
    assert!(squareness["u_enlargement"].as_f64().unwrap() < 3.0, "{squareness:#}");
    // It leads to zero, as an adjustment does: it has changed, and is not to correct.
    let statements = &found["statements"];
    let changed = &statements["changed"][0];
    assert!(statements["correct"].as_array().unwrap().is_empty() && changed["id"] == "EC0Y", "{statements:#}");
    assert!((changed["shift"]["value"].as_f64().unwrap().abs() - 20.0).abs() < 1.0, "{statements:#}");
    assert!(changed["drift_per_year"].is_null(), "{statements:#}");
    // The screen states its amount with its uncertainty, and nothing that contradicts it.
    let screen = place.shell("abbe fleet history results");
    let screen = String::from_utf8_lossy(&screen.stdout).to_string();
    let stated = screen.lines().find(|line| line.contains("EC0Y has shifted by"));
    let amount =
        stated.and_then(|line| line.split("EC0Y has shifted by ").nth(1)?.split(" ± ").next()?.parse::<f64>().ok());
    assert!((amount.unwrap_or(f64::NAN).abs() - 20.0).abs() < 1.0, "{screen}");
    // The table has the same amount.
    let amount = stated.and_then(|line| line.split("EC0Y has shifted by ").nth(1)).unwrap().trim_end_matches('.');
    assert!(screen.lines().any(|line| line.contains(&format!("EC0Y {amount}"))), "{screen}");
    for false_beside_a_step in ["No machine is out of control", "no parameter drifts or has shifted"] {
        assert!(!screen.contains(false_beside_a_step), "{screen}");
    }
    // A step before the last session: there is no later one to start the charts again.
    let last = sessions_with_a_step(7, 6);
    run(&last, "--no-trace");
    let output = last.shell("abbe fleet history results --json history.json");
    let screen = String::from_utf8_lossy(&output.stdout).to_string();
    let out = &serde_json::from_str::<Value>(&read(&last.at("history.json"))).unwrap()["machines"][0]["out_of_control"];
    for id in out.as_array().unwrap() {
        assert!(screen.contains(id.as_str().unwrap()), "{screen}");
    }
    assert!(screen.contains("EC0Y"), "{screen}");
}

/// The control charts begin again after a step. A model of before the step does not hold in the latest session, and puts the
/// machine out of control all the same; a model of after the step holds.
#[test]
fn a_model_that_does_not_hold_puts_its_machine_out_of_control() {
    let place = sessions_with_a_step(6, 3);
    for k in 0..6 {
        // Both patterns of the readings together scatter by 0.49 µm.
        let session = place.at(&format!("fleet/s{k:02}/session.toml"));
        fs::write(&session, read(&session).replace("noise_um = 0.3", "noise_um = 0.5")).unwrap();
    }
    fs::create_dir(place.at("models")).unwrap();
    for (session, verdict, out) in [("s00", json!("does-not-hold"), json!(["M"])), ("s05", Value::Null, json!([]))] {
        let saved = place.shell(&format!("abbe fit fleet/{session}/session.toml --save models/M.json --quiet"));
        assert!(saved.status.success(), "{}", String::from_utf8_lossy(&saved.stderr));
        run(&place, "--no-trace --models models");
        let found = history(&place, "");
        let machine = &found["machines"][0];
        assert_eq!((&machine["validation"], &machine["out_of_control"]), (&verdict, &json!([])), "{machine:#}");
        assert_eq!(found["statements"]["good"]["out_of_control"], out, "{session}: {found:#}");
        let screen = place.shell("abbe fleet history results");
        let screen = String::from_utf8_lossy(&screen.stdout).to_string();
        for said in ["Out of control: M", "M: validation does-not-hold: its model does not describe the latest session"]
        {
            assert_eq!(screen.contains(said), session == "s00", "{screen}");
        }
    }
}

/// A serial number that is longer than the name of a file may be has a page, and stops none of another machine.
#[test]
fn a_long_serial_number_has_a_page() {
    let long = ["ü", "M"].map(|letter| letter.repeat(300));
    let place = fleet(6, |k| {
        format!("serial_number = \"{}\"\nsession_id = \"{}\"\ndate = 2026-{:02}-05", long[k % 2], k / 2, k / 2 + 1)
    });
    fs::create_dir(place.at("models")).unwrap();
    run(&place, "--no-trace --models models");
    history(&place, "--pages pages");
    assert_eq!(fs::read_dir(place.at("pages")).unwrap().count(), 3);
}

/// One machine with a step that a table explains.
#[test]
fn a_history_has_pages_and_names_a_compensation() {
    let place = sessions_with_a_step(20, 10);
    run(&place, "--no-trace");
    let plain = place.shell("abbe fleet history results --json -");
    let plain: Value = serde_json::from_slice(&plain.stdout).unwrap();
    let change = &plain["machines"][0]["changes"][0];
    assert_eq!(change["kind"], "correction", "{change:#}");
    let value = change["changes"][0]["value"].as_f64().unwrap();
    assert!((value.abs() - 20.0).abs() < 1.0, "{change:#}");
    place.put("table.csv", &format!("machine_id,date,parameter,change,unit\nM,2024-10-20,EC0Y,{value:.1},arcsec\n"));
    let line =
        "abbe fleet history results --known-changes table.csv --json history.json --pages pages --report report.html";
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
    // A row of a parameter that no session has explains nothing, and hides nothing.
    place.put("table.csv", "machine_id,date,parameter,change,unit\nM,2024-10-20,EC0Z,5,arcsec\n");
    let unknown = place.shell("abbe fleet history results --known-changes table.csv --json -");
    let unknown: Value = serde_json::from_slice(&unknown.stdout).unwrap();
    assert_eq!(unknown["machines"], plain["machines"]);
    assert_eq!(unknown["not_used"][0]["file"], "table.csv:2");
    // A file without rows has these columns too.
    place.put("table.csv", "machine,date,parameter,change,unit\n");
    let wrong = place.shell("abbe fleet history results --known-changes table.csv");
    assert_eq!(wrong.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("table.csv:1: no column `machine_id`"));
    // A table in another unit is no table.
    place.put("table.csv", "machine_id,date,parameter,change,unit\nM,2024-10-20,EC0Y,-20,um\n");
    let wrong = place.shell("abbe fleet history results --known-changes table.csv");
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("state it in arcsec"));
}
