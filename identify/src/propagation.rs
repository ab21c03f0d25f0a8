//! The fit by Monte Carlo (JCGM 101): the readings and what is known of the set-ups are drawn about what was observed and stated, and every draw is
//! fitted again, nonlinearly.
//!
//! ```text
//! Y = argmin Σ ((x_i − L_i(β))/σ)² + Σ ((s_k − β_k)/u_k)²,    x_i ~ N(observed, σ²),  s_k ~ N(stated, u_k²)
//! ```
//!
//! Where the model is linear, `Y` is Gaussian with the covariance of the law of propagation. Whether it is, is judged as JCGM 101 (8.1) has it: with `u`
//! written as `c·10^l`, one digit of `c` counting, the ends of the two coverage intervals may differ by `δ = ½·10^l`.

use faer::Mat;
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use abbe_model::session::Prior;
use abbe_model::words::counted;

use crate::covariance;
use crate::error::IdentifyError;
use crate::fit::{Fit, Quantity, covariance, in_directions, quantities, values_at};
use crate::least_squares::{LeastSquares, Scaling, minimise};
use crate::monte_carlo::{self, Distribution, Draws, Function, MonteCarlo};
use crate::problem::{Block, Problem};
use crate::results::{DrawnParameter, FitMonteCarlo, FitResult, Verdict, phases_follow_amplitudes};
use crate::triangle::{BLOCK_ROWS, Triangle};

/// Steps with the fit's own curvature before a draw is fitted with its own.
const FEW_STEPS: usize = 8;
/// Expected fall of the sum of squares below which a draw's fit is at its end: a hundredth of a standard uncertainty.
const MIN_DECREASE: f64 = 1e-4;

/// From the inputs' deviations to what the fit reports.
struct Refit<'p, 'a> {
    problem: &'p Problem<'a>,
    fit: &'p Fit,
    blocks: Vec<Block>,
    /// Where the readings of each test start among the inputs.
    starts: Vec<usize>,
    /// Where the unknowns with a Gaussian prior stand among the inputs.
    priors: Vec<Option<usize>>,
    /// Where the distances between sockets start.
    distances: usize,
    quantities: Vec<Quantity>,
    /// Where the fit ended, in seen directions.
    end: Vec<f64>,
    /// `(NᵀJᵀV⁻¹J N)⁻¹` there.
    inverse: Mat<f64>,
    /// Standard uncertainty of each input.
    u: Vec<f64>,
}

impl<'p, 'a> Refit<'p, 'a> {
    fn new(problem: &'p Problem<'a>, fit: &'p Fit) -> Result<Self, IdentifyError> {
        // Where χ² says that uncertainties are too small, they are enlarged here as they are in the fit.
        let enlarged = fit.u_enlargement;
        let mut u = Vec::new();
        let mut starts = Vec::new();
        for residuals in &fit.residuals {
            starts.push(u.len());
            u.resize(u.len() + residuals.len(), problem.noise.sigma_mm * enlarged);
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
        let size: Vec<f64> = problem.parameters.list.iter().map(|p| p.size).collect();
        let mut whole = problem.prior_triangle(&fit.beta);
        fit.triangles.iter().for_each(|triangle| whole.merge(triangle));
        let seen = fit.rank.seen.ncols();
        let reduced = in_directions(&whole, &fit.rank.seen);
        Ok(Refit {
            problem,
            fit,
            blocks: problem.blocks(),
            starts,
            priors,
            distances,
            quantities: quantities(problem, &fit.rank),
            end: fit.rank.coordinates(&fit.beta, &size),
            inverse: covariance(&reduced, &Mat::identity(seen, seen))?,
            u,
        })
    }

    fn beta(&self, z: &[f64]) -> Vec<f64> {
        let seen = &self.fit.rank.seen;
        (0..seen.nrows())
            .map(|j| (0..z.len()).map(|k| seen[(j, k)] * z[k]).sum())
            .collect()
    }

    /// The seen coordinates that fit the inputs best.
    fn fitted(&self, deviations: &[f64]) -> Result<Vec<f64>, IdentifyError> {
        let drawn = Drawn {
            refit: self,
            deviations,
        };
        let mut z = self.end.clone();
        for _ in 0..FEW_STEPS {
            let Ok(descent) = drawn.descent(&z) else { break };
            let step: Vec<f64> = (0..z.len())
                .map(|i| (0..z.len()).map(|k| self.inverse[(i, k)] * descent[k]).sum())
                .collect();
            let fall: f64 = step.iter().zip(&descent).map(|(s, d)| s * d).sum();
            z.iter_mut().zip(&step).for_each(|(z, step)| *z += step);
            if fall < MIN_DECREASE {
                return Ok(z);
            }
            if !fall.is_finite() {
                break;
            }
        }
        // Too far from linear for the fit's curvature.
        let scale = Scaling::Physical(vec![1.0; self.end.len()]);
        Ok(minimise(&drawn, &self.end, &scale)?.x)
    }
}

impl Function for Refit<'_, '_> {
    type Scratch = ();
    const BLOCK: u64 = 32;
    const PILOT: u64 = 512;

    fn inputs(&self) -> usize {
        self.u.len()
    }

    fn outputs(&self) -> usize {
        let of = |quantity: &Quantity| match quantity {
            Quantity::Unknown(_) => 1,
            Quantity::Harmonic(_) => 2,
        };
        self.quantities.iter().map(of).sum()
    }

    fn evaluate(&self, inputs: &[f64], outputs: &mut [f64], (): &mut ()) {
        let Ok(z) = self.fitted(inputs) else {
            outputs.fill(f64::NAN);
            return;
        };
        let mut outputs = outputs.iter_mut();
        let put = |value: f64| {
            if let Some(output) = outputs.next() {
                *output = value;
            }
        };
        values_at(self.problem, self.fit, &self.quantities, &self.beta(&z), put);
    }
}

/// One draw as a least-squares problem in the directions that are seen.
struct Drawn<'r, 'p, 'a> {
    refit: &'r Refit<'p, 'a>,
    deviations: &'r [f64],
}

impl Drawn<'_, '_, '_> {
    fn prior_triangle(&self, beta: &[f64]) -> Triangle {
        let refit = self.refit;
        let centre = |j: usize| refit.priors[j].map_or(0.0, |place| self.deviations[place]);
        let longer = |number: usize| self.deviations[refit.distances + number];
        refit.problem.prior_triangle_about(beta, centre, longer)
    }

    /// Passes on the unknowns of every block's test, and the whitened rows `[J | r]` over those.
    fn rows(&self, beta: &[f64], mut take: impl FnMut(&[usize], Mat<f64>)) -> Result<(), IdentifyError> {
        let problem = self.refit.problem;
        let values = problem.slot_values(beta);
        let coordinates = problem.coordinates();
        for block in &self.refit.blocks {
            let mut rows = problem.own_rows(&values[block.test], block)?;
            let last = rows.ncols() - 1;
            let start = self.refit.starts[block.test] + block.rows.start * coordinates;
            for i in 0..rows.nrows() {
                rows[(i, last)] += self.deviations[start + i];
            }
            take(problem.own_unknowns(block.test), problem.whiten(&rows, block).0);
        }
        Ok(())
    }

    /// `Nᵀ Jᵀ V⁻¹ r`: against the slope of half the sum of squares.
    fn descent(&self, z: &[f64]) -> Result<Vec<f64>, IdentifyError> {
        let beta = self.refit.beta(z);
        let unknowns = beta.len();
        let mut whole = vec![0.0; unknowns];
        let mut add = |own: &[usize], rows: &Mat<f64>| {
            let residual = rows.col(own.len());
            for (j, column) in own.iter().zip(rows.col_iter()) {
                whole[*j] += column.transpose() * residual;
            }
        };
        let (r, c, _) = self.prior_triangle(&beta).parts();
        let all: Vec<usize> = (0..unknowns).collect();
        let known = Mat::from_fn(unknowns, unknowns + 1, |i, j| {
            if j == unknowns { c[i] } else { r[(i, j)] }
        });
        add(&all, &known);
        self.rows(&beta, |own, rows| add(own, &rows))?;
        let seen = &self.refit.fit.rank.seen;
        Ok((0..seen.ncols())
            .map(|k| (0..unknowns).map(|j| seen[(j, k)] * whole[j]).sum())
            .collect())
    }
}

impl LeastSquares for Drawn<'_, '_, '_> {
    fn unknowns(&self) -> usize {
        self.refit.end.len()
    }

    fn linearise(&self, z: &[f64]) -> Result<Triangle, IdentifyError> {
        let beta = self.refit.beta(z);
        let mut whole = self.prior_triangle(&beta);
        self.rows(&beta, |own, rows| {
            let mut narrow = Triangle::new(own.len());
            for start in (0..rows.nrows()).step_by(BLOCK_ROWS) {
                let count = BLOCK_ROWS.min(rows.nrows() - start);
                narrow.absorb(rows.subrows(start, count));
            }
            whole.merge(&narrow.among(own, beta.len()));
        })?;
        Ok(in_directions(&whole, &self.refit.fit.rank.seen))
    }

    fn sum_of_squares(&self, z: &[f64]) -> f64 {
        let refit = self.refit;
        let beta = refit.beta(z);
        let problem = refit.problem;
        let coordinates = problem.coordinates();
        let values = problem.slot_values(&beta);
        let mut sum = 0.0;
        for ((test, model), values) in problem.models.iter().enumerate().zip(&values) {
            let Some(readings) = &problem.tests[test].readings else {
                continue;
            };
            let start = refit.starts[test];
            let read = model.readings_mm(values);
            let residual: Vec<f64> = (0..read.len())
                .map(|i| readings.observed[i] + self.deviations[start + i] - read[i])
                .collect();
            for block in refit.blocks.iter().filter(|block| block.test == test) {
                let first = block.rows.start * coordinates;
                let column = Mat::from_fn(block.rows.len() * coordinates, 1, |i, _| residual[first + i]);
                let (white, _) = problem.whiten(&column, block);
                sum += (0..white.nrows()).map(|i| white[(i, 0)].powi(2)).sum::<f64>();
            }
        }
        let nothing = vec![0.0; beta.len()];
        sum + self.prior_triangle(&beta).sum_of_squares_after(&nothing)
    }
}

/// Draws, and puts into the result what is to be quoted: the Monte Carlo's `u` for every parameter at which the two do not agree.
///
/// # Errors
/// If nothing is seen, or too few draws can be fitted for a distribution.
pub fn add_monte_carlo(
    problem: &Problem<'_>,
    fit: &Fit,
    draws: &MonteCarlo,
    result: &mut FitResult,
) -> Result<(), IdentifyError> {
    if fit.rank.seen.ncols() == 0 {
        return Err(IdentifyError::Request(
            "there is nothing to draw: these readings see none of the unknowns".into(),
        ));
    }
    let refit = Refit::new(problem, fit)?;
    let mean = vec![0.0; refit.u.len()];
    let distributions = monte_carlo::propagate(
        &refit,
        &Draws {
            mean: &mean,
            u: &refit.u,
            runs: draws.runs,
            seed: draws.seed,
            coverage: draws.coverage,
        },
    );
    let unconverged = distributions.iter().map(|d| d.outside[2]).max().unwrap_or(0);
    if unconverged * 2 > draws.runs {
        return Err(IdentifyError::Request(format!(
            "{unconverged} of {} cannot be fitted: the set-ups' uncertainties reach beyond what the model can be evaluated at; state smaller \
             ones, or fit without --monte-carlo",
            counted(draws.runs, "draw")
        )));
    }
    let parameters: Vec<DrawnParameter> = result
        .parameters
        .iter()
        .zip(&distributions)
        .map(|(parameter, drawn)| {
            compared(
                &parameter.id,
                parameter.value,
                parameter.u,
                &parameter.unit,
                drawn,
                draws,
            )
        })
        .collect();
    for (parameter, drawn) in result.parameters.iter_mut().zip(&parameters) {
        if drawn.verdict != Verdict::Agree {
            parameter.set_u(drawn.u);
        }
    }
    phases_follow_amplitudes(&mut result.parameters);
    result.covariance = covariance::of_parameters(problem, fit, &result.parameters);
    if unconverged > 0 {
        result.warnings.push(format!(
            "{unconverged} of {} could not be fitted and are in no figure",
            counted(draws.runs, "draw")
        ));
    }
    result.monte_carlo = Some(FitMonteCarlo {
        runs: draws.runs,
        seed: draws.seed,
        coverage_probability: draws.coverage,
        unconverged_runs: unconverged,
        parameters,
    });
    Ok(())
}

/// Both propagations of one parameter.
fn compared(
    id: &str,
    value: f64,
    gum_u: f64,
    unit: &str,
    drawn: &Distribution,
    draws: &MonteCarlo,
) -> DrawnParameter {
    let normal = Normal::standard();
    let tail = (1.0 - draws.coverage) / 2.0;
    let factor = -normal.inverse_cdf(tail);
    let gum_interval = [value - factor * gum_u, value + factor * gum_u];
    let endpoint_differences = [0, 1].map(|end| (drawn.symmetric[end] - gum_interval[end]).abs());
    let tolerance = tolerance(gum_u);
    // A quantile's standard deviation, √(q(1 − q)/M) over the density there, taken as Gaussian.
    let share = (tail * (1.0 - tail) / draws.runs as f64).sqrt();
    let endpoint_u = drawn.u * share / normal.pdf(factor);
    let worst = endpoint_differences[0].max(endpoint_differences[1]);
    let verdict = if worst - 2.0 * endpoint_u > tolerance {
        Verdict::Differ
    } else if worst <= tolerance && 2.0 * endpoint_u <= tolerance {
        Verdict::Agree
    } else {
        Verdict::Undecided
    };
    DrawnParameter {
        id: id.to_string(),
        unit: unit.to_string(),
        value,
        gum_u,
        gum_interval: gum_interval.into(),
        mean: drawn.mean,
        u: drawn.u,
        symmetric_interval: drawn.symmetric.into(),
        shortest_interval: drawn.shortest.into(),
        endpoint_differences: endpoint_differences.into(),
        tolerance,
        endpoint_u,
        verdict,
    }
}

/// `½·10^l` for a standard uncertainty `c·10^l` of one digit (JCGM 101, 7.9.2).
///
/// ```
/// use abbe_identify::propagation::tolerance;
///
/// assert_eq!(tolerance(0.00035), 0.00005);
/// assert_eq!(tolerance(2.0), 0.5);
/// // 9.7 is 1·10¹ with one digit.
/// assert_eq!(tolerance(9.7), 5.0);
/// ```
pub fn tolerance(u: f64) -> f64 {
    if u.is_nan() || u <= 0.0 || u.is_infinite() {
        return 0.0;
    }
    let power = u.log10().floor() as i32;
    let power = if (u / 10.0_f64.powi(power)).round() >= 10.0 {
        power + 1
    } else {
        power
    };
    // Dividing by a whole power of ten keeps short decimals short.
    if power < 0 {
        0.5 / 10.0_f64.powi(-power)
    } else {
        0.5 * 10.0_f64.powi(power)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_model::session::read::{self, ReadOptions};

    use super::*;
    use crate::fit::prepare;

    /// The same draw three ways: its rows taken together, its residuals alone, and their slope against differences.
    #[test]
    fn a_draw_has_one_sum_of_squares_and_its_slope() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = read::session(&file, &ReadOptions::default()).unwrap();
        let (problem, fit) = prepare(&session, 1).unwrap();
        let refit = Refit::new(&problem, &fit).unwrap();
        // Deviations of a standard uncertainty, alternately up and down.
        let signs = [1.0, -1.0, 1.0, 1.0, -1.0].iter().cycle();
        let deviations: Vec<f64> = refit.u.iter().zip(signs).map(|(u, sign)| u * sign).collect();
        let drawn = Drawn {
            refit: &refit,
            deviations: &deviations,
        };
        let z = drawn.refit.end.clone();
        let nothing = vec![0.0; z.len()];
        let whole = drawn.linearise(&z).unwrap().sum_of_squares_after(&nothing);
        let alone = drawn.sum_of_squares(&z);
        assert!(alone > 0.5 * problem.readings() as f64, "{alone}");
        assert!((alone / whole - 1.0).abs() < 1e-9, "{alone} and {whole}");
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
            assert!(
                (slope + 2.0 * descent[k]).abs() * scale < 1e-4,
                "{k}: {slope} {}",
                descent[k]
            );
        }
    }
}
