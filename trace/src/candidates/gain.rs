//! The gain of a candidate, and a score that compares candidates with different numbers of columns.
//!
//! If a candidate with `k` observable columns is absent, its gain follows a `χ²ₖ` distribution. The gain is the
//! decrease of the sum of squares of whitened residuals. The score is `−ln P(χ²ₖ > gain)` less the candidate's cost in
//! the library. The tail is computed in logarithms, because it underflows at real effect sizes.
//!
//! With the products `d` and `g` of a candidate beside the fitted model, and `V = E⊥ᵀC` with the chosen effects
//! ([`super::gram`]),
//!
//! ```text
//! gain = g'ᵀ D⁻¹ g',   D = d − Vᵀ (EᵀE⊥)⁻¹ V,   g' = g − Vᵀ (EᵀE⊥)⁻¹ Eᵀy⊥
//! ```

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex};

use abbe_identify::numerics::gain::{ObservableSubspace, gain_of_few};
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::symmetric::pseudo_inverse;
use abbe_model::Diagnostic;
use faer::Mat;

use super::gram::{ChosenEffect, Gram, Projection, SegmentProducts, stored};

/// Candidates that one parallel task evaluates.
pub(super) const AT_ONCE: usize = 128;

/// The fitted model with chosen effects, trained on some folds.
pub struct TrainedModel<'m> {
    pub(super) gram: &'m Gram<'m>,
    pub(super) projection: Arc<Projection>,
    /// The training folds.
    pub folds: Vec<usize>,
    /// The chosen effects.
    pub(super) chosen: Vec<Arc<ChosenEffect>>,
    /// `(EᵀE⊥)⁻¹`.
    pub(super) inverse: Mat<f64>,
    /// `Eᵀ y⊥`.
    pub(super) along: Vec<f64>,
    /// Coefficients of the chosen effects.
    coefficients: Vec<f64>,
    segments: Mutex<HashMap<usize, Arc<Segment>>>,
}

/// The products of the candidates of a segment with the chosen effects.
pub(super) struct Segment {
    products: Arc<SegmentProducts>,
    /// `V`: chosen columns × columns.
    with_chosen: Mat<f64>,
    /// `(EᵀE⊥)⁻¹ V`.
    pub solved: Mat<f64>,
}

/// The gain of a candidate.
#[derive(Clone, Debug, Default)]
pub struct Gain {
    /// Decrease of the sum of squares.
    pub gain: f64,
    /// Number of added directions and tuned shape numbers.
    pub freedom: usize,
}

/// `D`, `g'` and the product with itself of a candidate.
pub struct Projected {
    /// `D`.
    pub d: Mat<f64>,
    /// `g'`.
    pub g: Vec<f64>,
    /// `CᵀC`.
    pub own: Mat<f64>,
}

impl<'m> TrainedModel<'m> {
    /// The fitted model with chosen candidates.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn new(gram: &'m Gram<'m>, chosen: &[usize], folds: &[usize]) -> Result<Self, Diagnostic> {
        let projection = gram.projection(folds)?;
        let chosen: Vec<Arc<ChosenEffect>> =
            chosen.iter().map(|candidate| projection.chosen(gram, *candidate)).collect::<Result<_, _>>()?;
        let along: Vec<f64> = chosen.iter().flat_map(|chosen| chosen.with_residual.iter().copied()).collect();
        let lengths: Vec<f64> = chosen.iter().flat_map(|chosen| chosen.lengths.iter().copied()).collect();
        let mut normal = Mat::zeros(along.len(), along.len());
        let mut row = 0;
        for a in &chosen {
            let mut column = 0;
            for b in &chosen {
                let part = gram.between(a, b);
                normal.as_mut().submatrix_mut(row, column, part.nrows(), part.ncols()).copy_from(&part);
                column += part.ncols();
            }
            row += a.rows.ncols();
        }
        // Columns of unit length make the rank independent of units.
        let scale: Vec<f64> = lengths.iter().map(|length| if *length > 0.0 { 1.0 / length } else { 0.0 }).collect();
        let scaled = Mat::from_fn(scale.len(), scale.len(), |i, j| normal[(i, j)] * scale[i] * scale[j]);
        let inverse = pseudo_inverse(scaled.as_ref())?;
        let inverse = Mat::from_fn(scale.len(), scale.len(), |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let coefficients =
            (0..along.len()).map(|i| (0..along.len()).map(|j| inverse[(i, j)] * along[j]).sum()).collect();
        let (folds, segments) = (folds.to_vec(), Mutex::default());
        Ok(TrainedModel { gram, projection, folds, chosen, inverse, along, coefficients, segments })
    }

    pub(super) fn segment(&self, number: usize) -> Result<Arc<Segment>, Diagnostic> {
        stored(&self.segments, &number, || {
            let products = self.projection.products(self.gram, number, &|| true)?;
            let mut with_chosen = Mat::zeros(self.along.len(), products.g.len());
            let mut row = 0;
            for chosen in &self.chosen {
                let part = self.projection.with_segment(self.gram, chosen, number)?;
                with_chosen.as_mut().subrows_mut(row, part.nrows()).copy_from(&*part);
                row += part.nrows();
            }
            let solved = &self.inverse * &with_chosen;
            Ok(Arc::new(Segment { products, with_chosen, solved }))
        })
    }

    /// A candidate in its segment: the segment, its columns and its square.
    fn place(&self, candidate: usize) -> Result<(Arc<Segment>, Range<usize>, Range<usize>), Diagnostic> {
        let (segment, local) = self.gram.place(candidate);
        let (columns, square) = (self.gram.columns_of(segment, local), self.gram.square_of(segment, local));
        Ok((self.segment(segment)?, columns, square))
    }

    /// `D`, `g'` and the product with itself of a candidate.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn projected(&self, candidate: usize) -> Result<Projected, Diagnostic> {
        let (segment, columns, square) = self.place(candidate)?;
        Ok(self.projected_in(&segment, columns, square))
    }

    pub(super) fn projected_in(&self, segment: &Segment, columns: Range<usize>, square: Range<usize>) -> Projected {
        let count = columns.len();
        let (d, own) = (&segment.products.d[square.clone()], &segment.products.own[square]);
        let (first, chosen) = (columns.start, self.along.len());
        let with = |k: usize, l: usize| -> f64 {
            let (v, solved) = (segment.with_chosen.col(first + k), segment.solved.col(first + l));
            (0..chosen).map(|i| v[i] * solved[i]).sum()
        };
        let along = |k: usize| -> f64 { (0..chosen).map(|i| segment.solved[(i, first + k)] * self.along[i]).sum() };
        Projected {
            d: Mat::from_fn(count, count, |k, l| d[k * count + l] - with(k, l)),
            g: (0..count).map(|k| segment.products.g[first + k] - along(k)).collect(),
            own: Mat::from_fn(count, count, |k, l| own[k * count + l]),
        }
    }

    /// The decrease of the sum of squares by the model, priors included.
    pub fn explained(&self) -> f64 {
        self.projection.explained + self.along.iter().zip(&self.coefficients).map(|(y, c)| y * c).sum::<f64>()
    }

    /// The degrees of freedom of a candidate's gain: its observable directions and its tuned shape numbers. Without the
    /// latter, tunable candidates would be preferred.
    pub(super) fn freedom(&self, candidate: usize, observable: usize) -> usize {
        if observable == 0 { 0 } else { observable + self.gram.numbers(candidate) }
    }

    /// The gain of a candidate.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn gain(&self, candidate: usize) -> Result<Gain, Diagnostic> {
        let (segment, columns, square) = self.place(candidate)?;
        Ok(self.gain_in(candidate, &segment, columns, square))
    }

    fn gain_in(&self, candidate: usize, segment: &Segment, columns: Range<usize>, square: Range<usize>) -> Gain {
        let (gain, observable) = match columns.len() {
            1 | 2 => self.gain_of_few(segment, columns, square),
            _ => {
                let Projected { d, g, own } = self.projected_in(segment, columns, square);
                let subspace = ObservableSubspace::of(&d, &own);
                (subspace.quadratic(&g), subspace.freedom)
            }
        };
        Gain { gain, freedom: self.freedom(candidate, observable) }
    }

    /// The gain and the observable directions of one or two columns, without allocation.
    fn gain_of_few(&self, segment: &Segment, columns: Range<usize>, square: Range<usize>) -> (f64, usize) {
        let count = columns.len();
        let (mut d, mut own, mut g) = ([[0.0; 2]; 2], [0.0; 2], [0.0; 2]);
        let (of_d, of_own) = (&segment.products.d[square.clone()], &segment.products.own[square]);
        for k in 0..count {
            g[k] = segment.products.g[columns.start + k];
            own[k] = of_own[k * count + k];
            for l in 0..count {
                d[k][l] = of_d[k * count + l];
            }
        }
        if !self.along.is_empty() {
            for k in 0..count {
                let v = segment.with_chosen.col_as_slice(columns.start + k);
                let solved = segment.solved.col_as_slice(columns.start + k);
                g[k] -= solved.iter().zip(&self.along).map(|(a, b)| a * b).sum::<f64>();
                for l in 0..count {
                    let solved = segment.solved.col_as_slice(columns.start + l);
                    d[k][l] -= v.iter().zip(solved).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        gain_of_few(count, d, own, g)
    }

    /// The gains of all candidates that `usable` accepts; those of the others are zero.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn gains(&self, usable: &(dyn Fn(usize) -> bool + Sync)) -> Result<Vec<Gain>, Diagnostic> {
        self.remaining_gains(Vec::new(), usable)
    }

    /// The gains of all candidates. `known` are those of the first candidates with the same model.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn remaining_gains(
        &self,
        mut known: Vec<Gain>,
        usable: &(dyn Fn(usize) -> bool + Sync),
    ) -> Result<Vec<Gain>, Diagnostic> {
        let (first, total) = (known.len(), self.gram.candidates());
        let chunks: Vec<Range<usize>> =
            (first..total).step_by(AT_ONCE).map(|start| start..(start + AT_ONCE).min(total)).collect();
        let mut segments: Vec<Option<Arc<Segment>>> = Vec::new();
        for candidate in (first..total).filter(|candidate| usable(*candidate)) {
            let number = self.gram.place(candidate).0;
            segments.resize(segments.len().max(number + 1), None);
            if segments[number].is_none() {
                segments[number] = Some(self.segment(number)?);
            }
        }
        let gain = |candidate: usize| {
            let (number, local) = self.gram.place(candidate);
            let segment = segments.get(number).and_then(Option::as_ref).filter(|_| usable(candidate));
            segment.map_or_else(Gain::default, |segment| {
                let columns = self.gram.columns_of(number, local);
                self.gain_in(candidate, segment, columns, self.gram.square_of(number, local))
            })
        };
        let gains = parallel::map(chunks.len(), &|k| chunks[k].clone().map(gain).collect::<Vec<Gain>>());
        for part in gains {
            known.extend(part);
        }
        Ok(known)
    }

    /// The share of a signature that a candidate can reproduce in addition to the model: `cos²` of the angle between
    /// the two. The signature is that of an effect which the model lacks, with its coefficients.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn explained_by_signature(
        &self,
        candidate: usize,
        effect: usize,
        coefficients: &[f64],
    ) -> Result<f64, Diagnostic> {
        let Projected { d, own, .. } = self.projected(candidate)?;
        let (g, projected) = self.with_signature(candidate, effect, coefficients)?;
        let subspace = ObservableSubspace::of(&d, &own);
        Ok(if projected <= 0.0 { 0.0 } else { (subspace.quadratic(&g) / projected).clamp(0.0, 1.0) })
    }

    /// The square of the difference of the fitted readings with one candidate and with another in its place, each with its
    /// own coefficients beside the model, in variances of the noise.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn difference_square(&self, [one, other]: [usize; 2]) -> Result<f64, Diagnostic> {
        let [of_one, of_other] = [self.with_candidate(one)?.1, self.with_candidate(other)?.1];
        let (with_one, square) = self.with_signature(one, other, &of_other)?;
        let product: f64 = of_one.iter().zip(&with_one).map(|(c, g)| c * g).sum();
        Ok((self.gain(one)?.gain + square - 2.0 * product).max(0.0))
    }

    /// The products of a candidate's columns with the signature of an effect, and of the signature with itself, beside the
    /// model.
    fn with_signature(
        &self,
        candidate: usize,
        effect: usize,
        coefficients: &[f64],
    ) -> Result<(Vec<f64>, f64), Diagnostic> {
        let signature = self.projection.chosen(self.gram, effect)?;
        // The signature's products with the chosen effects and with the candidate, the fitted model projected out.
        let along = |products: &Mat<f64>, column: usize| -> f64 {
            coefficients.iter().enumerate().map(|(k, c)| c * products[(k, column)]).sum()
        };
        let with_chosen: Vec<f64> = (self.chosen.iter())
            .flat_map(|chosen| {
                let products = self.gram.between(&signature, chosen);
                (0..chosen.rows.ncols()).map(move |l| along(&products, l)).collect::<Vec<_>>()
            })
            .collect();
        let (number, local) = self.gram.place(candidate);
        let columns = self.gram.columns_of(number, local);
        let (segment, products) = (self.segment(number)?, self.projection.with_segment(self.gram, &signature, number)?);
        let beside = |solved: &dyn Fn(usize) -> f64| -> f64 {
            with_chosen.iter().enumerate().map(|(i, value)| value * solved(i)).sum()
        };
        let g: Vec<f64> =
            columns.map(|column| along(&products, column) - beside(&|i| segment.solved[(i, column)])).collect();
        let itself = self.gram.between(&signature, &signature);
        let length: f64 = coefficients.iter().enumerate().map(|(l, c)| c * along(&itself, l)).sum();
        let m = with_chosen.len();
        let solved = |i: usize| (0..m).map(|j| self.inverse[(i, j)] * with_chosen[j]).sum::<f64>();
        Ok((g, length - beside(&solved)))
    }

    /// Coefficients of the model columns and of the chosen effects, and of a candidate's columns, if the candidate is
    /// added.
    ///
    /// # Errors
    /// If products are not finite.
    pub fn with_candidate(&self, candidate: usize) -> Result<(Vec<f64>, Vec<f64>), Diagnostic> {
        let Projected { d, g, own } = self.projected(candidate)?;
        let of_candidate = ObservableSubspace::of(&d, &own).solve(&g);
        let (segment, columns, _) = self.place(candidate)?;
        let mut of_chosen = self.coefficients.clone();
        for (column, c) in columns.zip(&of_candidate) {
            of_chosen.iter_mut().enumerate().for_each(|(i, of)| *of -= segment.solved[(i, column)] * c);
        }
        let added = self.projection.chosen(self.gram, candidate)?;
        let mut of_model = self.of_model(&of_chosen);
        for (i, of) in of_model.iter_mut().enumerate() {
            *of -= of_candidate.iter().enumerate().map(|(k, c)| added.of_model[(i, k)] * c).sum::<f64>();
        }
        of_model.extend(of_chosen);
        Ok((of_model, of_candidate))
    }

    /// Coefficients of the model columns for coefficients of the chosen effects.
    fn of_model(&self, of_chosen: &[f64]) -> Vec<f64> {
        let mut of_model = self.projection.coefficients.clone();
        let mut rest = of_chosen;
        for chosen in &self.chosen {
            let (own, others) = rest.split_at(chosen.rows.ncols());
            rest = others;
            for (i, of) in of_model.iter_mut().enumerate() {
                *of -= own.iter().enumerate().map(|(k, c)| chosen.of_model[(i, k)] * c).sum::<f64>();
            }
        }
        of_model
    }

    /// Coefficients of the model columns and of the chosen effects.
    pub fn coefficients(&self) -> (Vec<f64>, &[f64]) {
        (self.of_model(&self.coefficients), &self.coefficients)
    }

    /// Sum of squares of the residual over the training folds, and its degrees of freedom.
    pub fn residual_square(&self) -> (f64, usize) {
        let mut residual = self.projection.residual(self.gram).into_owned();
        let mut rest = &self.coefficients[..];
        for chosen in &self.chosen {
            let (own, others) = rest.split_at(chosen.rows.ncols());
            rest = others;
            for (k, c) in own.iter().enumerate() {
                let of_effect = chosen.rows.col_as_slice(k);
                residual.col_as_slice_mut(0).iter_mut().zip(of_effect).for_each(|(r, e)| *r -= c * e);
            }
        }
        let rows: usize = self.projection.training.blocks.iter().map(|block| block.count()).sum();
        let parameters = self.gram.rank() + self.along.len();
        (residual.squared_norm_l2(), rows.saturating_sub(parameters).max(1))
    }
}
