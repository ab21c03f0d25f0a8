//! Square roots of the information on named shared parameters, so that tests can be added or removed without a fit.
//!
//! Of each test only a square root of its information on the shared parameters remains. Its own parameters (a ball
//! mounted for it alone, its bar) are eliminated first, within their priors. Two such roots are added by one orthogonal
//! reduction.

use std::collections::HashMap;

use abbe_identify::error;
use abbe_identify::linear::Linearisation;
use abbe_identify::numerics::reduction::inverse_of_upper;
use abbe_identify::numerics::triangle::upper;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::Prior;
use faer::{Mat, MatRef};

/// The parameters that tests share, in column order. The target parameters are last.
#[derive(Clone, Debug)]
pub struct SharedParameters {
    /// Their identifiers.
    pub ids: Vec<ParameterId>,
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
    pub fn root_of(&self, problem: &Problem, linear: &Linearisation) -> Result<Root, Diagnostic> {
        let list = &problem.parameters.list;
        let index: HashMap<&ParameterId, usize> =
            list.iter().enumerate().map(|(j, parameter)| (&parameter.id, j)).collect();
        let known = || list.iter().map(|parameter| parameter.id.clone());
        let unknown =
            |id: &ParameterId| error::unknown("the plan", "parameter", id.clone(), "its parameters are", known());
        let columns = self.ids.iter().map(|id| index.get(id).copied().ok_or_else(|| unknown(id)));
        let columns = columns.collect::<Result<Vec<usize>, _>>()?;
        Ok(self.regularised(linear.marginal(&columns)?.as_ref(), 1.0))
    }

    /// Adds a prior of some multiples of the physical size to every parameter.
    pub fn regularised(&self, root: MatRef<'_, f64>, sizes: f64) -> Root {
        let k = self.ids.len();
        let priors = Mat::from_fn(k, k, |i, j| if i == j { 1.0 / (sizes * self.size[i]) } else { 0.0 });
        sum_of([root, priors.as_ref()].into_iter())
    }

    /// The root of the readings of a problem with one test, from their triangular factor `r`. Parameters that are not
    /// shared are eliminated within their priors. `as_shared` maps a parameter's identifier to that of the shared
    /// parameter.
    pub fn root_of_test(
        &self,
        problem: &Problem,
        r: MatRef<'_, f64>,
        as_shared: impl Fn(&ParameterId) -> ParameterId,
    ) -> Root {
        let list = &problem.parameters.list;
        let column_of = |id: &ParameterId| {
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

    /// The logarithm of the determinant of the targets' covariance, display units.
    pub fn log_determinant(&self, root: &Root) -> f64 {
        let first = self.ids.len() - self.targets;
        let logs = (first..self.ids.len()).map(|j| (self.display_per_internal[j] / root[(j, j)].abs()).ln());
        2.0 * logs.sum::<f64>()
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

/// The root of a sum of information, from rows or roots of its parts.
pub fn sum_of<'m>(parts: impl Iterator<Item = MatRef<'m, f64>>) -> Root {
    let parts: Vec<MatRef<'_, f64>> = parts.collect();
    let columns = parts.first().map_or(0, |part| part.ncols());
    let mut stacked = Mat::zeros(parts.iter().map(|part| part.nrows()).sum::<usize>().max(columns), columns);
    let mut row = 0;
    for part in parts {
        stacked.as_mut().subrows_mut(row, part.nrows()).copy_from(part);
        row += part.nrows();
    }
    upper(stacked)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::noise::{Noise, NoiseSource};
    use faer::linalg::solvers::Solve;

    use super::*;
    use crate::states;

    /// The information on the errors of the machine is the Schur complement of that on the set-up, whose priors are those
    /// of the session: `A − B (C + diag(u⁻²))⁻¹ Bᵀ`.
    #[test]
    fn a_test_informs_within_the_priors_of_its_set_up() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/chapter5.toml");
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        session.tests.truncate(1);
        let plan = states::complete(&session, true).unwrap();
        let problem = states::problem_by_test(&plan, Noise::white(3e-4, NoiseSource::Stated)).unwrap();
        let list = &problem.parameters.list;
        let linear = Linearisation::of(&problem, &vec![0.0; list.len()]).unwrap();
        let (shared, own): (Vec<usize>, Vec<usize>) = (0..list.len()).partition(|j| list[*j].id.is_error());
        let gaussian =
            |j: &&usize| matches!(list[**j].prior, Prior::Gaussian(u) if (u / list[**j].size - 1.0).abs() > 0.5);
        assert!(own.iter().filter(gaussian).count() >= 3, "priors that differ from the physical sizes");
        let shared_parameters = SharedParameters::of(&problem, &[], &shared);
        let r = linear.readings.r();
        let root = shared_parameters.root_of_test(&problem, r.as_ref(), Clone::clone);

        let whole = r.transpose() * &r;
        let part = |rows: &[usize], columns: &[usize]| {
            Mat::from_fn(rows.len(), columns.len(), |i, j| whole[(rows[i], columns[j])])
        };
        let mut of_own = part(&own, &own);
        for (k, j) in own.iter().enumerate() {
            let u = if let Prior::Gaussian(u) = list[*j].prior { u } else { list[*j].size };
            of_own[(k, k)] += 1.0 / (u * u);
        }
        let cross = part(&shared, &own);
        let before = part(&shared, &shared);
        let wanted = &before - &cross * of_own.partial_piv_lu().solve(cross.transpose());
        let found = root.transpose() * &root;
        for (i, j) in (0..shared.len()).flat_map(|i| (0..shared.len()).map(move |j| (i, j))) {
            let scale = (before[(i, i)] * before[(j, j)]).sqrt().max(1.0);
            assert!(
                (found[(i, j)] - wanted[(i, j)]).abs() < 1e-10 * scale,
                "{i} {j}: {} {}",
                found[(i, j)],
                wanted[(i, j)]
            );
        }
    }
}
