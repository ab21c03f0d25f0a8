//! Square roots of the information on named shared parameters, so that tests can be added or removed without a fit.
//!
//! Of each test only a square root of its information on the shared parameters remains. Its own parameters (a ball
//! mounted for it alone, its bar) are eliminated first, within their priors. Two such roots are added by one orthogonal
//! reduction.

use std::collections::HashMap;

use abbe_model::session::Prior;
use faer::{Mat, MatRef};

use super::linear::Linearisation;
use crate::error::IdentifyError;
use crate::numerics::reduction::inverse_of_upper;
use crate::numerics::triangle::upper;
use crate::problem::Problem;

/// The parameters that tests share, in column order. The target parameters are last.
#[derive(Clone, Debug)]
pub struct SharedParameters {
    /// Their identifiers.
    pub ids: Vec<String>,
    /// Physical sizes, internal units.
    pub size: Vec<f64>,
    /// Display units per internal unit.
    pub display_per_internal: Vec<f64>,
    /// Number of target parameters: the last columns.
    pub targets: usize,
}

/// A square root of information: `RᵀR`, upper triangular.
pub type Root = Mat<f64>;

impl SharedParameters {
    /// Parameters of a problem by index: the `kept` ones first, the `targets` ones last.
    pub fn of(problem: &Problem, kept: &[usize], targets: &[usize]) -> SharedParameters {
        let list = &problem.parameters.list;
        let order: Vec<usize> = kept.iter().chain(targets).copied().collect();
        SharedParameters {
            ids: order.iter().map(|j| list[*j].id.clone()).collect(),
            size: order.iter().map(|j| list[*j].size).collect(),
            display_per_internal: order.iter().map(|j| list[*j].unit.display_per_internal).collect(),
            targets: targets.len(),
        }
    }

    /// The parameters in some columns, which include all target parameters.
    pub fn part(&self, columns: &[usize]) -> SharedParameters {
        SharedParameters {
            ids: columns.iter().map(|j| self.ids[*j].clone()).collect(),
            size: columns.iter().map(|j| self.size[*j]).collect(),
            display_per_internal: columns.iter().map(|j| self.display_per_internal[*j]).collect(),
            targets: self.targets,
        }
    }

    /// The root of a whole plan, priors included. Parameters are regularised at their physical size, so that a
    /// parameter that is not identifiable has a very large uncertainty and needs no special case.
    ///
    /// # Errors
    /// If a parameter does not belong to the problem.
    pub fn root_of(&self, problem: &Problem, linear: &Linearisation) -> Result<Root, IdentifyError> {
        let list = &problem.parameters.list;
        let index: HashMap<&str, usize> =
            list.iter().enumerate().map(|(j, parameter)| (parameter.id.as_str(), j)).collect();
        let columns = self
            .ids
            .iter()
            .map(|id| index.get(id.as_str()).copied())
            .collect::<Option<Vec<usize>>>()
            .ok_or_else(|| IdentifyError::Request("a parameter does not belong to this plan".to_string()))?;
        let root = linear.marginal(&columns)?;
        Ok(self.regularised(&root))
    }

    /// Adds a prior of the physical size to every parameter.
    fn regularised(&self, root: &Root) -> Root {
        let k = self.ids.len();
        let priors = Mat::from_fn(k, k, |i, j| if i == j { 1.0 / self.size[i] } else { 0.0 });
        sum(root.as_ref(), priors.as_ref())
    }

    /// The root of the readings of a problem with one test, from their triangular factor `r`. Parameters that are not
    /// shared are eliminated within their priors. `as_shared` maps a parameter's identifier to that of the shared
    /// parameter.
    pub fn root_of_test(&self, problem: &Problem, r: MatRef<'_, f64>, as_shared: impl Fn(&str) -> String) -> Root {
        let list = &problem.parameters.list;
        let column_of = |id: &str| {
            let name = as_shared(id);
            self.ids.iter().position(|shared| *shared == name)
        };
        let index: Vec<Option<usize>> = list.iter().map(|parameter| column_of(&parameter.id)).collect();
        let own: Vec<usize> = (0..list.len()).filter(|j| index[*j].is_none()).collect();
        let (m, k) = (own.len(), self.ids.len());
        let mut stacked = Mat::zeros((list.len() + m).max(m + k), m + k);
        for (j, column) in index.iter().enumerate() {
            let target = match column {
                Some(column) => m + column,
                None => own.iter().position(|own| *own == j).unwrap_or(0),
            };
            for i in 0..list.len() {
                stacked[(i, target)] = r[(i, j)];
            }
        }
        for (index, j) in own.iter().enumerate() {
            let u = match list[*j].prior {
                Prior::Gaussian(u) => u,
                _ => list[*j].size,
            };
            stacked[(list.len() + index, index)] = 1.0 / u;
        }
        let upper = upper(stacked);
        Mat::from_fn(k, k, |i, j| if i <= j { upper[(m + i, m + j)] } else { 0.0 })
    }

    /// The root of the information on the target parameters, with the others eliminated.
    pub fn criterion_block<'r>(&self, root: &'r Root) -> MatRef<'r, f64> {
        let first = self.ids.len() - self.targets;
        root.as_ref().submatrix(first, first, self.targets, self.targets)
    }

    /// Standard uncertainties of the target parameters, display units.
    pub fn uncertainties(&self, root: &Root) -> Vec<f64> {
        let block = self.criterion_block(root);
        let inverse = inverse_of_upper(block);
        let first = self.ids.len() - self.targets;
        (0..self.targets)
            .map(|i| {
                let row = (i..self.targets).map(|j| inverse[(i, j)].powi(2)).sum::<f64>().sqrt();
                row * self.display_per_internal[first + i]
            })
            .collect()
    }
}

/// The root of the sum of two information matrices.
pub fn sum(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Root {
    let k = a.ncols();
    let stacked =
        Mat::from_fn(a.nrows() + b.nrows(), k, |i, j| if i < a.nrows() { a[(i, j)] } else { b[(i - a.nrows(), j)] });
    upper(stacked)
}
