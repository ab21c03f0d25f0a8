//! A fault as columns of a regression, and the values that follow from its coefficients.

use super::terms::PathRows;
use crate::noise::enlargement_of_mean;
use crate::numerics::regression::Regression;
use crate::results::ParameterResult;

/// A value of a fault: its name, a weight per column, and the conversion from internal units (mm) to its unit.
pub(super) struct Figure {
    pub name: String,
    pub weights: Vec<(usize, f64)>,
    pub per_mm: f64,
    pub unit: &'static str,
}

/// A fault with its columns and values.
pub(super) struct Fault {
    pub fault: &'static str,
    pub axes: String,
    pub columns: Vec<Vec<f64>>,
    pub figures: Vec<Figure>,
    /// Amplitudes over pairs of columns, by direction.
    pub amplitudes: Vec<(String, usize)>,
    /// Parameters found by search.
    pub searched: Vec<ParameterResult>,
}

impl Fault {
    pub fn new(fault: &'static str, axes: String, columns: Vec<Vec<f64>>) -> Fault {
        Fault { fault, axes, columns, figures: Vec::new(), amplitudes: Vec::new(), searched: Vec::new() }
    }

    pub fn figure(
        mut self,
        name: impl Into<String>,
        weights: &[(usize, f64)],
        per_mm: f64,
        unit: &'static str,
    ) -> Fault {
        self.figures.push(Figure { name: name.into(), weights: weights.to_vec(), per_mm, unit });
        self
    }
}

/// The columns of the regression: set-up first, then fault by fault.
pub(super) fn columns(rows: &PathRows, faults: &[Fault]) -> Vec<Vec<f64>> {
    let mut columns = rows.setup();
    columns.extend(faults.iter().flat_map(|fault| fault.columns.iter().cloned()));
    columns
}

/// Largest correlation of neighbouring residuals.
const MAX_CORRELATION: f64 = 0.99;

/// Variance of the residual, and the factor on it for the correlation of neighbours.
pub(super) fn variance_and_enlargement(rows: &PathRows, regression: &Regression) -> (f64, f64) {
    let residual = &regression.residual;
    let sum = regression.sum_of_squares();
    let neighbours: f64 = (1..residual.len()).filter(|i| rows.follows[*i]).map(|i| residual[i] * residual[i - 1]).sum();
    let freedom = residual.len().saturating_sub(regression.beta.len()).max(1);
    (sum / freedom as f64, enlargement_of_mean(neighbours, sum, MAX_CORRELATION))
}
