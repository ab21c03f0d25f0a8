//! `cotangent`: the cotangent of the position of a rotary axis: cot q.
//!
//! Over the elevation it is the tangent of the zenith distance, which refraction follows, and a sag that grows towards
//! the horizon. It has no value where the position is a multiple of 180°.

use super::kind::{Basis, Entry, Follows, ShapeFault, ShapeKind};
use super::words::EffectWords;
use super::{DriverSample, KeyWriter, Shape};
use crate::scalar::Nominal;

pub(super) const ENTRY: Entry = Entry {
    word: "cotangent",
    keys: &[],
    follows: Follows::RotaryAxis,
    read: |_| Ok(Shape::Cotangent),
    members: |_| Vec::new(),
};

/// The cotangent of a rotary position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cotangent;

impl ShapeKind for Cotangent {
    fn entry(&self) -> &'static Entry {
        &ENTRY
    }
    fn write(&self, _: &mut KeyWriter) {}
    fn check(&self) -> Result<(), ShapeFault> {
        Ok(())
    }
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
