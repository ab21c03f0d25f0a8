//! `warmup`: exponential approach in time: 1 − exp(−t/τ). The coefficient is the final value.

use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::{EffectWords, four_digits};
use super::{DriverSample, Key, KeyForm, KeyWriter, Shape};
use crate::scalar::Nominal;

/// Exponential approach; the coefficient is the final value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warmup {
    /// Time constant, s.
    pub tau_s: f64,
}

pub(super) const TAU_S: Key = Key { name: "tau_s", form: KeyForm::Positive, meaning: "time constant, s" };

pub(super) const ENTRY: Entry = Entry {
    word: "warmup",
    keys: &[TAU_S],
    follows: Follows::Time,
    read: |keys| {
        Ok(Shape::Warmup(Warmup {
            tau_s: keys.required_positive("tau_s", "add `tau_s`, the time constant in seconds")?,
        }))
    },
    // A longer time constant is a drift to the readings.
    members: |sampled| {
        let taus = sampled.numbers.iter();
        taus.filter(|tau_s| **tau_s < 2.0 * sampled.duration_s)
            .map(|tau_s| (Shape::Warmup(Warmup { tau_s: *tau_s }), 0.0))
            .collect()
    },
};

impl ShapeKind for Warmup {
    fn write(&self, keys: &mut KeyWriter) {
        keys.set("tau_s", self.tau_s);
    }
    fn check(&self) -> Result<(), String> {
        positive(self.tau_s, "the time constant of a warm-up")
    }
    fn describe(&self, words: &EffectWords) -> String {
        let tau = four_digits(self.tau_s);
        format!("{}, warming up with a time constant of {tau} s", words.motion)
    }
    fn fits_position_table(&self) -> bool {
        false
    }
    fn varies_within(&self) -> Option<[f64; 2]> {
        Some([0.0, 3.0 * self.tau_s])
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

impl Basis for Warmup {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push(N::constant(1.0) - (-sample.value / N::constant(self.tau_s)).exp());
    }
}
