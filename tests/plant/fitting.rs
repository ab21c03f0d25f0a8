//! The fit of the oracle: parameters with their priors and the true effect, by least squares on the exact plant.

use super::effect::Injected;
use super::oracle::{Oracle, WEAK_U};
use super::recipe::{Row, SimulatedSession};
use super::whitening::whiten;
use nalgebra::{DMatrix, DVector};

/// The result of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Names: those of the parameters, then `effect 0`, `effect 1` … for every amplitude (cosine and sine separately).
    pub ids: Vec<String>,
    /// Values in µm, arcsec, or the unit of the effect.
    pub values: Vec<f64>,
    /// Standard uncertainties, in the same units.
    pub u: Vec<f64>,
    /// Root mean square of the residual of the fitted readings, µm.
    pub rms_um: f64,
}

impl Fit {
    /// Value and standard uncertainty by name.
    pub fn get(&self, id: &str) -> Option<(f64, f64)> {
        let place = self.ids.iter().position(|other| other == id)?;
        Some((self.values[place], self.u[place]))
    }
}

/// Gauss–Newton iterations with the columns of the nominal machine: after three the error is far below the resolution.
const ROUNDS: usize = 3;

impl Oracle {
    /// Fits all readings except the outliers, with these effects in the model.
    pub fn fit(&self, draw: &SimulatedSession, effects: &[Injected]) -> Fit {
        let rows: Vec<Row> = draw.rows.iter().copied().filter(|row| !row.outlier).collect();
        self.fit_rows(&rows, effects)
    }

    /// Root mean square of the held-out residual, µm. Each fold holds out the traversals of one number in every test
    /// and fits all others. Outliers are excluded.
    pub fn heldout_rms_um(&self, draw: &SimulatedSession, effects: &[Injected]) -> f64 {
        let run_of = |row: &Row| self.plan.instants[row.instant].run;
        let runs = draw.rows.iter().map(run_of).max().unwrap_or(0);
        let (mut sum, mut count) = (0.0, 0_u32);
        for run in 1..=runs {
            let (left_out, fitted): (Vec<Row>, Vec<Row>) =
                draw.rows.iter().copied().filter(|row| !row.outlier).partition(|row| run_of(row) == run);
            let fit = self.fit_rows(&fitted, effects);
            let residuals = self.residuals_um(&left_out, &fit.values, effects);
            sum += residuals.norm_squared();
            count += u32::try_from(left_out.len()).unwrap_or(u32::MAX);
        }
        (sum / f64::from(count)).sqrt()
    }

    /// Reading minus plant, µm, for values of parameters and amplitudes in the order of [`Fit::ids`].
    pub(super) fn residuals_um(&self, rows: &[Row], values: &[f64], effects: &[Injected]) -> DVector<f64> {
        let (unknowns, amplitudes) = values.split_at(self.plan.unknowns.len());
        let effects: Vec<Injected> = effects
            .iter()
            .flat_map(Injected::basis_effects)
            .zip(amplitudes)
            .map(|(basis, amplitude)| basis.with_amplitude(*amplitude))
            .collect();
        DVector::from_iterator(
            rows.len(),
            rows.iter().map(|row| {
                let instant = &self.plan.instants[row.instant];
                (row.length_mm - self.plan.reading_mm(instant, unknowns, &effects)) * 1e3
            }),
        )
    }

    fn fit_rows(&self, rows: &[Row], effects: &[Injected]) -> Fit {
        let places: Vec<usize> = rows.iter().map(|row| row.instant).collect();
        let bases: Vec<Injected> = effects.iter().flat_map(Injected::basis_effects).collect();
        let unknowns = self.plan.unknowns.len();
        let mut columns = self.base.select_rows(&places).insert_columns(unknowns, bases.len(), 0.0);
        for (k, basis) in bases.iter().enumerate() {
            let column = self.column(basis).select_rows(&places);
            columns.set_column(unknowns + k, &column);
        }
        let columns = whiten(&self.plan, self.noise, &places, columns);
        let weights = DVector::from_fn(unknowns + bases.len(), |k, _| {
            self.plan.unknowns.get(k).map_or(0.0, |unknown| {
                let u = unknown.prior_u_um.unwrap_or(WEAK_U);
                1.0 / (u * u)
            })
        });
        let normal = columns.tr_mul(&columns) + DMatrix::from_diagonal(&weights);
        let inverse = inverse_scaled(normal);
        let mut values = DVector::zeros(weights.len());
        for _ in 0..ROUNDS {
            let residuals = self.residuals_um(rows, values.as_slice(), effects);
            let residuals = DMatrix::from_column_slice(rows.len(), 1, residuals.as_slice());
            let whitened = whiten(&self.plan, self.noise, &places, residuals);
            let gradient = columns.tr_mul(&whitened) - weights.component_mul(&values);
            values += &inverse * gradient;
        }
        let residual = self.residuals_um(rows, values.as_slice(), effects);
        let names = self.plan.unknowns.iter().map(|unknown| unknown.id.clone());
        Fit {
            ids: names.chain((0..bases.len()).map(|k| format!("effect {k}"))).collect(),
            values: values.as_slice().to_vec(),
            u: inverse.diagonal().iter().map(|variance| variance.sqrt()).collect(),
            rms_um: (residual.norm_squared() / rows.len() as f64).sqrt(),
        }
    }
}

/// The inverse of a symmetric matrix whose rows and columns are first scaled to a unit diagonal. A zero column, which
/// no reading responds to, has variance zero.
fn inverse_scaled(mut normal: DMatrix<f64>) -> DMatrix<f64> {
    let size = normal.nrows();
    let scales = DVector::from_fn(size, |k, _| if normal[(k, k)] > 0.0 { 1.0 / normal[(k, k)].sqrt() } else { 0.0 });
    for row in 0..size {
        for column in 0..size {
            normal[(row, column)] *= scales[row] * scales[column];
        }
    }
    let mut inverse = normal.pseudo_inverse(1e-13).unwrap_or_else(|_| DMatrix::zeros(size, size));
    for row in 0..size {
        for column in 0..size {
            inverse[(row, column)] *= scales[row] * scales[column];
        }
    }
    inverse
}
