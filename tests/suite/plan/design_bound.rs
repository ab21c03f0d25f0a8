//! The bound of a design against the optimum of the weights by SciPy, on the readings of three sessions.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use abbe::files::{self, ReadOptions};
use abbe::identify::noise::{Noise, NoiseSource};
use abbe::identify::problem::RowBlock;
use abbe::plan::design::information::SharedParameters;
use abbe::plan::design::{Design, Goal, bound};
use abbe::plan::states;
use faer::Mat;
use serde_json::{Value, json};

use crate::suite::ready;

/// Candidate readings of each session, evenly taken.
const CANDIDATES: usize = 60;
/// Readings to choose.
const CHOSEN: usize = 12;

fn nested(rows: &Mat<f64>) -> Vec<Vec<f64>> {
    (0..rows.nrows()).map(|i| (0..rows.ncols()).map(|j| rows[(i, j)]).collect()).collect()
}

#[test]
fn bounds_are_the_optima_of_another_program() {
    let Some(python) = test_needs::python("bounds_are_the_optima_of_another_program", "scipy") else { return };
    let mut asked = Vec::new();
    let mut found = Vec::new();
    for file in ["hermle-c600u/chapter5.toml", "r-test/plan.toml", "hermle-c600u/chapter6.toml"] {
        let session =
            files::session(&ready(file), &ReadOptions { read_data: false, ..ReadOptions::default() }).unwrap();
        let plan = states::complete(&session, true).unwrap();
        let problem = states::problem_by_test(&plan, Noise::white(1e-3, NoiseSource::Stated)).unwrap();
        let targets = Goal::A.targets(&problem);
        let others: Vec<usize> = (0..problem.parameters.list.len()).filter(|j| !targets.contains(j)).collect();
        let columns = [others.clone(), targets.clone()].concat();
        let shared = SharedParameters::of(&problem, &others, &targets);
        let values = problem.slot_values(&vec![0.0; columns.len()]);
        let mut rows = Vec::new();
        for (test, model) in problem.models.iter().enumerate() {
            let channels = problem.channels(test);
            let whole = problem.rows(&values, &RowBlock { test, rows: 0..model.rows() }).unwrap();
            rows.extend((0..model.rows()).map(|row| {
                Mat::from_fn(channels, columns.len(), |i, k| whole[(row * channels + i, columns[k])] / 1e-3)
            }));
        }
        let every = rows.len() / CANDIDATES;
        let rows: Vec<Mat<f64>> = rows.into_iter().step_by(every).take(CANDIDATES).collect();
        // A prior of a hundredth of the physical size makes every goal finite.
        let prior = Mat::from_fn(columns.len(), columns.len(), |i, j| if i == j { 1e2 / shared.size[i] } else { 0.0 });
        let base = shared.regularised(prior.as_ref(), 1.0);
        for (word, goal) in [("a", Goal::A), ("d", Goal::D), ("worst", Goal::WorstUncertainty)] {
            let views = rows.iter().map(|rows| rows.as_ref()).collect();
            let design = Design { shared: &shared, base: &base, rows: views, goal: &goal, repeats: true };
            let chosen = design.run(CHOSEN);
            let value = goal.value(&shared, &design.with(&chosen));
            found.push((file, word, bound::best_value(&design, &chosen).unwrap(), value));
            asked.push(json!({
                "goal": word,
                "count": CHOSEN,
                "base": nested(&base),
                "rows": rows.iter().map(nested).collect::<Vec<_>>(),
                "size": shared.size,
                "display": shared.display_per_internal,
                "targets": shared.targets,
            }));
        }
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/plan/design_bound.py");
    let mut solver = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    solver.stdin.take().unwrap().write_all(Value::from(asked).to_string().as_bytes()).unwrap();
    let run = solver.wait_with_output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let optima: Vec<f64> = serde_json::from_slice(&run.stdout).unwrap();
    for ((file, word, bound, value), optimum) in found.into_iter().zip(optima) {
        println!("{file} {word}: bound {bound:.5}, SciPy {optimum:.5}, chosen {value:.5}");
        assert!((bound / optimum - 1.0).abs() < 0.01, "{file} {word}: {bound} against {optimum}");
        assert!(value >= bound, "{file} {word}: {value} below {bound}");
    }
}
