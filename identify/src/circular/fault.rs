//! A fault as columns of a regression, and the figures that are read off its coefficients.

use crate::results::ParameterResult;

/// A value of a fault: its name, a weight for each of its columns, what one internal unit (mm) is in its unit.
pub(super) struct Figure {
    pub name: String,
    pub weights: Vec<(usize, f64)>,
    pub per_mm: f64,
    pub unit: &'static str,
}

/// A fault with its columns and its figures.
pub(super) struct Fault {
    pub fault: &'static str,
    pub axes: String,
    pub columns: Vec<Vec<f64>>,
    pub figures: Vec<Figure>,
    /// Figures of its amplitude over pairs of columns, by direction.
    pub amplitudes: Vec<(String, usize)>,
    /// Numbers that were searched for.
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
