//! Properties of random shapes of effects over the position of an axis, in its internal unit.

use abbe_model::axis::AxisKind;
use abbe_model::driver::{Driver, DriverSample};
use abbe_model::effect::shape::{Curve, Harmonic, Local, Periodic, Polynomial, Power, Spectrum};
use abbe_model::effect::{Component, Effect, Shape};
use proptest::prelude::*;

use super::drawn_shapes::shapes;
use super::machines::cases;

fn basis(shape: &Shape, sample: &DriverSample<f64>) -> Vec<f64> {
    let mut basis = Vec::new();
    shape.basis(sample, &mut basis);
    basis
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn a_shape_has_one_finite_basis_function_per_coefficient(
        shape in prop_oneof![shapes(AxisKind::Linear), shapes(AxisKind::Rotary)],
        value in -1e3..1e3,
        rate in -1e3..1e3,
        since_reversal in 0.0..1e3,
        back in any::<bool>(),
    ) {
        prop_assert_eq!(shape.check(), Ok(()));
        let sample = DriverSample {
            value,
            direction: if back { -1.0 } else { 1.0 },
            rate,
            since_reversal,
            since_reversal_s: 0.0,
        };
        let found = basis(&shape, &sample);
        prop_assert_eq!(found.len(), shape.coefficients());
        prop_assert_eq!(found.len(), shape.coefficient_names().len());
        prop_assert!(found.iter().all(|value| value.is_finite()), "{shape:?} {found:?}");
        match shape {
            // B-splines sum to one; a bump and a step are between zero and one; cosine and sine are on the unit circle.
            Shape::Curve { .. } => prop_assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-12),
            Shape::Local { .. } | Shape::Steps { .. } => {
                prop_assert!(found.iter().all(|value| (0.0..=1.0).contains(value)));
            }
            Shape::Harmonic { .. } | Shape::Periodic { .. } => {
                prop_assert!((found[0].hypot(found[1]) - 1.0).abs() < 1e-12);
            }
            Shape::Spectrum(Spectrum { orders, period }) => {
                for k in 0..orders {
                    let of_order = Shape::Periodic(Periodic { period: period / (k + 1) as f64 });
                    let expected = basis(&of_order, &sample);
                    prop_assert!((found[2 * k] - expected[0]).abs() < 1e-6, "{found:?}");
                    prop_assert!((found[2 * k + 1] - expected[1]).abs() < 1e-6, "{found:?}");
                }
            }
            Shape::Power(Power { degree, scale }) => {
                let all = basis(&Shape::Polynomial(Polynomial { degree, scale }), &sample);
                prop_assert!((found[0] - all[degree - 1]).abs() <= 1e-12 * found[0].abs());
            }
            _ => {}
        }
    }

    /// A periodic shape has the same value one period further on.
    #[test]
    fn periodic_shapes_are_periodic(shape in shapes(AxisKind::Rotary), value in -3.0..3.0, turns in -3_i32..=3) {
        let period = match &shape {
            Shape::Harmonic(Harmonic { order }) => std::f64::consts::TAU / order,
            Shape::Periodic(Periodic { period }) | Shape::Spectrum(Spectrum { period, .. }) => *period,
            Shape::Curve(Curve { from, to, closed: true, .. }) => to - from,
            Shape::Local(Local { recurs: Some(period), .. }) => *period,
            _ => return Ok(()),
        };
        let at = |value: f64| DriverSample { value, ..DriverSample::default() };
        let (here, there) = (basis(&shape, &at(value)), basis(&shape, &at(value + f64::from(turns) * period)));
        for (here, there) in here.iter().zip(there) {
            prop_assert!((here - there).abs() < 1e-9, "{shape:?}: {here} {there}");
        }
    }
}

#[test]
fn an_effect_acts_in_the_tests_that_it_is_confined_to() {
    let mut effect = Effect::new(
        Component::parse("EZC").expect("a component"),
        Driver::parse("C"),
        Shape::Harmonic(Harmonic { order: 1.0 }),
    );
    assert!(effect.acts_in("one") && effect.acts_in("two"));
    effect.tests.push("one".into());
    assert!(effect.acts_in("one") && !effect.acts_in("two"));
}
