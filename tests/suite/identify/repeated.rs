//! Repeated sessions: the scatter of their fits against the standard uncertainties of the fits.

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::prepare;
use abbe::identify::quantity::Given;
use abbe::identify::repeated::{Repeated, Scatter, Session as Fitted, compare};
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::session::Session;
use rayon::prelude::*;

use crate::suite::identify::recovery::THESIS;
use crate::suite::{abbe, ready, text};

/// The plan of chapter 5 with a reading every 10°.
fn plan() -> Session {
    let whole = std::fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap();
    let coarse = whole.replace("step_deg = 0.25", "step_deg = 10").replace("step_deg = 0.5", "step_deg = 10");
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(ready("hermle-c600u/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let path = folder.path().join("session.toml");
    std::fs::write(&path, coarse).unwrap();
    let mut session = files::session(&path, &ReadOptions::default()).unwrap();
    session.resolution_mm = None;
    session
}

/// The fit of one session with drawn or nominal set-ups, the errors of the thesis and an optional additional error.
fn session(plan: &Session, seed: u64, draw_setups: bool, changed: Option<&str>) -> Fitted {
    let mut given: Vec<Given> = THESIS.iter().map(|text| Given::parse(text).unwrap()).collect();
    if let Some(changed) = changed.map(|text| Given::parse(text).unwrap()) {
        given.retain(|other| other.id != changed.id);
        given.push(changed);
    }
    let simulation = Simulation { given, draw_setups, seed, ..Simulation::default() };
    let measured = plan.clone().with_readings(simulate(plan, &simulation).unwrap().readings);
    let (problem, fit) = prepare(&measured, 1).unwrap();
    Fitted::new(&format!("session {seed}"), &problem, &fit)
}

fn sessions(plan: &Session, seeds: std::ops::Range<u64>, draw_setups: bool) -> Vec<Fitted> {
    let one = |seed| session(plan, seed, draw_setups, None);
    seeds.into_par_iter().map(one).collect()
}

fn all_as_stated(result: &Repeated) -> bool {
    let stated = |p: &abbe::identify::repeated::RepeatedParameter| p.scatter == Scatter::AsStated;
    result.parameters.iter().all(stated) && result.deviating.is_empty()
}

#[test]
fn sessions_with_new_set_ups_scatter_by_the_stated_uncertainty() {
    let plan = plan();
    let all = sessions(&plan, 0..200, true);
    let result = compare(&all).unwrap();
    assert_eq!(result.parameters.len(), 8, "set-ups are not compared");
    // The standard deviation of 200 values has a relative standard deviation of 1/√(2·199) = 0.05.
    for parameter in &result.parameters {
        let ratio = parameter.ratio.unwrap();
        assert!((ratio - 1.0).abs() < 4.0 * 0.05, "{}: {ratio}", parameter.id);
        let (mean, u) = (parameter.mean, parameter.u_type_b / 200.0_f64.sqrt());
        let truth: f64 = THESIS
            .iter()
            .map(|text| Given::parse(text).unwrap())
            .find(|given| given.id == parameter.id || literature(&given.id) == parameter.id)
            .unwrap()
            .value;
        assert!((mean - truth).abs() < 4.0 * u, "{}: {mean} {truth} {u}", parameter.id);
    }
    // Both tests of a group of five have a level of 1 %; of forty groups hardly more than two exceed it.
    let groups: Vec<Repeated> = all.chunks(5).map(|group| compare(group).unwrap()).collect();
    let called = groups.iter().filter(|group| !all_as_stated(group)).count();
    assert!(called <= 4, "{called} of {} groups", groups.len());
}

fn literature(id: &str) -> &'static str {
    match id {
        "θ_y0a" => "EB0A",
        "θ_z0a" => "EC0A",
        "θ_x0c" => "EA0C",
        "θ_y0c" => "EB0C",
        _ => "",
    }
}

#[test]
fn a_session_with_a_bias_is_named() {
    let plan = plan();
    // 10 µm on a position with u = 1 µm in one session.
    for biased in [0_u64, 3] {
        let one = |seed| session(&plan, 400 + seed, true, (seed == biased).then_some("EZ0A=-23.4um"));
        let group: Vec<Fitted> = (0..5).map(one).collect();
        let result = compare(&group).unwrap();
        let off = &result.deviating;
        assert_eq!(off.len(), 1, "{off:?}");
        assert_eq!((off[0].session.as_str(), off[0].id.as_str()), (group[biased as usize].name.as_str(), "EZ0A"));
        assert!((off[0].deviation - 10.0).abs() < 4.0 * off[0].u, "{off:?}");
        let parameter = result.parameters.iter().find(|p| p.id == "EZ0A").unwrap();
        assert_eq!(parameter.scatter, Scatter::More);
    }
}

/// A set-up that stays mounted contributes to the uncertainty of every fit but not to the scatter.
#[test]
fn sessions_on_one_mounting_scatter_less() {
    let plan = plan();
    let result = compare(&sessions(&plan, 0..20, false)).unwrap();
    let less = result.parameters.iter().filter(|p| p.scatter == Scatter::Less).count();
    assert!(less >= 4, "{:?}", result.parameters);
    assert!(result.deviating.is_empty());
}

#[test]
fn the_command_compares_files() {
    let folder = tempfile::tempdir().unwrap();
    let plan = ready("tilting-head/session.toml");
    let run = |seed: &str| {
        let out = folder.path().join(format!("day{seed}"));
        let output = abbe(&["simulate", text(&plan), "--out", text(&out), "--draw-setups", "--seed", seed]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        out.join("session.toml")
    };
    let files = ["1", "2", "3"].map(run);
    let json = folder.path().join("repeat.json");
    let output =
        abbe(&["compare", text(&files[0]), text(&files[1]), text(&files[2]), "--repeated", "--json", text(&json)]);
    let screen = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    for parameter in found["parameters"].as_array().unwrap() {
        let values: Vec<f64> = parameter["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        let mean = values.iter().sum::<f64>() / 3.0;
        assert!((parameter["mean"].as_f64().unwrap() - mean).abs() < 1e-9);
        let s = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 2.0).sqrt();
        assert!((parameter["s"].as_f64().unwrap() - s).abs() < 1e-9);
        assert!(screen.contains(parameter["id"].as_str().unwrap()));
    }

    let refused = |status: i32, arguments: &[&str], part: &str| {
        let mut all = vec!["compare", text(&files[0]), "--repeated"];
        all.extend(arguments);
        let output = abbe(&all);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{stderr}");
        assert!(stderr.contains(part), "{stderr}");
    };
    refused(1, &[text(&files[0])], "is named twice");
    let other = ready("hermle-c600u/measured/session.toml");
    refused(1, &[text(&other)], "is not a repeat of");
    refused(2, &[text(&files[1]), "--shared", "bar"], "cannot be used with");
    refused(1, &[text(&plan)], "has no readings");
    let model = folder.path().join("model.json");
    assert!(abbe(&["fit", text(&files[0]), "--save", text(&model), "--quiet"]).status.success());
    refused(1, &[text(&model)], "is a model; `--repeated` compares the fits of sessions");
    let alone = abbe(&["compare", text(&files[0]), text(&files[1]), "--allow-implausible"]);
    assert_eq!(alone.status.code(), Some(2));
}
