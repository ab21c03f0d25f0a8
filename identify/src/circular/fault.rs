//! A fault as columns of a regression, and the values that follow from its coefficients.

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
        Fault {
            fault,
            axes,
            columns,
            figures: Vec::new(),
            amplitudes: Vec::new(),
            searched: Vec::new(),
        }
    }

    pub fn figure(
        mut self,
        name: impl Into<String>,
        weights: &[(usize, f64)],
        per_mm: f64,
        unit: &'static str,
    ) -> Fault {
        self.figures.push(Figure {
            name: name.into(),
            weights: weights.to_vec(),
            per_mm,
            unit,
        });
        self
    }
}
