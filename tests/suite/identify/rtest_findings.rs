//! The effects that Yamaji, Hamabata & Ihara (HPC 2014, Section 7) found with an R-test, found by trace in readings of
//! the plant. The session files declare no effect; only the assertions use the true effects.

use abbe::identify::results::TraceVerdict;
use abbe::trace::result::EffectResult;
use std::f64::consts::FRAC_PI_2;

use abbe::files::{self, ReadOptions};
use abbe::trace::{TraceOptions, TraceOutcome, trace};

use crate::plant::machine::Stated;
use crate::plant::rtest::{Nest, NestOn, Session};
use crate::plant::schedule::{Motion, Test, all_stand, with};
use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Recipe, Shape};

const R_MM: f64 = 100.0;
const H_MM: f64 = 60.0;

fn circles(phase_rad: f64) -> Motion {
    Motion::Circles { centre_mm: 0.0, radius_mm: R_MM, phase_rad }
}

fn test(name: &str, workpiece_ball_mm: [f64; 3], motions: [Motion; 5]) -> Test {
    Test {
        name: name.to_string(),
        stated: Stated { workpiece_ball_mm, workpiece_ball_on: AxisName::C, spindle_ball_mm: [0.0; 3], bar_mm: 0.0 },
        setup: name.to_string(),
        motions,
        range_deg: [0.0, 360.0],
        step_deg: 2.0,
        speed_deg_s: 6.0,
        traversals: 4,
    }
}

/// BK2: C turns the nest, and X and Y follow.
fn bk2() -> Test {
    let motions = with(all_stand(), AxisName::C, Motion::Turns);
    let motions = with(motions, AxisName::X, circles(0.0));
    let motions = with(motions, AxisName::Y, circles(-FRAC_PI_2));
    test("BK2", [R_MM, 0.0, H_MM], with(motions, AxisName::Z, Motion::Stands(H_MM)))
}

/// C alone under a ball on its axis.
fn c_alone() -> Test {
    let motions = with(all_stand(), AxisName::C, Motion::Turns);
    test("C-alone", [0.0, 0.0, H_MM], with(motions, AxisName::Z, Motion::Stands(H_MM)))
}

/// BK1: A turns the nest, and Y and Z follow.
fn bk1() -> Test {
    let motions = with(all_stand(), AxisName::A, Motion::Turns);
    let motions = with(motions, AxisName::Y, circles(0.0));
    test("BK1", [0.0, R_MM, 0.0], with(motions, AxisName::Z, circles(-FRAC_PI_2)))
}

fn errors_of(axis: AxisName) -> Vec<Component> {
    use Freedom::{A, B, C, X, Y, Z};
    let freedoms = if axis == AxisName::A { [Y, Z, B, C] } else { [X, Y, A, B] };
    freedoms.map(|freedom| Component::Location(freedom, axis)).to_vec()
}

fn session(on: NestOn, tests: Vec<Test>, declared: Vec<Component>, effects: Vec<Injected>) -> Session {
    let errors = declared.iter().copied().zip([12.0, -7.0, 9.0, 4.0]);
    Session {
        tests,
        nest: Nest::along_the_axes(on),
        errors: errors.collect(),
        effects,
        declared,
        noise_um: 0.3,
        seed: 4,
    }
}

fn motion(freedom: Freedom, axis: AxisName, shape: Shape, amplitude: f64) -> Injected {
    Injected::new(Component::Motion(freedom, axis), Driver::Axis(axis), shape, amplitude)
}

fn steps(at: &[f64], heights: &[f64]) -> Shape {
    Shape::Steps { at: at.to_vec(), heights: heights.to_vec() }
}

/// Pitch-error compensation in coarse increments, as in the control of Machine A.
const X_STEPS_MM: [f64; 3] = [-62.0, 18.0, 71.0];
const X_HEIGHTS_UM: [f64; 3] = [3.0, -4.0, 3.0];
const Y_STEPS_MM: [f64; 2] = [-41.0, 37.0];
const Y_HEIGHTS_UM: [f64; 2] = [-3.5, 3.0];

fn pitch_compensation() -> Vec<Injected> {
    vec![
        motion(Freedom::X, AxisName::X, steps(&X_STEPS_MM, &X_HEIGHTS_UM), 1.0),
        motion(Freedom::Y, AxisName::Y, steps(&Y_STEPS_MM, &Y_HEIGHTS_UM), 1.0),
    ]
}

/// Writes a session of the plant, reads it and traces it.
fn traced<T>(session: &Session, examine: impl FnOnce(&TraceOutcome) -> T) -> T {
    let folder = tempfile::tempdir().unwrap();
    session.write(folder.path()).unwrap();
    let session = files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let outcome = trace(&session, &TraceOptions::default(), &|_| true).unwrap();
    let result = &outcome.result;
    println!(
        "{}: {:.3} µm before, {:.3} after, {:.3} held out",
        result.verdict, result.before.fit.rms_um, result.after.fit.rms_um, result.after.fit.heldout_rms_um
    );
    for effect in &result.effects {
        println!("  {:?} {:?}", effect.name, effect.parameters);
    }
    examine(&outcome)
}

/// The staircase that trace finds for a component: positions and heights, µm.
fn staircase(outcome: &TraceOutcome, component: &str) -> Option<Vec<(f64, f64)>> {
    let number = outcome.effects.iter().position(|effect| effect.component.to_string() == component)?;
    let effect = &outcome.result.effects[number];
    let at = effect.shape_parameters.iter().find(|number| number.name == "at")?;
    assert_eq!(at.unit, "mm");
    let heights = effect.parameters.iter().map(|height| height.value);
    Some(at.values.iter().copied().zip(heights).collect())
}

/// The value of a staircase at a position, µm.
fn height(stairs: &[(f64, f64)], at: f64) -> f64 {
    stairs.iter().filter(|(edge, _)| at >= *edge).map(|(_, height)| height).sum()
}

/// The largest difference of two staircases away from their steps, after a common offset is removed, µm.
fn furthest(found: &[(f64, f64)], truth: &[(f64, f64)]) -> f64 {
    let places: Vec<f64> =
        (-95..=95).map(f64::from).filter(|place| truth.iter().all(|(edge, _)| (place - edge).abs() > 5.0)).collect();
    let differences: Vec<f64> = places.iter().map(|place| height(found, *place) - height(truth, *place)).collect();
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    differences.iter().fold(0.0, |most, difference| (difference - mean).abs().max(most))
}

fn pairs(at: &[f64], heights: &[f64]) -> Vec<(f64, f64)> {
    at.iter().copied().zip(heights.iter().copied()).collect()
}

/// Figs. 11 to 16: steps in radial and tangential direction that are steps of X and of Y at fixed positions.
#[test]
fn steps_of_pitch_compensation_are_found_in_x_and_in_y() {
    let tests = vec![bk2(), c_alone()];
    let session = session(NestOn::Table, tests, errors_of(AxisName::C), pitch_compensation());
    traced(&session, |outcome| {
        assert_eq!(outcome.result.verdict, TraceVerdict::Explained);
        assert_eq!(outcome.effects.len(), 2);
        let x = furthest(&staircase(outcome, "EXX").unwrap(), &pairs(&X_STEPS_MM, &X_HEIGHTS_UM));
        let y = furthest(&staircase(outcome, "EYY").unwrap(), &pairs(&Y_STEPS_MM, &Y_HEIGHTS_UM));
        println!("staircases within {x:.2} µm in X and {y:.2} µm in Y");
        assert!(x < 0.5 && y < 0.5, "{x} {y}");
        assert!(outcome.result.after.fit.heldout_rms_um < 0.32);
    });
}

/// In BK2 a C axis that jumps where X passes 18 mm is confounded with a step of X: only the test of C alone separates
/// them (Figs. 13, 14).
#[test]
fn the_test_of_c_alone_separates_steps_of_c_from_steps_of_x() {
    let jump_deg = (18.0 / R_MM).acos().to_degrees();
    let jumps = steps(&[jump_deg, 360.0 - jump_deg], &[-4.0, 4.0]);
    let effects = vec![motion(Freedom::X, AxisName::C, jumps, 1.0)];
    let of = |tests| session(NestOn::Table, tests, errors_of(AxisName::C), effects.clone());
    traced(&of(vec![bk2()]), |outcome| {
        // Each is named beside the other, and neither is unique.
        for (component, driver) in [("EXX", "X"), ("EXC", "C")] {
            let blames = |effect: &EffectResult| {
                let mut all = std::iter::once(&effect.name).chain(effect.aliases.iter().map(|alias| &alias.name));
                let steps =
                    all.any(|name| (&*name.component, &*name.driver, &*name.shape) == (component, driver, "steps"));
                steps && !effect.unique
            };
            assert!(outcome.result.effects.iter().any(blames), "{component}: {:?}", outcome.result.effects);
        }
    });
    traced(&of(vec![bk2(), c_alone()]), |outcome| {
        assert_eq!(outcome.result.verdict, TraceVerdict::Explained);
        assert!(!outcome.effects.is_empty());
        for effect in &outcome.effects {
            assert_eq!(effect.driver.to_string(), "C", "{}", effect.id());
        }
    });
}

/// Fig. 13: a ball bar on a circle of X and Y with C at rest responds to the same steps of X.
#[test]
fn a_ball_bar_on_x_and_y_alone_shows_the_same_steps() {
    let recipe = Recipe::new(Kind::LinearCircles, 11).with(pitch_compensation()[0].clone());
    let folder = tempfile::tempdir().unwrap();
    recipe.draw().write(folder.path()).unwrap();
    let session = files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let outcome = trace(&session, &TraceOptions::default(), &|_| true).unwrap();
    let stairs = staircase(&outcome, "EXX").expect("steps of X");
    let away = furthest(&stairs, &pairs(&X_STEPS_MM, &X_HEIGHTS_UM));
    println!("staircase of the ball bar within {away:.2} µm");
    assert!(away < 0.6, "{away}");
}

/// Figs. 17 and 18: an ellipse at 45° from the squareness of Y and Z, and waves from the straightness of Y, with the
/// sensors on either body.
#[test]
fn squareness_and_cyclic_straightness_of_y_are_found_in_bk1() {
    let squareness = Component::Location(Freedom::A, AxisName::Z);
    let effects = vec![
        Injected::new(squareness, Driver::Nothing, Shape::Constant, 25.0),
        motion(Freedom::Z, AxisName::Y, Shape::Periodic { period: 25.0, phase_deg: 40.0 }, 1.5),
    ];
    for on in [NestOn::Table, NestOn::Spindle] {
        let session = session(on, vec![bk1()], errors_of(AxisName::A), effects.clone());
        traced(&session, |outcome| {
            let result = &outcome.result;
            assert_eq!(result.verdict, TraceVerdict::Explained);
            assert_eq!(result.effects.len(), 2);
            // BK1 determines the squareness of Y and Z, not which of the two axes is tilted.
            let square = &result.effects[0];
            let mut names = std::iter::once(&square.name).chain(square.aliases.iter().map(|alias| &alias.name));
            assert!(names.any(|name| name.component == "EA0Z" && name.shape == "constant"), "{square:?}");
            assert!(square.name.shape == "constant" && square.name.component.starts_with("EA0"));
            let angle = &square.parameters[0];
            assert!((angle.value.abs() - 25.0).abs() < 4.0 * angle.u, "{angle:?}");
            let harmonic = result
                .effects
                .iter()
                .find(|effect| effect.name.component == "EZY" && effect.name.shape == "periodic")
                .unwrap();
            let [amplitude, phase] = [0, 1].map(|k| &harmonic.parameters[k]);
            assert!((amplitude.value - 1.5).abs() < 4.0 * amplitude.u, "{amplitude:?}");
            assert!((phase.value - 40.0).abs() < 4.0 * phase.u, "{phase:?}");
            assert!(result.after.fit.heldout_rms_um < 0.32, "{}", result.after.fit.heldout_rms_um);
        });
    }
}

/// Not of the paper: a table with a worm, at steps of 1°. Orders 1 and 3 of its wheel, and 72 and 144 of its worm, are found, the
/// last at 2.5 readings a cycle, and no wave of another axis or period takes their place.
#[test]
fn the_orders_of_a_worm_are_found_and_no_other_wave() {
    let waves = [(1, 6.0), (3, 0.8), (72, 4.0), (144, 1.5)];
    let tests = [bk2(), c_alone()].map(|own| Test { step_deg: 1.0, traversals: 2, ..own });
    let harmonic =
        |(order, arcsec)| motion(Freedom::C, AxisName::C, Shape::Harmonic { order, phase_deg: 25.0 }, arcsec);
    let effects = waves.map(harmonic).to_vec();
    traced(&session(NestOn::Table, tests.to_vec(), errors_of(AxisName::C), effects), |outcome| {
        let found = &outcome.result.effects;
        assert_eq!(found.len(), waves.len(), "{found:#?}");
        for (order, arcsec) in waves {
            let is_wave = |own: &&EffectResult| {
                let name = &own.name;
                let of_c = (&*name.component, &*name.driver, &*name.shape) == ("ECC", "C", "harmonic");
                of_c && name.order == Some(f64::from(order))
            };
            let wave = found.iter().find(is_wave).unwrap_or_else(|| panic!("order {order}: {found:#?}"));
            for (estimate, truth) in wave.parameters.iter().zip([arcsec, 25.0]) {
                assert!((estimate.value - truth).abs() < 4.0 * estimate.u, "{estimate:?}");
            }
        }
        assert_eq!(outcome.result.verdict, TraceVerdict::Explained);
        assert!(outcome.steps.len() <= 30, "{} steps", outcome.steps.len());
    });
}

/// BK2 with nothing undeclared.
pub fn bk2_without_effects(on: NestOn) -> Session {
    session(on, vec![bk2()], errors_of(AxisName::C), Vec::new())
}
