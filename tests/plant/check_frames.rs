//! Tests of the plant: frames and signs against hand calculations.

use super::component::{AxisName, Cartesian, Component, Freedom, unit_size};
use super::machine::{Commanded, Displacement, Machine, Stated};
use super::pose::{Axis, Joint, Pose};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;

const NONE: [f64; 6] = [0.0; 6];

fn near(found: Vector3<f64>, expected: [f64; 3]) {
    assert!((found - Vector3::from(expected)).norm() < 1e-12, "{found:?} is not {expected:?}");
}

fn stated(workpiece_ball_mm: [f64; 3], workpiece_ball_on: AxisName, bar_mm: f64) -> Stated {
    Stated { workpiece_ball_mm, workpiece_ball_on, spindle_ball_mm: [0.0; 3], bar_mm }
}

fn reading(position: [f64; 5], stated: &Stated, component: Component, value: f64) -> f64 {
    let mut displacement = Displacement::default();
    displacement.add(component, value);
    let commanded = Commanded { position, velocity: [0.0; 5] };
    Machine::default().reading_mm(&commanded, stated, &displacement)
}

#[test]
fn a_displaced_body_turns_about_z_first_and_x_last() {
    let pose = Pose::displaced(&[1.0, 2.0, 3.0, FRAC_PI_2, 0.0, FRAC_PI_2]);
    // x -> Rz -> y -> Rx -> z, then the translation.
    near(pose.apply(Vector3::x()), [1.0, 2.0, 4.0]);
    let pose = Pose::displaced(&[0.0, 0.0, 0.0, FRAC_PI_2, FRAC_PI_2, 0.0]);
    // z -> Ry -> x -> Rx -> x.
    near(pose.apply(Vector3::z()), [1.0, 0.0, 0.0]);
}

#[test]
fn a_rotary_axis_turns_about_its_origin_and_its_location_error_does_not_turn() {
    let axis = Axis { joint: Joint::Rotary, direction: Vector3::z(), origin_mm: Vector3::new(10.0, 0.0, 0.0) };
    near(axis.motion(FRAC_PI_2, &NONE, &NONE).apply(Vector3::new(11.0, 0.0, 5.0)), [10.0, 1.0, 5.0]);
    // EX0 is along X of R at any position of the axis; so is EX of the error motion, which is applied after the
    // rotation.
    let shifted = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
    near(axis.motion(FRAC_PI_2, &shifted, &NONE).apply(Vector3::new(11.0, 0.0, 5.0)), [10.5, 1.0, 5.0]);
    near(axis.motion(FRAC_PI_2, &NONE, &shifted).apply(Vector3::new(11.0, 0.0, 5.0)), [10.5, 1.0, 5.0]);
    // A tilt of 90° about Y rotates the point about the origin of the axis, not about that of R.
    let tilted = [0.0, 0.0, 0.0, 0.0, FRAC_PI_2, 0.0];
    near(axis.motion(0.0, &tilted, &NONE).apply(Vector3::new(10.0, 0.0, 2.0)), [12.0, 0.0, 0.0]);
    // The location error is outside the error motion: translation by EX0, then tilt by EB.
    near(axis.motion(0.0, &shifted, &tilted).apply(Vector3::new(10.0, 0.0, 2.0)), [12.5, 0.0, 0.0]);
}

#[test]
fn a_linear_axis_moves_along_its_tilted_direction_and_is_not_shortened() {
    let axis = Axis { joint: Joint::Linear, direction: Vector3::y(), origin_mm: Vector3::new(0.0, 0.0, 7.0) };
    // ω0 = (0, 0, 0.01): Y is inclined towards −X; the component along Y remains 100.
    let squareness = [9.0, 9.0, 9.0, 0.0, 0.0, 0.01];
    near(axis.motion(100.0, &squareness, &NONE).apply(Vector3::zeros()), [-1.0, 100.0, 0.0]);
    // An angular error motion rotates the carried point about the origin of the axis.
    let rolled = [0.0, 0.0, 0.0, 0.0, FRAC_PI_2, 0.0];
    near(axis.motion(100.0, &NONE, &rolled).apply(Vector3::new(0.0, 0.0, 8.0)), [1.0, 100.0, 7.0]);
}

#[test]
fn the_chain_goes_from_the_bed_outwards_on_either_side() {
    let machine = Machine::default();
    let none = Displacement::default();
    // C by 90° rotates +X to +Y, then A by 90° rotates +Y to +Z.
    let position = [0.0, 0.0, 0.0, FRAC_PI_2, FRAC_PI_2];
    near(machine.workpiece_point(&position, &none, [100.0, 0.0, 0.0]), [0.0, 0.0, 100.0]);
    near(machine.tool_point(&[1.0, 2.0, 3.0, 0.0, 0.0], &none, [0.1, 0.2, 0.3]), [1.1, 2.2, 3.3]);
    // Y carries X and Z: a yaw of Y by 90° rotates the travel of X into Y.
    let mut yawed = Displacement::default();
    yawed.add(Component::Motion(Freedom::C, AxisName::Y), FRAC_PI_2);
    near(machine.tool_point(&[1.0, 2.0, 3.0, 0.0, 0.0], &yawed, [0.0; 3]), [0.0, 3.0, 3.0]);
}

#[test]
fn readings_by_hand() {
    // A150 of chapter 5 at A = 0: ball at (0, 100, 0), spindle ball at (−50√5, 0, 0), bar 150.
    let stated = stated([0.0, 100.0, 0.0], AxisName::C, 150.0);
    let offset = 50.0 * 5.0_f64.sqrt();
    let at = |component, value| reading([-offset, 0.0, 0.0, 0.0, 0.0], &stated, component, value) - 150.0;
    let deviations = [
        (Component::Bar, 0.01, -0.01),
        (Component::WorkpieceBall(Cartesian(1)), 0.01, (offset * offset + 100.01 * 100.01_f64).sqrt() - 150.0),
        (Component::SpindleBall(Cartesian(0)), 0.01, ((offset - 0.01) * (offset - 0.01) + 1e4).sqrt() - 150.0),
        // E_Y0A moves the ball outwards by the cosine of the slope of the bar.
        (Component::Location(Freedom::Y, AxisName::A), 0.03, (offset * offset + 100.03 * 100.03_f64).sqrt() - 150.0),
        // EC0A rotates the ball at +Y towards −X, towards the spindle ball.
        (
            Component::Location(Freedom::C, AxisName::A),
            1e-3,
            ((offset - 100.0 * 1e-3_f64.sin()).powi(2) + (100.0 * 1e-3_f64.cos()).powi(2)).sqrt() - 150.0,
        ),
    ];
    for (component, value, expected) in deviations {
        let found = at(component, value);
        assert!((found - expected).abs() < 1e-11, "{component}: {found} is not {expected}");
    }
}

/// C stands 90° away and is shifted: a ball on A is where A has it, and one on the table where both have it.
#[test]
fn a_ball_on_the_tilting_axis_is_not_carried_by_the_table() {
    let at = |on| {
        let stated = stated([100.0, 0.0, 0.0], on, 100.0);
        reading([0.0, 0.0, 0.0, 0.0, FRAC_PI_2], &stated, Component::Location(Freedom::X, AxisName::C), 30.0)
    };
    assert!((at(AxisName::A) - 100.0).abs() < 1e-12);
    assert!((at(AxisName::C) - 30.0_f64.hypot(100.0)).abs() < 1e-12);
}

#[test]
fn the_sensor_has_a_gain_about_the_stated_length_and_a_delay() {
    let stated = stated([0.5, 0.0, 0.0], AxisName::C, 100.0);
    // Distance 99.5 mm: 0.5 mm too short, with a gain error of 1 %.
    let gain = reading([100.0, 0.0, 0.0, 0.0, 0.0], &stated, Component::Sensor, 0.01);
    assert!((gain - (100.0 - 0.505)).abs() < 1e-12);
    let mut late = Displacement::default();
    late.add(Component::Trigger, 0.01);
    let commanded = Commanded { position: [100.0, 0.0, 0.0, 0.0, 0.0], velocity: [20.0, 0.0, 0.0, 0.0, 0.0] };
    let found = Machine::default().reading_mm(&commanded, &stated, &late);
    assert!((found - 99.3).abs() < 1e-12, "{found}");
}

#[test]
fn the_gravity_moment_about_a_lowers_the_ball() {
    let machine = Machine::default();
    // Gravity rotates a ball at +Y about X in the negative sense.
    let stated = stated([0.0, 100.0, 0.0], AxisName::C, 100.0);
    let moment = machine.gravity_moment_a_mm(&[0.0; 5], &stated);
    assert!((moment + 100.0).abs() < 1e-12);
    let moment = machine.gravity_moment_a_mm(&[0.0, 0.0, 0.0, FRAC_PI_2, 0.0], &stated);
    assert!(moment.abs() < 1e-12);
    assert!((unit_size("arcsec") * 3600.0 - 1.0_f64.to_radians()).abs() < 1e-15);
}
