//! Powers of an axis position: one name has one scale, independent of the travel of a test.

use std::f64::consts::PI;

use abbe::model::driver::Driver;
use abbe::model::effect::Shape;
use abbe::model::effect::shape::Power;
use abbe::model::session::Session;
use abbe::plan::effects::effects;
use abbe::plan::results::EffectDetectability;
use abbe::plan::states;
use abbe::trace::candidates::library;

use crate::suite::plan::help::{machine, noise_um, session};

const NOISE_UM: f64 = 0.3;
const BAR_U_UM: f64 = 0.5;
/// `(z_0.995 + z_0.95)²`: the noncentrality at which a two-sided normal test at 1 % has 95 % power.
const NONCENTRALITY: f64 = 17.814_164;

/// A bar of 100 mm along C while one axis moves; the bar length is the only parameter.
fn upright(sweep: &str) -> Session {
    let mut text = machine("[wCbXYZt]", None);
    text.push_str(&format!(
        "[instrument]\nkind = \"ballbar\"\nnoise_um = {NOISE_UM}\n[unknowns]\nerrors = []\n\
         [[test]]\nname = \"upright\"\nbar_mm = 100\nbar_u_um = {BAR_U_UM}\nworkpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 100]\n\
         sweep = {{ {sweep}, runs = 1, both_directions = true }}\n"
    ));
    session(&text)
}

fn judged(plan: &Session) -> Vec<EffectDetectability> {
    let complete = states::complete(plan, true).unwrap();
    let problem = states::problem_by_test(&complete, noise_um(NOISE_UM)).unwrap();
    for candidate in library::candidates(&problem).unwrap() {
        if let Shape::Power(Power { scale, .. }) = candidate.effect.shape {
            let expected = match &candidate.effect.driver {
                Driver::Axis(name) if name == "C" => PI,
                Driver::Axis(_) => 100.0,
                _ => 1.0,
            };
            assert_eq!(scale, expected, "{}", candidate.effect.id());
        }
    }
    effects(&problem).unwrap().effects
}

/// The detectable amplitude, µm, or µm/m of a slope, of an effect whose response at each position is `signal`: numerical least squares with
/// the bar length as the second parameter.
fn closed_form(positions: impl Iterator<Item = f64>, signal: impl Fn(f64) -> [f64; 2]) -> f64 {
    let weight = 1.0 / NOISE_UM.powi(2);
    let (mut own, mut cross, mut bar) = (0.0, 0.0, 1.0 / BAR_U_UM.powi(2));
    for position in positions {
        let [effect, length] = signal(position);
        // Forward and backward.
        own += 2.0 * weight * effect * effect;
        cross += 2.0 * weight * effect * length;
        bar += 2.0 * weight * length * length;
    }
    (NONCENTRALITY / (own - cross * cross / bar)).sqrt()
}

fn check(judged: &[EffectDetectability], id: &str, expected: f64, unit: &str) {
    let found = judged.iter().find(|effect| effect.id == id).unwrap();
    let detectable = found.detectable_amplitude.unwrap();
    println!("{id}: {detectable:.4} {}, closed form {expected:.4} {unit}", found.unit);
    assert_eq!(found.unit, unit, "{id}");
    assert!((detectable / expected - 1.0).abs() < 1e-3, "{id}: {detectable} for {expected}");
}

#[test]
fn a_power_of_a_rotary_axis_is_stated_at_half_a_turn() {
    for (from, to) in [(-45, 45), (-90, 30), (100, 170)] {
        let plan = upright(&format!("axis = \"C\", from_deg = {from}, to_deg = {to}, step_deg = 1"));
        let judged = judged(&plan);
        for power in 1..=3 {
            let positions = (from..=to).map(f64::from);
            let expected = closed_form(positions, |q| [(q / 180.0).powi(power), 1.0]);
            check(&judged, &format!("EZC~C:power{power}"), expected, "um");
        }
    }
}

#[test]
fn a_power_of_a_linear_axis_is_stated_at_100_mm_and_a_slope_per_metre() {
    for (from, to) in [(-20, 20), (-5, 25)] {
        let plan = upright(&format!("axis = \"X\", from_mm = {from}, to_mm = {to}, step_mm = 0.5"));
        let judged = judged(&plan);
        for power in 1..=3 {
            let positions = (2 * from..=2 * to).map(|half| 0.5 * f64::from(half));
            // The bar is inclined: the reading is the cosine of the displacement along Z.
            let (scale_mm, unit) = if power == 1 { (1000.0, "um/m") } else { (100.0, "um") };
            let signal = |x: f64| [(x / scale_mm).powi(power) * 100.0 / x.hypot(100.0), 1.0];
            check(&judged, &format!("EZX~X:power{power}"), closed_form(positions, signal), unit);
        }
    }
}
