//! What a trace claims of readings of the independent plant: one explanation has one entry, and the first reading of a run is no
//! effect.

use std::collections::BTreeSet;

use abbe::identify::results::{EffectResult, TraceResult};
use abbe::model::session::Session;
use abbe::trace::{TraceOptions, trace};

use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Recipe, Shape};
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
