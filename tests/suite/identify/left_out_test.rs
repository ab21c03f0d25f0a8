//! A left-out test is predicted by the right component and not by its alias.

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::FitResult;
use abbe::model::driver::Driver as FollowedDriver;
use abbe::model::effect::shape::Harmonic;
use abbe::model::effect::{Component as Moved, Effect, Shape as Form};
use abbe::model::session::Session;
use abbe::trace::SessionFit;

use crate::plant::machine::{Machine, Stated};
use crate::plant::schedule::{Motion, Test, all_stand, with};
use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Plan, Recipe, Shape};

/// Height of the spindle ball above the workpiece ball, mm.
const HEIGHT_MM: f64 = 100.0;

/// C turns with the workpiece ball at a radius. Each radius has its own mounts and bar.
fn turn(name: &str, radius_mm: f64) -> Test {
    let at = with(all_stand(), AxisName::Z, Motion::Stands(HEIGHT_MM));
    Test {
        name: name.to_string(),
        stated: Stated {
            workpiece_ball_mm: [0.0, radius_mm, 0.0],
            workpiece_ball_on: AxisName::C,
            spindle_ball_mm: [0.0; 3],
            bar_mm: radius_mm.hypot(HEIGHT_MM),
        },
        setup: name.to_string(),
        motions: with(at, AxisName::C, Motion::Turns),
        range_deg: [0.0, 360.0],
        step_deg: 1.5,
        speed_deg_s: 2.0,
        traversals: 4,
    }
}

/// Readings at radii of 50 mm and 100 mm, with an axial motion of C of 1.5 µm · cos(2 C + 60°).
fn measured() -> Session {
    let shape = Shape::Harmonic { order: 2, phase_deg: 60.0 };
    let axial = Component::Motion(Freedom::Z, AxisName::C);
    let recipe = Recipe::new(Kind::Rotary, 31).with(Injected::new(axial, Driver::Axis(AxisName::C), shape, 1.5));
    let tests = vec![turn("R50", 50.0), turn("R100", 100.0)];
    let plan = Plan::of_tests(Kind::Rotary, Machine::default(), tests, false);
    let folder = tempfile::tempdir().unwrap();
    recipe.draw_on(&plan).write(folder.path()).unwrap();
    files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap()
}

/// The fit of a session with a declared harmonic over C.
fn fitted(session: &Session, component: &str, order: f64) -> FitResult {
    let mut session = session.clone();
    session.effects = vec![Effect::new(
        Moved::parse(component).unwrap(),
        FollowedDriver::parse("C"),
        Form::Harmonic(Harmonic { order }),
    )];
    SessionFit::of(&session, 1).unwrap().result
}

#[test]
fn the_right_component_predicts_a_left_out_radius_and_its_alias_does_not() {
    let session = measured();
    // At one radius, the tilt of order 1 explains the axial motion of order 2.
    for test in &session.tests {
        let one = Session { tests: vec![test.clone()], ..session.clone() };
        let [axial, tilt] = [("EZC", 2.0), ("EAC", 1.0)].map(|(component, order)| fitted(&one, component, order));
        assert!(
            axial.model.fit.rms_um < 0.32 && tilt.model.fit.rms_um < 1.02 * axial.model.fit.rms_um,
            "{} {}",
            axial.model.fit.rms_um,
            tilt.model.fit.rms_um
        );
        assert_eq!(axial.model.cross_validation.left_out_test_rms_um, None);
    }
    let [axial, tilt] = [("EZC", 2.0), ("EAC", 1.0)].map(|(component, order)| fitted(&session, component, order));
    for result in [&axial, &tilt] {
        assert_eq!(
            result.model.cross_validation.left_out_tests,
            ["R50", "R100"],
            "{:?}",
            result.model.cross_validation
        );
        assert_eq!(result.model.cross_validation.left_out_run_rms_um, Some(result.model.fit.heldout_rms_um));
        assert_eq!(result.model.cross_validation.extrapolation_rms_um, None);
    }
    let [axial, tilt] = [axial, tilt].map(|result| result.model.cross_validation.left_out_test_rms_um.unwrap());
    println!("left-out radius: EZC order 2 {axial:.3} µm, EAC order 1 {tilt:.3} µm");
    assert!(axial < 0.33, "{axial}");
    assert!(tilt > 2.0 * axial, "{tilt} {axial}");
}

/// An effect that acts in one test only is identifiable from that test only, so that the others cannot predict it.
#[test]
fn a_test_that_alone_identifies_a_parameter_is_named_and_not_left_out() {
    let session = measured();
    let only = session.tests.iter().map(|test| test.name.clone()).take(1).collect();
    let mut session = session;
    session.effects = vec![Effect {
        tests: only,
        ..Effect::new(Moved::parse("EZC").unwrap(), FollowedDriver::parse("C"), Form::Harmonic(Harmonic { order: 2.0 }))
    }];
    let result = SessionFit::of(&session, 1).unwrap().result.model.cross_validation;
    assert_eq!(result.left_out_tests, ["R100"]);
    assert_eq!(result.tests_not_left_out.len(), 1);
    assert_eq!(result.tests_not_left_out[0].test, "R50");
    let named = &result.tests_not_left_out[0].parameters;
    assert!(!named.is_empty() && named.iter().all(|id| id.starts_with("EZC~C:h2")), "{named:?}");
}
