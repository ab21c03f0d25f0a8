//! Robots of an independent chain: what the search chooses among families and single effects, against a fit that knows the
//! form of the errors; and the test of the remaining structure.

use std::path::Path;

use abbe::files::{ReadOptions, session};
use abbe::identify::model_file::{IdentifiedModel, Provenance};
use abbe::identify::results::TraceVerdict;
use abbe::model::session::Session;
use abbe::trace::validate::validate;
use abbe::trace::{TraceOptions, TraceOutcome, trace};
use rayon::prelude::*;

use super::rates::Rate;
use super::sessions::{sessions, skipped, verbose};
use crate::plant::robot::{Effects, Robot, RobotOracle, Wave};

/// Poses of the second set.
const SECOND: usize = 300;
/// What the figures of the oracle may be exceeded by.
const NEAR: f64 = 1.1;

fn read(folder: &Path, name: &str) -> Session {
    session(&folder.join(format!("{name}.toml")), &ReadOptions::default()).unwrap()
}

fn searched(session: &Session, exclude: &[&str], max_effects: Option<usize>) -> TraceOutcome {
    let exclude = exclude.iter().map(|text| text.to_string()).collect();
    trace(session, &TraceOptions { exclude, max_effects, ..TraceOptions::default() }, &|_| true).unwrap()
}

/// A robot, searched in three ways.
struct Searched {
    number: u64,
    truth: String,
    oracle_heldout_um: f64,
    oracle_second_um: f64,
    second_um: f64,
    stated: TraceOutcome,
    unstated: TraceOutcome,
    single: TraceOutcome,
}

fn robot(number: u64) -> Searched {
    let mut robot = Robot::new(number, Effects::Drawn);
    let (first, second) = (robot.measure(robot.poses), robot.measure(SECOND));
    let folder = tempfile::tempdir().unwrap();
    for (name, measured, stated) in [("stated", &first, true), ("unstated", &first, false), ("second", &second, true)] {
        robot.write(folder.path(), name, measured, stated).unwrap();
    }
    let [of_stated, of_unstated, of_second] = ["stated", "unstated", "second"].map(|name| read(folder.path(), name));
    let stated = searched(&of_stated, &[], None);
    let model = IdentifiedModel::of_fit(&stated.after, &stated.after_fit, Provenance::default()).unwrap();
    let oracle = RobotOracle::new(&robot, &first);
    let wave = |wave: &Wave| format!("J{} {}: {:.0}″", wave.joint + 1, wave.order, wave.amplitude * 206_265.0);
    let waves: Vec<String> = robot.waves.iter().map(wave).collect();
    let compliant = if robot.is_compliant() { ", compliance" } else { "" };
    let (poses, noise) = (robot.poses, robot.noise_mm * 1e3);
    Searched {
        number,
        truth: format!("{poses} poses, noise {noise:.0} µm, {}{compliant}", waves.join(", ")),
        oracle_heldout_um: oracle.heldout_um(&first),
        oracle_second_um: oracle.predicted_um(&second),
        second_um: validate(&model, &of_second).unwrap().result.model.residual.rms.rms_um,
        unstated: searched(&of_unstated, &[], None),
        single: searched(&of_stated, &[":spectrum", "~gravity"], None),
        stated,
    }
}

impl Searched {
    /// Whether the verdict "explained" goes with a residual like noise.
    fn is_honest(&self) -> bool {
        let result = &self.stated.result;
        result.verdict != TraceVerdict::Explained
            || result.after.outcome.goodness.chi_square_ratio <= 1.3 && !result.remainder.structured
    }

    fn summary(&self) -> String {
        let figures = |outcome: &TraceOutcome| {
            let ids: Vec<String> = outcome.effects.iter().map(|effect| effect.id()).collect();
            format!("{:.1} {} {}", outcome.result.after.fit.heldout_rms_um, outcome.result.verdict, ids.join(" "))
        };
        format!(
            "{}: {}; oracle {:.1} {:.1}, second {:.1}\n  stated {}\n  unstated {}\n  single {}",
            self.number,
            self.truth,
            self.oracle_heldout_um,
            self.oracle_second_um,
            self.second_um,
            figures(&self.stated),
            figures(&self.unstated),
            figures(&self.single)
        )
    }
}

/// A turn of J1 about its own axis and an inclination of J2 that turns with J1 are one motion if J2 lies on the axis of J1:
/// the simpler one is named, and the other is among its aliases.
fn names_the_simpler_of_two_equal_effects(outcome: &TraceOutcome) -> bool {
    let with_alias = outcome.effects.iter().zip(&outcome.alias_effects);
    with_alias
        .filter(|(effect, _)| effect.id() == "ECJ1~J1:h1")
        .all(|(_, aliases)| aliases.iter().any(|alias| alias.id() == "EC0J2~J1:h1"))
}

#[test]
fn a_search_on_robots_predicts_as_well_as_a_fit_that_knows_the_effects() {
    if skipped("a_search_on_robots_predicts_as_well_as_a_fit_that_knows_the_effects") {
        return;
    }
    let found: Vec<Searched> = (0..sessions() as u64).into_par_iter().map(robot).collect();
    let [mut heldout, mut second, mut families, mut statement, mut honest] = [Rate::default(); 5];
    for one in &found {
        let [stated, unstated, single] =
            [&one.stated, &one.unstated, &one.single].map(|outcome| outcome.result.after.fit.heldout_rms_um);
        heldout.count(stated <= NEAR * one.oracle_heldout_um);
        second.count(one.second_um <= NEAR * one.oracle_second_um);
        families.count(stated <= 1.01 * single);
        statement.count((stated / unstated - 1.0).abs() < 0.02);
        honest.count(one.is_honest());
        assert!(names_the_simpler_of_two_equal_effects(&one.stated), "{}", one.summary());
        if verbose() {
            println!("{}", one.summary());
        }
    }
    println!(
        "| robots | |\n|---|---|\n| held-out error within 10 % of the oracle's | {heldout} |\n\
         | second set within 10 % of the oracle's | {second} |\n| held-out error not above that without families | {families} |\n\
         | the same with and without a stated noise | {statement} |\n| explained only where the residual is noise | {honest} |"
    );
    assert!(heldout.is_consistent_with_at_least(0.9), "{heldout}");
    assert!(second.is_consistent_with_at_least(0.9), "{second}");
    assert!(families.is_consistent_with_at_least(0.98), "{families}");
    assert!(statement.is_consistent_with_at_least(0.95), "{statement}");
    assert_eq!(honest.hits, honest.of, "{honest}");
}

/// As many parameters as readings leave no residual, and no noise to estimate.
#[test]
fn a_search_on_few_poses_ends() {
    for poses in [2, 3, 5, 8, 13, 17, 25] {
        let mut robot = Robot::new(poses as u64, Effects::Drawn);
        let measured = robot.measure(poses);
        let folder = tempfile::tempdir().unwrap();
        for (name, stated) in [("stated", true), ("unstated", false)] {
            robot.write(folder.path(), name, &measured, stated).unwrap();
            let found = trace(&read(folder.path(), name), &TraceOptions::default(), &|_| true);
            assert!(found.is_ok(), "{poses} poses, {name}: {:?}", found.err());
        }
    }
}

/// p-values of the structure that remains beside the declared model.
fn remaining(effects: Effects, first: u64) -> Vec<f64> {
    let p_value = |number: u64| {
        let mut robot = Robot::new(first + number, effects);
        let measured = robot.measure(robot.poses);
        let folder = tempfile::tempdir().unwrap();
        robot.write(folder.path(), "stated", &measured, true).unwrap();
        searched(&read(folder.path(), "stated"), &[], Some(0)).result.remainder.p_value
    };
    (0..sessions() as u64).into_par_iter().map(p_value).collect()
}

#[test]
fn neighbouring_poses_tell_whether_structure_remains() {
    if skipped("neighbouring_poses_tell_whether_structure_remains") {
        return;
    }
    let below = |p_values: &[f64], level: f64| {
        let mut rate = Rate::default();
        p_values.iter().for_each(|p_value| rate.count(*p_value <= level));
        rate
    };
    let clean = remaining(Effects::None, 10_000);
    let eccentric = remaining(Effects::Eccentricity(3), 20_000);
    let (false_alarms, power) = (below(&clean, 0.05), below(&eccentric, 0.05));
    println!(
        "| structure beside independent poses | |\n|---|---|\n| nothing remains, p ≤ 0.05 | {false_alarms} |\n\
         | nothing remains, p ≤ 0.01 | {} |\n| an eccentricity of 3 σ, p ≤ 0.05 | {power} |\n| the same, p ≤ 0.01 | {} |",
        below(&clean, 0.01),
        below(&eccentric, 0.01)
    );
    assert!(false_alarms.is_consistent_with_at_most(0.07), "{false_alarms}");
    assert!(power.is_consistent_with_at_least(0.9), "{power}");
}
