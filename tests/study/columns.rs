//! A displacement that follows the temperature of the spindle with a first-order lag, and one that follows a
//! temperature collinear with time.

use rand::RngExt;

use super::judging::{short, summary};
use super::rates::Rate;
use super::sessions::{NOISES, TracedSession, at_multiple, oracle, random, run, sessions, skipped, verbose};
use crate::plant::families::thermal_components;
use crate::plant::{Driver, Injected, Kind, Shape, Spindle};
use abbe::identify::results::EffectName;

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
        let names = |effect: &abbe::identify::results::EffectResult| -> Vec<EffectName> {
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
            let found: Vec<String> = outcome.result.effects.iter().flat_map(|e| names(e)).map(|n| short(&n)).collect();
            println!("{} {found:?}", summary(outcome, if hit { "ok" } else { "MISS" }));
        }
    }
    println!("| temperature and time are named as aliases | {both} |");
    assert!(both.is_consistent_with_at_least(0.95), "{both}");
}
