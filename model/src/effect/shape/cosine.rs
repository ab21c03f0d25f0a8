//! `cosine`: the cosine of `order` times the position of a rotary axis, without the sine: cos nq.
//!
//! A tube that bends under its weight sags with the cosine of its elevation and with nothing else.

use super::harmonic::ORDER;
use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, KeyWriter, Shape};
use crate::scalar::Nominal;

/// Cosine of `order` times a rotary position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cosine {
    /// Cycles per revolution.
    pub order: f64,
}

pub(super) const ENTRY: Entry = Entry {
    word: "cosine",
    keys: &[ORDER],
    follows: Follows::RotaryAxis,
    read: |keys| Ok(Shape::Cosine(Cosine { order: keys.required_positive("order", "add `order = 1`")? })),
    // Elsewhere the library has the harmonics, which hold it.
    members: |sampled| match sampled.is_elevation {
        true => vec![(Shape::Cosine(Cosine { order: 1.0 }), 0.0)],
        false => Vec::new(),
    },
};

impl ShapeKind for Cosine {
    fn write(&self, keys: &mut KeyWriter) {
        keys.set("order", self.order);
    }
    fn check(&self) -> Result<(), String> {
        positive(self.order, "the order of a cosine")
    }
    fn describe(&self, words: &EffectWords) -> String {
        let EffectWords { motion, driver, .. } = words;
        if self.order == 1.0 {
            format!("{motion} with the cosine of {driver}")
        } else {
            format!("{motion} with the cosine of {} times {driver}", self.order)
        }
    }
    fn tag(&self) -> String {
        format!("cos{}", self.order)
    }
    fn order(&self) -> Option<f64> {
        Some(self.order)
    }
}

impl Basis for Cosine {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push((N::constant(self.order) * sample.value).sin_cos().1);
    }
}
