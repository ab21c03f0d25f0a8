//! `periodic`: a sinusoid with a period of any length: cos 2πq/p, sin 2πq/p.

use std::f64::consts::TAU;

use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyWriter, Shape};
use crate::effect::sampled::{READINGS_PER_CYCLE, Sampled};
use crate::scalar::Nominal;

/// Cosine and sine with a period of any length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Periodic {
    /// The period, in the driver's unit.
    pub period: f64,
}

/// Maximum number of half cycles over the travel.
const MAX_HALF_CYCLES: usize = 240;
/// Cost of a member.
const COST: f64 = 0.5;

pub(super) const PERIOD: Key = Key { name: "period", form: KeyForm::Quantity, meaning: "length of a period" };

pub(super) const ENTRY: Entry = Entry {
    word: "periodic",
    keys: &[PERIOD],
    follows: Follows::Anything,
    read: |keys| Ok(Shape::Periodic(Periodic { period: keys.required_quantity(&PERIOD)? })),
    members,
};

/// Frequencies from one cycle on, half a cycle over the travel apart.
fn members(sampled: &Sampled) -> Vec<(Shape, f64)> {
    if sampled.step <= 0.0 || sampled.poses {
        return Vec::new();
    }
    let span = sampled.span();
    let most = ((2.0 * span / (READINGS_PER_CYCLE * sampled.step)) as usize).min(MAX_HALF_CYCLES);
    // Over full turns, whole cycles are harmonics.
    let turns = span / TAU;
    let whole = sampled.rotary && (turns - turns.round()).abs() < 0.01;
    (2..=most)
        .filter(|half_cycles| !whole || half_cycles % 2 == 1)
        .map(|half_cycles| {
            let period = 2.0 * span / half_cycles as f64;
            (Shape::Periodic(Periodic { period }), COST)
        })
        .collect()
}

/// Spacing of the periods of the library: adjacent frequencies differ by half a cycle over the travel.
pub(super) fn spacing(period: f64, span: f64) -> f64 {
    0.5 * period * period / span
}

/// The interval of periods up to the neighbouring frequencies of the library.
pub(super) fn bracket(period: f64, spacing: f64) -> [f64; 2] {
    let near = spacing / period;
    [period / (1.0 + near), period / (1.0 - near.min(0.5))]
}

impl ShapeKind for Periodic {
    fn write(&self, keys: &mut KeyWriter) {
        keys.quantity(&PERIOD, self.period);
    }
    fn check(&self) -> Result<(), String> {
        positive(self.period, "a period")
    }
    fn describe(&self, words: &EffectWords) -> String {
        format!("{}, repeating every {}{}", words.motion, words.at_value(self.period), words.of_another_axis)
    }
    fn is_wave(&self) -> bool {
        true
    }
    fn reported(&self) -> Vec<(&'static str, Vec<f64>)> {
        vec![("period", vec![self.period])]
    }
    fn spacing(&self, span: f64) -> f64 {
        spacing(self.period, span)
    }
    fn brackets(&self, spacing: f64) -> Vec<[f64; 2]> {
        vec![bracket(self.period, spacing)]
    }
    fn number_names(&self) -> &'static [&'static str] {
        &["period"]
    }
    fn set_number(&mut self, _: usize, value: f64) {
        self.period = value;
    }
}

impl Basis for Periodic {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let (sin, cos) = (N::constant(TAU) * sample.value / N::constant(self.period)).sin_cos();
        basis.extend([cos, sin]);
    }
}
