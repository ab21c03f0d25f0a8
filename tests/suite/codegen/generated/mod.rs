//! Plans that `abbe new --from-code` writes: their content, and their fits to readings of the independent simulator.
//!
//! The tests draw errors and set-ups, and the plant simulates the readings. The figures in the docs are those of
//!
//! ```text
//! ABBE_STUDY=100 cargo test --profile checked --test main generated -- --nocapture --test-threads 1
//! ```

mod draw;
mod pulls;

use std::fs;
use std::path::{Path, PathBuf};

use abbe::files::{self, ReadOptions};
use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::instrument::Station;
use abbe::model::instrument::ballbar::BallBar;
use abbe::model::session::planned::planned_session;
use abbe::model::session::{Session, Test};
use abbe::plan::{PlanOptions, analyse};

use self::draw::draw;
use crate::plant::chain::{Chain, ChainErrors};
use crate::suite::plan::topologies::{FIGURE_1_1, TABLE_1_1};
use crate::suite::{abbe, text};

/// Unusual codes: rotary axes on both sides in any order, linear axes on and behind rotary ones, parallel axes, one
/// rotary axis.
const MIXED: [&str; 5] =
    ["w B X b Y Z A t", "w C A X b Y Z B t", "w X Y Z b C B t", "w C b U V W t", "w Y A b X Z W C t"];

/// Further codes, some without some of the linear axes.
const OTHERS: [&str; 6] =
    ["w b Z X Y C B t", "[wCbt]", "[wCbXYt]", "w C b Z A t", "w C B A b X Y Z t", "w b X Y C Z t"];

fn codes() -> impl Iterator<Item = &'static str> {
    TABLE_1_1.into_iter().chain(FIGURE_1_1).chain(MIXED)
}

/// The plan that the command writes for a code.
fn generated(code: &str, folder: &Path) -> Session {
    let made = folder.join(code.replace(' ', "-"));
    let run = abbe(&["new", text(&made), "--from-code", code]);
    assert!(run.status.success(), "{code}: {}", String::from_utf8_lossy(&run.stderr));
    files::session(&plan_file(code, folder), &ReadOptions::default()).unwrap_or_else(|fault| panic!("{code}: {fault}"))
}

/// The file of the plan of a code.
fn plan_file(code: &str, folder: &Path) -> PathBuf {
    folder.join(code.replace(' ', "-")).join("plan.toml")
}

/// The plant of a code, with its axes where the machine file states them.
fn chain(code: &str, plan: &Session) -> Chain {
    let mut chain = Chain::from_code(code);
    for link in chain.workpiece_side.iter_mut().chain(&mut chain.tool_side) {
        let stated = &plan.machine.axes[plan.machine.axis_index(&link.letter.to_string()).unwrap()];
        link.axis.origin_mm = stated.origin_mm.into();
    }
    chain
}

fn bar(test: &Test) -> &BallBar<f64> {
    match &test.station {
        Station::BallBar(bar) => bar,
        other => panic!("{}: {other:?}", test.name),
    }
}

/// Asserts that tests with one set-up state one position and one uncertainty of its ball, and that the nominal length
/// of the plant is the stated one.
fn check_described_once(code: &str, plan: &Session, written: &str) {
    assert!(plan.warnings.is_empty(), "{code}: {:?}", plan.warnings);
    for (index, test) in plan.tests.iter().enumerate() {
        for other in &plan.tests[..index] {
            let pair = format!("{code}: {} and {}", other.name, test.name);
            if test.setup == other.setup {
                assert_eq!(bar(test).workpiece_ball, bar(other).workpiece_ball, "{pair}");
            }
            if test.spindle_setup == other.spindle_setup {
                assert_eq!(bar(test).spindle_ball, bar(other).spindle_ball, "{pair}");
            }
            if test.bar_setup == other.bar_setup {
                assert_eq!(bar(test).bar, bar(other).bar, "{pair}");
            }
            assert_eq!(test.priors, other.priors, "{pair}");
        }
    }
    let chain = chain(code, plan);
    for (test, readings) in plan.tests.iter().zip(planned_session(plan).unwrap()) {
        let stated = bar(test);
        let mut still = vec![true; plan.machine.axes.len()];
        for row in 0..readings.rows() {
            let position = |letter: char| {
                let axis = plan.machine.axis_index(&letter.to_string()).unwrap();
                readings.positions[axis][row]
            };
            for (axis, still) in still.iter_mut().enumerate() {
                *still &= readings.positions[axis][row] == readings.positions[axis][0];
            }
            let none = ChainErrors::default();
            let length = chain.reading_mm(&position, stated.workpiece_ball.mm, stated.spindle_ball.mm, &none);
            assert!((length - stated.bar).abs() < 1e-9, "{code} {}: {length} at reading {row}", test.name);
        }
        // Every stationary axis is at the position that the file states.
        let start = written.find(&format!("name = \"{}\"", test.name)).unwrap();
        let of_test = written[start..].split("[[test]]").next().unwrap();
        for (axis, still) in still.into_iter().enumerate() {
            let name = plan.machine.axes[axis].name.to_lowercase();
            let listed = [" ", "{ "].iter().any(|before| {
                ["mm", "deg"].iter().any(|unit| {
                    of_test
                        .lines()
                        .any(|line| line.starts_with("at = ") && line.contains(&format!("{before}{name}_{unit} = ")))
                })
            });
            assert_eq!(listed, still, "{code} {}: {name}\n{of_test}", test.name);
            if still {
                assert_eq!(readings.positions[axis][0], test.at[axis], "{code} {}", test.name);
            }
        }
    }
}

#[test]
fn two_tests_of_one_set_up_place_a_ball_at_one_point() {
    let folder = tempfile::tempdir().unwrap();
    for code in codes().chain(OTHERS) {
        let plan = generated(code, folder.path());
        let written = fs::read_to_string(plan_file(code, folder.path())).unwrap();
        check_described_once(code, &plan, &written);
        let options = PlanOptions { effects: false, ..PlanOptions::default() };
        let analysis = analyse(&plan, &options).unwrap();
        assert!(analysis.warnings.is_empty(), "{code}: {:?}", analysis.warnings);
        assert!(
            analysis.unidentifiable.is_empty(),
            "{code}: {:?}",
            analysis.unidentifiable.iter().map(|item| &item.why).collect::<Vec<_>>()
        );
    }
}

#[test]
fn one_mount_of_each_ball_serves_a_whole_machine() {
    let folder = tempfile::tempdir().unwrap();
    for code in codes() {
        let plan = generated(code, folder.path());
        let first = &plan.tests[0];
        let one = |test: &Test| test.setup == first.setup && test.spindle_setup == first.spindle_setup;
        assert!(plan.tests.iter().all(one), "{code}");
    }
}

#[test]
fn a_ball_that_no_axis_moves_is_mounted_again_with_a_comment() {
    let folder = tempfile::tempdir().unwrap();
    for (code, test, along) in [("[wCbt]", "C150", "Z"), ("[wCbXYt]", "C150", "Z"), ("w b X Y C Z t", "C150", "Z")] {
        let plan = generated(code, folder.path());
        let comment = format!("No linear axis can move the balls there along {along}:");
        let written = fs::read_to_string(plan_file(code, folder.path())).unwrap();
        let start = written.find(&format!("name = \"{test}\"")).unwrap();
        assert!(written[..start].contains(&comment), "{code}\n{written}");
        let first = &plan.tests[0];
        let again = plan.tests.iter().find(|other| other.name == test).unwrap();
        assert!(again.setup != first.setup || again.spindle_setup != first.spindle_setup, "{code}");
    }
}

/// On the axis of a head is the head itself: without linear axes that follow it, no bar is set up for it.
#[test]
fn a_head_that_no_linear_axes_follow_is_not_tested() {
    let folder = tempfile::tempdir().unwrap();
    let plan = generated("w C b Z A t", folder.path());
    assert!(plan.unknowns.iter().all(|name| name.to_string().ends_with('C')), "{:?}", plan.unknowns);
    let written = fs::read_to_string(plan_file("w C b Z A t", folder.path())).unwrap();
    assert!(written.contains("# A: no linear axes follow it with a bar that stays clear of the head"), "{written}");
    let run = abbe(&["new", text(&folder.path().join("none")), "--from-code", "w b Z B t"]);
    let message = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(message.contains("a bar cannot be set up for any test") && message.contains("X, Y and Z"), "{message}");
    assert!(!folder.path().join("none").exists());
}

#[test]
fn simulate_and_the_plant_agree_on_a_generated_plan() {
    let folder = tempfile::tempdir().unwrap();
    for (number, code) in codes().chain(OTHERS).enumerate() {
        let mut plan = generated(code, folder.path());
        let drawn = draw(code, &plan, number as u64, 0.0);
        plan.resolution_mm = None;
        let given = drawn.values.iter().map(|(id, value)| Given {
            id: id.clone(),
            value: *value,
            unit: if "ABC".contains(id.chars().nth(1).unwrap()) && id.starts_with('E') {
                "arcsec".to_string()
            } else {
                "um".to_string()
            },
        });
        let simulation = Simulation { given: given.collect(), noise_mm: Some(0.0), ..Simulation::default() };
        let simulated = simulate(&plan, &simulation).unwrap();
        for (test, readings) in drawn.measured.tests.iter().zip(&simulated.readings) {
            let plant = &test.readings.as_ref().unwrap().observed;
            assert_eq!(plant.len(), readings.observed.len());
            for (plant, abbe) in plant.iter().zip(&readings.observed) {
                assert!((plant - abbe).abs() < 1e-9, "{code} {}: {plant} {abbe}", test.name);
            }
        }
    }
}

#[test]
fn plan_simulate_and_fit_run_on_a_generated_plan() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let code = "w b Z X Y C B t";
    generated(code, folder.path());
    let file = plan_file(code, folder.path());
    let (run, json) = (at("run"), at("fit.json"));
    let measured = run.join("session.toml");
    let steps: [&[&str]; 3] = [
        &["plan", text(&file), "--no-effects"],
        &[
            "simulate",
            text(&file),
            "--out",
            text(&run),
            "--draw-setups",
            "--error",
            "EA0C=12arcsec",
            "--error",
            "EX0B=-9um",
            "--seed",
            "4",
        ],
        &["fit", text(&measured), "--json", text(&json)],
    ];
    for arguments in steps {
        let ran = abbe(arguments);
        let stderr = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert!(ran.status.success(), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("warning"), "{arguments:?}: {stderr}");
    }
    let fitted: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    for parameter in fitted["parameters"].as_array().unwrap() {
        let id = parameter["id"].as_str().unwrap();
        if !id.starts_with('E') {
            continue;
        }
        let truth = match id {
            "EA0C" => 12.0,
            "EX0B" => -9.0,
            _ => 0.0,
        };
        let (value, u) = (parameter["value"].as_f64().unwrap(), parameter["u"].as_f64().unwrap());
        assert!((value - truth).abs() < 4.5 * u, "{id}: {value} ± {u}");
    }
    // The data contain the positions of the axes, and the ball has not moved.
    let lifted = std::fs::read_to_string(run.join("C150.csv")).unwrap();
    let header: Vec<&str> = lifted.lines().next().unwrap().split(',').collect();
    let z = header.iter().position(|name| *name == "z_mm").unwrap();
    for line in lifted.lines().skip(1) {
        let z: f64 = line.split(',').nth(z).unwrap().parse().unwrap();
        // The tilt that brings the spindle ball to 100 mm from the axis lifts it, 250 mm below the pivot.
        assert!((z - 12_500_f64.sqrt() + 250.0 * (1.0 - 0.84_f64.sqrt())).abs() < 1e-6, "{line}");
    }
}
