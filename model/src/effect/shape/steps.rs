//! `steps`: one at and beyond each position, 0 below: a compensation table, a pitch correction.

use super::kind::{Basis, Entry, Follows, ShapeKind};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyWriter, Shape};
use crate::effect::sampled::Sampled;
use crate::scalar::Nominal;

/// A step at each position: 0 below, 1 at and beyond.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    /// Positions of the steps.
    pub at: Vec<f64>,
}

/// Number of intervals of the travel between the positions of the library.
const POSITIONS: usize = 40;
/// Maximum number of steps in a description.
const MAX_LISTED: usize = 6;

const AT: Key = Key { name: "at", form: KeyForm::Quantities, meaning: "positions of the steps" };

pub(super) const ENTRY: Entry = Entry {
    word: "steps",
    keys: &[AT],
    follows: Follows::Anything,
    read: |keys| Ok(Shape::Steps(Steps { at: keys.required_quantities(&AT)? })),
    members,
};

/// A single step between the levels of a driver column; along an axis at each position, with the dictionary of all positions, from which a search composes a table.
fn members(sampled: &Sampled) -> Vec<(Shape, f64)> {
    if !sampled.between_levels.is_empty() {
        let single = |position: &f64| (Shape::Steps(Steps { at: vec![*position] }), 0.0);
        return sampled.between_levels.iter().map(single).collect();
    }
    let Some([low, _]) = sampled.ends.filter(|_| !sampled.poses && sampled.step > 0.0) else {
        return Vec::new();
    };
    let position = |k: usize| low + sampled.span() * k as f64 / POSITIONS as f64;
    let positions: Vec<f64> = (1..POSITIONS).map(position).collect();
    let singles = positions.iter().map(|position| vec![*position]);
    singles.chain([positions.clone()]).map(|at| (Shape::Steps(Steps { at }), 0.0)).collect()
}

impl ShapeKind for Steps {
    fn write(&self, keys: &mut KeyWriter) {
        keys.quantities(&AT, &self.at);
    }
    fn check(&self) -> Result<(), String> {
        if self.at.is_empty() {
            return Err("steps without a position".into());
        }
        match self.at.iter().find(|position| !position.is_finite()) {
            Some(position) => Err(format!("a step at {position}")),
            None => Ok(()),
        }
    }
    fn describe(&self, words: &EffectWords) -> String {
        let at = |position: &f64| words.at_value(*position);
        let steps = match self.at.as_slice() {
            [one] => format!("a step at {}", at(one)),
            [first, .., last] if self.at.len() > MAX_LISTED => {
                format!("{} steps from {} to {}", self.at.len(), at(first), at(last))
            }
            several => format!("steps at {}", several.iter().map(at).collect::<Vec<_>>().join(", ")),
        };
        format!("{}, {steps}{}", words.motion, words.of_another_axis)
    }
    fn coefficients(&self) -> usize {
        self.at.len()
    }
    fn varies_within(&self) -> Option<[f64; 2]> {
        let low = self.at.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.at.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let margin = (0.2 * (high - low)).max(1e-3);
        Some([low - margin, high + margin])
    }
    fn reported(&self) -> Vec<(&'static str, Vec<f64>)> {
        vec![("at", self.at.clone())]
    }
    fn numbers(&self) -> usize {
        usize::from(self.at.len() == 1)
    }
    fn spacing(&self, span: f64) -> f64 {
        span / POSITIONS as f64
    }
    fn positions(&self) -> &[f64] {
        &self.at
    }
    fn set_positions(&mut self, positions: Vec<f64>) {
        self.at = positions;
    }
}

impl Basis for Steps {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let step = |position: &f64| (sample.value - N::constant(*position)).step();
        basis.extend(self.at.iter().map(step));
    }
}
