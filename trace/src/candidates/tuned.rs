//! The gain of an effect whose shape numbers or positions differ from those of the library.
//!
//! Its products follow from the sums over the states of its driver, which do not depend on the numbers. If one of
//! several positions changes, only its column is computed again.

use std::sync::Arc;

use abbe_identify::numerics::gain::quadratic_gain;
use abbe_model::effect::Shape;
use faer::Mat;

use super::columns::{Channel, Columns, EffectColumns};
use super::gain::TrainedModel;
use super::gram::{ChannelProducts, TuningSide};

impl TrainedModel<'_> {
    /// What the columns of tuned effects are multiplied with.
    pub fn tuning(&self) -> Tuning<'_> {
        Tuning { model: self, side: TuningSide::of(self.gram, &self.projection, &self.chosen) }
    }
}

/// Gains of effects that are no candidates beside a model.
pub struct Tuning<'t> {
    model: &'t TrainedModel<'t>,
    side: TuningSide,
}

/// The products of one effect with a model.
#[derive(Clone)]
struct EffectProducts {
    /// With the model columns, the residual and the chosen effects: vectors × columns.
    cross: Mat<f64>,
    /// With itself.
    own: Mat<f64>,
}

impl<'t> Tuning<'t> {
    /// The sums over the states of a channel.
    fn channel<'c>(&'c self, channel: &'c Arc<Channel>) -> ChannelProducts<'c> {
        self.side.channel(&self.model.projection, channel)
    }

    /// The gain of an effect.
    fn gain(&self, products: &EffectProducts) -> f64 {
        let rank = self.model.gram.rank();
        let (cross, count) = (&products.cross, products.own.ncols());
        let of_model = cross.subrows(0, rank);
        let of_chosen = cross.subrows(rank + 1, self.model.along.len());
        let solved = &self.model.inverse * of_chosen;
        let d = &products.own
            - of_model.transpose() * (&self.model.projection.inverse * of_model)
            - of_chosen.transpose() * &solved;
        let along = |k: usize| -> f64 { self.model.along.iter().enumerate().map(|(i, y)| solved[(i, k)] * y).sum() };
        let g: Vec<f64> = (0..count).map(|k| cross[(rank, k)] - along(k)).collect();
        quadratic_gain(&d, &products.own, &g)
    }
}

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
        let columns = self.columns.basis(shape, &self.set.channel);
        let rows = columns.first().map_or(0, Vec::len);
        self.effect_of(Mat::from_fn(rows, columns.len(), |i, k| columns[k][i]))
    }

    /// The effect with basis functions (states × columns).
    pub(super) fn effect_of(&self, basis: Mat<f64>) -> TunedEffect {
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
