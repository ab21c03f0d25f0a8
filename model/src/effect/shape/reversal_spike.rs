//! `reversal-spike`: a peak after each reversal: direction · exp(−distance since reversal / width).

use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyWriter, Shape};
use crate::driver::DriverPart;
use crate::effect::sampled::Sampled;
use crate::scalar::Nominal;

/// A peak after each reversal that decays with the distance moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReversalSpike {
    /// Distance over which it decays to 1/e.
    pub width: f64,
}

/// Widths of the library, as shares of the travel.
const WIDTHS: [f64; 5] = [0.002, 0.005, 0.01, 0.02, 0.05];

const WIDTH: Key = Key { name: "width", form: KeyForm::Quantity, meaning: "decay distance of a reversal spike" };

pub(super) const ENTRY: Entry = Entry {
    word: "reversal-spike",
    keys: &[WIDTH],
    follows: Follows::Axis,
    read: |keys| Ok(Shape::ReversalSpike(ReversalSpike { width: keys.required_quantity(&WIDTH)? })),
    members,
};

fn members(sampled: &Sampled) -> Vec<(Shape, f64)> {
    // A run that starts where the previous run ended starts with a reversal.
    let observable = sampled.reverses_inside_runs || sampled.both_directions;
    if !observable || sampled.poses {
        return Vec::new();
    }
    let spike = |share: f64| Shape::ReversalSpike(ReversalSpike { width: share * sampled.span() });
    WIDTHS.map(|share| (spike(share), 0.0)).to_vec()
}

impl ShapeKind for ReversalSpike {
    fn write(&self, keys: &mut KeyWriter) {
        keys.quantity(&WIDTH, self.width);
    }
    fn check(&self) -> Result<(), String> {
        positive(self.width, "the width of a reversal spike")
    }
    fn describe(&self, words: &EffectWords) -> String {
        format!(
            "{}, a spike after reversal{} that decays over {}",
            words.motion,
            words.of_another_axis,
            words.at_value(self.width)
        )
    }
    fn uses(&self) -> DriverPart {
        DriverPart::SinceReversal
    }
    fn fits_position_table(&self) -> bool {
        false
    }
    fn varies_within(&self) -> Option<[f64; 2]> {
        Some([0.0, 3.0 * self.width])
    }
    fn reported(&self) -> Vec<(&'static str, Vec<f64>)> {
        vec![("width", vec![self.width])]
    }
    fn brackets(&self, _: f64) -> Vec<[f64; 2]> {
        vec![[self.width * 0.4, self.width * 2.5]]
    }
    fn number_names(&self) -> &'static [&'static str] {
        &["width"]
    }
    fn set_number(&mut self, _: usize, value: f64) {
        self.width = value;
    }
}

impl Basis for ReversalSpike {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push(sample.direction * (-sample.since_reversal / N::constant(self.width)).exp());
    }
}
