//! The same input, seed and binary give the same bytes for any number of threads.
//!
//! Every command runs twice with the same files, once with one thread and once with two, each in a folder of its own.
//! Standard output and all files of the folder are compared byte by byte. Each run is a process, so hash tables have
//! different seeds.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::suite::ready;

/// All files below a folder, with their contents.
fn contents(folder: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>, root: &Path) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            contents(&path, files, root);
        } else {
            files.insert(path.strip_prefix(root).unwrap().to_path_buf(), fs::read(&path).unwrap());
        }
    }
}

/// The outputs of a command with that many threads: its standard output under the name `-`, and all files.
fn outputs(input: &[(&str, String)], threads: &str, commands: &[Vec<&str>]) -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in input {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let mut printed = Vec::new();
    for arguments in commands {
        let output = Command::new(env!("CARGO_BIN_EXE_abbe"))
            .args(arguments)
            .current_dir(folder.path())
            .env("RAYON_NUM_THREADS", threads)
            .output()
            .expect("the command starts");
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        printed.extend(output.stdout);
        printed.extend(output.stderr);
    }
    let mut files = BTreeMap::from([(PathBuf::from("-"), printed)]);
    contents(folder.path(), &mut files, folder.path());
    files
}

/// Runs the commands with one thread and with two and asserts equal bytes. Returns the number of compared files.
#[track_caller]
fn the_same(input: &[(&str, String)], commands: &[Vec<&str>]) -> usize {
    let one = outputs(input, "1", commands);
    let two = outputs(input, "2", commands);
    assert_eq!(one.keys().collect::<Vec<_>>(), two.keys().collect::<Vec<_>>(), "other files");
    for (name, bytes) in &one {
        let differs = bytes.iter().zip(&two[name]).position(|(a, b)| a != b);
        let lengths = (bytes.len(), two[name].len());
        assert!(bytes == &two[name], "{}: differs at byte {differs:?}, lengths {lengths:?}", name.display());
    }
    one.len()
}

/// The plan of chapter 5 with coarse steps, so that a search takes seconds, and its machine.
fn plan() -> Vec<(&'static str, String)> {
    let read = |name: &str| fs::read_to_string(ready(&format!("hermle-c600u/{name}"))).unwrap();
    let plan =
        read("chapter5.toml").replace("step_deg = 0.25", "step_deg = 3").replace("step_deg = 0.5", "step_deg = 6");
    vec![("plan.toml", plan), ("machine.toml", read("machine.toml"))]
}

/// The same with an axial error motion that the simulated session does not declare.
fn with_axial_motion() -> Vec<(&'static str, String)> {
    let mut input = plan();
    input[0].1.push_str("\n[[effect]]\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n");
    input
}

const SEEDS: [&str; 3] = ["1", "2", "3"];

fn simulate(seed: &str) -> Vec<&str> {
    let effect = "EZC~C:h2.amplitude=1.5um";
    let errors = ["--error", "EY0A=35.3um", "--error", "EB0A=-1.29arcsec"];
    let mut arguments = vec!["simulate", "plan.toml", "--out", "run", "--draw-setups", "--seed", seed];
    arguments.extend(errors);
    arguments.extend(["--effect", effect, "--hide-effects"]);
    arguments
}

#[test]
fn a_fit() {
    for seed in SEEDS {
        let files = the_same(
            &with_axial_motion(),
            &[
                simulate(seed),
                vec![
                    "fit",
                    "run/session.toml",
                    "--seed",
                    seed,
                    "--json",
                    "fit.json",
                    "--csv",
                    "fit.csv",
                    "--report",
                    "fit.html",
                    "--plots",
                    "plots",
                ],
                vec!["fit", "run/session.toml", "--method", "cone", "--json", "cone.json"],
            ],
        );
        assert!(files > 12, "{files}");
    }
}

#[test]
fn a_trace() {
    for seed in SEEDS {
        let files = the_same(
            &with_axial_motion(),
            &[
                simulate(seed),
                vec![
                    "trace",
                    "run/session.toml",
                    "--quiet",
                    "--seed",
                    seed,
                    "--json",
                    "trace.json",
                    "--csv",
                    "trace.csv",
                    "--report",
                    "trace.html",
                    "--plots",
                    "plots",
                    "--write",
                    "next.toml",
                ],
            ],
        );
        assert!(files > 12, "{files}");
    }
}

#[test]
fn a_plan() {
    for seed in SEEDS {
        the_same(
            &plan(),
            &[
                vec!["plan", "plan.toml", "--seed", seed, "--json", "plan.json", "--report", "plan.html"],
                vec!["plan", "plan.toml", "--seed", seed, "--improve", "1", "--json", "improve.json"],
            ],
        );
    }
}

#[test]
fn monte_carlo() {
    // Two tests of the four, because each draw is a complete fit.
    let mut input = plan();
    let (head, tests) = input[0].1.split_once("[[test]]").unwrap();
    let tests: Vec<&str> = tests.split("[[test]]").filter(|test| test.contains("name = \"C1")).collect();
    assert_eq!(tests.len(), 2);
    input[0].1 = format!("{head}[[test]]{}", tests.join("[[test]]")).replace("step_deg = 6", "step_deg = 30");
    for seed in SEEDS {
        the_same(
            &input,
            &[
                vec!["simulate", "plan.toml", "--out", "run", "--seed", seed],
                vec!["fit", "run/session.toml", "--seed", seed, "--monte-carlo", "10000", "--json", "fit.json"],
            ],
        );
    }
    let measured = ready("self-calibration/measured/session.toml");
    let measured = measured.to_str().unwrap();
    for seed in SEEDS {
        the_same(
            &[],
            &[vec![
                "fit",
                measured,
                "--method",
                "self-calibration",
                "--seed",
                seed,
                "--monte-carlo",
                "20000",
                "--json",
                "fit.json",
            ]],
        );
    }
}

#[test]
fn equations_and_maps() {
    let errors = ready("volumetric/errors.toml");
    let machine = ready("volumetric/machine.toml");
    let (errors, machine) = (errors.to_str().unwrap(), machine.to_str().unwrap());
    the_same(
        &plan(),
        &[
            vec!["equation", "plan.toml", "--test", "A150", "--order", "first"],
            vec!["equation", "plan.toml", "--test", "C150", "--as", "c", "--gradient", "--out", "c150.c"],
            vec!["volumetric", machine, "--map", "map.csv", "--functions", errors, "--correction"],
        ],
    );
}

/// The option of the command has the effect of the environment, and none on the result.
#[test]
fn the_option_for_threads_changes_no_result() {
    let folder = tempfile::tempdir().unwrap();
    let session = ready("hermle-c600u/measured/session.toml");
    let result = |threads: &str| {
        let json = folder.path().join(format!("{threads}.json"));
        let output = Command::new(env!("CARGO_BIN_EXE_abbe"))
            .args(["fit", session.to_str().unwrap(), "--threads", threads, "--json", json.to_str().unwrap()])
            .output()
            .expect("the command starts");
        (output.status.success(), fs::read(json).ok(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let [(_, one, _), (_, two, _)] = ["1", "2"].map(result);
    assert!(one.is_some() && one == two);
    let (is_done, _, said) = result("0");
    assert!(!is_done && said.contains("--threads"), "{said}");
}
