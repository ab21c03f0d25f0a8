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

use abbe_identify::error;
use abbe_identify::numerics::parallel;
use abbe_model::Diagnostic;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use layout::Layout;

use super::columns::{Adjoint, Columns, EffectColumns};
pub(super) use projection::{ChosenEffect, Projection, SegmentProducts};
pub(super) use tuning::{ChannelProducts, TuningSide};

/// Least number of null draws whose products are formed together.
const DRAWS_AT_ONCE: usize = 16;
/// Null draws from which the model is projected out together. Each is held in double precision.
const PROJECTED_AT_ONCE: usize = 8;
/// Largest number of entries of the null draws whose products are formed together. The least number of draws may have more.
const MAX_NULL_ENTRIES: usize = 4_000_000;
/// Number of entries of all null draws up to which a search best keeps them for candidates to come: 128 MB. A search that
/// finds nothing adds no candidates.
pub const MAX_KEPT_DRAWS: usize = 32_000_000;
/// Number of entries up to which an array of a projection that can be formed anew is kept: 64 MB.
const MAX_KEPT_ENTRIES: usize = 8_000_000;

/// The priors as products with the model columns.
pub struct PriorGram {
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
pub struct Gram<'c> {
    columns: &'c Columns<'c>,
    sets: Vec<EffectColumns>,
    segments: Vec<Segment>,
    next_key: Arc<AtomicUsize>,
    /// Rows × rank.
    model: Arc<Mat<f64>>,
    residual: Arc<Vec<f64>>,
    prior: Arc<PriorGram>,
    /// Number of null draws.
    draws: usize,
    /// Forms the null draws again; `None` if no segment that is added later needs them.
    source: Option<&'c (dyn DrawSource + 'c)>,
    /// The null draws, for the products of segments that are added later.
    null: Arc<Mutex<Option<Arc<NullDraws>>>>,
    /// For each segment draws × columns.
    null_products: Store<usize, Mat<f64>>,
    /// By training folds.
    projections: Store<Vec<usize>, Projection>,
    /// Number of entries up to which projections keep what they can form anew.
    kept_by_projections: usize,
}

/// Null draws with the model projected out: some draws, one part after another. They are the largest array of a trace of few
/// driver states. Single precision halves it; scores are compared with each other, and a rounding of 10⁻⁷ decides nothing.
type NullDraws = Vec<Adjoint<f32>>;

/// What forms null draws.
pub trait DrawSource: Sync {
    /// All draws from the first one on, each formed when it is taken, over the whitened rows in fold order.
    fn draws(&self) -> Box<dyn ExactSizeIterator<Item = Vec<f64>> + Send + '_>;
}

/// Draws of a test: their number, and what forms each.
#[cfg(test)]
pub struct Given<F>(pub usize, pub F);

#[cfg(test)]
impl<F: Fn(usize) -> Vec<f64> + Sync> DrawSource for Given<F> {
    fn draws(&self) -> Box<dyn ExactSizeIterator<Item = Vec<f64>> + Send + '_> {
        Box::new((0..self.0).map(&self.1))
    }
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

impl<'c> Gram<'c> {
    /// From the orthonormal model columns (rows × rank) and the residual over all rows, without null draws.
    pub fn new(
        columns: &'c Columns<'c>,
        sets: Vec<EffectColumns>,
        model: Arc<Mat<f64>>,
        residual: &[f64],
        prior: PriorGram,
    ) -> Gram<'c> {
        let mut gram = Gram {
            columns,
            sets: Vec::new(),
            segments: Vec::new(),
            next_key: Arc::default(),
            model,
            residual: Arc::new(residual.to_vec()),
            prior: Arc::new(prior),
            draws: 0,
            source: None,
            null: Arc::default(),
            null_products: Arc::default(),
            projections: Arc::default(),
            kept_by_projections: MAX_KEPT_ENTRIES,
        };
        gram.append(sets);
        gram
    }

    /// Forms the products of the candidates with null draws, each over all rows. Draws are taken in parts and forgotten,
    /// unless candidates that are added later need them: up to `kept_entries` are then kept, and more are formed again for the
    /// first of these candidates. `None`: no candidates are added.
    ///
    /// # Errors
    /// If products are not finite, or `INTERRUPTED` if `should_continue` returns `false`.
    pub fn take_draws(
        &mut self,
        source: &'c (dyn DrawSource + 'c),
        kept_entries: Option<usize>,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Diagnostic> {
        let whole = self.projection(&self.all_folds())?;
        let (draws, layout) = (source.draws(), Arc::clone(&self.segments[0].layout));
        self.draws = draws.len();
        let kept = kept_entries.is_some_and(|most| self.draws * self.residual.len() <= most);
        let mut products = Mat::zeros(self.draws, layout.total());
        let mut null = NullDraws::new();
        let mut places = None;
        if kept || layout.total() > 0 {
            self.in_parts(&whole, draws, |first, side| {
                if !should_continue() {
                    return Err(error::interrupted());
                }
                let places = places.get_or_insert_with(|| layout.places(&whole.training, &side.rows, self.draws));
                let formed = layout.products_at(places, &whole.training, &side, false, should_continue);
                let formed = formed.ok_or_else(error::interrupted)?.side;
                products.as_mut().subrows_mut(first, formed.nrows()).copy_from(&formed);
                if kept {
                    null.push(side);
                }
                Ok(())
            })?;
        }
        self.source = kept_entries.map(|_| source);
        self.null = Arc::new(Mutex::new(kept.then(|| Arc::new(null))));
        stored(&self.null_products, &self.segments[0].key, || Ok(Arc::new(products))).map(|_: Arc<Mat<f64>>| ())
    }

    /// Passes null draws on in parts, with the model projected out, each with the number of its first draw. Draws are formed
    /// one after the other: the next ones beside what is done with these.
    fn in_parts(
        &self,
        whole: &Projection,
        mut draws: Box<dyn ExactSizeIterator<Item = Vec<f64>> + Send + '_>,
        mut each: impl FnMut(usize, Adjoint<f32>) -> Result<(), Diagnostic> + Send,
    ) -> Result<(), Diagnostic> {
        // Whole parts: a column of fewer draws is padded to a multiple of 64 bytes.
        let at_once = DRAWS_AT_ONCE * (MAX_NULL_ENTRIES / (DRAWS_AT_ONCE * self.residual.len().max(1))).max(1);
        let mut rows = None;
        let mut next: Vec<Vec<f64>> = draws.by_ref().take(at_once).collect();
        for first in (0..self.draws).step_by(at_once) {
            let part = std::mem::take(&mut next);
            let done = || {
                let side = self.projected(whole, part);
                let rows = rows.get_or_insert_with(|| Arc::clone(&side.rows));
                each(first, Adjoint { rows: Arc::clone(rows), ..side })
            };
            parallel::both(done, || next = draws.by_ref().take(at_once).collect()).0?;
        }
        Ok(())
    }

    /// The null draws, for a segment that was added later.
    fn null(&self) -> Result<Arc<NullDraws>, Diagnostic> {
        let known = || self.null.lock().ok().and_then(|null| null.clone());
        if let Some(null) = known() {
            return Ok(null);
        }
        let mut null = NullDraws::new();
        if let Some(source) = &self.source {
            let whole = self.projection(&self.all_folds())?;
            self.in_parts(&whole, source.draws(), |_, side| {
                null.push(side);
                Ok(())
            })?;
        }
        let null = Arc::new(null);
        if let Ok(mut place) = self.null.lock() {
            *place = Some(Arc::clone(&null));
        }
        Ok(null)
    }

    /// Null draws with the model projected out.
    fn projected(&self, whole: &Projection, draws: Vec<Vec<f64>>) -> Adjoint<f32> {
        let parts: Vec<&[Vec<f64>]> = draws.chunks(PROJECTED_AT_ONCE).collect();
        let projected = parallel::map(parts.len(), &|k| {
            let mut part = Mat::from_fn(self.residual.len(), parts[k].len(), |i, draw| parts[k][draw][i]);
            let along = &whole.inverse * transposed_product(self.model(), part.as_ref());
            matmul(part.as_mut(), Accum::Add, self.model(), along.as_ref(), -1.0, Par::Seq);
            Adjoint::of(&whole.training, part.as_ref()).single()
        });
        let rows = projected.first().map(|part| Arc::clone(&part.rows)).unwrap_or_default();
        let mut values = Mat::zeros(draws.len(), rows.len());
        let mut first = 0;
        for part in projected {
            values.as_mut().subrows_mut(first, part.values.nrows()).copy_from(&part.values);
            first += part.values.nrows();
        }
        Adjoint { rows, values }
    }

    /// The products of the library over all rows with each of some other residuals.
    ///
    /// # Errors
    /// If products are not finite, or `INTERRUPTED` if `should_continue` returns `false`.
    pub fn with_residuals(
        &self,
        residuals: &[Vec<f64>],
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<Gram<'c>>, Diagnostic> {
        let known = self.projection(&self.all_folds())?.products(self, 0, should_continue)?;
        let other = |residual: &Vec<f64>| Gram {
            residual: Arc::new(residual.clone()),
            projections: Arc::default(),
            ..self.clone()
        };
        let others: Vec<Gram<'c>> = residuals.iter().map(other).collect();
        let whole = |other| Ok((other, Gram::projection(other, &other.all_folds())?));
        let projections = others.iter().map(whole).collect::<Result<Vec<_>, Diagnostic>>()?;
        Projection::take_products(&projections, 0, &known, should_continue)?;
        drop(projections);
        Ok(others)
    }

    /// The same with everything formed anew, as in a long session.
    #[cfg(test)]
    pub fn keeping_nothing(self) -> Gram<'c> {
        Gram { kept_by_projections: 0, ..self }
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
    pub(super) fn projection(&self, folds: &[usize]) -> Result<Arc<Projection>, Diagnostic> {
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
    /// If products are not finite, or `INTERRUPTED` if `should_continue` returns `false`.
    pub fn prepare(&self, folds: &[&[usize]], should_continue: &(dyn Fn() -> bool + Sync)) -> Result<(), Diagnostic> {
        self.projection(&self.all_folds())?.products(self, 0, should_continue)?;
        let prepared = parallel::map(folds.len(), &|k| {
            self.projection(folds[k])?.products(self, 0, should_continue)?;
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
    pub(super) fn null_products(&self, segment: usize) -> Result<Arc<Mat<f64>>, Diagnostic> {
        stored(&self.null_products, &self.segments[segment].key, || {
            let null = self.null()?;
            debug_assert!(self.draws == 0 || !null.is_empty(), "the draws are not for candidates that are added later");
            let whole = self.projection(&self.all_folds())?;
            let layout = &self.segments[segment].layout;
            let mut products = Mat::zeros(self.draws, layout.total());
            let mut first = 0;
            let rows = null.first().map(|part| Arc::clone(&part.rows)).unwrap_or_default();
            let places = layout.places(&whole.training, &rows, self.draws);
            for part in null.iter() {
                let formed = layout.products_at(&places, &whole.training, part, false, &|| true);
                let formed = formed.ok_or_else(error::interrupted)?.side;
                products.as_mut().subrows_mut(first, formed.nrows()).copy_from(&formed);
                first += formed.nrows();
            }
            Ok(Arc::new(products))
        })
    }

    /// Number of null draws.
    pub fn draws(&self) -> usize {
        self.draws
    }
}
