//! `first-order-lag`: proportional to a column after a first-order lag: y/s with `τ dy/dt + y = q`.
//!
//! The driver's samples are those of y: see [`crate::driver::Reference`]. The coefficient is the final value of the
//! component after a step of q by the scale s.

use super::kind::{Basis, Entry, Follows, Per, ShapeKind, positive};
use super::words::{EffectWords, four_digits};
use super::{DriverSample, KeyWriter, Shape, polynomial, warmup};
use crate::scalar::Nominal;

/// Proportional to a column after a first-order lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstOrderLag {
    /// Time constant, s.
    pub tau_s: f64,
    /// The divisor of the driver.
    pub scale: f64,
}

pub(super) const ENTRY: Entry = Entry {
    word: "first-order-lag",
    keys: &[warmup::TAU_S, polynomial::SCALE],
    follows: Follows::Column,
    read: |keys| {
        let tau_s = keys.required_positive("tau_s", "add `tau_s`, the time constant in seconds")?;
        let scale = keys.quantity(&polynomial::SCALE)?.unwrap_or(keys.default_scale());
        Ok(Shape::FirstOrderLag(FirstOrderLag { tau_s, scale }))
    },
    // A longer time constant is the integral of the column to the readings.
    members: |sampled| {
        let taus = sampled.numbers.iter().filter(|tau_s| sampled.has_time && **tau_s < 2.0 * sampled.duration_s);
        let member = |tau_s: &f64| FirstOrderLag { tau_s: *tau_s, scale: sampled.default_scale };
        taus.map(|tau_s| (Shape::FirstOrderLag(member(tau_s)), 0.0)).collect()
    },
};

impl ShapeKind for FirstOrderLag {
    fn write(&self, keys: &mut KeyWriter) {
        keys.set("tau_s", self.tau_s);
        keys.quantity(&polynomial::SCALE, self.scale);
    }
    fn check(&self) -> Result<(), String> {
        positive(self.tau_s, "the time constant of a first-order lag")?;
        positive(self.scale, "the scale of a first-order lag")
    }
    fn describe(&self, words: &EffectWords) -> String {
        let tau = four_digits(self.tau_s);
        format!("{}, following {} with a time constant of {tau} s", words.motion, words.driver)
    }
    fn lag_s(&self) -> Option<f64> {
        Some(self.tau_s)
    }
    fn per(&self, _: usize) -> Per {
        if self.scale == 1.0 { Per::Power(1) } else { Per::One }
    }
    fn fits_position_table(&self) -> bool {
        false
    }
    fn reported(&self) -> Vec<(&'static str, Vec<f64>)> {
        vec![("time constant", vec![self.tau_s])]
    }
    fn brackets(&self, _: f64) -> Vec<[f64; 2]> {
        vec![[self.tau_s * 0.5, self.tau_s * 2.0]]
    }
    fn number_names(&self) -> &'static [&'static str] {
        &["tau"]
    }
    fn set_number(&mut self, _: usize, value: f64) {
        self.tau_s = value;
    }
}

impl Basis for FirstOrderLag {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push(sample.value / N::constant(self.scale));
    }
}
