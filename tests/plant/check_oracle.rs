//! Tests of the oracle against the plant and against known aliases.

use super::component::{AxisName, Component, Freedom};
use super::effect::{Driver, Injected, Shape};
use super::families::{Family, outside_library, random_effect, random_member};
use super::kind::Kind;
use super::noise::Noise;
use super::oracle::{Oracle, two_sided_tail};
use super::recipe::Recipe;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

fn harmonic(freedom: Freedom, order: u32) -> Injected {
    let component = Component::Motion(freedom, AxisName::C);
    Injected::new(component, Driver::Axis(AxisName::C), Shape::Harmonic { order, phase_deg: 30.0 }, 1.0)
}

#[test]
fn columns_equal_the_response_of_the_plant() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    for kind in Kind::ALL {
        let recipe = Recipe::new(kind, 0).readings(200);
        let oracle = Oracle::new(&recipe);
        let plan = &oracle.plan;
        let zeros = vec![0.0; plan.unknowns.len()];
        for _ in 0..60 {
            let effect = random_effect(kind, &mut random);
            let column = oracle.column(&effect);
            let largest = column.amax().max(1e-3);
            for (instant, expected) in plan.instants.iter().zip(column.iter()) {
                let at = |amplitude| plan.reading_mm(instant, &zeros, &[effect.with_amplitude(amplitude)]);
                let found = (at(0.5) - at(-0.5)) * 1e3;
                assert!((found - expected).abs() < 1e-5 * largest, "{kind:?} {effect:?}: {found} {expected}");
            }
        }
    }
}

#[test]
fn known_aliases_are_found_and_others_are_not() {
    let oracle = Oracle::new(&Recipe::new(Kind::Rotary, 0));
    let cosine = |a: &Injected, b: &Injected| oracle.largest_angle_cosine(a, b);
    use Freedom::{A, B, C, Z};
    let table = [
        (harmonic(Z, 2), harmonic(A, 1), 0.95..=1.0),
        (harmonic(Z, 2), harmonic(B, 1), 0.95..=1.0),
        (harmonic(Z, 5), harmonic(Z, 5), 0.999..=1.0),
        (harmonic(Z, 5), harmonic(Z, 6), 0.0..=0.2),
        // The rotation of the table is not identifiable if the spindle ball lies on its axis (at C = 0 a cosine is a
        // constant).
        (harmonic(C, 5), harmonic(Z, 5), 0.0..=1e-6),
    ];
    for (a, b, expected) in table {
        let found = cosine(&a, &b);
        println!("{:?} {:?} against {:?} {:?}: {found:.4}", a.component, a.shape, b.component, b.shape);
        assert!(expected.contains(&found));
    }
    let mut sine = harmonic(C, 5);
    sine.shape = Shape::Harmonic { order: 5, phase_deg: -90.0 };
    assert_eq!(oracle.smallest_significant_amplitude(&sine, 1.96), f64::INFINITY);
    // A tilt of the table is one of the parameters.
    assert_eq!(oracle.smallest_significant_amplitude(&harmonic(Z, 1), 1.96), f64::INFINITY);
    let axial_motion = harmonic(Z, 2).with_amplitude(2.0);
    let class = oracle.alias_class(&axial_motion, 0.95, 2.0);
    for alias in &class {
        println!("{:?}: share {:.4}, deficit {:.1} sigma", alias.name, alias.share, alias.deficit_sigma);
    }
    let has = |component: &str, order| {
        class.iter().any(|alias| alias.name.component == component && alias.name.order == Some(order))
    };
    assert!(has("EZC", 2) && has("EAC", 1) && has("EBC", 1) && !has("EZC", 3));
    assert!(class[0].share > 0.9999);
    // Two tilts together explain at least as much as one; a set with the truth explains everything.
    let tilts = [harmonic(A, 1), harmonic(B, 1)];
    assert!(
        oracle.explained_share_of(&axial_motion, &tilts) >= oracle.explained_share(&axial_motion, &tilts[0]) - 1e-12
    );
    assert!(oracle.explained_share_of(&axial_motion, &[harmonic(Z, 5), harmonic(Z, 2)]) > 0.9999);
    assert!(oracle.explained_share_of(&axial_motion, &[harmonic(Z, 5), harmonic(Z, 4)]) < 0.1);
    // A smaller amplitude has more aliases.
    assert!(oracle.alias_class(&axial_motion.with_amplitude(0.1), 0.95, 2.0).len() > class.len());
}

#[test]
fn the_smallest_amplitude_is_z_uncertainties_of_a_fit() {
    let component = Component::Motion(Freedom::Y, AxisName::Y);
    let backlash = Injected::new(component, Driver::Axis(AxisName::Y), Shape::Backlash, 1.0);
    for noise in [Noise::White { sigma_um: 0.3 }, Noise::Serial { sigma_um: 0.3, coefficient: 0.8 }] {
        let recipe = Recipe::new(Kind::LinearCircles, 11).noise(noise).with(backlash.clone());
        let oracle = Oracle::new(&recipe);
        let smallest = oracle.smallest_significant_amplitude(&backlash, 1.96);
        let fit = oracle.fit(&recipe.draw(), std::slice::from_ref(&backlash));
        let (amplitude, u) = fit.get("effect 0").unwrap();
        println!("{noise:?}: smallest {smallest:.4} um, fitted {amplitude:.3} ± {u:.4}");
        assert!((smallest / u / 1.96 - 1.0).abs() < 1e-6);
        assert!((amplitude - 1.0).abs() < 4.0 * u);
    }
}

#[test]
fn pulls_are_normal_with_the_effect_and_biased_without() {
    let component = Component::Motion(Freedom::Z, AxisName::A);
    let sag = Shape::Polynomial { degree: 2 };
    let effect = Injected::new(component, Driver::Axis(AxisName::A), sag, 1.0);
    let noises = [
        Noise::White { sigma_um: 0.3 },
        Noise::Serial { sigma_um: 0.3, coefficient: 0.8 },
        Noise::Outliers { sigma_um: 0.3, share: 0.01 },
    ];
    for noise in noises {
        let recipe = Recipe::new(Kind::Rotary, 0).noise(noise).readings(700);
        let oracle = Oracle::new(&recipe);
        let smallest = oracle.smallest_significant_amplitude(&effect, 1.96);
        let effect = effect.with_amplitude(20.0 * smallest);
        let (mut squares, mut biased, mut count) = (0.0, 0.0, 0.0);
        for seed in 0..40 {
            let draw = Recipe { seed, ..recipe.clone() }.with(effect.clone()).draw_on(&oracle.plan);
            let with = oracle.fit(&draw, &draw.truth.effects);
            let without = oracle.fit(&draw, &[]);
            for (id, value, _) in draw.truth.piges() {
                let pull = |(found, u): (f64, f64)| ((found - value) / u).powi(2);
                squares += pull(with.get(id).unwrap());
                biased += pull(without.get(id).unwrap());
                count += 1.0;
            }
        }
        let (sound, biased) = (f64::sqrt(squares / count), f64::sqrt(biased / count));
        println!("{noise:?}: {:?} {smallest:.4}: pulls {sound:.3}, without the effect {biased:.3}", effect.component);
        assert!((0.85..1.15).contains(&sound));
        assert!(biased > 1.3);
    }
}

#[test]
fn the_oracle_predicts_held_out_readings_to_the_noise() {
    for kind in Kind::ALL {
        let oracle = Oracle::new(&Recipe::new(kind, 0));
        let mut random = Pcg64Mcg::seed_from_u64(17 + kind as u64);
        let effect = oracle.random_detectable(10.0, &mut random);
        let draw = Recipe::new(kind, 21).with(effect).draw_on(&oracle.plan);
        let with = oracle.heldout_rms_um(&draw, &draw.truth.effects);
        let without = oracle.heldout_rms_um(&draw, &[]);
        println!("{kind:?} {:?}: {with:.4} um, without {without:.4} um", draw.truth.effects[0]);
        assert!((with / oracle.noise.total_um() - 1.0).abs() < 0.08);
        assert!(without > with);
    }
}

#[test]
fn every_family_has_a_detectable_member() {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    for kind in Kind::ALL {
        let oracle = Oracle::new(&Recipe::new(kind, 0).readings(400));
        for family in Family::of(kind) {
            let mut smallest: Vec<f64> = (0..40)
                .map(|_| random_member(family, kind, &mut random))
                .map(|effect| oracle.smallest_significant_amplitude(&effect, 1.96))
                .collect();
            smallest.sort_by(f64::total_cmp);
            let detectable = smallest.iter().filter(|amplitude| amplitude.is_finite()).count();
            println!(
                "{kind:?} {family:?}: {detectable} of 40 detectable, smallest {:.3}, median {:.3}",
                smallest[0], smallest[20]
            );
            assert!(smallest[0] < 10.0, "{kind:?} {family:?}: {}", smallest[0]);
        }
        for _ in 0..10 {
            let effect = outside_library(kind, &mut random);
            let smallest = oracle.smallest_significant_amplitude(&effect, 1.96);
            assert!(smallest < 4.0, "{kind:?} {effect:?}: {smallest}");
        }
    }
}

#[test]
fn tails_are_those_of_tables() {
    for (z, expected) in
        [(1.0, 0.317_310_507_9), (1.96, 0.049_995_790_3), (3.0, 0.002_699_796_1), (5.0, 5.733_031_4e-7)]
    {
        let found = two_sided_tail(z);
        assert!((found / expected - 1.0).abs() < 1e-7, "{z}: {found}");
    }
}
