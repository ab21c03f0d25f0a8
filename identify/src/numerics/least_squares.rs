//! Gauss–Newton iteration with Levenberg–Marquardt damping, on problems in the form of triangular factors.
//!
//! In scaled parameters `y = x/d` the step solves `min ‖c − R·D·η‖² + λ‖η‖²` by the singular value decomposition of
//! `R·D`. `λ` is zero as long as full steps lower the sum of squares. A linear problem therefore takes one step
//! (Marquardt, J. SIAM 11 (1963) 431; Moré, Lecture Notes in Mathematics 630 (1978) 105).
//!
//! Along a direction that the readings hardly determine, the neglected second derivatives may be nearly as large as
//! `JᵀJ`. Each full step is then `q` times the step before with `q` close to 1, or close to −1 if it goes too far. The sum
//! of all further steps, `1/(1 − q)` times the present one, leads to the minimum (Aitken's extrapolation).

use faer::Mat;

use super::solve::Svd;
use super::triangle::Triangle;
use crate::error::IdentifyError;

/// A problem `min ‖r(x)‖²`.
pub trait LeastSquares {
    /// Number of parameters.
    fn parameters(&self) -> usize;
    /// The triangular factor of `[J | r]` at `x`, with `r = observed − model` and `J = ∂model/∂x`, both divided by the
    /// standard deviation.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    fn linearise(&self, x: &[f64]) -> Result<Triangle, IdentifyError>;
    /// `‖r(x)‖²`; not finite if the model cannot be evaluated.
    fn sum_of_squares(&self, x: &[f64]) -> f64;
}

/// The scale of each parameter.
#[derive(Clone, Debug)]
pub enum Scaling {
    /// The physical size of each parameter: 1 mm, 0.01 rad. Null columns stay null.
    Physical(Vec<f64>),
    /// The reciprocal of the largest column norm so far (Moré), for parameters of unknown size.
    Columns,
}

/// The solution of a least-squares problem.
#[derive(Clone, Debug)]
pub struct LeastSquaresSolution {
    /// The parameters.
    pub x: Vec<f64>,
    /// The triangular factor at the solution.
    pub triangle: Triangle,
    /// `‖r‖²`.
    pub sum_of_squares: f64,
    /// Number of linearisations.
    pub iterations: usize,
}

const MAX_ITERATIONS: usize = 200;
const SMALLEST_RELATIVE_STEP: f64 = 1e-12;
/// Decrease of the sum of squares, as a share of it, that is below the rounding of the sum.
const ROUNDING_OF_SUM: f64 = 1e-12;
/// Relative step below which the nonlinearity of the model is negligible: its square is below rounding.
const LINEAR_RELATIVE_STEP: f64 = 1e-7;

/// Predicted decrease of the sum of squares, in units of the variance of a reading, at which steps that do not end within
/// [`MAX_ITERATIONS`] are close enough to the minimum.
const NEGLIGIBLE_DECREASE: f64 = 1e-4;

/// Iterations after which steps that shrink slowly are extrapolated.
const PATIENCE: usize = 10;
/// Least `|q|` of steps that shrink slowly. With less, some hundred steps reach [`SMALLEST_RELATIVE_STEP`].
const SLOW: f64 = 0.8;

/// Minimises the sum of squares from a start value.
///
/// # Errors
/// If the model cannot be evaluated at the start, or the iterations do not converge.
pub fn minimise(
    problem: &impl LeastSquares,
    start: &[f64],
    scaling: &Scaling,
) -> Result<LeastSquaresSolution, IdentifyError> {
    let n = problem.parameters();
    let mut x = start.to_vec();
    let mut triangle = problem.linearise(&x)?;
    let mut current = triangle.sum_of_squares();
    let mut scale = match scaling {
        Scaling::Physical(sizes) => sizes.clone(),
        Scaling::Columns => vec![f64::INFINITY; n],
    };
    let mut damping = 0.0;
    let mut step_before = 1.0;
    // The full step before, in scaled parameters.
    let mut full_before: Option<Vec<f64>> = None;
    for iteration in 1..=MAX_ITERATIONS {
        let (r, c, _) = triangle.parts();
        if let Scaling::Columns = scaling {
            for j in 0..n {
                let norm = (0..n).map(|i| r[(i, j)].powi(2)).sum::<f64>().sqrt();
                if norm > 0.0 {
                    scale[j] = scale[j].min(1.0 / norm);
                } else if !scale[j].is_finite() {
                    scale[j] = 1.0;
                }
            }
        }
        let scaled = Mat::from_fn(n, n, |i, j| r[(i, j)] * scale[j]);
        let directions = Svd::of(scaled.as_ref())?;
        let largest = directions.singular_values.first().copied().unwrap_or(0.0);
        // A step is accepted if the sum of squares falls. Near the minimum the decrease is below rounding and the sizes
        // of the steps decide.
        let mut accepted = false;
        let mut converged = false;
        let mut next = None;
        for attempt in 0..60 {
            let mut step = directions.solve(&c, damping);
            step.iter_mut().zip(&scale).for_each(|(step, scale)| *step *= scale);
            let after = |factor: f64| x.iter().zip(&step).map(|(a, b)| a + factor * b).collect::<Vec<f64>>();
            let mut trial = after(1.0);
            let relative = step
                .iter()
                .zip(&scale)
                .zip(&x)
                .map(|((s, d), x)| {
                    (s / (x.abs() + if let Scaling::Physical(_) = scaling { *d } else { 0.0 }).max(1e-300)).abs()
                })
                .fold(0.0, f64::max);
            // Successive steps shrink by about the same factor. This product estimates the next step.
            let next_relative = relative * (relative / step_before);
            if damping == 0.0 && relative < LINEAR_RELATIVE_STEP && next_relative < SMALLEST_RELATIVE_STEP {
                let triangle = triangle.after(&step);
                return Ok(LeastSquaresSolution {
                    x: trial,
                    sum_of_squares: triangle.sum_of_squares(),
                    triangle,
                    iterations: iteration,
                });
            }
            // A direction may be determined so poorly that a step along it changes the sum of squares by less than
            // rounding, while it is no small step. Successive steps decide then: the minimum is reached when they no
            // longer shrink by half.
            let rounded = damping == 0.0 && directions.explained(&c) < ROUNDING_OF_SUM * current;
            if rounded && iteration > 1 && relative < LINEAR_RELATIVE_STEP && relative > 0.5 * step_before {
                converged = true;
                accepted = true;
                break;
            }
            // The first attempt is nearly always accepted, so it is linearised at once.
            let mut sum = if attempt == 0 {
                next = problem.linearise(&trial).ok();
                next.as_ref().map_or(f64::NAN, |next| next.sum_of_squares())
            } else {
                next = None;
                problem.sum_of_squares(&trial)
            };
            let mut full = (damping == 0.0).then(|| step.iter().zip(&scale).map(|(s, d)| s / d).collect::<Vec<f64>>());
            if let (Some(now), Some(before)) = (&full, &full_before)
                && iteration > PATIENCE
            {
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let q = dot(now, before) / dot(before, before);
                if (SLOW..1.0).contains(&q.abs()) {
                    let extrapolated = after(1.0 / (1.0 - q));
                    let of_extrapolated = problem.sum_of_squares(&extrapolated);
                    if of_extrapolated < sum {
                        (trial, sum, next, full) = (extrapolated, of_extrapolated, None, None);
                    }
                }
            }
            let close = rounded || relative < SMALLEST_RELATIVE_STEP * 100.0;
            if sum.is_finite() && (sum < current || (close && sum <= current * (1.0 + 1e-9))) {
                x = trial;
                converged = relative < SMALLEST_RELATIVE_STEP
                    || (!rounded && current - sum <= 1e-15 * current && relative < LINEAR_RELATIVE_STEP);
                current = sum;
                damping *= 0.1;
                if damping < largest * largest * 1e-12 {
                    damping = 0.0;
                }
                (step_before, full_before) = (relative, full);
                accepted = true;
                break;
            }
            next = None;
            if relative < 1e-9 && damping == 0.0 {
                // The full step is below rounding: this is the minimum.
                converged = true;
                accepted = true;
                break;
            }
            damping = if damping == 0.0 { largest * largest * 1e-6 } else { damping * 10.0 };
        }
        if !accepted {
            break;
        }
        triangle = match next {
            Some(next) => next,
            None => problem.linearise(&x)?,
        };
        if converged {
            return Ok(LeastSquaresSolution { x, triangle, sum_of_squares: current, iterations: iteration });
        }
    }
    // In standard deviations of the readings, a remaining decrease far below 1 is a distance from the minimum far below the
    // uncertainty of the parameters.
    if let Scaling::Physical(_) = scaling {
        let (r, c, _) = triangle.parts();
        let scaled = Mat::from_fn(n, n, |i, j| r[(i, j)] * scale[j]);
        if Svd::of(scaled.as_ref())?.explained(&c) < NEGLIGIBLE_DECREASE {
            return Ok(LeastSquaresSolution { x, triangle, sum_of_squares: current, iterations: MAX_ITERATIONS });
        }
    }
    Err(IdentifyError::NoConvergence { iterations: MAX_ITERATIONS, sum_of_squares: current })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beside residuals of 10⁴ standard deviations, steps of 10⁻⁴ along `x` change the part `(y₁ − eˣ)² + (y₂ − e²ˣ)²`
    /// of the sum of squares by less than the rounding of the sum. With `y₁ = 3/2` and `y₂ = 3/4` its minimum is `x = 0`:
    /// with `t = eˣ` it solves `2t³ + t(1 − 2y₂) = y₁`. The residual stays, so that each step is about a tenth of the
    /// step before.
    struct Poorly;

    impl Poorly {
        fn rows(x: &[f64]) -> Mat<f64> {
            let t = x[1].exp();
            let rows = [
                [1e4, 0.0, 1e4 * (0.0 - x[0])],
                [1e4, 0.0, 1e4 * (2.0 - x[0])],
                [0.0, t, 1.5 - t],
                [0.0, 2.0 * t * t, 0.75 - t * t],
            ];
            Mat::from_fn(4, 3, |i, j| rows[i][j])
        }
    }

    impl LeastSquares for Poorly {
        fn parameters(&self) -> usize {
            2
        }

        fn linearise(&self, x: &[f64]) -> Result<Triangle, IdentifyError> {
            Ok(Triangle::of(Poorly::rows(x)))
        }

        fn sum_of_squares(&self, x: &[f64]) -> f64 {
            let rows = Poorly::rows(x);
            (0..4).map(|i| rows[(i, 2)].powi(2)).sum()
        }
    }

    #[test]
    fn a_direction_below_the_rounding_of_the_sum_is_minimised_too() {
        let found = minimise(&Poorly, &[0.3, 0.3], &Scaling::Physical(vec![1.0; 2])).unwrap();
        assert!((found.x[0] - 1.0).abs() < 1e-12, "{:?}", found.x);
        assert!(found.x[1].abs() < 1e-10, "{:?}", found.x);
    }

    /// `r = (x₀ − x, b + x²/2)`: near the minimum the neglected second derivative is `b` times `JᵀJ`. With `b = ∓0.993`
    /// each full step is ±0.993 times the step before, so that 200 of them leave a quarter of the way. The minimum solves
    /// `x − x₀ + (b + x²/2) x = 0`; `x₀` is chosen so that it is `x = 0.001`.
    struct Valley {
        b: f64,
    }

    impl Valley {
        const MINIMUM: f64 = 1e-3;

        fn rows(&self, x: f64) -> Mat<f64> {
            let at = Valley::MINIMUM;
            let x_0 = at + (self.b + 0.5 * at * at) * at;
            // r = observed − model, so that the Jacobian of the model has the opposite sign.
            let rows = [[1.0, x_0 - x], [-x, self.b + 0.5 * x * x]];
            Mat::from_fn(2, 2, |i, j| rows[i][j])
        }
    }

    impl LeastSquares for Valley {
        fn parameters(&self) -> usize {
            1
        }

        fn linearise(&self, x: &[f64]) -> Result<Triangle, IdentifyError> {
            Ok(Triangle::of(self.rows(x[0])))
        }

        fn sum_of_squares(&self, x: &[f64]) -> f64 {
            let rows = self.rows(x[0]);
            (0..2).map(|i| rows[(i, 1)].powi(2)).sum()
        }
    }

    #[test]
    fn slowly_shrinking_steps_end_at_the_minimum() {
        for b in [-0.993, 0.993] {
            let found = minimise(&Valley { b }, &[0.0], &Scaling::Physical(vec![1.0])).unwrap();
            // A thousandth of `x` changes the sum of squares by little more than its rounding.
            assert!((found.x[0] / Valley::MINIMUM - 1.0).abs() < 1e-3, "{b}: {:?}", found.x);
            assert!(found.iterations < 50, "{b}: {}", found.iterations);
        }
    }
}
