//! The products of candidates over some folds, with the fitted model projected out.
//!
//! The products without one fold follow from those of all rows (leave-out update, Woodbury). With `X_f = Q R` the model
//! rows of the fold and `e = C_f − X_f (XᵀX)⁻¹ XᵀC` the fold's rows of the projected candidate,
//!
//! ```text
//! d(without f) = d − eᵀ (1 − H)⁻¹ e,   g(without f) = g − eᵀ (1 − H)⁻¹ y⊥_f,   H = X_f (XᵀX)⁻¹ X_fᵀ
//! ```
//!
//! `H` acts within the columns of `Q`, of which a fold has few: its readings belong to one test.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use abbe_identify::error;
use abbe_identify::numerics::reduction::orthonormal_basis;
use abbe_identify::numerics::symmetric::pseudo_inverse;
use abbe_model::Diagnostic;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::{Gram, stored, transposed_product};
use crate::candidates::columns::{Adjoint, EffectColumns, TrainingRows};

/// Share of the largest entry below which a pivot of the model rows of a fold is a rounding error.
const PIVOT_ROUNDING: f64 = 1e-13;
/// Share of the product over all rows below which a product without some folds is a rounding error.
const PRODUCT_ROUNDING: f64 = 1e-12;

/// The fitted model over some folds, and the products of candidates with it projected out.
pub(in crate::candidates) struct Projection {
    /// The training folds.
    folds: Vec<usize>,
    /// The whitened rows of these folds.
    pub training: TrainingRows,
    /// `(XᵀX)⁻¹`, priors included.
    pub inverse: Mat<f64>,
    /// Coefficients of the model columns.
    pub coefficients: Vec<f64>,
    /// The decrease of the sum of squares by the model, priors included.
    pub explained: f64,
    /// The residual of the model over all rows in fold order; zero outside the training folds. In a long session it is formed
    /// anew, since there is a projection for each fold.
    residual: OnceLock<Mat<f64>>,
    /// The rows that were left out; `None` if there are none.
    left_out: Option<LeftOut>,
    /// `Wᵀ [X | y⊥]` over all rows. Without some folds it is formed anew, since a projection for each fold would hold one, and
    /// in a long session, of which it is one of the largest arrays.
    side: OnceLock<Arc<Adjoint>>,
    segments: Mutex<HashMap<usize, Arc<SegmentProducts>>>,
    /// By [`key`]: the effect keeps what the addresses refer to.
    chosen: Mutex<HashMap<(usize, usize), Arc<ChosenEffect>>>,
}

/// The rows of the folds that are not trained on.
struct LeftOut {
    training: TrainingRows,
    /// `R`: columns of `Q` × rank.
    r: Mat<f64>,
    /// `(1 − R (XᵀX)⁻¹ Rᵀ)⁻¹`.
    weight: Mat<f64>,
    /// `Qᵀ y⊥` over the fold.
    along: Vec<f64>,
    /// `Wᵀ [Q | y⊥]` over the fold.
    side: Adjoint,
}

/// The products of the candidates of a segment.
pub(in crate::candidates) struct SegmentProducts {
    /// Each candidate with itself, square after square.
    pub own: Vec<f64>,
    /// The same with the model projected out.
    pub d: Vec<f64>,
    /// Candidates with the residual of the model.
    pub g: Vec<f64>,
    /// `XᵀC` and `(XᵀX)⁻¹ XᵀC`, of the projection of all rows.
    with_model: Option<Mat<f64>>,
}

/// The columns of a chosen effect with the model projected out.
pub(in crate::candidates) struct ChosenEffect {
    /// Rows × columns, in fold order; zero outside the training folds.
    pub rows: Mat<f64>,
    /// `(XᵀX)⁻¹ XᵀE`.
    pub of_model: Mat<f64>,
    /// `Eᵀ y⊥`.
    pub with_residual: Vec<f64>,
    /// Length of each column over all rows.
    pub lengths: Vec<f64>,
    /// Keeps the addresses that are its key.
    _set: EffectColumns,
    side: OnceLock<Arc<Adjoint>>,
    segments: Mutex<HashMap<usize, Arc<Mat<f64>>>>,
}

impl ChosenEffect {
    /// `Wᵀ E⊥` over its training rows.
    pub fn side(&self, training: &TrainingRows) -> Arc<Adjoint> {
        Arc::clone(self.side.get_or_init(|| Arc::new(Adjoint::of(training, self.rows.as_ref()))))
    }
}

/// The key of an effect: the address of its basis functions and that of its channel.
fn key(set: &EffectColumns) -> (usize, usize) {
    (Arc::as_ptr(&set.basis) as usize, Arc::as_ptr(&set.channel) as usize)
}

impl Projection {
    /// Of some training folds.
    pub fn of(gram: &Gram<'_>, folds: &[usize]) -> Result<Projection, Diagnostic> {
        let columns = gram.columns;
        let all = gram.all_folds();
        let training = columns.training_rows(folds);
        let part = |fold: usize| {
            let rows = &columns.fold_rows[fold];
            gram.model().subrows(rows.start, rows.len())
        };
        let mut normal = gram.prior.base.clone();
        let mut with_y = Mat::from_fn(gram.rank(), 1, |i, _| gram.prior.base_y[i]);
        for fold in folds {
            let (rows, own) = (&columns.fold_rows[*fold], part(*fold));
            let y = MatRef::from_column_major_slice(&gram.residual[rows.clone()], rows.len(), 1);
            matmul(normal.as_mut(), Accum::Add, own.transpose(), own, 1.0, Par::Seq);
            matmul(with_y.as_mut(), Accum::Add, own.transpose(), y, 1.0, Par::Seq);
        }
        let inverse = pseudo_inverse(normal.as_ref())?;
        let coefficients = &inverse * &with_y;
        let left_out: Vec<usize> = all.iter().copied().filter(|fold| !folds.contains(fold)).collect();
        let left_out = match left_out.is_empty() {
            true => None,
            false => Some(LeftOut::of(gram, &left_out)?),
        };
        Ok(Projection {
            folds: folds.to_vec(),
            training,
            explained: (with_y.transpose() * &coefficients)[(0, 0)],
            coefficients: coefficients.col(0).iter().copied().collect(),
            inverse,
            residual: OnceLock::new(),
            left_out,
            side: OnceLock::new(),
            segments: Mutex::default(),
            chosen: Mutex::default(),
        })
    }

    /// The residual of the model over all rows in fold order; zero outside the training folds.
    pub fn residual(&self, gram: &Gram<'_>) -> Cow<'_, Mat<f64>> {
        let of_all_projections = gram.residual.len() * (1 + gram.columns.fold_rows.len());
        match of_all_projections > gram.kept_by_projections {
            true => Cow::Owned(self.formed_residual(gram)),
            false => Cow::Borrowed(self.residual.get_or_init(|| self.formed_residual(gram))),
        }
    }

    fn formed_residual(&self, gram: &Gram<'_>) -> Mat<f64> {
        let mut residual = Mat::zeros(gram.residual.len(), 1);
        for fold in &self.folds {
            let rows = gram.columns.fold_rows[*fold].clone();
            let model = gram.model().subrows(rows.start, rows.len());
            let mut of_fold = residual.as_mut().subrows_mut(rows.start, rows.len());
            of_fold.copy_from(MatRef::from_column_major_slice(&gram.residual[rows.clone()], rows.len(), 1));
            let coefficients = MatRef::from_column_major_slice(&self.coefficients, self.coefficients.len(), 1);
            matmul(of_fold, Accum::Add, model, coefficients, -1.0, Par::Seq);
        }
        residual
    }

    /// The products of a segment.
    ///
    /// # Errors
    /// `INTERRUPTED` if `should_continue` returns `false`.
    pub fn products(
        &self,
        gram: &Gram<'_>,
        segment: usize,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Result<Arc<SegmentProducts>, Diagnostic> {
        stored(&self.segments, &gram.segments[segment].key, || {
            let products = match &self.left_out {
                None => self.of_all(gram, segment, should_continue)?,
                Some(left_out) => left_out.products(gram, segment, should_continue)?,
            };
            Ok(Arc::new(products))
        })
    }

    /// Takes the products of a segment that do not depend on the residual from the same projection with another residual.
    /// Those with the residuals are formed at once for all of the given projections, which have the same rows.
    ///
    /// # Errors
    /// `INTERRUPTED` if `should_continue` returns `false`.
    pub fn take_products(
        projections: &[(&Gram<'_>, Arc<Projection>)],
        segment: usize,
        known: &SegmentProducts,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Diagnostic> {
        let Some((first, same)) = projections.first() else { return Ok(()) };
        let mut residuals = Mat::zeros(first.residual.len(), projections.len());
        for (k, (gram, projection)) in projections.iter().enumerate() {
            residuals.as_mut().subcols_mut(k, 1).copy_from(&*projection.residual(gram));
        }
        let side = Adjoint::of(&same.training, residuals.as_ref());
        let formed = first.segments[segment].layout.products(&same.training, &side, false, should_continue);
        let formed = formed.ok_or_else(error::interrupted)?;
        for (k, (gram, projection)) in projections.iter().enumerate() {
            let g = formed.side.row(k).iter().copied().collect();
            let products =
                SegmentProducts { own: known.own.clone(), d: known.d.clone(), g, with_model: known.with_model.clone() };
            stored(&projection.segments, &gram.segments[segment].key, || Ok::<_, Diagnostic>(Arc::new(products)))?;
        }
        Ok(())
    }

    /// `Wᵀ [X | y⊥]` over the training rows.
    pub fn side(&self, gram: &Gram<'_>) -> Arc<Adjoint> {
        let formed = || {
            let residual = self.residual(gram);
            Arc::new(Adjoint::beside(&self.training, gram.model(), &[Mat::as_ref(&residual)]))
        };
        let is_large = gram.residual.len() * (gram.rank() + 1) > gram.kept_by_projections;
        if self.left_out.is_some() || is_large { formed() } else { Arc::clone(self.side.get_or_init(formed)) }
    }

    fn of_all(
        &self,
        gram: &Gram<'_>,
        segment: usize,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Result<SegmentProducts, Diagnostic> {
        let layout = &gram.segments[segment].layout;
        let rank = gram.rank();
        let products = layout.products(&self.training, &*self.side(gram), true, should_continue);
        let products = products.ok_or_else(error::interrupted)?;
        let cross = products.side.subrows(0, rank);
        let solved = &self.inverse * cross;
        let mut d = products.own.clone();
        for candidate in 0..layout.first.len() - 1 {
            let columns = layout.columns(candidate);
            for (to, (k, l)) in d[layout.squares(candidate)].iter_mut().zip(pairs(&columns)) {
                *to -= cross.col(k).transpose() * solved.col(l);
            }
        }
        let g = (0..layout.total()).map(|k| products.side[(rank, k)]).collect();
        Ok(SegmentProducts { own: products.own, d, g, with_model: Some(solved) })
    }

    /// Forgets the products of chosen effects other than some candidates.
    pub fn keep_chosen(&self, gram: &Gram<'_>, candidates: &[usize]) {
        let kept: Vec<(usize, usize)> = candidates.iter().map(|k| key(gram.set(*k))).collect();
        if let Ok(mut chosen) = self.chosen.lock() {
            chosen.retain(|key, _| kept.contains(key));
        }
    }

    /// A chosen effect.
    pub fn chosen(&self, gram: &Gram<'_>, candidate: usize) -> Result<Arc<ChosenEffect>, Diagnostic> {
        let set = gram.set(candidate);
        stored(&self.chosen, &key(set), || {
            let mut rows = Mat::zeros(gram.columns.rows(), set.count);
            gram.columns.fill(&[set], rows.as_mut());
            let lengths = rows.col_iter().map(|column| column.norm_l2()).collect();
            for (_, of_fold) in gram.columns.fold_rows.iter().enumerate().filter(|(fold, _)| !self.folds.contains(fold))
            {
                rows.as_mut().subrows_mut(of_fold.start, of_fold.len()).fill(0.0);
            }
            let of_model = &self.inverse * transposed_product(gram.model(), rows.as_ref());
            let with_residual =
                transposed_product(rows.as_ref(), Mat::as_ref(&self.residual(gram))).col(0).iter().copied().collect();
            for fold in &self.folds {
                let of_fold = &gram.columns.fold_rows[*fold];
                let model = gram.model().subrows(of_fold.start, of_fold.len());
                let to = rows.as_mut().subrows_mut(of_fold.start, of_fold.len());
                matmul(to, Accum::Add, model, of_model.as_ref(), -1.0, Par::Seq);
            }
            Ok(Arc::new(ChosenEffect {
                rows,
                of_model,
                with_residual,
                lengths,
                _set: set.clone(),
                side: OnceLock::new(),
                segments: Mutex::default(),
            }))
        })
    }

    /// The products of a chosen effect with the columns of a segment: `E⊥ᵀ C`.
    pub fn with_segment(
        &self,
        gram: &Gram<'_>,
        chosen: &ChosenEffect,
        segment: usize,
    ) -> Result<Arc<Mat<f64>>, Diagnostic> {
        stored(&chosen.segments, &gram.segments[segment].key, || {
            let layout = &gram.segments[segment].layout;
            let products = layout.products(&self.training, &*chosen.side(&self.training), false, &|| true);
            Ok(Arc::new(products.ok_or_else(error::interrupted)?.side))
        })
    }
}

/// All pairs of columns, row after row.
fn pairs(columns: &std::ops::Range<usize>) -> impl Iterator<Item = (usize, usize)> + use<> {
    let columns = columns.clone();
    columns.clone().flat_map(move |k| columns.clone().map(move |l| (k, l)))
}

impl LeftOut {
    fn of(gram: &Gram<'_>, folds: &[usize]) -> Result<LeftOut, Diagnostic> {
        let columns = gram.columns;
        let whole = gram.projection(&gram.all_folds())?;
        let training = columns.training_rows(folds);
        let rows: Vec<usize> = folds.iter().flat_map(|fold| columns.fold_rows[*fold].clone()).collect();
        let rank = gram.rank();
        let model = Mat::from_fn(rows.len(), rank, |i, j| gram.model[(rows[i], j)]);
        let (q, r) = reduced(&model);
        let projected = Mat::from_fn(r.nrows(), r.nrows(), |i, j| if i == j { 1.0 } else { 0.0 })
            - &r * &whole.inverse * r.transpose();
        let of_all = whole.residual(gram);
        let residual = Mat::from_fn(rows.len(), 1, |i, _| of_all[(rows[i], 0)]);
        let along = q.transpose() * &residual;
        let mut side = Mat::zeros(columns.rows(), q.ncols() + 1);
        for (i, row) in rows.iter().enumerate() {
            for j in 0..q.ncols() {
                side[(*row, j)] = q[(i, j)];
            }
            side[(*row, q.ncols())] = residual[(i, 0)];
        }
        let side = Adjoint::of(&training, side.as_ref());
        Ok(LeftOut {
            training,
            weight: pseudo_inverse(projected.as_ref())?,
            r,
            along: along.col(0).iter().copied().collect(),
            side,
        })
    }

    fn products(
        &self,
        gram: &Gram<'_>,
        segment: usize,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Result<SegmentProducts, Diagnostic> {
        let layout = &gram.segments[segment].layout;
        let all = gram.projection(&gram.all_folds())?.products(gram, segment, should_continue)?;
        let fold = layout.products(&self.training, &self.side, true, should_continue).ok_or_else(error::interrupted)?;
        let m = self.along.len();
        let of_model =
            all.with_model.as_ref().map(|solved| &self.r * solved).unwrap_or_else(|| Mat::zeros(m, layout.total()));
        // Qᵀe of the columns.
        let left = fold.side.subrows(0, m) - &of_model;
        let weighted = &self.weight * &left;
        let mut g = all.g.clone();
        for (k, g) in g.iter_mut().enumerate() {
            let entries =
                (0..m).map(|i| of_model[(i, k)] * self.along[i] - (weighted[(i, k)] - left[(i, k)]) * self.along[i]);
            *g += entries.sum::<f64>() - fold.side[(m, k)];
        }
        let mut own: Vec<f64> = all.own.iter().zip(&fold.own).map(|(all, fold)| all - fold).collect();
        let mut d: Vec<f64> = all.d.iter().zip(&fold.own).map(|(all, fold)| all - fold).collect();
        for candidate in 0..layout.first.len() - 1 {
            let (columns, square) = (layout.columns(candidate), layout.squares(candidate));
            let count = columns.len();
            for (to, (k, l)) in d[square.clone()].iter_mut().zip(pairs(&columns)) {
                for i in 0..m {
                    *to += fold.side[(i, k)] * fold.side[(i, l)] - left[(i, k)] * weighted[(i, l)];
                }
            }
            // A difference at the rounding level counts as zero.
            for k in 0..count {
                let diagonal = square.start + k * count + k;
                if own[diagonal] <= PRODUCT_ROUNDING * all.own[diagonal] {
                    for l in 0..count {
                        for at in [square.start + k * count + l, square.start + l * count + k] {
                            (own[at], d[at]) = (0.0, 0.0);
                        }
                    }
                    g[columns.start + k] = 0.0;
                }
            }
        }
        Ok(SegmentProducts { own, d, g, with_model: None })
    }
}

/// `Q` and `R` of a matrix, without the columns of `Q` that are rounding errors.
fn reduced(matrix: &Mat<f64>) -> (Mat<f64>, Mat<f64>) {
    let q = orthonormal_basis(matrix, PIVOT_ROUNDING);
    // R of the columns in their own order.
    let r = q.transpose() * matrix;
    (q, r)
}
