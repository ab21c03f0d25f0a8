//! The first screen of fit, trace and plan: what a user reads without an option, and what `--all` adds.

use serde_json::Value;

use crate::suite::{abbe, ready, text, widest};

/// What a command on a ready session prints, warnings included, and its JSON.
fn printed(command: &str, session: &str, more: &[&str]) -> (String, Value) {
    let folder = tempfile::tempdir().unwrap();
    let (file, session) = (folder.path().join("result.json"), ready(session));
    let arguments = [command, text(&session), "--json", text(&file)];
    let output = abbe(&[&arguments, more].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    let said: Vec<&str> = said.lines().filter(|line| !line.starts_with("  + ")).collect();
    let screen = String::from_utf8(output.stdout).unwrap() + &said.join("\n");
    (screen, serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap())
}

/// The identifiers of a result's parameters, those of errors and those of set-up parameters.
fn ids(parameters: &Value) -> (Vec<&str>, Vec<&str>) {
    let ids = parameters.as_array().unwrap().iter().map(|p| p["id"].as_str().unwrap());
    ids.partition(|id| id.starts_with('E'))
}

/// The line whose first word this is.
fn row<'s>(screen: &'s str, first: &str) -> Option<&'s str> {
    screen.lines().find(|line| line.split_whitespace().next() == Some(first))
}

#[test]
fn a_fit_of_four_tests_has_at_most_40_lines() {
    let session = "hermle-c600u/measured/session.toml";
    let (screen, fit) = printed("fit", session, &[]);
    println!("{screen}");
    assert!(screen.lines().count() <= 40, "{} lines", screen.lines().count());
    assert!(widest(&screen, &ready("hermle-c600u/measured")) < 170);
    for words in ["numerical rank", "identifiable", "standard uncertainty", "χ²/ν = ", "Held-out rms"] {
        assert!(screen.contains(words), "`{words}` is not in\n{screen}");
    }
    // Goodness of fit, rank, estimates, what is confounded, what to do next: in this order.
    let order =
        ["Goodness of fit", "numerical rank", "EY0A", "set-up parameters", "Determined by the set-up priors", "Next:"];
    let places: Vec<usize> = order.iter().map(|words| screen.find(words).unwrap()).collect();
    assert!(places.is_sorted(), "{places:?}\n{screen}");
    let (errors, setup) = ids(&fit["parameters"]);
    assert_eq!((errors.len(), setup.len()), (8, 19));
    for id in errors {
        let row = row(&screen, id).unwrap();
        let parameter = fit["parameters"].as_array().unwrap().iter().find(|p| p["id"] == id).unwrap();
        let (value, u) = (parameter["value"].as_f64().unwrap(), parameter["u"].as_f64().unwrap());
        // Only the set-up priors separate these errors from the set-up.
        assert_eq!(row.contains(" † "), value.abs() > 2.0 * u, "{row}");
        assert!(!row.contains(" * "), "{row}");
        assert!(row.ends_with(parameter["meaning"].as_str().unwrap()), "{row}");
    }
    assert!(screen.contains("not to be quoted"), "{screen}");
    assert!(screen.contains("19 set-up parameters, largest pull "));
    assert!(setup.iter().all(|id| row(&screen, id).is_none()));
    let (all, _) = printed("fit", session, &["--all"]);
    assert!(setup.iter().all(|id| row(&all, id).is_some()), "{all}");
    assert!(!all.contains("--all lists"), "{all}");
}

#[test]
fn a_trace_states_uniqueness_in_the_first_three_lines() {
    let (screen, trace) = printed("trace", "hermle-c600u/measured/session.toml", &[]);
    println!("{screen}");
    let count = &trace["effects"][0]["explanation_count"];
    let first: Vec<&str> = screen.lines().take(3).collect();
    assert!(first[0].starts_with("Verdict: explained. 1 effect explains"), "{first:?}");
    // The headline names the effect with its values.
    let amplitude = trace["effects"][0]["parameters"][0]["value"].as_f64().unwrap();
    assert!(first[0].contains(&format!("axial motion twice per turn, amplitude {amplitude:.2}")), "{first:?}");
    let standing = format!("1 of {count} indistinguishable explanations");
    assert!(first.iter().any(|line| line.contains(&standing)), "{first:?}");
    let order = ["Verdict", "indistinguishable", "What to correct", "What to measure next", "before", "EY0A"];
    let order = [&order[..], &["1. EZC over C", "Tests that separate", "Next:"]].concat();
    let places: Vec<usize> = order.iter().map(|words| screen.find(words).unwrap()).collect();
    assert!(places.is_sorted(), "{places:?}\n{screen}");
    assert!(screen.lines().count() <= 60, "{} lines", screen.lines().count());
    // Three aliases, and the number of the others.
    let listed = screen.lines().filter(|line| line.starts_with("  or ")).count() as u64;
    let others = count.as_u64().unwrap() - 1 - listed;
    assert!(screen.contains(&format!("  … {others} more; --all lists them")), "{screen}");
}

/// The opening names the error with the largest standard uncertainty, 1 µm counting as 1″, and the largest part of its
/// variance.
#[test]
fn a_plan_opens_with_its_worst_error_and_what_limits_it() {
    for (session, more) in [
        ("hermle-c600u/chapter5.toml", &[][..]),
        ("hermle-c600u/chapter5.toml", &["--setup-um", "0.001"]),
        ("r-test/plan.toml", &[]),
        ("table-and-head/session.toml", &[]),
    ] {
        let (screen, plan) = printed("plan", session, &[&["--no-effects"], more].concat());
        let u = |error: &Value| error["u"].as_f64();
        let errors = plan["errors"].as_array().unwrap().iter().filter(|error| u(error).is_some());
        let worst = errors.max_by(|a, b| u(a).unwrap().total_cmp(&u(b).unwrap())).unwrap();
        let verdict = screen.lines().take(3).collect::<Vec<_>>().join("\n");
        println!("{session} {more:?}: {verdict}");
        let id = worst["id"].as_str().unwrap();
        assert!(verdict.contains(&format!("{id} is worst determined: u = ")), "{worst:#}");
        let parts = worst["budget"].as_array().unwrap();
        let noise = parts.iter().find(|part| part["source"] == "noise").unwrap()["share"].as_f64().unwrap();
        if noise >= 0.5 {
            assert!(verdict.contains(&format!("the noise limits {id}")), "{noise}");
        } else {
            let setup = parts.iter().filter(|part| part["source"] != "noise");
            let share = |part: &&Value| part["share"].as_f64().unwrap();
            let largest = setup.clone().map(|part| share(&part)).fold(0.0, f64::max);
            // Rounding decides nothing among equal shares.
            let named = setup.filter(|part| share(part) > largest * (1.0 - 1e-9));
            let mut named = named.map(|part| format!("which limits {id}: {} ", part["source"].as_str().unwrap()));
            assert!(named.any(|named| verdict.contains(&named)), "{verdict}");
        }
    }
    let (screen, _) = printed("plan", "hermle-c600u/chapter5.toml", &[]);
    println!("{screen}");
    assert!(screen.lines().count() <= 40, "{} lines", screen.lines().count());
}

/// Errors that no test determines are named in front of all others.
#[test]
fn a_plan_names_errors_that_are_not_identifiable() {
    let folder = tempfile::tempdir().unwrap();
    let plan = std::fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap();
    // Without the tests of A.
    let first = plan.find("[[test]]\nname = \"C100\"").unwrap();
    let without = format!("{}{}", &plan[..plan.find("[[test]]").unwrap()], &plan[first..]);
    std::fs::copy(ready("hermle-c600u/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let file = folder.path().join("plan.toml");
    std::fs::write(&file, without).unwrap();
    let output = abbe(&["plan", text(&file), "--no-effects"]);
    let screen = String::from_utf8(output.stdout).unwrap();
    let first = screen.lines().next().unwrap();
    assert!(first.starts_with("The plan does not identify ") && first.contains("EC0A"), "{screen}");
}

/// Every result opens with three statements, and JSON has them: is it good, what to correct, what to measure next.
#[test]
fn results_open_with_three_statements() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (measured, model, results) = (ready("hermle-c600u/measured/session.toml"), at("model.json"), at("results"));
    let session = at("dated.toml");
    let dated = std::fs::read_to_string(&measured).unwrap();
    std::fs::write(&session, format!("[about]\ndate = \"2026-01-10\"\n{dated}")).unwrap();
    for file in std::fs::read_dir(measured.parent().unwrap()).unwrap().map(|entry| entry.unwrap().path()) {
        std::fs::copy(&file, at(file.file_name().unwrap().to_str().unwrap())).unwrap();
    }
    let analysed = abbe(&["fleet", "run", text(&session), "--out", text(&results), "--no-trace", "--quiet"]);
    assert!(analysed.status.success(), "{}", String::from_utf8_lossy(&analysed.stderr));
    for command in [
        vec!["fit", text(&measured), "--save", text(&model)],
        vec!["plan", text(&measured), "--no-effects"],
        vec!["validate", text(&model), text(&measured)],
        vec!["compare", text(&model), text(&measured), "--places", "0"],
        vec!["fleet", "history", text(&results)],
    ] {
        let (json, page) = (at("result.json"), at("result.html"));
        let output = abbe(&[&command[..], &["--json", text(&json), "--report", text(&page)]].concat());
        let screen = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
        let result: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
        for part in ["good", "correct", "measure"] {
            assert!(!result["statements"][part].is_null(), "{command:?}: {part}");
        }
        let page = std::fs::read_to_string(&page).unwrap();
        for words in ["What to correct: ", "What to measure next: "] {
            let place = screen.find(words).unwrap_or_else(|| panic!("{command:?}: {words} in\n{screen}"));
            // Above all tables and figures.
            assert!(screen[..place].lines().count() <= 5, "{command:?}\n{screen}");
            assert!(page.split("<h2").next().unwrap().contains(words), "{command:?}: {words}");
        }
    }
}
