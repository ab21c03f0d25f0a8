//! What a trace claims of readings of the independent plant: one explanation has one entry, the most probable one is named, and
//! the first reading of a run is no effect.

use std::collections::BTreeSet;

use abbe::files::{self, ReadOptions};
use abbe::model::session::Session;
use abbe::trace::result::{EffectName, EffectResult, TraceResult};
use abbe::trace::{TraceOptions, trace};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::plant::machine::Machine;
use crate::plant::noise::normal;
use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Oracle, Plan, Recipe, Shape};
use crate::suite::identify::{result_and_screen, session_of, with_length};
use crate::suite::text;

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
        // What is excluded is said to be no fault.
        let excluded = &result.after.outliers;
        assert!(!excluded.is_empty() && excluded.iter().all(|one| one.first_at_reversal), "{excluded:?}");
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

/// A wave of nearly the period of a harmonic is a variant of its entry, and is not counted: by the simulator their readings
/// differ by less than a tenth of the noise.
#[test]
fn a_wave_of_nearly_one_turn_is_a_variant_of_the_harmonic() {
    let truth = harmonic(Freedom::B, 1, 3.0);
    let recipe = Recipe::new(Kind::Rotary, 6).with(truth.clone());
    let oracle = Oracle::new(&recipe);
    let folder = tempfile::tempdir().unwrap();
    recipe.draw().write(folder.path()).unwrap();
    let (found, screen) = result_and_screen("trace", &folder.path().join("session.toml"), &["--all"]);
    let effect = &found["effects"][0];
    let aliases = effect["aliases"].as_array().unwrap();
    let count = 1 + aliases.len();
    assert_eq!(effect["explanation_count"], count, "{screen}");
    assert!(screen.contains(&format!("\n1 of {count} indistinguishable explanations: ")), "{screen}");
    let mut waves = 0;
    for entry in std::iter::once(effect).chain(aliases) {
        let variants = entry["variants"].as_array().into_iter().flatten();
        for variant in variants.filter(|own| own["shape"] == "periodic") {
            let period = variant["meaning"].as_str().unwrap().split("repeating every ").nth(1).unwrap();
            let period = period.trim_end_matches('°').parse().unwrap();
            let order = entry["order"].as_u64().unwrap_or_else(|| panic!("{entry:#}")) as u32;
            let component = Component::parse(entry["component"].as_str().unwrap()).unwrap();
            let shapes = [Shape::Periodic { period, phase_deg: 0.0 }, Shape::Harmonic { order, phase_deg: 0.0 }];
            // How far the best of each is from the truth. They are no further apart than the sum.
            let missed = shapes.map(|shape| {
                let share = oracle.explained_share(&truth, &Injected::new(component, C, shape, 1.0));
                oracle.strength_sigma(&truth) * (1.0 - share * share).sqrt()
            });
            let of_noise = missed.iter().sum::<f64>() / (oracle.plan.instants.len() as f64).sqrt();
            assert!(of_noise < 0.1, "{of_noise}: {entry:#}");
            waves += 1;
        }
    }
    assert!(waves > 0, "{screen}");
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
        let outcome = trace(&session_of(&recipe, &plan, |_, _, _| {}), &TraceOptions::default(), &|_| true).unwrap();
        assert_eq!(named(&outcome.result), [format!("ECC~C:harmonic{order}")]);
        // Each step screens all candidates: few steps are little work.
        assert!(outcome.steps.len() <= 12, "{} steps", outcome.steps.len());
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

/// The likelihood and probability ratios that a text states, in their order. Where the two are equal only the first is stated.
fn stated_ratios(shown: &str) -> Vec<[String; 2]> {
    let number = |text: &str| -> String {
        let end = text.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | '−'))).unwrap_or(text.len());
        text[..end].replace('−', "-")
    };
    let after = shown.split("likelihood ratio ").skip(1);
    let pair = |rest: &str| {
        let likelihood = number(rest);
        let beside = rest.find(", probability ratio ").filter(|place| *place < 20);
        let probability =
            beside.map_or(likelihood.clone(), |place| number(&rest[place + ", probability ratio ".len()..]));
        [likelihood, probability]
    };
    after.map(pair).collect()
}

/// A tilt once per turn with a radial motion twice per turn are found together, as pairs are compared with pairs. How probable
/// each alternative is stands alike in JSON, on the screen and on the page, and none is more probable than what is named.
#[test]
fn probabilities_of_explanations_are_the_same_wherever_they_stand() {
    let wobble =
        |kind, seed| Recipe::new(kind, seed).with(harmonic(Freedom::B, 1, 5.0)).with(harmonic(Freedom::X, 2, 2.0));
    for recipe in [wobble(Kind::Rotary, 10), wobble(Kind::Chapter4, 12)] {
        let folder = tempfile::tempdir().unwrap();
        recipe.draw().write(folder.path()).unwrap();
        let page = folder.path().join("page.html");
        let file = folder.path().join("session.toml");
        let (found, screen) = result_and_screen("trace", &file, &["--all", "--report", text(&page)]);
        let effects = found["effects"].as_array().unwrap();
        assert_eq!(effects.len(), 2, "{screen}");
        for (component, order) in [("EBC", 1), ("EXC", 2)] {
            let explains = |effect: &serde_json::Value| {
                let mut all = std::iter::once(effect).chain(effect["aliases"].as_array().unwrap());
                all.any(|own| own["component"] == component && own["order"].as_f64() == Some(f64::from(order)))
            };
            assert!(effects.iter().any(explains), "{component} {order}: {screen}");
        }
        let aliases: Vec<&serde_json::Value> =
            effects.iter().flat_map(|effect| effect["aliases"].as_array().unwrap()).collect();
        assert!(!aliases.is_empty(), "{screen}");
        for shown in [screen, std::fs::read_to_string(&page).unwrap()] {
            let stated = stated_ratios(&shown);
            assert_eq!(stated.len(), aliases.len(), "{shown}");
            for (stated, alias) in stated.iter().zip(&aliases) {
                for (stated, key) in stated.iter().zip(["likelihood_ratio", "probability_ratio"]) {
                    let (stated, exact) = (stated.parse::<f64>().unwrap(), alias[key].as_f64().unwrap());
                    let rounding = if (0.01..1000.0).contains(&exact) { 0.0051 } else { 0.51 * exact };
                    assert!((stated - exact).abs() <= rounding, "{key}: {stated} for {alias:#}");
                }
                assert!(alias["probability_ratio"].as_f64().unwrap() < 3.1, "{alias:#}");
            }
        }
    }
}

/// A tilt of constant amount, in arcsec, whose direction turns with the table or, of a negative order, against it.
fn precession(order: i32, amplitude: f64) -> [Injected; 2] {
    let sideways_deg = if order < 0 { 120.0 } else { -60.0 };
    [(Freedom::A, 30.0), (Freedom::B, sideways_deg)].map(|(freedom, phase_deg)| {
        let shape = Shape::Harmonic { order: order.unsigned_abs(), phase_deg };
        Injected::new(motion(freedom, AxisName::C), C, shape, amplitude)
    })
}

/// A tilt of constant amount whose direction turns against the table reads as a motion along its axis: each is named beside the
/// other.
#[test]
fn a_precession_is_an_explanation_of_a_machine_tool() {
    for (order, seed) in [(-3, 15), (-4, 16)] {
        let recipe = Recipe { effects: precession(order, 1.5).to_vec(), ..Recipe::new(Kind::Rotary, seed) };
        let result = traced(&session_of(&recipe, &recipe.plan(), |_, _, _| {}));
        let explained = |effect: &EffectResult| {
            std::iter::once(&effect.name)
                .chain(effect.aliases.iter().map(|alias| &alias.name))
                .any(|name| name.component == "EAC" && name.shape == "precession")
        };
        assert!(result.effects.iter().any(explained), "{:#?}", result.effects);
        // A tilt that turns twice per turn with the table is constant in the frame in which the readings show it. The screen
        // says so of the table, which may precess, and of the other axis among the details.
        let presumed = "EA0C and EB0C presume that there is no EAC~C:precession1 or EAC~C:precession2";
        assert!(result.presumed.iter().any(|own| own == presumed), "{:#?}", result.presumed);
        let folder = tempfile::tempdir().unwrap();
        recipe.draw().write(folder.path()).unwrap();
        let (_, screen) = result_and_screen("trace", &folder.path().join("session.toml"), &[]);
        assert!(screen.contains(presumed), "{screen}");
        assert!(screen.lines().filter(|line| line.contains(" presume ")).all(|line| line.contains("C~C:")), "{screen}");
    }
}

/// A precession of amount a and phase φ lifts a ball at x = −R sin C, y = R cos C by R a cos((n ± 1) C + φ), the upper sign
/// against the table: with one radius the axial motion is named, and the precession beside it. With two radii the precession is.
#[test]
fn a_precession_has_its_order_amplitude_and_phase() {
    const AMOUNT_ARCSEC: f64 = 2.0;
    let is_truth = |effect: &EffectResult, amplitude: f64| {
        let mut pairs = effect.parameters.iter().zip([amplitude, 30.0]);
        effect.parameters.len() == 2 && pairs.all(|(own, truth)| (own.value - truth).abs() < 3.0 * own.u)
    };
    let recipe_of =
        |order, seed| Recipe { effects: precession(order, AMOUNT_ARCSEC).to_vec(), ..Recipe::new(Kind::Rotary, seed) };
    for (order, seed) in [(-3_i32, 17), (4, 18)] {
        let recipe = recipe_of(order, seed);
        let result = traced(&session_of(&recipe, &recipe.plan(), |_, _, _| {}));
        assert_eq!(named(&result), [format!("EZC~C:harmonic{}", (order - 1).abs())]);
        let axial = &result.effects[0];
        let lifted_um = 100e3 * (AMOUNT_ARCSEC / 3600.0).to_radians();
        assert!(is_truth(axial, lifted_um), "{lifted_um}: {:#?}", axial.parameters);
        let mut beside = axial.aliases.iter().flat_map(|alias| std::iter::once(&alias.name).chain(&alias.variants));
        let is_it = |name: &EffectName| {
            (&*name.component, &*name.shape, name.order) == ("EAC", "precession", Some(f64::from(order)))
        };
        assert!(beside.any(is_it), "{:#?}", axial.aliases);
    }
    for (order, seed) in [(-3, 19), (-4, 20)] {
        let recipe = recipe_of(order, seed);
        let mut tests = Kind::Rotary.tests(recipe.step_deg);
        tests.extend(Kind::rotary_at(60.0, recipe.step_deg).split_off(2));
        let plan = Plan::of_tests(Kind::Rotary, Machine::default(), tests, false);
        let result = traced(&session_of(&recipe, &plan, |_, _, _| {}));
        assert_eq!(named(&result), [format!("EAC~C:precession{order}")]);
        assert!(is_truth(&result.effects[0], AMOUNT_ARCSEC), "{:#?}", result.effects[0].parameters);
    }
}

/// A drift takes the estimates of the balls far beyond their priors. With the drift found nothing contradicts the session, on
/// screen, page and in JSON, and all errors are those of the simulator.
#[test]
fn a_conflict_that_the_found_effect_removes_is_not_claimed() {
    let drift = Injected::new(Component::Location(Freedom::Z, AxisName::A), Driver::Time, Shape::Drift, 40.0);
    let recipe = Recipe { shared_mounts: true, ..Recipe::new(Kind::Rotary, 41).readings(600) }.with(drift);
    let (plan, folder) = (recipe.plan(), tempfile::tempdir().unwrap());
    let drawn = recipe.draw_on(&plan);
    drawn.write(folder.path()).unwrap();
    let [file, page] = ["session.toml", "page.html"].map(|name| folder.path().join(name));
    let (fitted, screen) = result_and_screen("fit", &file, &[]);
    assert_eq!(fitted["statements"]["measure"]["step"], "correct-session", "{screen}");
    assert!(screen.contains("nothing before the session is corrected"), "{screen}");
    // Which of the two it is the fit alone does not know.
    assert!(screen.contains("the model lacks an effect, or the session is not as stated"), "{screen}");
    assert!(screen.contains("What to correct: nothing yet; what the readings contradict biases"), "{screen}");
    let (found, screen) = result_and_screen("trace", &file, &["--all", "--report", text(&page)]);
    assert_eq!(found["verdict"], "explained", "{screen}");
    // The declared model has one χ², by the stated noise, although the repeats give the search another one.
    for key in ["chi_square", "noise_um", "degrees_of_freedom"] {
        let [of_fit, before] = [&fitted[key], &found["before"][key]].map(|value| value.as_f64().unwrap());
        assert!((before / of_fit - 1.0).abs() < 1e-6, "{key}: {of_fit} and {before}");
    }
    assert_ne!(found["statements"]["measure"]["step"], "correct-session", "{screen}");
    for key in ["conflicts", "suggestions"] {
        assert!(found[key].as_array().is_none_or(Vec::is_empty), "{key}: {}", found[key]);
    }
    for shown in [&screen, &std::fs::read_to_string(&page).unwrap()] {
        assert!(!shown.contains("contradict") && !shown.contains("session is corrected"), "{screen}");
    }
    let um_per_h = 40.0 * 3600.0 / plan.instants.last().unwrap().time_s;
    let truth = drawn.truth.piges().map(|(id, value, _)| (id, value)).chain([("EZ0A~time:drift", um_per_h)]);
    let parameters = found["after"]["parameters"].as_array().unwrap();
    for (id, truth) in truth {
        let parameter = parameters.iter().find(|own| own["id"] == id).unwrap_or_else(|| panic!("{id}: {screen}"));
        let [value, u] = ["value", "u"].map(|key| parameter[key].as_f64().unwrap());
        assert!((value - truth).abs() < 4.0 * u, "{truth}: {parameter}");
    }
}

/// A tilt of C once per turn that is ten times its uncertainty: an axial motion twice per turn explains the readings as well. A
/// staircase with as many numbers as it likes does not take its place.
#[test]
fn no_staircase_takes_the_place_of_a_wave() {
    for seed in [4, 5, 23, 24] {
        let recipe = Recipe::new(Kind::Rotary, seed).readings(1500).with(harmonic(Freedom::B, 1, 1.2));
        let found = named(&traced(&session_of(&recipe, &recipe.plan(), |_, _, _| {})));
        assert!(!found.is_empty() && found.iter().all(|id| !id.contains("steps")), "seed {seed}: {found:?}");
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
