//! `constant`: a PIGE. The basis function is 1.

use super::kind::{Basis, Entry, Follows, ShapeKind};
use super::words::EffectWords;
use super::{DriverSample, Shape};
use crate::scalar::Nominal;

/// Constant: a PIGE.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant;

pub(super) const ENTRY: Entry = Entry {
    word: "constant",
    keys: &[],
    follows: Follows::Nothing,
    read: |_| Ok(Shape::Constant),
    members: |_| vec![(Shape::Constant, 0.0)],
};

impl ShapeKind for Constant {
    fn describe(&self, words: &EffectWords) -> String {
        format!("{}, constant", words.motion)
    }
    fn fits_position_table(&self) -> bool {
        false
    }
}

impl Basis for Constant {
    fn basis<N: Nominal>(&self, _: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push(N::constant(1.0));
    }
}
