//! A displacement that follows the temperature of the spindle with a first-order lag, and one that follows a
//! temperature collinear with time.

use abbe::files::{ReadOptions, session};
use abbe::trace::result::{EffectName, EffectResult};
use abbe::trace::{TraceOptions, trace};
use nalgebra::Vector3;
use rand::RngExt;

use super::judging::{short, summary};
use super::rates::Rate;
use super::sessions::{NOISES, TracedSession, at_multiple, oracle, random, run, sessions, skipped, verbose};
use crate::plant::families::thermal_components;
use crate::plant::pose::Pose;
use crate::plant::{Driver, Injected, Kind, Shape, Spindle};

/// The displacement in multiples of the smallest significant one. The uncertainty of the time constant is then some
/// 5 %.
const FACTOR: f64 = 20.0;
/// The kinds of sessions that take more than a quarter of an hour.
const KINDS: [Kind; 4] = [Kind::Rotary, Kind::Chapter4, Kind::Chapter6, Kind::TiltedTable];
/// Largest relative deviation of a time constant that counts as found.
const TOLERANCE: f64 = 0.2;
/// A thermal displacement of which more than this share acts through the priors leaves little in the readings.
const LEAST_SHARE: f64 = 0.5;

/// One displacement of a random component that follows the spindle in each session. The sessions are the kinds that
/// last longer than the temperature takes to change: nobody records it between two tests.
fn study(seed: u64, follow: impl Fn(f64) -> (Spindle, Shape) + Sync) -> Vec<TracedSession> {
    run(0..sessions(), |number| {
        let (kind, noise) = (KINDS[number % KINDS.len()], NOISES[number / KINDS.len() % NOISES.len()]);
        let oracle = oracle(kind, noise);
        let mut random = random(seed, number);
        let components = thermal_components(kind);
        let effect = loop {
            let (spindle, shape) = follow(100.0 + 200.0 * random.random::<f64>());
            let component = components[random.random_range(0..components.len())];
            let effect = Injected::new(component, Driver::Spindle(spindle), shape, 1.0);
            let effect = at_multiple(&oracle, &effect, FACTOR);
            if effect.amplitude.is_finite() && oracle.share_in_readings(&effect) > LEAST_SHARE {
                break effect;
            }
        };
        (kind, noise, vec![effect])
    })
}

fn follows_spindle(name: &EffectName) -> bool {
    name.driver == "spindle_temperature_c"
}

#[test]
fn a_spindle_temperature_is_named_with_its_time_constant() {
    if skipped("a_spindle_temperature_is_named_with_its_time_constant") {
        return;
    }
    let outcomes = study(41, |tau_s| (Spindle::Cycles { period_s: 6.0 * tau_s }, Shape::FirstOrderLag { tau_s }));
    let (mut named, mut drifts, mut deviations) = (Rate::default(), Rate::default(), Vec::new());
    for outcome in &outcomes {
        let truth = &outcome.draw.truth.effects[0];
        let Shape::FirstOrderLag { tau_s } = truth.shape else { panic!("{truth:?}") };
        let effects = &outcome.result.effects;
        let found =
            effects.iter().find(|effect| follows_spindle(&effect.name) && effect.name.shape == "first-order-lag");
        let ratio = found.map_or(f64::NAN, |effect| effect.shape_parameters[0].values[0] / tau_s - 1.0);
        deviations.push(ratio.abs());
        let hit = ratio.abs() <= TOLERANCE;
        let drift = effects.iter().any(|effect| effect.name.driver == "time");
        named.count(hit);
        drifts.count(drift);
        if verbose() {
            println!("{} time constant {:+.1} %", summary(outcome, if hit { "ok" } else { "MISS" }), 100.0 * ratio);
        }
    }
    deviations.sort_by(f64::total_cmp);
    println!("| the temperature of the spindle with its time constant within 20 % | {named} |");
    println!("| an effect of time is named | {drifts} |");
    println!("| deviation of the time constant, median | {:.1} % |", 100.0 * deviations[deviations.len() / 2]);
    assert!(named.is_consistent_with_at_least(0.95), "{named}");
    assert!(drifts.hits == 0, "{drifts}");
}

#[test]
fn a_temperature_collinear_with_time_is_an_alias_of_time() {
    if skipped("a_temperature_collinear_with_time_is_an_alias_of_time") {
        return;
    }
    let outcomes = study(42, |_| (Spindle::Rises { rate: 0.01 }, Shape::Polynomial { degree: 1 }));
    let mut both = Rate::default();
    for outcome in &outcomes {
        let names = |effect: &EffectResult| -> Vec<EffectName> {
            std::iter::once(&effect.name).chain(effect.aliases.iter().map(|alias| &alias.name)).cloned().collect()
        };
        let hit = outcome
            .result
            .effects
            .iter()
            .map(names)
            .any(|names| names.iter().any(follows_spindle) && names.iter().any(|name| name.driver == "time"));
        both.count(hit);
        if verbose() {
            let found: Vec<String> = outcome.result.effects.iter().flat_map(names).map(|n| short(&n)).collect();
            println!("{} {found:?}", summary(outcome, if hit { "ok" } else { "MISS" }));
        }
    }
    println!("| temperature and time are named as aliases | {both} |");
    assert!(both.is_consistent_with_at_least(0.95), "{both}");
}

/// A joint that gives under its torque: 200 poses of an arm with three joints, seen by a tracker.
#[test]
fn a_compliance_under_a_measured_torque_is_named_on_poses() {
    const PER_TORQUE_ARCSEC: f64 = 1.0;
    let mut random = random(43, 0);
    let mut uniform = |size: f64| size * (2.0 * random.random::<f64>() - 1.0);
    let about = |direction, height_mm: f64, angle_rad| {
        Pose::slide(Vector3::z() * height_mm)
            .then_inner(Pose::rotation(direction, angle_rad))
            .then_inner(Pose::slide(-Vector3::z() * height_mm))
    };
    let mut data = "J1_deg,J2_deg,J3_deg,driver.torque_j2_nm,px_mm,py_mm,pz_mm\n".to_string();
    for _ in 0..200 {
        let [j1, j2, j3] = [uniform(170.0), uniform(100.0), uniform(120.0)];
        let torque_nm = (10.0 * uniform(100.0)).round() / 10.0;
        let given_rad = (PER_TORQUE_ARCSEC * torque_nm / 3600.0).to_radians();
        let tool = about(Vector3::z(), 0.0, j1.to_radians())
            .then_inner(about(Vector3::y(), 300.0, j2.to_radians() + given_rad))
            .then_inner(about(Vector3::y(), 700.0, j3.to_radians()));
        let target = tool.apply(Vector3::new(60.0, 0.0, 1100.0));
        let seen: Vec<String> = target.iter().map(|mm| format!("{:.4}", mm + uniform(0.02))).collect();
        data += &format!("{j1:?},{j2:?},{j3:?},{torque_nm},{}\n", seen.join(","));
    }
    let axis = |name: &str, direction: &str, z: &str| {
        format!("[axis.{name}]\nkind = \"rotary\"\ndirection = {direction}\norigin_mm = [0, 0, {z}]\n")
    };
    let machine = format!(
        "name = \"Arm\"\nchain = \"w b J1 J2 J3 t\"\n{}{}{}",
        axis("J1", "[0, 0, 1]", "0"),
        axis("J2", "[0, 1, 0]", "300"),
        axis("J3", "[0, 1, 0]", "700")
    );
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("machine.toml", &machine);
    write("poses.csv", &data);
    write(
        "session.toml",
        "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"tracker\"\n[unknowns]\nerrors = [\"EB0J2\", \
         \"EB0J3\"]\n[[test]]\nname = \"poses\"\ndata = \"poses.csv\"\ntarget_mm = [60, 0, 1100]\n",
    );
    let read = session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let found = trace(&read, &TraceOptions::default(), &|_| true).unwrap().result;
    let is_truth = |name: &EffectName| {
        (name.component.as_str(), name.driver.as_str(), name.order) == ("EB0J2", "torque_j2_nm", Some(1.0))
    };
    let effect = found.effects.iter().find(|effect| is_truth(&effect.name));
    let effect = effect.unwrap_or_else(|| panic!("{:?}", found.effects));
    let parameter = &effect.parameters[0];
    assert_eq!(parameter.unit, "arcsec/(N m)");
    assert!((parameter.value - PER_TORQUE_ARCSEC).abs() < 4.0 * parameter.u, "{parameter:?}");
}
