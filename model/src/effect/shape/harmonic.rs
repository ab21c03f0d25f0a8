//! `harmonic`: whole or broken cycles per revolution of a rotary axis: cos nq, sin nq.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyWriter, Shape};
use crate::effect::sampled::{READINGS_PER_CYCLE, Sampled};
use crate::scalar::Nominal;

/// Cosine and sine of `order` times a rotary position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Cycles per revolution.
    pub order: f64,
}

/// Highest order of the library: twice the teeth of the worm wheels of rotary tables, as far as the readings resolve it.
const HIGHEST_ORDER: usize = 360;
/// Highest order for poses, which sample an axis at random. An independent search found no significant order above it.
const HIGHEST_ORDER_OF_POSES: usize = 40;

/// Highest order of the error motion of an axis about itself, for poses.
const HIGHEST_ORDER_OF_GEARS: usize = 200;

pub(super) const ORDER: Key =
    Key { name: "order", form: KeyForm::Positive, meaning: "cycles per revolution of a harmonic" };

pub(super) const ENTRY: Entry = Entry {
    word: "harmonic",
    keys: &[ORDER],
    follows: Follows::RotaryAxis,
    read: |keys| Ok(Shape::Harmonic(Harmonic { order: keys.required_positive("order", "add `order = 1`")? })),
    members: |sampled| Harmonic::up_to(highest_order(sampled)),
};

/// The highest order that the sampling resolves.
fn highest_order(sampled: &Sampled) -> usize {
    if sampled.poses { HIGHEST_ORDER_OF_POSES } else { Harmonic::resolved(sampled).min(HIGHEST_ORDER) }
}

impl Harmonic {
    /// The highest order that readings along runs resolve; 0 without runs.
    pub(super) fn resolved(sampled: &Sampled) -> usize {
        if sampled.step > 0.0 { ((TAU / (READINGS_PER_CYCLE * sampled.step)) as usize).max(1) } else { 0 }
    }

    /// The members of the library up to an order. There are many high orders, and each single one is unlikely. The cost
    /// therefore grows as the logarithm of the order.
    pub fn up_to(most: usize) -> Vec<(Shape, f64)> {
        Harmonic::of_orders(1..=most)
    }

    /// The orders of gears about the axis itself, of poses: above those of the other error motions. The teeth of a strain
    /// wave gear with a ratio of 100 come 100 or 200 times per turn.
    pub fn of_gears() -> Vec<(Shape, f64)> {
        Harmonic::of_orders(HIGHEST_ORDER_OF_POSES + 1..=HIGHEST_ORDER_OF_GEARS)
    }

    fn of_orders(orders: RangeInclusive<usize>) -> Vec<(Shape, f64)> {
        let orders = orders.map(|order| order as f64);
        orders.map(|order| (Shape::Harmonic(Harmonic { order }), order.ln())).collect()
    }
}

/// `once`, `twice`, `17 times`.
pub(super) fn times(order: f64) -> String {
    if order == 1.0 {
        "once".to_string()
    } else if order == 2.0 {
        "twice".to_string()
    } else {
        format!("{order} times")
    }
}

impl ShapeKind for Harmonic {
    fn write(&self, keys: &mut KeyWriter) {
        keys.set("order", self.order);
    }
    fn check(&self) -> Result<(), String> {
        positive(self.order, "the order of a harmonic")
    }
    fn describe(&self, words: &EffectWords) -> String {
        format!("{} {} per turn{}", words.motion, times(self.order), words.of_another_axis)
    }
    fn tag(&self) -> String {
        format!("h{}", self.order)
    }
    fn order(&self) -> Option<f64> {
        Some(self.order)
    }
    fn is_wave(&self) -> bool {
        true
    }
}

impl Basis for Harmonic {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let (sin, cos) = (N::constant(self.order) * sample.value).sin_cos();
        basis.extend([cos, sin]);
    }
}
