//! What a trace claims of readings of the independent plant: one explanation has one entry, the most probable one is named, and
//! the first reading of a run is no effect.

use std::collections::BTreeSet;

use abbe::files::{self, ReadOptions};
use abbe::identify::results::{EffectResult, TraceResult};
use abbe::model::session::Session;
use abbe::trace::{TraceOptions, trace};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::plant::machine::Machine;
use crate::plant::noise::normal;
use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Plan, Recipe, Shape};
use crate::suite::identify::{session_of, with_length};

const C: Driver = Driver::Axis(AxisName::C);

fn motion(freedom: Freedom, axis: AxisName) -> Component {
    Component::Motion(freedom, axis)
}

fn harmonic(freedom: Freedom, order: u32, amplitude: f64) -> Injected {
    Injected::new(motion(freedom, AxisName::C), C, Shape::Harmonic { order, phase_deg: 25.0 }, amplitude)
}

fn traced(session: &Session) -> TraceResult {
    trace(session, &TraceOptions::default(), &|_| true).unwrap().result
}

fn named(result: &TraceResult) -> Vec<String> {
    let name = |effect: &EffectResult| {
        let order = effect.name.order.map_or(String::new(), |order| format!("{order}"));
        format!("{}~{}:{}{order}", effect.name.component, effect.name.driver, effect.name.shape)
    };
    result.effects.iter().map(name).collect()
}

/// A circle begins where X reverses. The table came from the other side, so that its first reading has the lost motion of the
/// way before: that is no spike, and the reading is named.
#[test]
fn the_first_reading_at_a_reversal_makes_no_effect() {
    for (seed, warms) in [(3, false), (4, true)] {
        let backlash = Injected::new(motion(Freedom::X, AxisName::X), Driver::Axis(AxisName::X), Shape::Backlash, 4.0);
        let mut recipe = Recipe::new(Kind::SquarenessCircles, seed).with(backlash);
        if warms {
            let body = Component::Location(Freedom::Y, AxisName::C);
            recipe = recipe.with(Injected::new(body, Driver::Time, Shape::Warmup { tau_s: 100.0 }, 6.0));
        }
        let plan = recipe.plan();
        let run_of = std::cell::RefCell::new(String::new());
        let session = session_of(&recipe, &plan, |test, number, cells| {
            // At X = 100 mm an error of X changes the length by as much.
            let run = format!("{test} {}", cells[1]);
            if number > 0 && *run_of.borrow() != run {
                *run_of.borrow_mut() = run;
                with_length(cells, |length| length - 4e-3);
            }
        });
        let result = traced(&session);
        let found = named(&result);
        assert_eq!(found.len(), 1 + usize::from(warms), "{found:?}");
        assert!(found.contains(&"EXX~X:backlash".to_string()), "{found:?}");
        let place = found.iter().position(|name| name == "EXX~X:backlash").unwrap();
        let lost = &result.effects[place].parameters[0];
        assert!((lost.value.abs() - 4.0).abs() < 4.0 * lost.u, "{lost:?}");
    }
}

/// A harmonic and a wave of nearly its period are one explanation.
#[test]
fn shapes_with_the_same_readings_are_one_explanation() {
    for (freedom, order, seed) in [(Freedom::Z, 2, 5), (Freedom::B, 1, 6)] {
        let recipe = Recipe::new(Kind::Rotary, seed).with(harmonic(freedom, order, 3.0));
        let result = traced(&session_of(&recipe, &recipe.plan(), |_, _, _| {}));
        let heads = |effect: &EffectResult| {
            effect.variants.len() + effect.aliases.iter().map(|alias| alias.variants.len()).sum::<usize>()
        };
        assert!(result.effects.iter().map(heads).sum::<usize>() > 0, "{:#?}", result.effects);
        for effect in &result.effects {
            let all = std::iter::once(&effect.name).chain(effect.aliases.iter().map(|alias| &alias.name));
            let all: Vec<(&str, &str)> = all.map(|name| (name.component.as_str(), name.driver.as_str())).collect();
            let distinct: BTreeSet<&(&str, &str)> = all.iter().collect();
            assert_eq!(distinct.len(), all.len(), "{:?} {:#?}", effect.name, effect.aliases);
            assert_eq!(effect.explanation_count, all.len());
        }
    }
}

/// What one reading alone shows after each reversal within a run decays in no width that the readings have: no spike is named for
/// it.
#[test]
fn a_spike_of_one_reading_is_no_effect() {
    let recipe = Recipe::new(Kind::SquarenessCircles, 5);
    let session = session_of(&recipe, &recipe.plan(), |_, _, cells| {
        let x_mm: f64 = cells[2].parse().unwrap_or(0.0);
        if x_mm < -99.9999 {
            with_length(cells, |length| length + 6e-3);
        }
    });
    let result = traced(&session);
    assert!(result.effects.iter().all(|effect| effect.name.shape != "reversal-spike"), "{:?}", named(&result));
}

/// A worm wheel of 72 teeth turns the table 144 times per turn while X and Y follow: at steps of 1° the readings resolve it, and
/// no wave of X or Y is named in its place.
#[test]
fn orders_go_as_far_as_the_readings_resolve_them() {
    for (order, seed) in [(144, 11), (131, 12)] {
        let recipe =
            Recipe { step_deg: 1.0, ..Recipe::new(Kind::Simultaneous, seed) }.with(harmonic(Freedom::C, order, 6.0));
        let mut tests = Kind::Simultaneous.tests(recipe.step_deg);
        tests.truncate(2);
        tests.iter_mut().for_each(|test| test.traversals = 2);
        let plan = Plan::of_tests(Kind::Simultaneous, Machine::default(), tests, false);
        let result = traced(&session_of(&recipe, &plan, |_, _, _| {}));
        assert_eq!(named(&result), [format!("ECC~C:harmonic{order}")]);
    }
}

/// No alias is clearly more probable than the effect that is named, whether one effect is found or two: a squareness that turns
/// with the table is not named where an error motion of the table explains as much.
#[test]
fn the_most_probable_explanation_is_named() {
    let two = Recipe::new(Kind::TiltedTable, 8).with(harmonic(Freedom::B, 1, 5.0)).with(harmonic(Freedom::X, 2, 2.0));
    for recipe in [two, Recipe::new(Kind::Simultaneous, 9).with(harmonic(Freedom::B, 1, 5.0))] {
        let result = traced(&session_of(&recipe, &recipe.plan(), |_, _, _| {}));
        assert!(!result.effects.is_empty());
        for effect in &result.effects {
            for alias in &effect.aliases {
                assert!(alias.probability_ratio < 3.1, "{:?}: {alias:?}", effect.name);
            }
        }
    }
}

/// A tilt of constant amount whose direction turns against the table reads as a motion along its axis: each is named beside the
/// other.
#[test]
fn a_precession_is_an_explanation_of_a_machine_tool() {
    for (order, seed) in [(3, 15), (4, 16)] {
        let tilt = |freedom, phase_deg| {
            Injected::new(motion(freedom, AxisName::C), C, Shape::Harmonic { order, phase_deg }, 1.5)
        };
        let recipe = Recipe::new(Kind::Rotary, seed).with(tilt(Freedom::A, 30.0)).with(tilt(Freedom::B, 120.0));
        let result = traced(&session_of(&recipe, &recipe.plan(), |_, _, _| {}));
        let explained = |effect: &EffectResult| {
            std::iter::once(&effect.name)
                .chain(effect.aliases.iter().map(|alias| &alias.name))
                .any(|name| name.component == "EAC" && name.shape == "precession")
        };
        assert!(result.effects.iter().any(explained), "{:#?}", result.effects);
        // A tilt that turns twice per turn with the table is constant in the frame in which the readings show it.
        let presumed = "EA0C and EB0C presume that there is no EAC~C:precession1 or EAC~C:precession2";
        assert!(result.presumed.iter().any(|own| own == presumed), "{:#?}", result.presumed);
    }
}

/// A machine of three linear axes with a laser along X: `deviation_um` of position in mm and direction, at irregular positions,
/// five times there and back.
fn laser_line(seed: u64, deviation_um: impl Fn(f64, f64) -> f64) -> Session {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    let axis =
        |(name, direction): (&str, &str)| format!("[axis.{name}]\ndirection = {direction}\ntravel_mm = [-600, 600]\n");
    let axes = [("X", "[1, 0, 0]"), ("Y", "[0, 1, 0]"), ("Z", "[0, 0, 1]")].map(axis).concat();
    write("machine.toml", format!("name = \"mill\"\nchain = \"w b X Y Z t\"\n{axes}"));
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let positions: Vec<f64> =
        (0..13).map(|k| f64::from(k) * 40.0 + 6.0 * normal(&mut random).clamp(-1.5, 1.5)).collect();
    let mut rows = String::from("run,x_mm,deviation_um\n");
    for run in 0..10 {
        let forward = run % 2 == 0;
        for k in 0..positions.len() {
            let x_mm = positions[if forward { k } else { positions.len() - 1 - k }];
            let direction = if forward { 1.0 } else { -1.0 };
            let read_um = deviation_um(x_mm, direction) + 0.48 * normal(&mut random);
            rows += &format!("{},{x_mm:.1},{read_um:.2}\n", run + 1);
        }
    }
    write("x.csv", rows);
    let test = "[[test]]\nname = \"LX\"\ndata = \"x.csv\"\nbeam = [1, 0, 0]\n";
    write("session.toml", format!("[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"laser\"\n{test}"));
    files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap()
}

/// Enough steps approximate a slope with a wave. The smooth shapes predict held-out readings as well, and are named; a staircase
/// of a compensation table stays one.
#[test]
fn a_slope_with_a_wave_is_no_staircase() {
    let mut staircases = [0, 0];
    for seed in 0..12 {
        let phase = f64::from(seed as u32);
        let period_mm = 160.0 + 10.0 * phase;
        let smooth = |x_mm: f64, direction: f64| {
            18e-3 * x_mm + 1.2 * (std::f64::consts::TAU * x_mm / period_mm + phase).sin() - 1.5 * direction
        };
        let table = |x_mm: f64, direction: f64| {
            let steps = [2.5, -1.8, 3.0, 2.2];
            let passed = (1..).zip(steps).filter(|(k, _)| x_mm > 100.0 * f64::from(*k) + 7.0);
            passed.map(|(_, step)| step).sum::<f64>() - 1.5 * direction
        };
        for (count, session) in staircases.iter_mut().zip([laser_line(seed, smooth), laser_line(seed, table)]) {
            *count += usize::from(traced(&session).effects.iter().any(|effect| effect.name.shape == "steps"));
        }
    }
    assert!(staircases[0] <= 1 && staircases[1] >= 11, "{staircases:?} of 12");
}

/// A slope with lost motion is found as such: a spike that decays over more than the travel takes the place of neither.
#[test]
fn a_slope_with_lost_motion_is_found() {
    for seed in 0..12 {
        let result = traced(&laser_line(seed, |x_mm, direction| 12e-3 * x_mm - 1.4 * direction));
        let found = named(&result);
        assert!(found.contains(&"EXX~X:backlash".to_string()) && found.len() == 2, "{seed}: {found:?}");
        // No alias without a value of its number makes an uncertainty of a metre.
        let all = result.effects.iter().flat_map(|effect| &effect.parameters);
        all.for_each(|estimate| assert!(estimate.u < 1.0, "{estimate:?}"));
    }
}
