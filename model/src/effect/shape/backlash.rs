//! `backlash`: lost motion on reversal. The basis function is −½ · direction, so the coefficient is the full lost
//! motion.

use super::kind::{Basis, Entry, Follows, ShapeKind};
use super::words::EffectWords;
use super::{DriverSample, Shape};
use crate::driver::DriverPart;
use crate::scalar::Nominal;

/// Lost motion on reversal; the coefficient is the full lost motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backlash;

pub(super) const ENTRY: Entry = Entry {
    word: "backlash",
    keys: &[],
    follows: Follows::Axis,
    read: |_| Ok(Shape::Backlash),
    members: |sampled| {
        if sampled.both_directions && !sampled.poses { vec![(Shape::Backlash, 0.0)] } else { Vec::new() }
    },
};

impl ShapeKind for Backlash {
    fn describe(&self, words: &EffectWords) -> String {
        if words.is_positioning {
            "lost motion (backlash) at reversal".to_string()
        } else {
            let EffectWords { motion, of_another_axis, .. } = words;
            format!("{motion} that changes at reversal{of_another_axis} (backlash)")
        }
    }
    fn uses(&self) -> DriverPart {
        DriverPart::Direction
    }
}

impl Basis for Backlash {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push(N::constant(-0.5) * sample.direction);
    }
}
