//! Proposed tests as blocks of a session: `plan --improve --write`, `plan --separate --write` and `trace --write
//! --with-tests` give sessions that other commands take, with the predicted uncertainty.

use serde_json::Value;

use crate::suite::{abbe, ready, text};

fn run(arguments: &[&str]) -> String {
    let output = abbe(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn parsed(file: &std::path::Path) -> Value {
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

#[test]
fn a_written_plan_has_the_predicted_uncertainty_and_keeps_the_text() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("plan");
    run(&["new", text(&folder), "--template", "hermle-c600u"]);
    let at = |name: &str| folder.join(name);
    let [own, next, found, again] = ["chapter5.toml", "next.toml", "found.json", "again.json"].map(at);
    let few = ["--radii-mm", "50,100", "--heights-mm", "0,100", "--bars-mm", "100,150"];
    let asked = ["plan", text(&own), "--improve", "2", "--write", text(&next), "--json", text(&found), "--quiet"];
    run(&[&asked[..], &few].concat());
    let (before, after) = [&own, &next].map(|file| std::fs::read_to_string(file).unwrap()).into();
    assert!(after.starts_with(&before), "the user's text and its comments stay");
    let steps = parsed(&found)["improvement"]["steps"].as_array().unwrap().clone();
    assert_eq!(steps.len(), 2);
    for step in &steps {
        assert!(after.contains(step["session_toml"].as_str().unwrap()), "{step}");
    }
    run(&["plan", text(&next), "--planned", "--no-effects", "--json", text(&again), "--quiet"]);
    let worst = (parsed(&again)["errors"].as_array().unwrap().iter())
        .map(|error| error["u"].as_f64().unwrap())
        .fold(0.0, f64::max);
    let predicted = steps[1]["after"].as_f64().unwrap();
    assert!((worst / predicted - 1.0).abs() < 1e-3, "{worst} against {predicted}");
    // The programs and the sheets of the new plan, and readings of it that a fit takes.
    let [programs, sheets, measured] = ["programs", "sheets.html", "measured"].map(at);
    run(&["nc", text(&next), "--control", "linuxcnc", "--out", text(&programs)]);
    assert_eq!(std::fs::read_dir(&programs).unwrap().count(), 7);
    run(&["sheet", text(&next), "--out", text(&sheets)]);
    run(&["simulate", text(&next), "--out", text(&measured), "--error", "EY0A=20um"]);
    let fitted = at("fit.json");
    run(&["fit", text(&measured.join("session.toml")), "--quiet", "--json", text(&fitted)]);
    let fit = parsed(&fitted);
    let parameter = fit["parameters"].as_array().unwrap().iter().find(|p| p["id"] == "EY0A").unwrap().clone();
    let [value, u] = ["value", "u"].map(|key| parameter[key].as_f64().unwrap());
    assert!((value - 20.0).abs() < 4.0 * u, "{parameter}");
}

/// One command writes what to measure next: the test, its program and its sheet, and nothing of what was measured.
#[test]
fn a_trace_writes_the_next_measurement_as_a_session_of_its_own() {
    let place = tempfile::tempdir().unwrap();
    let measured = ready("hermle-c600u/measured/session.toml");
    let [next, found] = ["next", "trace.json"].map(|name| place.path().join(name));
    let only = ["--only", "EZC~C:h", "--only", "EAC~C:h"];
    let asked =
        ["trace", text(&measured), "--next", text(&next), "--control", "linuxcnc", "--json", text(&found), "--quiet"];
    run(&[&asked[..], &only].concat());
    let tests = parsed(&found)["effects"][0]["separating_tests"].as_array().unwrap().clone();
    let session = next.join("session.toml");
    let written = std::fs::read_to_string(&session).unwrap();
    assert_eq!(written.matches("[[test]]").count(), tests.len(), "{written}");
    assert!(!written.contains("data = ") && written.contains("component = \"EZC\""), "{written}");
    assert!(next.join("machine.toml").exists() && next.join("sheets.html").exists());
    // A program for each test, and the one that calls them.
    assert_eq!(std::fs::read_dir(next.join("programs")).unwrap().count(), tests.len() + 1);
    run(&["plan", text(&session), "--no-effects", "--quiet"]);
    // The folder is not written twice.
    assert!(!abbe(&asked).status.success());
}

/// A control that does not exist is refused before the search, and no folder is left. A folder that exists and is empty gets
/// all files, those of the programs too.
#[test]
fn the_next_measurement_is_written_whole_or_not_at_all() {
    let place = tempfile::tempdir().unwrap();
    let measured = ready("hermle-c600u/measured/session.toml");
    let next = place.path().join("next");
    let only = ["--only", "EZC~C:h", "--only", "EAC~C:h", "--quiet"];
    let asked = |control: &str| {
        let asked = ["trace", text(&measured), "--next", text(&next), "--control", control];
        abbe(&[&asked[..], &only].concat())
    };
    let refused = asked("nonsense");
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && refused.stdout.is_empty(), "{said}");
    assert!(said.contains("invalid value 'nonsense'") && said.contains("siemens"), "{said}");
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
    // An empty folder.
    std::fs::create_dir(&next).unwrap();
    let written = asked("siemens");
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    for file in ["session.toml", "machine.toml", "sheets.html", "programs/main.mpf"] {
        assert!(next.join(file).is_file(), "{file}");
    }
    // The sheets name the programs.
    assert!(std::fs::read_to_string(next.join("sheets.html")).unwrap().contains("main.mpf"));
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1, "nothing is left beside it");
}

#[test]
fn a_trace_appends_the_tests_that_separate() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("run");
    std::fs::create_dir(&folder).unwrap();
    let measured = ready("hermle-c600u/measured/session.toml");
    for entry in std::fs::read_dir(measured.parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
    let [own, next, found] = ["session.toml", "next.toml", "trace.json"].map(|name| folder.join(name));
    let only = ["--only", "EZC~C:h", "--only", "EAC~C:h"];
    let asked = ["trace", text(&own), "--write", text(&next), "--with-tests", "--json", text(&found), "--quiet"];
    run(&[&asked[..], &only].concat());
    let written = std::fs::read_to_string(&next).unwrap();
    let tests = parsed(&found)["effects"][0]["separating_tests"].as_array().unwrap().clone();
    assert!(!tests.is_empty());
    for test in &tests {
        assert!(written.contains(test["session_toml"].as_str().unwrap()), "{test}");
        assert!(written.contains(&format!("# {}", test["test"].as_str().unwrap())), "{test}");
    }
    // Tests without data are planned, and the fit uses the others.
    run(&["fit", text(&next), "--quiet"]);
    run(&["plan", text(&next), "--no-effects", "--quiet"]);
}
