//! Fit, trace and validation: estimates, uncertainties and verdicts against independent data.

pub mod below_noise;
pub mod channels;
pub mod circular;
pub mod claims;
pub mod closed_loop;
pub mod conformity;
pub mod conformity_set_up;
pub mod conformity_shares;
pub mod doors;
pub mod free_set_ups;
pub mod geometric;
pub mod left_out_test;
pub mod measured;
pub mod metamorphic;
pub mod nist;
pub mod one_answer;
pub mod parameter_ids;
pub mod patterns;
pub mod plausibility;
pub mod pointing;
pub mod propagation;
pub mod recovery;
pub mod repeated;
pub mod robots;
pub mod rtest;
pub mod rtest_command;
pub mod rtest_findings;
pub mod self_calibration;
pub mod set_up_mistakes;
pub mod simulate;
pub mod statements;
pub mod targets;
pub mod trace;
pub mod trace_claims;
pub mod trace_reported;
pub mod tracker_blunders;
pub mod validate_command;

use std::path::Path;

use abbe::files::{self, ReadOptions};
use abbe::model::session::Session;
use serde_json::Value;

use crate::plant::{Plan, Recipe};
use crate::suite::{abbe, text};

/// The result of a command on a session, and what it prints.
pub fn result_and_screen(command: &str, session: &Path, more: &[&str]) -> (Value, String) {
    let json = session.with_file_name(format!("{command}.json"));
    let run = abbe(&[&[command, text(session), "--json", text(&json)], more].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let screen = String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr);
    (serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap(), screen)
}

/// A session in a folder, after a change of the lines of its data files: name of the test, number of the line, cells.
pub fn session_of(recipe: &Recipe, plan: &Plan, change: impl Fn(&str, usize, &mut Vec<String>)) -> Session {
    let folder = tempfile::tempdir().unwrap();
    recipe.draw_on(plan).write(folder.path()).unwrap();
    for test in &plan.tests {
        let file = folder.path().join(format!("{}.csv", test.name));
        let lines = std::fs::read_to_string(&file).unwrap();
        let changed = lines.lines().enumerate().map(|(number, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
            change(&test.name, number, &mut cells);
            cells.join(",") + "\n"
        });
        std::fs::write(&file, changed.collect::<String>()).unwrap();
    }
    files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap()
}

/// Changes the last cell of a line of data, the length in mm.
pub fn with_length(cells: &mut [String], change: impl Fn(f64) -> f64) {
    let last = cells.last_mut().unwrap();
    if let Ok(length) = last.parse::<f64>() {
        *last = format!("{:.4}", change(length));
    }
}
