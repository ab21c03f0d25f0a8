//! Tests of the plant: shapes against hand calculations, noise against its statistics, files against their text.

use super::component::{AxisName, Cartesian, Component, Freedom};
use super::effect::{Decay, Driver, Injected, Profile, Shape};
use super::kind::Kind;
use super::naming::{from_name, named};
use super::noise::{Noise, traversal};
use super::plan::Plan;
use super::recipe::Recipe;
use super::schedule::Instant;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::PI;

/// The `nth` instant of one traversal of one test.
fn instant(plan: &Plan, test: usize, run: u32, nth: usize) -> Instant {
    *plan.instants.iter().filter(|instant| (instant.test, instant.run) == (test, run)).nth(nth).unwrap()
}

fn of_x(shape: Shape) -> Injected {
    let component = Component::Motion(Freedom::X, AxisName::X);
    Injected::new(component, Driver::Axis(AxisName::X), shape, 1.0)
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9, "{found} is not {expected}");
}

#[test]
fn direction_speed_and_reversal_on_a_circle() {
    // 1° per reading, 1,000 mm/min on a radius of 100 mm.
    let plan = Plan::new(Kind::LinearCircles, 1.0, false);
    let speed_mm_s = 1000.0 / 60.0;
    let at = |run, nth| instant(&plan, 0, run, nth);
    let x = AxisName::X.index();
    let y = AxisName::Y.index();
    // Anticlockwise at 30°: x falls since 0°, y rises since −90°.
    let there = at(1, 30);
    near(there.commanded.position[x], 100.0 * (PI / 6.0).cos());
    near(there.commanded.velocity[x], -speed_mm_s * 0.5);
    near(there.commanded.velocity[y], speed_mm_s * (PI / 6.0).cos());
    assert_eq!((there.direction[x], there.direction[y]), (-1.0, 1.0));
    near(there.since_reversal_s[x], 100.0 * PI / 6.0 / speed_mm_s);
    near(there.since_reversal_s[y], 100.0 * PI * 2.0 / 3.0 / speed_mm_s);
    near(there.way_since_reversal[x], 100.0 * (1.0 - (PI / 6.0).cos()));
    near(there.way_since_reversal[y], 150.0);
    // Clockwise at the same point (360° − 330 readings): opposite directions.
    let back = at(2, 330);
    near(back.commanded.position[x], there.commanded.position[x]);
    assert_eq!((back.direction[x], back.direction[y]), (1.0, -1.0));
    // At the point of reversal the axis has the direction of arrival, in both traversals.
    assert_eq!(at(1, 0).direction[x], 1.0);
    assert_eq!(at(1, 90).direction[y], 1.0);
    assert_eq!(at(1, 91).direction[y], -1.0);
    assert_eq!(at(2, 270).direction[y], 1.0);
    assert_eq!(at(2, 271).direction[y], -1.0);
}

#[test]
fn shapes_have_the_signs_of_their_table() {
    let plan = Plan::new(Kind::LinearCircles, 1.0, false);
    let there = instant(&plan, 0, 1, 30);
    let x_mm = 100.0 * (PI / 6.0).cos();
    near(of_x(Shape::Backlash).basis(&there), 0.5);
    near(of_x(Shape::Polynomial { degree: 2 }).basis(&there), 0.75);
    let period = Shape::Periodic { period: 2.0 * x_mm, phase_deg: 60.0 };
    near(of_x(period).basis(&there), (PI + PI / 3.0).cos());
    // A lag of 2 ms of an axis that moves down at 8.3 mm/s: it is 16.7 µm too high.
    near(of_x(Shape::Lag).with_amplitude(2.0).value(&there), 2e-3 * 1000.0 / 120.0);
    // The axis has just reversed at X+ and sticks.
    let spike = Shape::ReversalSpike { decay: Decay::Way(10.0) };
    near(of_x(spike).basis(&there), (-(100.0 - x_mm) / 10.0).exp());
    let local_feature = |profile| Shape::Local { centre: x_mm - 5.0, width: 10.0, profile };
    near(of_x(local_feature(Profile::Gaussian)).basis(&there), (-0.125_f64).exp());
    near(of_x(local_feature(Profile::RaisedCosine)).basis(&there), 0.5);
    let steps = Shape::Steps { at: vec![-50.0, 0.0, 90.0], heights: vec![1.0, -3.0, 7.0] };
    near(of_x(steps).basis(&there), -2.0);
    let last = plan.instants.last().unwrap();
    near(of_x(Shape::Drift).basis(last), 1.0);
    near(of_x(Shape::Warmup { tau_s: last.time_s }).basis(last), 1.0 - (-1.0_f64).exp());
    near(of_x(Shape::Remount { after_test: 0 }).basis(&there), 0.0);
    near(of_x(Shape::Remount { after_test: 0 }).basis(last), 1.0);
}

#[test]
fn a_harmonic_is_spanned_by_its_cosine_and_sine() {
    let plan = Plan::new(Kind::Rotary, 5.0, false);
    let shape = Shape::Harmonic { order: 3, phase_deg: 40.0 };
    let component = Component::Motion(Freedom::Z, AxisName::C);
    let effect = Injected::new(component, Driver::Axis(AxisName::C), shape, 2.0);
    // C100, reading 2 at 20°.
    let there = instant(&plan, 2, 1, 2);
    near(effect.value(&there), 2e-3 * 100.0_f64.to_radians().cos());
    let bases = effect.basis_effects();
    let parts = bases.iter().zip(effect.coordinates()).map(|(basis, part)| part * basis.basis(&there));
    near(parts.sum(), effect.basis(&there));
    near(bases[1].basis(&there), 60.0_f64.to_radians().sin());
}

#[test]
fn a_local_feature_on_a_rotary_axis_is_periodic() {
    let plan = Plan::new(Kind::Rotary, 5.0, false);
    let shape = Shape::Local { centre: 355.0, width: 10.0, profile: Profile::Gaussian };
    let component = Component::Motion(Freedom::Z, AxisName::C);
    let effect = Injected::new(component, Driver::Axis(AxisName::C), shape, 1.0);
    near(effect.basis(&instant(&plan, 2, 1, 0)), (-0.125_f64).exp());
}

#[test]
fn autocorrelated_noise_has_its_coefficient_and_outliers_their_proportion() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let serial = Noise::Serial { sigma_um: 0.3, coefficient: 0.8 };
    let noise: Vec<f64> = traversal(serial, 200_000, &mut random).iter().map(|(noise, _)| *noise).collect();
    let variance = noise.iter().map(|e| e * e).sum::<f64>() / noise.len() as f64;
    let product = noise.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / noise.len() as f64;
    assert!((variance.sqrt() - 0.3).abs() < 0.005, "{variance}");
    assert!((product / variance - 0.8).abs() < 0.01, "{product}");
    let outlier = traversal(Noise::Outliers { sigma_um: 0.3, share: 0.01 }, 200_000, &mut random);
    let share = outlier.iter().filter(|(_, outlier)| *outlier).count() as f64 / outlier.len() as f64;
    assert!((share - 0.01).abs() < 0.001, "{share}");
    assert!(outlier.iter().all(|(noise, outlier)| *outlier == (noise.abs() > 3.0)));
}

#[test]
fn a_session_depends_on_its_seed_alone_and_declares_no_effect() {
    let bar = Injected::new(Component::Bar, Driver::Temperature, Shape::Polynomial { degree: 1 }, 1.0);
    let mut recipe = Recipe::new(Kind::Rotary, 5).with(bar);
    recipe.dropped_share = 0.05;
    recipe.temperature_column = true;
    let draw = recipe.draw();
    assert_eq!(draw, recipe.draw());
    assert_ne!(draw.files, Recipe { seed: 6, ..recipe.clone() }.draw().files);
    let everything = recipe.plan().instants.len();
    let kept = draw.rows.len() as f64 / everything as f64;
    assert!((1400..1600).contains(&everything), "{everything}");
    assert!((0.92..0.98).contains(&kept), "{kept}");
    assert!(draw.files.iter().all(|(_, text)| !text.contains("effect") && !text.contains("EZC")));
    let (name, text) = &draw.files[2];
    assert_eq!(name, "A100.csv");
    assert!(text.starts_with("time_s,run,x_mm,y_mm,z_mm,a_deg,c_deg,temperature_c,length_mm\n0.000,1,0.0"));
}

#[test]
fn every_kind_has_about_as_many_readings_as_requested() {
    for kind in Kind::ALL {
        for readings in [1500, 6000] {
            let plan = Recipe::new(kind, 1).readings(readings).plan();
            let ratio = plan.instants.len() as f64 / readings as f64;
            assert!((0.93..1.08).contains(&ratio), "{kind:?}: {ratio}");
            // The nominal machine reads the nominal bar length, except for a declared eccentricity.
            let zeros = vec![0.0; plan.unknowns.len()];
            for instant in &plan.instants {
                let deviation = plan.reading_mm(instant, &zeros, &[]) - plan.tests[instant.test].stated.bar_mm;
                let allowed = if kind == Kind::EccentricCircles { 0.6 } else { 1e-9 };
                assert!(deviation.abs() < allowed, "{kind:?}: {deviation}");
            }
        }
    }
}

#[test]
fn names_parse_back_to_themselves() {
    let names = ["EZC", "EX0C", "EC0Y", "workpiece_ball.y", "spindle_ball.z", "bar", "gain", "trigger"];
    for name in names {
        assert_eq!(Component::parse(name).unwrap().to_string(), name);
    }
    assert_eq!(Component::parse("EZQ"), None);
    assert_eq!(Component::parse("workpiece_ball.w"), None);
    let component = Component::WorkpieceBall(Cartesian(1));
    let remount = Injected::new(component, Driver::Time, Shape::Remount { after_test: 1 }, 1.0);
    assert_eq!(from_name(&named(&remount), &remount).unwrap(), remount);
}
