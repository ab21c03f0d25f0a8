//! `lag`: the component trails in proportion to the rate of the driver. The basis function is −rate, so the coefficient
//! is the delay in s.

use super::kind::{Basis, Entry, Follows, Per, ShapeKind};
use super::words::EffectWords;
use super::{DriverSample, Shape};
use crate::driver::DriverPart;
use crate::scalar::Nominal;

/// The component trails in proportion to the driver's rate; the coefficient is a delay in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lag;

pub(super) const ENTRY: Entry = Entry {
    word: "lag",
    keys: &[],
    follows: Follows::Axis,
    read: |_| Ok(Shape::Lag),
    members: |sampled| {
        if sampled.has_time && !sampled.poses { vec![(Shape::Lag, 0.0)] } else { Vec::new() }
    },
};

impl ShapeKind for Lag {
    fn describe(&self, words: &EffectWords) -> String {
        if words.is_positioning {
            "lag behind the command in proportion to the speed".to_string()
        } else {
            let EffectWords { motion, of_another_axis, .. } = words;
            format!("{motion} in proportion to the speed{of_another_axis}")
        }
    }
    fn uses(&self) -> DriverPart {
        DriverPart::Rate
    }
    fn per(&self, _: usize) -> Per {
        Per::Rate
    }
    fn fits_position_table(&self) -> bool {
        false
    }
}

impl Basis for Lag {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push(-sample.rate);
    }
}
