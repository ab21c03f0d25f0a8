//! JSON documents state where they come from, and their figures agree with one another. `--residuals` writes what the
//! figures follow from.

use std::process::Command;

use serde_json::{Value, json};

use crate::suite::{abbe, ready, text};

fn array(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// The document that a command writes.
fn document(arguments: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("result.json");
    let run = abbe(&[arguments, &["--json", text(&file)]].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap()
}

#[test]
fn a_document_states_version_command_inputs_and_options() {
    let session = ready("hermle-c600u/measured/session.toml");
    let folder = tempfile::tempdir().unwrap();
    let residuals = folder.path().join("residuals.csv");
    let fit = document(&["fit", text(&session), "--seed", "7", "--residuals", text(&residuals)]);
    assert_eq!(fit["schema_version"], 3);
    assert_eq!(fit["tool_version"], env!("CARGO_PKG_VERSION"));
    assert_eq!((&fit["command"], &fit["seed"]), (&json!("fit"), &json!(7)));
    assert_eq!(fit["options"], json!({"residuals": text(&residuals)}));
    assert_eq!(fit["session"]["file"], text(&session));
    // The session, its machine and four data files.
    let inputs = array(&fit["session"]["inputs"]);
    assert_eq!(inputs.len(), 6, "{inputs:?}");
    assert_eq!(fit["session"]["sha256"], inputs[0]["sha256"]);
    let name = "a_document_states_version_command_inputs_and_options";
    let Some(sha256sum) = test_needs::program(name, &["sha256sum"], &["--version"]) else { return };
    for input in inputs {
        let file = input["file"].as_str().unwrap();
        let told = Command::new(&sha256sum).arg(file).output().unwrap();
        let told = String::from_utf8(told.stdout).unwrap();
        assert_eq!(told.split_whitespace().next(), input["sha256"].as_str(), "{file}");
    }
}

#[test]
fn the_map_of_a_machine_names_its_two_files() {
    let folder = tempfile::tempdir().unwrap();
    let (machine, errors) = (ready("volumetric/machine.toml"), ready("volumetric/errors.toml"));
    let map = document(&[
        "volumetric",
        text(&machine),
        "--map",
        text(&folder.path().join("map.csv")),
        "--functions",
        text(&errors),
        "--places",
        "2",
    ]);
    let files: Vec<&str> = array(&map["inputs"]).iter().map(|input| input["file"].as_str().unwrap()).collect();
    assert_eq!(files, [text(&machine), text(&errors)]);
    assert_eq!(map["options"]["places"], 2);
    assert!(map.get("session").is_none());
}

#[test]
fn uncertainties_covariance_and_chi_square_agree() {
    let fit = document(&["fit", text(&ready("hermle-c600u/measured/session.toml"))]);
    let parameters = array(&fit["parameters"]);
    let covariance = &fit["covariance"];
    assert_eq!(array(&covariance["ids"]).len(), parameters.len());
    let matrix = array(&covariance["matrix"]);
    for (i, parameter) in parameters.iter().enumerate() {
        assert_eq!(covariance["ids"][i], parameter["id"]);
        assert_eq!(fit["identifiable"][i], parameter["id"]);
        assert_eq!(covariance["units"][i], parameter["unit"]);
        let (value, u) = (number(&parameter["value"]), number(&parameter["u"]));
        assert!((number(&matrix[i][i]) / (u * u) - 1.0).abs() < 1e-9);
        assert_eq!(number(&parameter["expanded_u"]), 2.0 * u);
        // The readings alone do not separate the errors of this session from the set-up.
        let by_readings = parameter["determined_by"] == "readings";
        assert_eq!(parameter["significant"], by_readings && value.abs() > 2.0 * u);
        assert!(!parameter["meaning"].as_str().unwrap().is_empty(), "{parameter}");
        for j in 0..parameters.len() {
            assert_eq!(matrix[i][j], matrix[j][i]);
            let limit = u * number(&parameters[j]["u"]);
            assert!(number(&matrix[i][j]).abs() <= limit * (1.0 + 1e-9));
        }
    }
    let ratio = number(&fit["chi_square"]) / number(&fit["degrees_of_freedom"]);
    assert!((ratio.sqrt() / number(&fit["birge_ratio"]) - 1.0).abs() < 1e-12);
    let meaning = |id: &str| {
        let own = parameters.iter().find(|parameter| parameter["id"] == id);
        own.unwrap_or_else(|| panic!("{id}"))["meaning"].as_str().unwrap().to_string()
    };
    assert_eq!(meaning("EB0C"), "C table: inclination of the axis about Y (squareness to X)");
    assert_eq!(meaning("EA0C"), "C table: inclination of the axis about X (squareness to Y)");
    assert_eq!(meaning("bar[A100]"), "A100: bar length");
}

/// Balls at unknown positions leave directions unidentifiable. Each row of the null space is a combination of
/// `unobservable`.
#[test]
fn the_null_space_has_the_rows_of_the_unobservable_combinations() {
    let plan = std::fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plan.toml");
    std::fs::copy(ready("hermle-c600u/machine.toml"), folder.path().join("machine.toml")).unwrap();
    // The set-up has no priors.
    let free = plan
        .replace("_ball_u_um = [2, 2, 2]", "_ball_u_um = [inf, inf, inf]")
        .replace("_ball_u_um = [1, 1, 1]", "_ball_u_um = [inf, inf, inf]");
    std::fs::write(&file, free.replace("step_deg = 0.25", "step_deg = 5")).unwrap();
    let run = folder.path().join("run");
    document(&["simulate", text(&file), "--out", text(&run)]);
    let fit = document(&["fit", text(&run.join("session.toml"))]);
    let (space, unobservable) = (&fit["null_space"], array(&fit["unobservable"]));
    let rows = array(&space["vectors"]);
    assert!(!rows.is_empty());
    assert_eq!(rows.len(), unobservable.len());
    assert_eq!(number(&fit["rank"]) + rows.len() as f64, number(&fit["parameter_count"]));
    for (row, item) in rows.iter().zip(unobservable) {
        for (id, value) in array(&space["ids"]).iter().zip(array(row)) {
            let own = item["combination"].get(id.as_str().unwrap());
            assert_eq!(own.map_or(0.0, number), number(value), "{id}");
        }
    }
}

#[test]
fn residuals_are_those_of_the_figures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("residuals.csv");
    for (session, coordinates) in [("hermle-c600u/measured/session.toml", 1), ("r-test/measured/session.toml", 3)] {
        let fit = document(&["fit", text(&ready(session)), "--residuals", text(&path)]);
        let mut reader = csv::Reader::from_path(&path).unwrap();
        let header: Vec<String> = reader.headers().unwrap().iter().map(String::from).collect();
        let columns =
            |prefix: &str| -> Vec<usize> { (0..header.len()).filter(|k| header[*k].starts_with(prefix)).collect() };
        let (residual, standardised) = (columns("residual"), columns("standardised"));
        assert_eq!((residual.len(), standardised.len()), (coordinates, coordinates));
        assert_eq!(columns("reading").len(), coordinates);
        let (mut count, mut sum) = (0, 0.0);
        for row in reader.records() {
            let row = row.unwrap();
            if &row[header.len() - 1] != "yes" {
                continue;
            }
            count += 1;
            for (k, s) in residual.iter().zip(&standardised) {
                let um: f64 = row[*k].parse().unwrap();
                let ratio: f64 = row[*s].parse().unwrap();
                sum += um * um;
                assert!((um / number(&fit["noise_um"]) - ratio).abs() < 1e-3);
            }
        }
        assert_eq!(count, number(&fit["readings"]) as usize);
        let rms = (sum / (count * coordinates) as f64).sqrt();
        assert!((rms - number(&fit["rms_um"])).abs() < 1e-4, "{rms}");
    }
}
