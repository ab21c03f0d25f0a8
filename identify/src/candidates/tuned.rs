//! The gain of an effect whose shape numbers or positions differ from those of the library.
//!
//! Its products follow from the sums over the states of its driver, which do not depend on the numbers. If one of
//! several positions changes, only its column is computed again.

use abbe_model::effect::Shape;
use faer::Mat;

use super::columns::{Columns, EffectColumns};
use super::gain::{EffectProducts, Tuning};
use super::moments::ChannelProducts;

/// A channel whose effects are tuned.
pub struct TunedChannel<'t> {
    columns: &'t Columns<'t>,
    tuning: &'t Tuning<'t>,
    set: &'t EffectColumns,
    products: ChannelProducts<'t>,
}

/// The basis functions of an effect and their products over the training folds of a model.
pub struct TunedEffect {
    /// At the states of the training rows.
    local: Mat<f64>,
    /// At all states.
    basis: Mat<f64>,
    products: EffectProducts,
}

impl<'t> TunedChannel<'t> {
    /// Of the channel of an effect.
    pub fn of(columns: &'t Columns<'t>, tuning: &'t Tuning<'t>, set: &'t EffectColumns) -> TunedChannel<'t> {
        TunedChannel { columns, tuning, set, products: tuning.channel(&set.channel) }
    }

    /// The effect with a shape.
    pub fn effect(&self, shape: &Shape) -> TunedEffect {
        let basis = (*self.columns.reshaped(shape, &self.set.channel).basis).clone();
        let (local, cross, own) = self.products.of(&basis);
        TunedEffect { local, basis, products: EffectProducts { cross, own } }
    }

    /// The gain of an effect.
    pub fn gain(&self, effect: &TunedEffect) -> f64 {
        self.tuning.gain(&effect.products)
    }

    /// The gain of an effect with column `column` replaced by the column of `other`.
    pub fn gain_with(&self, effect: &TunedEffect, column: usize, other: &TunedEffect) -> f64 {
        self.tuning.gain(&self.exchanged(effect, column, other))
    }

    /// Replaces column `column` of an effect by the column of `other`.
    pub fn exchange(&self, effect: &mut TunedEffect, column: usize, other: &TunedEffect) {
        effect.products = self.exchanged(effect, column, other);
        effect.local.col_mut(column).copy_from(other.local.col(0));
        effect.basis.col_mut(column).copy_from(other.basis.col(0));
    }

    fn exchanged(&self, effect: &TunedEffect, column: usize, other: &TunedEffect) -> EffectProducts {
        let mut products = effect.products.clone();
        products.cross.col_mut(column).copy_from(other.products.cross.col(0));
        let of_other = (other.local.col_as_slice(0), other.basis.col_as_slice(0));
        for k in 0..effect.local.ncols() {
            let of_effect = (effect.local.col_as_slice(k), effect.basis.col_as_slice(k));
            let same = k == column;
            let product = if same { other.products.own[(0, 0)] } else { self.products.between(of_effect, of_other) };
            products.own[(k, column)] = product;
            products.own[(column, k)] = product;
        }
        products
    }
}
