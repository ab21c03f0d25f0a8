//! Products of candidates with the model, the residual and the null draws.
//!
//! With `X` the orthonormal columns of the fitted model, `y` the residual and `C` a candidate's columns over the rows of
//! some folds, the products of each candidate are kept with the model projected out:
//!
//! ```text
//! d = CᵀC − CᵀX (XᵀX)⁻¹ XᵀC,   g = Cᵀ y⊥,   y⊥ = y − X (XᵀX)⁻¹ Xᵀy
//! ```
//!
//! The columns `E` of a chosen effect are projected too: `E⊥ = E − X (XᵀX)⁻¹ XᵀE`. The gain of a candidate beside chosen
//! effects then needs only `CᵀE⊥`, one vector for each column of `E` ([`super::gain`]).
//!
//! Candidates come in segments: the library, and what the search adds. The products of a segment are formed over the
//! states of the drivers ([`layout`]) when they are first needed, for all rows or for the rows outside one fold
//! ([`projection`]).

mod layout;
mod projection;
mod states;
mod tuning;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::columns::{Adjoint, Columns, EffectColumns};
use crate::error::IdentifyError;
use crate::numerics::parallel;
use layout::Layout;
pub(super) use projection::{ChosenEffect, Projection, SegmentProducts};
pub(super) use tuning::{ChannelProducts, TuningSide};

/// Null draws that are projected together.
const DRAWS_AT_ONCE: usize = 32;
/// Largest number of entries of the null draws whose products are formed together.
const MAX_NULL_ENTRIES: usize = 4_000_000;

/// The priors as products with the model columns.
pub struct PriorMoments {
    /// Model with model.
    pub base: Mat<f64>,
    /// Model with residual.
    pub base_y: Vec<f64>,
}

/// Candidates whose products are formed together.
#[derive(Clone)]
struct Segment {
    /// Index of the first candidate.
    start: usize,
    /// Its key in the stores of products. Clones with other segments share these stores.
    key: usize,
    layout: Arc<Layout>,
}

/// The products of the candidates of a session. Clones share all products. Each can have further candidates.
#[derive(Clone)]
pub struct Moments<'c> {
    columns: &'c Columns<'c>,
    sets: Vec<EffectColumns>,
    segments: Vec<Segment>,
    next_key: Arc<AtomicUsize>,
    /// Rows × rank.
    model: Arc<Mat<f64>>,
    residual: Arc<Vec<f64>>,
    prior: Arc<PriorMoments>,
    /// The null draws with the model projected out.
    null: Arc<Adjoint>,
    /// For each segment draws × columns.
    null_products: Store<usize, Mat<f64>>,
    /// By training folds.
    projections: Store<Vec<usize>, Projection>,
}

/// Values that clones share.
type Store<K, V> = Arc<Mutex<HashMap<K, Arc<V>>>>;

pub(crate) fn transposed_product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut product = Mat::zeros(a.ncols(), b.ncols());
    matmul(product.as_mut(), Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    product
}

/// The stored value of a key. Computes and stores it if it is absent.
pub(super) fn stored<K: std::hash::Hash + Eq + Clone, V: Clone, E>(
    store: &Mutex<HashMap<K, V>>,
    key: &K,
    make: impl FnOnce() -> Result<V, E>,
) -> Result<V, E> {
    if let Some(value) = store.lock().ok().and_then(|store| store.get(key).cloned()) {
        return Ok(value);
    }
    let value = make()?;
    Ok(match store.lock() {
        Ok(mut store) => store.entry(key.clone()).or_insert(value).clone(),
        Err(_) => value,
    })
}

impl<'c> Moments<'c> {
    /// From the orthonormal model columns (rows × rank), the residual, and the null draws, each over all rows.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn new(
        columns: &'c Columns<'c>,
        sets: Vec<EffectColumns>,
        model: Mat<f64>,
        residual: &[f64],
        prior: PriorMoments,
        null: Vec<Vec<f64>>,
    ) -> Result<Moments<'c>, IdentifyError> {
        let mut moments = Moments {
            columns,
            sets: Vec::new(),
            segments: Vec::new(),
            next_key: Arc::default(),
            model: Arc::new(model),
            residual: Arc::new(residual.to_vec()),
            prior: Arc::new(prior),
            null: Arc::new(Adjoint { rows: Vec::new(), values: Mat::zeros(0, 0) }),
            null_products: Arc::default(),
            projections: Arc::default(),
        };
        moments.take_draws(null)?;
        moments.append(sets);
        Ok(moments)
    }

    /// Projects the model out of the null draws and keeps them. Each draw is released as soon as it is projected.
    fn take_draws(&mut self, null: Vec<Vec<f64>>) -> Result<(), IdentifyError> {
        let draws = null.len();
        let whole = self.projection(&self.all_folds())?;
        let mut values: Option<Adjoint> = None;
        let mut rest = null.into_iter();
        for first in (0..draws).step_by(DRAWS_AT_ONCE) {
            let part: Vec<Vec<f64>> = rest.by_ref().take(DRAWS_AT_ONCE).collect();
            let mut part = Mat::from_fn(self.residual.len(), part.len(), |i, k| part[k][i]);
            let along = &whole.inverse * transposed_product(self.model(), part.as_ref());
            matmul(part.as_mut(), Accum::Add, self.model(), along.as_ref(), -1.0, Par::Seq);
            let Adjoint { rows, values: of_part } = Adjoint::of(&whole.training, part.as_ref());
            let kept = values.get_or_insert_with(|| Adjoint { values: Mat::zeros(draws, rows.len()), rows });
            kept.values.as_mut().subrows_mut(first, of_part.nrows()).copy_from(&of_part);
        }
        self.null = Arc::new(values.unwrap_or(Adjoint { rows: Vec::new(), values: Mat::zeros(0, 0) }));
        Ok(())
    }

    /// Adds candidates as a segment of their own.
    pub fn append(&mut self, sets: Vec<EffectColumns>) {
        let key = self.next_key.fetch_add(1, Ordering::Relaxed);
        self.segments.push(Segment { start: self.sets.len(), key, layout: Arc::new(Layout::of(&sets)) });
        self.sets.extend(sets);
    }

    /// Number of candidates.
    pub fn candidates(&self) -> usize {
        self.sets.len()
    }

    /// The model columns: rows × rank.
    fn model(&self) -> MatRef<'_, f64> {
        Mat::as_ref(&self.model)
    }

    /// Number of model columns.
    pub fn rank(&self) -> usize {
        self.model.ncols()
    }

    /// Number of columns of a candidate.
    pub fn count(&self, candidate: usize) -> usize {
        self.sets[candidate].count
    }

    /// Number of tuned shape numbers of a candidate.
    pub fn numbers(&self, candidate: usize) -> usize {
        self.sets[candidate].numbers
    }

    /// The columns of a candidate.
    pub fn set(&self, candidate: usize) -> &EffectColumns {
        &self.sets[candidate]
    }

    /// Index of the segment of a candidate, and its index in the segment.
    pub(super) fn place(&self, candidate: usize) -> (usize, usize) {
        let segment = self.segments.partition_point(|segment| segment.start <= candidate) - 1;
        (segment, candidate - self.segments[segment].start)
    }

    /// The range of a candidate's columns in its segment.
    pub(super) fn columns_of(&self, segment: usize, local: usize) -> Range<usize> {
        self.segments[segment].layout.columns(local)
    }

    /// The range of a candidate's square in its segment.
    pub(super) fn square_of(&self, segment: usize, local: usize) -> Range<usize> {
        self.segments[segment].layout.squares(local)
    }

    /// The projection for some training folds.
    pub(super) fn projection(&self, folds: &[usize]) -> Result<Arc<Projection>, IdentifyError> {
        stored(&self.projections, &folds.to_vec(), || Ok(Arc::new(Projection::of(self, folds)?)))
    }

    /// The training folds of all readings.
    fn all_folds(&self) -> Vec<usize> {
        (0..self.columns.fold_rows.len()).collect()
    }

    /// Forgets the products over some training folds of chosen effects other than some candidates.
    pub fn keep_chosen(&self, folds: &[usize], candidates: &[usize]) {
        let projection = self.projections.lock().ok().and_then(|projections| projections.get(folds).cloned());
        if let Some(projection) = projection {
            projection.keep_chosen(self, candidates);
        }
    }

    /// Forms the products of the library for several sets of training folds at the same time.
    ///
    /// # Errors
    /// If products are not finite, or [`IdentifyError::Interrupted`] if `go_on` returns `false`.
    pub fn prepare(&self, folds: &[&[usize]], go_on: &(dyn Fn() -> bool + Sync)) -> Result<(), IdentifyError> {
        self.projection(&self.all_folds())?.products(self, 0, go_on)?;
        let prepared = parallel::map(folds.len(), &|k| {
            self.projection(folds[k])?.products(self, 0, go_on)?;
            Ok(())
        });
        prepared.into_iter().collect()
    }

    /// `Aᵀ B⊥` of two chosen effects over the same training folds. Outside the readings the model is held by its priors.
    pub(super) fn between(&self, a: &ChosenEffect, b: &ChosenEffect) -> Mat<f64> {
        let of_priors = a.of_model.transpose() * &self.prior.base * &b.of_model;
        transposed_product(a.rows.as_ref(), b.rows.as_ref()) + of_priors
    }

    /// The products of a segment with the projected null draws: draws × columns.
    pub(super) fn null_products(&self, segment: usize) -> Result<Arc<Mat<f64>>, IdentifyError> {
        stored(&self.null_products, &self.segments[segment].key, || {
            let whole = self.projection(&self.all_folds())?;
            let layout = &self.segments[segment].layout;
            let draws = self.draws();
            let at_once = (MAX_NULL_ENTRIES / self.null.rows.len().max(1)).clamp(1, draws.max(1));
            let form = |side: &Adjoint| {
                layout.products(&whole.training, side, false, &|| true).ok_or(IdentifyError::Interrupted)
            };
            if at_once == draws {
                return Ok(Arc::new(form(&self.null)?.side));
            }
            let mut products = Mat::zeros(draws, layout.total());
            for first in (0..draws).step_by(at_once) {
                let count = at_once.min(draws - first);
                let values = self.null.values.as_ref().subrows(first, count).to_owned();
                let side = Adjoint { rows: self.null.rows.clone(), values };
                products.as_mut().subrows_mut(first, count).copy_from(&form(&side)?.side);
            }
            Ok(Arc::new(products))
        })
    }

    /// Number of null draws.
    pub fn draws(&self) -> usize {
        self.null.values.nrows()
    }
}
