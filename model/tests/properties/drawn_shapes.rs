//! Random shapes of effects over the position of an axis, in its internal unit.

use abbe_model::axis::AxisKind;
use abbe_model::effect::Shape;
use abbe_model::effect::shape::{Curve, Harmonic, Local, Periodic, Polynomial, Power, ReversalSpike, Spectrum, Steps};
use proptest::collection::vec;
use proptest::prelude::*;

/// Shapes with parameters as files may state them: lengths up to 400 mm, angles up to a revolution.
pub fn shapes(kind: AxisKind) -> impl Strategy<Value = Shape> {
    let far = match kind {
        AxisKind::Linear => 400.0,
        AxisKind::Rotary => std::f64::consts::PI,
    };
    let place = move || -far..far;
    let width = move || 1e-3 * far..far;
    let recurs = (kind == AxisKind::Rotary).then_some(std::f64::consts::TAU);
    let of_rotary = (1_u32..40).prop_map(|halves| Shape::Harmonic(Harmonic { order: f64::from(halves) / 2.0 }));
    let harmonic = match kind {
        AxisKind::Rotary => of_rotary.boxed(),
        AxisKind::Linear => Just(Shape::Lag).boxed(),
    };
    prop_oneof![
        harmonic,
        (1_usize..6, width()).prop_map(|(degree, scale)| Shape::Polynomial(Polynomial { degree, scale })),
        (1_usize..6, width()).prop_map(|(degree, scale)| Shape::Power(Power { degree, scale })),
        width().prop_map(|period| Shape::Periodic(Periodic { period })),
        (1_usize..12, width()).prop_map(|(orders, period)| Shape::Spectrum(Spectrum { orders, period })),
        (place(), width(), 4_usize..30, any::<bool>()).prop_map(|(from, length, intervals, closed)| {
            Shape::Curve(Curve { from, to: from + length, intervals, closed })
        }),
        Just(Shape::Backlash),
        Just(Shape::Lag),
        width().prop_map(|width| Shape::ReversalSpike(ReversalSpike { width })),
        vec(place(), 1..5).prop_map(|at| Shape::Steps(Steps { at })),
        (place(), width(), any::<bool>()).prop_map(move |(centre, width, again)| Shape::Local(Local {
            centre,
            width,
            recurs: recurs.filter(|_| again),
        })),
    ]
}
