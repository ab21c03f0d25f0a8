//! `cotangent`: the cotangent of the position of a rotary axis: cot q.
//!
//! Over the elevation it is the tangent of the zenith distance, which refraction follows, and a sag that grows towards
//! the horizon. It has no value where the position is a multiple of 180°.

use super::kind::{Basis, Entry, Follows, ShapeKind};
use super::words::EffectWords;
use super::{DriverSample, Shape};
use crate::effect::sampled::Sampled;
use crate::scalar::Nominal;

pub(super) const ENTRY: Entry = Entry {
    word: "cotangent",
    keys: &[],
    follows: Follows::RotaryAxis,
    read: |_| Ok(Shape::Cotangent),
    members: |sampled| match sampled.is_elevation && is_finite(sampled) {
        true => vec![(Shape::Cotangent, 0.0)],
        false => Vec::new(),
    },
};

/// Least distance of the positions from where there is no value, rad: 1°.
const LEAST_DISTANCE: f64 = std::f64::consts::PI / 180.0;

/// Whether it has a value at all positions between the ends of the travel.
fn is_finite(sampled: &Sampled) -> bool {
    let half_turns = |position: f64| (position / std::f64::consts::PI).floor();
    sampled.ends.is_some_and(|[low, high]| half_turns(low - LEAST_DISTANCE) == half_turns(high + LEAST_DISTANCE))
}

/// The cotangent of a rotary position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cotangent;

impl ShapeKind for Cotangent {
    fn describe(&self, words: &EffectWords) -> String {
        format!("{} with the cotangent of {}", words.motion, words.driver)
    }
    fn tag(&self) -> String {
        "cot".to_string()
    }
}

impl Basis for Cotangent {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let (sin, cos) = sample.value.sin_cos();
        basis.push(cos / sin);
    }
}
