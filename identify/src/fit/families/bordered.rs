//! Models that share most of their parameters: the information of the shared ones is factored once, and each model borders
//! it by its own few.
//!
//! ```text
//! H = [A B; Bᵀ D] = [L 0; Zᵀ M]·[L 0; Zᵀ M]ᵀ,   A = L Lᵀ,   Z = L⁻¹ B,   D − ZᵀZ = M Mᵀ
//! ```
//!
//! The right-hand side `(a, d)` then explains `‖L⁻¹a‖² + ‖M⁻¹(d − Zᵀ L⁻¹a)‖²`.

use abbe_model::Diagnostic;
use faer::linalg::solvers::Llt;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::Solve;
use faer::{Mat, Par, Side};

use super::{FoldEquations, PRESENT_VARIANCE};
use crate::error;
use crate::numerics::parallel;
use crate::problem::Problem;

/// The equations of a problem at its present scales and noise, factored over shared parameters, for all readings and without
/// each fold.
pub struct Bordered<'e> {
    equations: &'e FoldEquations,
    /// The shared parameters, and all others.
    shared: Vec<usize>,
    others: Vec<usize>,
    whole: Factored,
    without_folds: Vec<Factored>,
}

/// A factored model.
struct Factored {
    factor: Llt<f64>,
    /// `Z`: shared × others.
    z: Mat<f64>,
    /// `L⁻¹a`.
    along: Mat<f64>,
    /// `D − ZᵀZ` and `d − Zᵀ L⁻¹a`, over all others.
    rest: Mat<f64>,
    right: Mat<f64>,
}

impl FoldEquations {
    /// Factors the equations over shared parameters, in ascending order. `folds` is whether the folds are held out.
    ///
    /// # Errors
    /// If the equations are not positive definite.
    pub fn bordered(&self, shared: &[usize], folds: bool, problem: &Problem) -> Result<Bordered<'_>, Diagnostic> {
        self.bordered_at(shared, folds, PRESENT_VARIANCE, &self.precisions(problem))
    }

    fn bordered_at(
        &self,
        shared: &[usize],
        folds: bool,
        variance: f64,
        precisions: &[f64],
    ) -> Result<Bordered<'_>, Diagnostic> {
        let others: Vec<usize> = (0..self.sizes.len()).filter(|j| shared.binary_search(j).is_err()).collect();
        let information = self.equations.information(variance, precisions);
        let right = self.equations.right_side(variance);
        let without = |fold: usize| {
            let products = &self.folds[fold].products;
            let information = &information - &products.gram * faer::Scale(1.0 / variance);
            let right: Vec<f64> =
                right.iter().zip(&products.projection).map(|(all, own)| all - own / variance).collect();
            Factored::of(&information, &right, shared, &others)
        };
        let without_folds = parallel::map(if folds { self.folds.len() } else { 0 }, &without);
        Ok(Bordered {
            equations: self,
            whole: Factored::of(&information, &right, shared, &others)?,
            without_folds: without_folds.into_iter().collect::<Result<_, _>>()?,
            shared: shared.to_vec(),
            others,
        })
    }
}

impl Bordered<'_> {
    /// Decrease of the penalised sum of squares by the shared parameters and some others, in units of the whitening.
    ///
    /// # Errors
    /// If the equations are not positive definite.
    pub fn explained(&self, others: &[usize]) -> Result<f64, Diagnostic> {
        let places = self.places(others);
        let own = self.whole.right_of(&places);
        let solved = self.whole.border(&places)?.solve(&own);
        Ok(self.whole.along.squared_norm_l2() + (own.transpose() * solved)[(0, 0)])
    }

    /// Sum of squares of the residual of each held-out fold under the model with the shared parameters and some others, in
    /// units of the whitening.
    ///
    /// # Errors
    /// If the equations are not positive definite.
    pub fn held_out(&self, others: &[usize]) -> Result<Vec<f64>, Diagnostic> {
        let places = self.places(others);
        let of_folds = parallel::map(self.without_folds.len(), &|k| {
            let (of_shared, of_others) = self.without_folds[k].solution(&places)?;
            let mut b = vec![0.0; self.equations.sizes.len()];
            self.shared.iter().enumerate().for_each(|(i, j)| b[*j] = of_shared[(i, 0)]);
            others.iter().enumerate().for_each(|(i, j)| b[*j] = of_others[(i, 0)]);
            Ok(self.equations.folds[k].products.residual_square(&b))
        });
        of_folds.into_iter().collect()
    }

    fn places(&self, others: &[usize]) -> Vec<usize> {
        others.iter().filter_map(|j| self.others.binary_search(j).ok()).collect()
    }
}

impl Factored {
    fn of(information: &Mat<f64>, right: &[f64], shared: &[usize], others: &[usize]) -> Result<Factored, Diagnostic> {
        let part = |rows: &[usize], columns: &[usize]| {
            Mat::from_fn(rows.len(), columns.len(), |i, j| information[(rows[i], columns[j])])
        };
        let right = |rows: &[usize]| Mat::from_fn(rows.len(), 1, |i, _| right[rows[i]]);
        let factor = part(shared, shared).llt(Side::Lower).map_err(|_| error::decomposition())?;
        let (mut z, mut along) = (part(shared, others), right(shared));
        solve_lower_triangular_in_place(factor.L(), z.as_mut(), Par::Seq);
        solve_lower_triangular_in_place(factor.L(), along.as_mut(), Par::Seq);
        let rest = part(others, others) - z.transpose() * &z;
        let right = right(others) - z.transpose() * &along;
        Ok(Factored { factor, z, along, rest, right })
    }

    fn border(&self, places: &[usize]) -> Result<Llt<f64>, Diagnostic> {
        let border = Mat::from_fn(places.len(), places.len(), |i, j| self.rest[(places[i], places[j])]);
        border.llt(Side::Lower).map_err(|_| error::decomposition())
    }

    fn right_of(&self, places: &[usize]) -> Mat<f64> {
        Mat::from_fn(places.len(), 1, |i, _| self.right[(places[i], 0)])
    }

    /// The shared parameters and the others at the minimum.
    fn solution(&self, places: &[usize]) -> Result<(Mat<f64>, Mat<f64>), Diagnostic> {
        let of_others = self.border(places)?.solve(&self.right_of(places));
        let mut of_shared = self.along.clone();
        for (place, value) in places.iter().zip(of_others.col_as_slice(0)) {
            of_shared -= self.z.get(.., *place..*place + 1) * faer::Scale(*value);
        }
        solve_upper_triangular_in_place(self.factor.L().transpose(), of_shared.as_mut(), Par::Seq);
        Ok((of_shared, of_others))
    }
}

#[cfg(test)]
mod tests {
    use faer::prelude::SolveLstsq;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::fit::families::Fold;
    use crate::numerics::evidence::NormalEquations;
    use crate::numerics::products::{Products, RowSum};

    /// Three folds of seven parameters, two of them a family. Models with none, one and both of two parameters beside the
    /// others are solved from their rows: by a QR decomposition of readings and priors.
    #[test]
    fn bordered_models_are_those_of_their_rows() {
        let (parameters, variance, precision) = (7, 2.0_f64, 5.0_f64);
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(8);
        let folds: Vec<Mat<f64>> =
            (0..3).map(|_| Mat::from_fn(9, parameters + 1, |_, _| random.random_range(-1.0..1.0))).collect();
        let normal = |rows: &Mat<f64>| {
            let mut sum = <Products as RowSum>::new(parameters);
            sum.absorb(rows.as_ref());
            sum.normal()
        };
        let products: Vec<_> = folds.iter().map(normal).collect();
        let mut readings = products[0].clone();
        products[1..].iter().for_each(|other| readings.add(other));
        let equations = FoldEquations {
            equations: NormalEquations {
                readings,
                prior: Mat::from_fn(parameters, parameters, |i, j| if i == j && i < 5 { 0.3 } else { 0.0 }),
                prior_projection: vec![0.0; parameters],
                families: vec![vec![5, 6]],
            },
            folds: products.into_iter().map(|products| Fold { products, readings: 9.0 }).collect(),
            readings: 27.0,
            parameters: (0..parameters).collect(),
            sizes: vec![1.0; parameters],
            origin: vec![0.0; parameters],
        };
        let shared = [0, 1, 2, 5, 6];
        let bordered = equations.bordered_at(&shared, true, variance, &[precision]).unwrap();
        for others in [vec![], vec![3], vec![4], vec![3, 4]] {
            let present: Vec<usize> = shared.iter().chain(&others).copied().collect();
            // The minimum over the rows of some folds and the priors, and the penalised sums of squares without and with it.
            let solved = |used: &[usize]| {
                let rows: Vec<(&Mat<f64>, usize)> =
                    used.iter().flat_map(|fold| (0..9).map(|i| (&folds[*fold], i))).collect();
                let all = Mat::from_fn(rows.len() + present.len(), present.len(), |i, k| match rows.get(i) {
                    Some((rows, row)) => rows[(*row, present[k])] / variance.sqrt(),
                    None if i - rows.len() != k => 0.0,
                    None => (if present[k] < 5 { 0.3 } else { precision }).sqrt(),
                });
                let y = Mat::from_fn(all.nrows(), 1, |i, _| {
                    rows.get(i).map_or(0.0, |(rows, row)| rows[(*row, parameters)] / variance.sqrt())
                });
                let b = all.qr().solve_lstsq(&y);
                let left = &y - &all * &b;
                (b, y.squared_norm_l2() - left.squared_norm_l2())
            };
            let explained = bordered.explained(&others).unwrap();
            assert!((explained - solved(&[0, 1, 2]).1).abs() < 1e-10, "{others:?}");
            for (fold, square) in bordered.held_out(&others).unwrap().into_iter().enumerate() {
                let used: Vec<usize> = (0..3).filter(|other| *other != fold).collect();
                let b = solved(&used).0;
                let rows = &folds[fold];
                let residual = |i: usize| {
                    let predicted: f64 = present.iter().enumerate().map(|(k, j)| rows[(i, *j)] * b[(k, 0)]).sum();
                    rows[(i, parameters)] - predicted
                };
                let expected: f64 = (0..9).map(|i| residual(i).powi(2)).sum();
                assert!((square - expected).abs() < 1e-10, "{others:?} {fold}: {square} {expected}");
            }
        }
    }
}
