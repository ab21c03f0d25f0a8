//! What a trace and a fit claim of readings of the independent plant: one explanation has one entry, the most probable one is
//! the headline, and what was wrong with a session is named.

use std::collections::BTreeSet;
use std::path::Path;

use abbe::files::{self, ReadOptions};
use abbe::identify::plausibility::{Plausibility, SuggestionKind};
use abbe::identify::results::TraceResult;
use abbe::model::session::Session;
use abbe::trace::{SessionFit, TraceOptions, trace};

use crate::plant::machine::Machine;
use crate::plant::{AxisName, Cartesian, Component, Driver, Freedom, Injected, Kind, Plan, Recipe, Shape};

const C: Driver = Driver::Axis(AxisName::C);

fn motion(freedom: Freedom, axis: AxisName) -> Component {
    Component::Motion(freedom, axis)
}

fn harmonic(freedom: Freedom, order: u32, amplitude: f64) -> Injected {
    Injected::new(motion(freedom, AxisName::C), C, Shape::Harmonic { order, phase_deg: 25.0 }, amplitude)
}

/// A session in a folder, after a change of the lines of its data files: name of the test, number of the line, cells.
fn session_of(recipe: &Recipe, plan: &Plan, change: impl Fn(&str, usize, &mut Vec<String>)) -> Session {
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

fn as_it_is(recipe: &Recipe) -> Session {
    session_of(recipe, &recipe.plan(), |_, _, _| {})
}

fn traced(session: &Session) -> TraceResult {
    trace(session, &TraceOptions::default(), &|_| true).unwrap().result
}

fn named(result: &TraceResult) -> Vec<String> {
    let name = |effect: &abbe::identify::results::EffectResult| {
        let order = effect.name.order.map_or(String::new(), |order| format!("{order}"));
        format!("{}~{}:{}{order}", effect.name.component, effect.name.driver, effect.name.shape)
    };
    result.effects.iter().map(name).collect()
}

fn plausibility(session: &Session) -> Plausibility {
    SessionFit::of(session, 1).unwrap().result.plausibility
}

/// Changes the last cell of a line of data, the length in mm.
fn with_length(cells: &mut [String], change: impl Fn(f64) -> f64) {
    let last = cells.last_mut().unwrap();
    if let Ok(length) = last.parse::<f64>() {
        *last = format!("{:.4}", change(length));
    }
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

/// A harmonic and a wave of nearly its period are one explanation.
#[test]
fn shapes_with_the_same_readings_are_one_explanation() {
    for (freedom, order, seed) in [(Freedom::Z, 2, 5), (Freedom::B, 1, 6)] {
        let result = traced(&as_it_is(&Recipe::new(Kind::Rotary, seed).with(harmonic(freedom, order, 3.0))));
        for effect in &result.effects {
            let all = std::iter::once(&effect.name).chain(effect.aliases.iter().map(|alias| &alias.name));
            let all: Vec<(&str, &str)> = all.map(|name| (name.component.as_str(), name.driver.as_str())).collect();
            let distinct: BTreeSet<&(&str, &str)> = all.iter().collect();
            assert_eq!(distinct.len(), all.len(), "{:?} {:#?}", effect.name, effect.aliases);
            assert_eq!(effect.explanation_count, all.len());
        }
    }
}

/// No alias is more probable than the effect that is named, whether one effect is found or two.
#[test]
fn the_most_probable_explanation_is_named() {
    let two = Recipe::new(Kind::TiltedTable, 8).with(harmonic(Freedom::B, 1, 5.0)).with(harmonic(Freedom::X, 2, 2.0));
    for recipe in [two, Recipe::new(Kind::Simultaneous, 9).with(harmonic(Freedom::B, 1, 5.0))] {
        let result = traced(&as_it_is(&recipe));
        assert!(!result.effects.is_empty());
        for effect in &result.effects {
            for alias in &effect.aliases {
                assert!(alias.probability_ratio < 1.02, "{:?}: {alias:?}", effect.name);
            }
        }
    }
}

/// A ball that was moved between two tests is moved in all later ones.
#[test]
fn a_ball_that_was_moved_is_named_with_the_test_before_which_it_moved() {
    let moved = |component| Injected::new(component, Driver::Nothing, Shape::Remount { after_test: 1 }, 40.0);
    for (component, thing) in [
        (Component::WorkpieceBall(Cartesian(2)), "workpiece ball of P1"),
        (Component::SpindleBall(Cartesian(2)), "spindle ball of S1"),
    ] {
        let recipe = Recipe { shared_mounts: true, ..Recipe::new(Kind::Rotary, 21) }.with(moved(component));
        let found = plausibility(&as_it_is(&recipe));
        let words: Vec<&str> = found.suggestions.iter().map(|one| one.words.as_str()).collect();
        let wanted = format!("the {thing} was moved before test C100, for C150 too");
        assert!(words.contains(&wanted.as_str()), "{words:#?}\n{:#?}", found.conflicts);
    }
}

/// The sign of one test is the first of what is suggested, and of two bars that are off both are named.
#[test]
fn the_simplest_mistake_that_explains_all_tests_comes_first() {
    let recipe = Recipe { shared_mounts: true, ..Recipe::new(Kind::Rotary, 31) };
    let plan = recipe.plan();
    for test in ["C100", "A150"] {
        let bar_mm = plan.tests.iter().find(|own| own.name == test).unwrap().stated.bar_mm;
        let session = session_of(&recipe, &plan, |own, _, cells| {
            if own == test {
                with_length(cells, |length| 2.0 * bar_mm - length);
            }
        });
        let found = plausibility(&session);
        let first = &found.suggestions[0];
        assert_eq!((first.kind, first.subject.as_str()), (SuggestionKind::DeviationSign, test), "{found:#?}");
    }
    for off_um in [12.3, -9.0] {
        let session = session_of(&recipe, &plan, |_, _, cells| with_length(cells, |length| length + off_um * 1e-3));
        let found = plausibility(&session);
        // A single bar explains nothing; the readings do not separate both from the ball that they turn about.
        let bars: Vec<_> = found.suggestions.iter().filter(|one| one.subject.starts_with("bar[")).collect();
        assert!(bars.iter().all(|one| one.subject == "bar[B100+B150]") && !bars.is_empty(), "{found:#?}");
        let words = &bars[0].words;
        assert!(words.contains("`bar_mm`") && words.contains("`length_mm`"), "{words}");
    }
}

/// X and Y are exchanged in the data: the bar reaches nowhere, and the message says why.
#[test]
fn exchanged_columns_are_named() {
    let recipe = Recipe::new(Kind::Simultaneous, 41).readings(400);
    let plan = recipe.plan();
    let folder = tempfile::tempdir().unwrap();
    recipe.draw_on(&plan).write(folder.path()).unwrap();
    let of = |folder: &Path| files::session(&folder.join("session.toml"), &ReadOptions::default());
    assert!(of(folder.path()).is_ok());
    for test in &plan.tests {
        let file = folder.path().join(format!("{}.csv", test.name));
        let text = std::fs::read_to_string(&file).unwrap().replacen("x_mm,y_mm", "y_mm,x_mm", 1);
        std::fs::write(&file, text).unwrap();
    }
    let help = of(folder.path()).unwrap_err().help().unwrap_or_default().to_string();
    assert!(help.contains("the columns of Y and X were exchanged"), "{help}");
}
