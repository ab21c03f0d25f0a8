//! `drift`: linear in time. The basis function is the time in hours.

use super::kind::{Basis, Entry, Follows, Per, ShapeKind};
use super::words::EffectWords;
use super::{DriverSample, Shape};
use crate::driver::SECONDS_PER_HOUR;
use crate::scalar::Nominal;

/// Linear in time; the coefficient is the change per hour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift;

pub(super) const ENTRY: Entry = Entry {
    word: "drift",
    keys: &[],
    follows: Follows::Time,
    read: |_| Ok(Shape::Drift),
    members: |_| vec![(Shape::Drift, 0.0)],
};

impl ShapeKind for Drift {
    fn describe(&self, words: &EffectWords) -> String {
        format!("{}, drifting with {}", words.motion, words.driver)
    }
    fn per(&self, _: usize) -> Per {
        Per::Hour
    }
    fn fits_position_table(&self) -> bool {
        false
    }
}

impl Basis for Drift {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push(sample.value / N::constant(SECONDS_PER_HOUR));
    }
}
