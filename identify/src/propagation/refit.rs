//! The nonlinear fit of one simulated session, as a function of the deviations of its inputs.

use abbe_model::Diagnostic;
use abbe_model::session::Prior;
use faer::Mat;

use crate::fit::{Fit, Quantity, quantities, values_at};
use crate::monte_carlo::Function;
use crate::numerics::least_squares::{LeastSquares, Scaling, minimise};
use crate::numerics::triangle::{BLOCK_ROWS, Triangle};
use crate::problem::{Problem, RowBlock};

/// Number of steps with the curvature of the original fit. After these the simulated session is fitted with its own
/// curvature.
const MAX_SHARED_STEPS: usize = 8;
/// Expected decrease of the sum of squares below which the iteration ends: a hundredth of a standard uncertainty.
const MIN_DECREASE: f64 = 1e-4;

/// The function from the deviations of the inputs to the reported quantities.
pub(super) struct Refit<'p> {
    problem: &'p Problem,
    fit: &'p Fit,
    blocks: Vec<RowBlock>,
    /// Index among the inputs of each test's first reading.
    starts: Vec<usize>,
    /// Index among the inputs of each parameter with a Gaussian prior.
    priors: Vec<Option<usize>>,
    /// Index among the inputs of the first distance between sockets.
    distances: usize,
    quantities: Vec<Quantity>,
    /// The solution of the fit, in identifiable coordinates.
    end: Vec<f64>,
    /// `(NᵀJᵀV⁻¹J N)⁻¹` at the solution.
    inverse: Mat<f64>,
    /// Standard uncertainty of each input.
    pub u: Vec<f64>,
}

impl<'p> Refit<'p> {
    pub fn new(problem: &'p Problem, fit: &'p Fit) -> Result<Self, Diagnostic> {
        // The factor on uncertainties applies here as in the fit.
        let enlarged = fit.u_enlargement;
        let mut u = Vec::new();
        let mut starts = Vec::new();
        for residuals in &fit.residuals {
            starts.push(u.len());
            u.resize(u.len() + residuals.len(), problem.noise.likelihood_mm() * enlarged);
        }
        let mut priors = Vec::new();
        for parameter in &problem.parameters.list {
            priors.push(match parameter.prior {
                Prior::Gaussian(prior) => {
                    u.push(prior * enlarged);
                    Some(u.len() - 1)
                }
                Prior::Known | Prior::Free => None,
            });
        }
        let distances = u.len();
        let stated = &problem.session.socket_distances;
        u.extend(stated.iter().map(|distance| distance.u_mm * enlarged));
        let basis = &fit.rank.identifiable_basis;
        let reduced = problem.prior_triangle(&fit.beta).merged(&fit.triangles).in_directions(basis);
        Ok(Refit {
            problem,
            fit,
            blocks: problem.blocks(),
            starts,
            priors,
            distances,
            quantities: quantities(problem, fit)
                .into_iter()
                .filter(|one| !matches!(one, Quantity::Position(_)))
                .collect(),
            end: fit.rank.coordinates(&fit.beta, &problem.parameters.sizes()),
            inverse: reduced.covariance(&Mat::identity(basis.ncols(), basis.ncols()))?,
            u,
        })
    }

    /// The inputs with the deviations of readings as the autocorrelation of the noise makes them, `x_t = Σ a_k x_{t−k} + e_t`,
    /// from independent ones of the variance of the noise.
    fn along_runs(&self, inputs: &[f64]) -> Vec<f64> {
        let noise = &self.problem.noise;
        let mut inputs = inputs.to_vec();
        let innovation = noise.innovation_mm() / noise.sigma_mm;
        for block in self.blocks.iter().filter(|_| !noise.ar_coefficients.is_empty()) {
            let start = self.starts[block.test];
            for row in block.rows.clone().skip(noise.ar_coefficients.len()) {
                let lags = noise.ar_coefficients.iter().enumerate();
                let past: f64 = lags.map(|(lag, a)| a * inputs[start + row - lag - 1]).sum();
                inputs[start + row] = past + innovation * inputs[start + row];
            }
        }
        inputs
    }

    /// The identifiable coordinates with the best fit to the inputs.
    fn fitted(&self, deviations: &[f64]) -> Result<Vec<f64>, Diagnostic> {
        let drawn = SimulatedFit { refit: self, deviations };
        let mut z = self.end.clone();
        for _ in 0..MAX_SHARED_STEPS {
            let Ok(descent) = drawn.descent(&z) else { break };
            let step: Vec<f64> =
                (0..z.len()).map(|i| (0..z.len()).map(|k| self.inverse[(i, k)] * descent[k]).sum()).collect();
            let fall: f64 = step.iter().zip(&descent).map(|(s, d)| s * d).sum();
            z.iter_mut().zip(&step).for_each(|(z, step)| *z += step);
            if fall < MIN_DECREASE {
                return Ok(z);
            }
            if !fall.is_finite() {
                break;
            }
        }
        // Too nonlinear for the curvature of the original fit.
        let scale = Scaling::Physical(vec![1.0; self.end.len()]);
        Ok(minimise(&drawn, &self.end, &scale)?.x)
    }
}

impl Function for Refit<'_> {
    type Scratch = ();
    const BLOCK: u64 = 32;
    const PILOT: u64 = 512;

    fn inputs(&self) -> usize {
        self.u.len()
    }

    fn outputs(&self) -> usize {
        let of = |quantity: &Quantity| match quantity {
            Quantity::Parameter(_) | Quantity::Rms(..) | Quantity::Position(_) => 1,
            Quantity::Harmonic(_) => 2,
        };
        self.quantities.iter().map(of).sum()
    }

    fn evaluate(&self, inputs: &[f64], outputs: &mut [f64], (): &mut ()) {
        let Ok(z) = self.fitted(&self.along_runs(inputs)) else {
            outputs.fill(f64::NAN);
            return;
        };
        let mut outputs = outputs.iter_mut();
        let put = |value: f64| {
            if let Some(output) = outputs.next() {
                *output = value;
            }
        };
        values_at(self.problem, self.fit, &self.quantities, &self.fit.rank.parameters_at(&z), put);
    }
}

/// One simulated session as a least-squares problem in the identifiable directions.
struct SimulatedFit<'r, 'p> {
    refit: &'r Refit<'p>,
    deviations: &'r [f64],
}

impl SimulatedFit<'_, '_> {
    fn prior_triangle(&self, beta: &[f64]) -> Triangle {
        let refit = self.refit;
        let centre = |j: usize| refit.priors[j].map_or(0.0, |place| self.deviations[place]);
        let longer = |number: usize| self.deviations[refit.distances + number];
        refit.problem.prior_triangle_about(beta, centre, longer)
    }

    /// Passes on the parameters of every block's test, and the whitened rows `[J | r]` over these parameters.
    fn rows(&self, beta: &[f64], mut take: impl FnMut(&[usize], Mat<f64>)) -> Result<(), Diagnostic> {
        let problem = self.refit.problem;
        let values = problem.slot_values(beta);
        for block in &self.refit.blocks {
            let mut rows = problem.own_rows(&values[block.test], block)?;
            let last = rows.ncols() - 1;
            let start = self.refit.starts[block.test] + block.rows.start * problem.channels(block.test);
            for i in 0..rows.nrows() {
                rows[(i, last)] += self.deviations[start + i];
            }
            take(problem.own_parameters(block.test), problem.whiten(&rows, block).0);
        }
        Ok(())
    }

    /// `Nᵀ Jᵀ V⁻¹ r`: the negative gradient of half the sum of squares.
    fn descent(&self, z: &[f64]) -> Result<Vec<f64>, Diagnostic> {
        let beta = self.refit.fit.rank.parameters_at(z);
        let count = beta.len();
        let mut whole = vec![0.0; count];
        let mut add = |own: &[usize], rows: &Mat<f64>| {
            let residual = rows.col(own.len());
            for (j, column) in own.iter().zip(rows.col_iter()) {
                whole[*j] += column.transpose() * residual;
            }
        };
        let (r, c, _) = self.prior_triangle(&beta).parts();
        let all: Vec<usize> = (0..count).collect();
        let known = Mat::from_fn(count, count + 1, |i, j| if j == count { c[i] } else { r[(i, j)] });
        add(&all, &known);
        self.rows(&beta, |own, rows| add(own, &rows))?;
        let basis = &self.refit.fit.rank.identifiable_basis;
        Ok((0..basis.ncols()).map(|k| (0..count).map(|j| basis[(j, k)] * whole[j]).sum()).collect())
    }
}

impl LeastSquares for SimulatedFit<'_, '_> {
    fn parameters(&self) -> usize {
        self.refit.end.len()
    }

    fn linearise(&self, z: &[f64]) -> Result<Triangle, Diagnostic> {
        let beta = self.refit.fit.rank.parameters_at(z);
        let mut whole = self.prior_triangle(&beta);
        self.rows(&beta, |own, rows| {
            let mut narrow = Triangle::new(own.len());
            for start in (0..rows.nrows()).step_by(BLOCK_ROWS) {
                let count = BLOCK_ROWS.min(rows.nrows() - start);
                narrow.absorb(rows.subrows(start, count));
            }
            whole.merge(&narrow.over_columns(own, beta.len()));
        })?;
        Ok(whole.in_directions(&self.refit.fit.rank.identifiable_basis))
    }

    fn degrees_of_freedom(&self) -> f64 {
        self.refit.fit.degrees_of_freedom.max(1) as f64
    }

    fn sum_of_squares(&self, z: &[f64]) -> f64 {
        let refit = self.refit;
        let beta = refit.fit.rank.parameters_at(z);
        let problem = refit.problem;
        let values = problem.slot_values(&beta);
        let mut sum = 0.0;
        for ((test, model), values) in problem.models.iter().enumerate().zip(&values) {
            let Some(readings) = &problem.tests[test].readings else {
                continue;
            };
            let (start, channels) = (refit.starts[test], problem.channels(test));
            let read = model.readings(values);
            let residual: Vec<f64> =
                (0..read.len()).map(|i| readings.observed[i] + self.deviations[start + i] - read[i]).collect();
            for block in refit.blocks.iter().filter(|block| block.test == test) {
                let first = block.rows.start * channels;
                let column = Mat::from_fn(block.rows.len() * channels, 1, |i, _| residual[first + i]);
                let (white, _) = problem.whiten(&column, block);
                sum += (0..white.nrows()).map(|i| white[(i, 0)].powi(2)).sum::<f64>();
            }
        }
        sum + self.prior_triangle(&beta).sum_of_squares()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;

    use super::*;
    use crate::fit::prepare;

    /// Whitening the deviations of readings gives back the independent ones, over their standard deviation.
    #[test]
    fn deviations_have_the_autocorrelation_of_the_noise() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, fit) = prepare(&session, 1).unwrap();
        problem.noise.ar_coefficients = vec![0.9, -0.2];
        let refit = Refit::new(&problem, &fit).unwrap();
        let independent: Vec<f64> = refit.u.iter().enumerate().map(|(i, u)| u * ((i * 7) as f64).sin()).collect();
        let drawn = refit.along_runs(&independent);
        for block in &refit.blocks {
            let start = refit.starts[block.test] + block.rows.start;
            let column = Mat::from_fn(block.rows.len(), 1, |i, _| drawn[start + i]);
            let white = problem.whitened(column, &(0..block.rows.len()).collect::<Vec<_>>());
            for i in 0..block.rows.len() {
                let expected = independent[start + i] / problem.noise.sigma_mm;
                assert!((white[(i, 0)] - expected).abs() < 1e-9, "{} {expected}", white[(i, 0)]);
            }
        }
        assert_eq!(drawn[refit.distances..], independent[refit.distances..]);
    }

    /// Three computations for one simulated session agree: the sum of squares of its rows, that of its residuals, and
    /// its gradient against differences.
    #[test]
    fn sum_of_squares_and_gradient_of_a_simulated_session_agree() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (problem, fit) = prepare(&session, 1).unwrap();
        let refit = Refit::new(&problem, &fit).unwrap();
        // Deviations of one standard uncertainty with alternating signs.
        let signs = [1.0, -1.0, 1.0, 1.0, -1.0].iter().cycle();
        let deviations: Vec<f64> = refit.u.iter().zip(signs).map(|(u, sign)| u * sign).collect();
        let drawn = SimulatedFit { refit: &refit, deviations: &deviations };
        let z = drawn.refit.end.clone();
        let whole = drawn.linearise(&z).unwrap().sum_of_squares();
        let of_residuals = drawn.sum_of_squares(&z);
        assert!(of_residuals > 0.5 * problem.readings() as f64, "{of_residuals}");
        assert!((of_residuals / whole - 1.0).abs() < 1e-9, "{of_residuals} and {whole}");
        let descent = drawn.descent(&z).unwrap();
        for k in 0..z.len() {
            let by = 1e-2 * refit.inverse[(k, k)].sqrt();
            let at = |by: f64| {
                let mut moved = z.clone();
                moved[k] += by;
                drawn.sum_of_squares(&moved)
            };
            let slope = (at(by) - at(-by)) / (2.0 * by);
            let scale = refit.inverse[(k, k)].sqrt();
            assert!((slope + 2.0 * descent[k]).abs() * scale < 1e-4, "{k}: {slope} {}", descent[k]);
        }
    }
}
