//! `triangle`: a triangular wave with a period of any length, as belt and chain drives show: 1 − 4d with d the distance
//! to the nearest whole period over the period, and the same a quarter of a period later.
//!
//! The coefficients are those of a cosine-like wave, with its peak at 0, and of a sine-like wave, with its peak at a
//! quarter of a period. One of them alone is a triangle. Both together have kinks at every quarter of the period.

use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::periodic::{self, PERIOD};
use super::words::EffectWords;
use super::{DriverSample, KeyWriter, Shape};
use crate::scalar::Nominal;

/// Cosine-like and sine-like triangular waves with a period of any length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// The period, in the driver's unit.
    pub period: f64,
}

pub(super) const ENTRY: Entry = Entry {
    word: "triangle",
    keys: &[PERIOD],
    follows: Follows::Anything,
    read: |keys| Ok(Shape::Triangle(Triangle { period: keys.required_quantity(&PERIOD)? })),
    // Nearly collinear with the sinusoids of the library, which cost as much.
    members: |_| Vec::new(),
};

impl ShapeKind for Triangle {
    fn write(&self, keys: &mut KeyWriter) {
        keys.quantity(&PERIOD, self.period);
    }
    fn check(&self) -> Result<(), String> {
        positive(self.period, "a period")
    }
    fn describe(&self, words: &EffectWords) -> String {
        let period = words.at_value(self.period);
        format!("{}, a triangular wave every {period}{}", words.motion, words.of_another_axis)
    }
    fn coefficients(&self) -> usize {
        2
    }
    fn coefficient_names(&self) -> Vec<String> {
        vec!["cos".into(), "sin".into()]
    }
    fn reported(&self) -> Vec<(&'static str, Vec<f64>)> {
        vec![("period", vec![self.period])]
    }
    fn spacing(&self, span: f64) -> f64 {
        periodic::spacing(self.period, span)
    }
    fn brackets(&self, spacing: f64) -> Vec<[f64; 2]> {
        vec![periodic::bracket(self.period, spacing)]
    }
    fn number_names(&self) -> &'static [&'static str] {
        &["period"]
    }
    fn set_number(&mut self, _: usize, value: f64) {
        self.period = value;
    }
}

impl Basis for Triangle {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let periods = sample.value / N::constant(self.period);
        basis.extend([wave(periods), wave(periods - N::constant(0.25))]);
    }
}

/// The triangular wave of period 1: 1 at every whole number, −1 halfway.
fn wave<N: Nominal>(periods: N) -> N {
    let from_peak = periods - periods.round();
    N::constant(1.0) - N::constant(4.0) * from_peak * from_peak.signum()
}
