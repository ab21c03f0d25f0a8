//! `precession`: a tilt or a radial motion of a rotary axis whose amount is constant and whose direction turns with the
//! axis.
//!
//! The rolling elements, the lobes of a raceway and the supports of a turntable move the axis of rotation in two directions
//! at once. With the error `e₁` of the component and the error `e₂` at right angles to it, a quarter of a turn further in
//! the sense of the axis,
//!
//! ```text
//! e₁ = R cos(nq − φ),   e₂ = ± R sin(nq − φ)
//! ```
//!
//! The upper sign turns with the axis (forward precession), the lower one against it (backward). Every harmonic of order n
//! of the two errors is the sum of one precession in either sense, so that a single one has two coefficients where the
//! harmonics have four (the full spectrum of D. E. Bently and C. T. Hatch, *Fundamentals of Rotating Machinery
//! Diagnostics*, 2002). ISO 230-7 calls the errors tilt and radial error motion.

use super::harmonic::{Harmonic, ORDER, times};
use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyWriter, Shape};
use crate::effect::sampled::Sampled;
use crate::scalar::Nominal;

/// A tilt or a radial motion of constant amount that turns with its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precession {
    /// Turns of the direction per revolution of the axis.
    pub order: f64,
    /// Whether the direction turns against the axis.
    pub backward: bool,
}

/// Highest order of the library: bearings of few lobes and supports. Finer harmonics are searched one error at a time.
const HIGHEST_ORDER: usize = 4;

const BACKWARD: Key = Key {
    name: "backward",
    form: KeyForm::Flag,
    meaning: "whether the direction of a precession turns against the axis",
};

pub(super) const ENTRY: Entry = Entry {
    word: "precession",
    keys: &[ORDER, BACKWARD],
    follows: Follows::RotaryAxis,
    read: |keys| {
        let order = keys.required_positive("order", "add `order = 2`")?;
        Ok(Shape::Precession(Precession { order, backward: keys.flag("backward")?.unwrap_or_default() }))
    },
    members: |sampled| members(sampled),
};

/// Cost along runs in addition to that of the order. An instrument may read one direction alone there, in which a precession
/// is a harmonic; that two error motions have one amplitude is the less plausible cause.
const COUPLED: f64 = 1.0;

fn members(sampled: &Sampled) -> Vec<(Shape, f64)> {
    let resolved = if sampled.poses { HIGHEST_ORDER } else { Harmonic::resolved(sampled) };
    let most = if sampled.rotary { resolved.min(HIGHEST_ORDER) } else { 0 };
    let of_order = |order: usize| {
        let order = order as f64;
        let cost = order.ln() + if sampled.poses { 0.0 } else { COUPLED };
        [false, true].map(|backward| (Shape::Precession(Precession { order, backward }), cost))
    };
    (1..=most).flat_map(of_order).collect()
}

impl ShapeKind for Precession {
    fn write(&self, keys: &mut KeyWriter) {
        keys.set("order", self.order);
        if self.backward {
            keys.set("backward", true);
        }
    }
    fn check(&self) -> Result<(), String> {
        positive(self.order, "the order of a precession")
    }
    fn describe(&self, words: &EffectWords) -> String {
        let sense = if self.backward { "against" } else { "with" };
        format!(
            "{} and at right angles to it, of constant amount, whose direction turns {} per turn {sense} the axis",
            words.motion,
            times(self.order)
        )
    }
    fn tag(&self) -> String {
        format!("precession{}{}", if self.backward { "-" } else { "" }, self.order)
    }
    fn order(&self) -> Option<f64> {
        Some(if self.backward { -self.order } else { self.order })
    }
    fn is_wave(&self) -> bool {
        true
    }
    fn turns(&self) -> Option<f64> {
        Some(if self.backward { -1.0 } else { 1.0 })
    }
    fn fits_position_table(&self) -> bool {
        false
    }
}

impl Basis for Precession {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let (sin, cos) = (N::constant(self.order) * sample.value).sin_cos();
        basis.extend([cos, sin]);
    }
}
