//! The command `abbe plan`.

use serde_json::Value;

use crate::suite::{abbe, ready, text, widest};

fn chapter_5() -> String {
    text(&ready("hermle-c600u/chapter5.toml")).to_string()
}

fn json(arguments: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plan.json");
    let mut all = vec!["plan"];
    all.extend(arguments);
    all.extend(["--json", text(&file)]);
    let output = abbe(&all);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

#[test]
fn the_terminal_and_the_json_agree() {
    let session = chapter_5();
    let plan = json(&[&session]);
    assert_eq!(plan["errors"].as_array().unwrap().len(), 8);
    assert_eq!(plan["rank"], plan["parameter_count"]);
    let screen = abbe(&["plan", &session, "--all"]);
    let screen = String::from_utf8(screen.stdout).unwrap();
    for error in plan["errors"].as_array().unwrap() {
        assert!(error["u"].as_f64().unwrap() > 0.0);
        assert!(screen.contains(error["id"].as_str().unwrap()));
    }
    assert!(screen.contains("only A150 makes EB0A, EC0A"));
    assert!(screen.contains("EC0A is confounded with y of the spindle ball in A150: 1″ : −0.54 µm"), "{screen}");
    assert!(widest(&screen, &ready("hermle-c600u")) < 170, "a line too long for a screen");
    // A second run gives the same.
    assert_eq!(screen, String::from_utf8(abbe(&["plan", &session, "--all"]).stdout).unwrap());
}

/// A number in CSV has all its digits: it reads back to the number of the JSON.
#[test]
fn the_csv_of_a_plan_has_the_figures_of_its_json() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("plan.csv");
    let plan = json(&[&chapter_5(), "--csv", text(&csv)]);
    let rows = std::fs::read_to_string(&csv).unwrap();
    let rows: Vec<Vec<&str>> = rows.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0], ["section", "id", "of", "value", "unit"]);
    let figure = |section: &str, id: &str, of: &str| -> (f64, String) {
        let found: Vec<_> = rows.iter().filter(|row| row[..3] == [section, id, of]).collect();
        assert_eq!(found.len(), 1, "{section}, {id}, {of}");
        (found[0][3].parse().unwrap(), found[0][4].to_string())
    };
    let number = |value: &Value| value.as_f64().unwrap();
    assert_eq!(figure("plan", "noise", ""), (number(&plan["noise_um"]), "um".to_string()));
    for error in plan["errors"].as_array().unwrap() {
        let (id, unit) = (error["id"].as_str().unwrap(), error["unit"].as_str().unwrap().to_string());
        assert_eq!(figure("uncertainty", id, ""), (number(&error["u"]), unit.clone()));
        assert_eq!(figure("conditional uncertainty", id, ""), (number(&error["conditional_u"]), unit.clone()));
        assert_eq!(figure("rms sensitivity", id, "").0, number(&error["sensitivity"]["rms"]));
        for part in error["budget"].as_array().unwrap() {
            assert_eq!(figure("budget", id, part["source"].as_str().unwrap()), (number(&part["u"]), unit.clone()));
        }
    }
    assert_eq!(figure("index", "O3", "").0, number(&plan["indices"]["o3"]));
    let rho = number(&plan["correlation"]["matrix"][1][0]);
    assert_eq!(figure("correlation", "EZ0A", "EY0A").0, rho);
    let effect = &plan["effects"]["effects"][0];
    assert_eq!(
        figure("share in the residual", effect["id"].as_str().unwrap(), "").0,
        number(&effect["residual_share"])
    );
}

#[test]
fn the_effects_list_what_a_clean_residual_does_not_exclude() {
    let plan = json(&[&chapter_5()]);
    let effects = plan["effects"]["effects"].as_array().unwrap();
    let verdict = |id: &str| effects.iter().find(|effect| effect["id"] == id).map(|effect| effect["verdict"].clone());
    // At one height and one radius the tilt of C at order 1 is confounded with the axial motion at order 2.
    assert_eq!(verdict("EZC~C:h3").unwrap(), "detectable");
    assert_eq!(verdict("EZC~C:h1").unwrap(), "confounded");
    // The spindle ball lies on the C axis: C tests do not respond to ECC, and in A tests it is a constant at C = 0.
    assert_eq!(verdict("ECC~C:h2").unwrap(), "confounded");
    let bound =
        |id: &str| effects.iter().find(|effect| effect["id"] == id).unwrap()["detectable_amplitude"].as_f64().unwrap();
    assert!(bound("EZC~C:h3") < 0.1, "{}", bound("EZC~C:h3"));
    for effect in effects.iter().filter(|effect| effect["detectable_amplitude"].is_f64()) {
        let searched = effect["detectable_amplitude_screened"].as_f64();
        assert!(
            searched.is_none_or(|searched| searched > effect["detectable_amplitude"].as_f64().unwrap()),
            "{effect}"
        );
    }
}

#[test]
fn invalid_requests_fail_with_the_reason() {
    let session = chapter_5();
    let bars: Vec<String> = (0..2001).map(|k| format!("{:.2}", 100.0 + 0.01 * f64::from(k))).collect();
    let bars = bars.join(",");
    for (arguments, words) in [
        // Counted before any is made.
        (
            vec!["plan", &session, "--improve", "1", "--bars-mm", &bars],
            "the limit is 100000: state fewer of the 2001 bars",
        ),
        (vec!["plan", &session, "--separate", "EZC~C:q2,EAC~C:h1"], "similar ones: EZC~C:h1"),
        (vec!["plan", &session, "--separate", "EZC~C:h2"], "two different effects"),
        (vec!["plan", &session, "--noise-um", "0"], "is expected"),
        (vec!["plan", &session, "--improve", "--bars-mm", "0"], "a length from 1 to 1000000 mm"),
        (vec!["plan", &session, "--improve", "--bars-mm", "20"], "no candidate test"),
        (vec!["plan", &session, "--device-mm", "1,2"], "six lengths"),
        (vec!["plan", &session, "--improve", "--sweep-shares", "1.5"], "a share of the range above 0 and at most 1"),
        (vec!["plan", &session, "--improve", "--feeds", "0"], "a multiple of the feed above 0 and at most 1000"),
        (vec!["plan", &session, "--improve", "--setup-min=-1"], "a number of minutes from 0 to 10000"),
    ] {
        let output = abbe(&arguments);
        let message = String::from_utf8_lossy(&output.stderr).to_string();
        assert!(matches!(output.status.code(), Some(1 | 2)), "{arguments:?}: {message}");
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
}

#[test]
fn sweeps_can_shrink_until_an_uncertainty_doubles() {
    let plan = json(&[&chapter_5(), "--range"]);
    let ranges = plan["ranges"].as_array().unwrap();
    assert_eq!(ranges.len(), 4);
    for range in ranges {
        let planned = range["range"]["high"].as_f64().unwrap() - range["range"]["low"].as_f64().unwrap();
        let least = range["minimum_range"]["high"].as_f64().unwrap() - range["minimum_range"]["low"].as_f64().unwrap();
        assert!(least > 0.0 && least < planned, "{range}");
    }
}

#[test]
fn a_warning_names_a_test_beyond_the_travel_of_the_sensor() {
    let folder = tempfile::tempdir().unwrap();
    let machine = ready("hermle-c600u/machine.toml");
    std::fs::copy(machine, folder.path().join("machine.toml")).unwrap();
    let text = std::fs::read_to_string(chapter_5()).unwrap();
    // An offset of 2 mm at 48° to the bar changes its length by 1.5 mm.
    let farther = text.replace("\"-sqrt(R_e^2 - R^2)\"", "\"-sqrt(R_e^2 - R^2) - 2\"");
    assert_ne!(text, farther);
    let file = folder.path().join("session.toml");
    std::fs::write(&file, farther).unwrap();
    let warnings = |more: &[&str]| {
        let mut arguments = vec!["plan", crate::suite::text(&file), "--no-effects"];
        arguments.extend(more);
        String::from_utf8(abbe(&arguments).stderr).unwrap()
    };
    assert!(
        warnings(&[]).contains("A150: the distance of the balls differs from the bar length by up to 1.50 mm"),
        "{}",
        warnings(&[])
    );
    assert!(!warnings(&["--reach-mm", "2"]).contains("A150"));
}

/// Every result of a plan with uncertainties states where its noise comes from, on the terminal and in JSON.
#[test]
fn results_of_a_plan_name_the_source_of_the_noise() {
    let folder = tempfile::tempdir().unwrap();
    let [stated, assumed, json] = ["stated.toml", "assumed.toml", "plan.json"].map(|name| folder.path().join(name));
    std::fs::copy(ready("hermle-c600u/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let plan = std::fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap();
    let silent: String =
        plan.lines().filter(|line| !line.starts_with("noise_um")).map(|line| format!("{line}\n")).collect();
    assert_ne!(plan.lines().count(), silent.lines().count());
    std::fs::write(&stated, plan).unwrap();
    std::fs::write(&assumed, silent).unwrap();
    for (session, source) in [(&stated, "stated"), (&assumed, "assumed")] {
        for options in
            [&["--no-effects"][..], &["--range"], &["--improve", "--bars-mm", "100"], &["--global", "--samples", "8"]]
        {
            let run = abbe(&[&["plan", text(session), "--json", text(&json)][..], options].concat());
            let shown = String::from_utf8_lossy(&run.stdout).into_owned();
            assert!(run.status.success(), "{options:?}: {}", String::from_utf8_lossy(&run.stderr));
            assert!(shown.contains(&format!("({source})")), "{options:?}: {shown}");
            let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
            assert_eq!(found["noise_source"], source, "{options:?}");
            assert!(found["noise_um"].as_f64().is_some_and(|um| um > 0.0), "{options:?}");
        }
    }
}
