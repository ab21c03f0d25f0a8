//! Covariance of the reported parameters, and the null space as a matrix.

use faer::Mat;

use super::Fit;
use super::cover::add_to_covariance;
use super::quantities::{Quantity, quantities, slopes_of_rms, values_at};
use crate::numerics::rank::Rank;
use crate::problem::Problem;
use crate::results::{Covariance, Estimate, NullSpace};

/// Covariance of the reported parameters by the law of propagation of uncertainty, in their order and units. It has the
/// same factor as the standard uncertainties and covers aliases as they do, so its diagonal holds their squares.
pub fn of_parameters(problem: &Problem, fit: &Fit, parameters: &[Estimate]) -> Covariance {
    let list = &problem.parameters.list;
    // Rows of the Jacobian of the reported quantities: their parameters, and the derivative by each.
    let mut rows: Vec<Vec<(usize, f64)>> = Vec::with_capacity(parameters.len());
    for quantity in quantities(problem, fit) {
        match quantity {
            Quantity::Parameter(j) => rows.push(vec![(j, list[j].unit.display_per_internal)]),
            Quantity::Rms(j, count) => {
                let display = list[j].unit.display_per_internal;
                let slopes = slopes_of_rms(&fit.beta[j..j + count]).map(|slope| slope * display);
                rows.push((j..).zip(slopes).collect());
            }
            Quantity::Harmonic(j) => {
                let (a, b) = (fit.beta[j], fit.beta[j + 1]);
                let amplitude = a.hypot(b).max(f64::MIN_POSITIVE);
                let display = list[j].unit.display_per_internal;
                rows.push(vec![(j, a / amplitude * display), (j + 1, b / amplitude * display)]);
                let per_radian = 1.0_f64.to_degrees() / amplitude;
                rows.push(vec![(j, b / amplitude * per_radian), (j + 1, -a / amplitude * per_radian)]);
            }
            // Its variance is that of the result.
            Quantity::Position(_) => rows.push(Vec::new()),
        }
    }
    let enlargement = fit.u_enlargement * fit.u_enlargement;
    let entry = |p: &[(usize, f64)], q: &[(usize, f64)]| -> f64 {
        let products = p.iter().flat_map(|(j, a)| q.iter().map(move |(k, b)| a * b * fit.covariance[(*j, *k)]));
        products.sum::<f64>() * enlargement
    };
    let mut matrix = Mat::from_fn(rows.len(), rows.len(), |i, j| entry(&rows[i], &rows[j]));
    let quantities = quantities(problem, fit);
    add_to_covariance(&mut matrix, fit, |beta| {
        let mut values = Vec::with_capacity(parameters.len());
        values_at(problem, fit, &quantities, beta, |value| values.push(value));
        values
    });
    adapt_diagonal(&mut matrix, parameters);
    Covariance {
        ids: parameters.iter().map(|parameter| parameter.id.clone()).collect(),
        units: parameters.iter().map(|parameter| parameter.unit.clone()).collect(),
        matrix: (0..rows.len()).map(|i| (0..rows.len()).map(|j| matrix[(i, j)]).collect()).collect(),
    }
}

/// Sets the diagonal of a covariance to the squares of the standard uncertainties, and keeps the matrix positive
/// semidefinite. An additional contribution (competing explanations) is added as uncorrelated. A phase, whose
/// uncertainty has an upper limit, is scaled.
fn adapt_diagonal(matrix: &mut Mat<f64>, parameters: &[Estimate]) {
    for (i, parameter) in parameters.iter().enumerate().take(matrix.nrows()) {
        let variance = parameter.u * parameter.u;
        let present = matrix[(i, i)];
        if present > variance {
            let scale = parameter.u / present.sqrt();
            for j in 0..matrix.nrows() {
                matrix[(i, j)] *= scale;
                matrix[(j, i)] *= scale;
            }
        }
        matrix[(i, i)] = variance;
    }
}

/// The null space in reduced row echelon form, in display units, over the parameters that take part in it, in their
/// order.
pub fn null_space(problem: &Problem, rank: &Rank) -> NullSpace {
    let list = &problem.parameters.list;
    let involved: Vec<usize> =
        (0..list.len()).filter(|j| rank.null_combinations.iter().any(|row| row[*j] != 0.0)).collect();
    let displayed = |row: &[f64], j: usize| row[j] * list[j].size * list[j].unit.display_per_internal;
    let vectors = rank
        .null_combinations
        .iter()
        .zip(&rank.pivots)
        .map(|(row, pivot)| {
            let leading = displayed(row, *pivot);
            involved.iter().map(|j| displayed(row, *j) / leading).collect()
        })
        .collect();
    NullSpace {
        ids: involved.iter().map(|j| list[*j].id.to_string()).collect(),
        units: involved.iter().map(|j| list[*j].unit.name.clone()).collect(),
        vectors,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_covariance_has_the_squares_of_the_uncertainties_on_its_diagonal() {
        let parameters = [Estimate::new("a", 1.0, 2.0, "um"), Estimate::new("b", 1.0, 3.0, "um")];
        let mut matrix = Mat::from_fn(2, 2, |i, j| [[16.0, 4.0], [4.0, 4.0]][i][j]);
        adapt_diagonal(&mut matrix, &parameters);
        assert_eq!((matrix[(0, 0)], matrix[(1, 1)]), (4.0, 9.0));
        assert_eq!((matrix[(0, 1)], matrix[(1, 0)]), (2.0, 2.0));
    }
}
