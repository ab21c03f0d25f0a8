//! Gauss–Newton iteration with Levenberg–Marquardt damping, on problems in the form of triangular factors.
//!
//! In scaled parameters `y = x/d` the step solves `min ‖c − R·D·η‖² + λ‖η‖²` by the singular value decomposition of
//! `R·D`. `λ` is zero as long as full steps lower the sum of squares as predicted. A linear problem therefore takes one
//! step. Otherwise the gain ratio, the decrease over the predicted one, controls `λ` (Marquardt, J. SIAM 11 (1963) 431;
//! Madsen, Nielsen, Tingleff, Methods for non-linear least squares problems, 2004, section 3.2).
//!
//! The iterations end where the undamped step would lower the sum of squares by a negligible share of its mean over the
//! degrees of freedom, `‖R·D·η‖² < ε · ‖r‖²/ν`: the parameters are then `√ε` standard uncertainties from the minimum,
//! whatever noise is assumed. That the steps so far shrink fast says nothing of the next one: a direction along which they
//! shrink slowly may have been small beside the others.
//!
//! Along a direction that the readings hardly determine, the neglected second derivatives may be nearly as large as
//! `JᵀJ`. Each full step is then `q` times the step before with `q` close to 1, or close to −1 if it goes too far. The sum
//! of all further steps, `1/(1 − q)` times the present one, leads to the minimum (Aitken's extrapolation).

use abbe_model::Diagnostic;
use faer::Mat;

use super::solve::Svd;
use super::triangle::Triangle;
use crate::error::NO_CONVERGENCE;

/// A problem `min ‖r(x)‖²`.
pub trait LeastSquares {
    /// Number of parameters.
    fn parameters(&self) -> usize;
    /// The triangular factor of `[J | r]` at `x`, with `r = observed − model` and `J = ∂model/∂x`, both divided by the
    /// standard deviation.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    fn linearise(&self, x: &[f64]) -> Result<Triangle, Diagnostic>;
    /// `‖r(x)‖²`; not finite if the model cannot be evaluated.
    fn sum_of_squares(&self, x: &[f64]) -> f64;
    /// Degrees of freedom of `‖r‖²`, at least 1.
    fn degrees_of_freedom(&self) -> f64;
    /// The parameters that a step still moves, in words, for the message that the iterations do not converge.
    fn still_moved(&self, step: &[f64]) -> String {
        let _ = step;
        String::new()
    }
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

const MAX_ITERATIONS: usize = 1000;
/// Attempts to find a damping with which a step lowers the sum of squares.
const MAX_ATTEMPTS: usize = 30;
/// Predicted decrease of the sum of squares, as a share of its mean, at which the iterations end: 10⁻¹⁰ standard
/// uncertainties. One more step follows.
const CONVERGED: f64 = 1e-20;
/// The same for steps that do not end within [`MAX_ITERATIONS`]: a hundredth of a standard uncertainty.
const NEGLIGIBLE: f64 = 1e-4;
/// Decrease of the sum of squares, as a share of it, that is below the rounding of the sum.
const ROUNDING_OF_SUM: f64 = 1e-12;
/// Rise of the sum, as a share of it, that such a step may have. The rounding of lengths of 10⁵ to 10⁶ standard deviations, in
/// each reading, moves the sum by more than that of its terms.
const ROUNDING_OF_RESIDUALS: f64 = 1e-10;
/// Full steps of such a decrease go on as long as each predicts at most this share of the one before.
const SHRINKING: f64 = 0.9;
/// Relative step that is below the rounding of the readings.
const ROUNDING_OF_STEP: f64 = 1e-9;
/// Gain ratio below which the damping grows, and the one above which it falls.
const POOR_GAIN: f64 = 0.25;
/// Least `|q|` of steps that shrink slowly.
const SLOW: f64 = 0.5;

/// Minimises the sum of squares from a start value.
///
/// # Errors
/// If the model cannot be evaluated at the start, or the iterations do not converge.
pub fn minimise(
    problem: &impl LeastSquares,
    start: &[f64],
    scaling: &Scaling,
) -> Result<LeastSquaresSolution, Diagnostic> {
    let n = problem.parameters();
    let mut x = start.to_vec();
    let mut triangle = problem.linearise(&x)?;
    let mut current = triangle.sum_of_squares();
    let mut scale = match scaling {
        Scaling::Physical(sizes) => sizes.clone(),
        Scaling::Columns => vec![f64::INFINITY; n],
    };
    let mut damping = Damping::default();
    // The full step before, in scaled parameters, and the decrease that it predicted.
    let mut before: Option<(Vec<f64>, f64)> = None;
    for iteration in 1..=MAX_ITERATIONS {
        let (r, c, _) = triangle.parts();
        if let Scaling::Columns = scaling {
            largest_norms(&r, &mut scale);
        }
        let scaled = Mat::from_fn(n, n, |i, j| r[(i, j)] * scale[j]);
        let directions = Svd::of(scaled.as_ref())?;
        let full = directions.solve(&c, 0.0);
        let predicted = directions.explained(&c);
        let mean = current / problem.degrees_of_freedom();
        let after = |step: &[f64], factor: f64| -> Vec<f64> {
            x.iter().zip(step).zip(&scale).map(|((x, step), scale)| x + factor * step * scale).collect()
        };
        let end = |accepted: bool| -> LeastSquaresSolution {
            let step: Vec<f64> = full.iter().zip(&scale).map(|(step, scale)| step * scale).collect();
            let (x, triangle) =
                if accepted { (after(&full, 1.0), triangle.after(&step)) } else { (x.clone(), triangle.clone()) };
            LeastSquaresSolution { x, sum_of_squares: triangle.sum_of_squares(), triangle, iterations: iteration }
        };
        if predicted <= CONVERGED * mean {
            return Ok(end(true));
        }
        // A decrease below the rounding of the sum cannot be seen in the sum. The minimum is reached when full steps no
        // longer shrink.
        let rounded = predicted < ROUNDING_OF_SUM * current;
        if rounded && before.as_ref().is_some_and(|(_, before)| predicted > SHRINKING * before) {
            return Ok(end(false));
        }
        let q = before.as_ref().map_or(0.0, |(before, _)| dot(&full, before) / dot(before, before));
        let mut found = None;
        for attempt in 0..MAX_ATTEMPTS {
            let mut is_full = damping.value == 0.0 || rounded;
            let step = if is_full { full.clone() } else { directions.solve(&c, damping.value) };
            let mut trial = after(&step, 1.0);
            // The first attempt is nearly always accepted, so it is linearised at once.
            let mut next = if attempt == 0 { problem.linearise(&trial).ok() } else { None };
            let mut sum = match (&next, attempt) {
                (Some(next), _) => next.sum_of_squares(),
                (None, 0) => f64::NAN,
                (None, _) => problem.sum_of_squares(&trial),
            };
            if is_full && (SLOW..1.0).contains(&q.abs()) {
                let extrapolated = after(&step, 1.0 / (1.0 - q));
                let further = problem.sum_of_squares(&extrapolated);
                if further < sum || (rounded && further <= sum * (1.0 + ROUNDING_OF_SUM)) {
                    (trial, sum, next, is_full) = (extrapolated, further, None, false);
                }
            }
            if sum < current || (rounded && sum <= current * (1.0 + ROUNDING_OF_RESIDUALS)) {
                damping.accepted((current - sum) / decrease(&scaled, &c, &step), &directions, rounded);
                found = Some((trial, next, is_full.then_some((step, predicted))));
                break;
            }
            let share = |k: usize| {
                let size = x[k].abs() + if let Scaling::Physical(_) = scaling { scale[k] } else { 0.0 };
                (step[k] * scale[k] / size.max(f64::MIN_POSITIVE)).abs()
            };
            if (0..n).map(share).fold(0.0, f64::max) < ROUNDING_OF_STEP {
                return Ok(end(false));
            }
            damping.rejected(&directions);
        }
        let Some((trial, next, step)) = found else { break };
        (x, before) = (trial, step);
        triangle = next.map_or_else(|| problem.linearise(&x), Ok)?;
        current = triangle.sum_of_squares();
    }
    let (r, c, _) = triangle.parts();
    let directions = Svd::of(Mat::from_fn(n, n, |i, j| r[(i, j)] * scale[j]).as_ref())?;
    if directions.explained(&c) < NEGLIGIBLE * current / problem.degrees_of_freedom() {
        return Ok(LeastSquaresSolution { x, triangle, sum_of_squares: current, iterations: MAX_ITERATIONS });
    }
    let step: Vec<f64> = directions.solve(&c, 0.0).iter().zip(&scale).map(|(step, scale)| step * scale).collect();
    let along = problem.still_moved(&step);
    Err(Diagnostic::coded(
        NO_CONVERGENCE,
        format!(
            "no convergence after {MAX_ITERATIONS} iterations (the sum of squares is {current:.3e}){along}; check that the \
             readings belong to this machine and that the nominal geometry is right"
        ),
    ))
}

/// The scales as the reciprocals of the largest column norms so far.
fn largest_norms(r: &Mat<f64>, scale: &mut [f64]) {
    for (j, scale) in scale.iter_mut().enumerate() {
        let norm = r.col(j).iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        if norm > 0.0 {
            *scale = scale.min(1.0 / norm);
        } else if !scale.is_finite() {
            *scale = 1.0;
        }
    }
}

/// By how much a step lowers `‖c − A·η‖²`.
fn decrease(scaled: &Mat<f64>, c: &[f64], step: &[f64]) -> f64 {
    let along = |i: usize| step.iter().enumerate().map(|(j, step)| scaled[(i, j)] * step).sum::<f64>();
    (0..c.len()).map(|i| (along(i), c[i])).map(|(along, c)| along * (2.0 * c - along)).sum()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `λ`, and the factor by which the next rejection enlarges it.
struct Damping {
    value: f64,
    growth: f64,
}

impl Default for Damping {
    fn default() -> Damping {
        Damping { value: 0.0, growth: 2.0 }
    }
}

impl Damping {
    /// The square of the least singular value: less damping leaves every direction as it is.
    fn least(directions: &Svd) -> f64 {
        let rank = directions.numerical_rank();
        rank.checked_sub(1).map_or(0.0, |last| directions.singular_values[last].powi(2))
    }

    fn accepted(&mut self, gain: f64, directions: &Svd, rounded: bool) {
        self.growth = 2.0;
        if rounded {
            return;
        }
        if gain < POOR_GAIN {
            self.value = (self.value * 2.0).max(Damping::least(directions));
        } else {
            self.value *= (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(0.1, 1.0);
            if self.value < 1e-2 * Damping::least(directions) {
                self.value = 0.0;
            }
        }
    }

    fn rejected(&mut self, directions: &Svd) {
        self.value = if self.value == 0.0 { Damping::least(directions) } else { self.value * self.growth };
        self.growth *= 2.0;
    }
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

        fn linearise(&self, x: &[f64]) -> Result<Triangle, Diagnostic> {
            Ok(Triangle::of(Poorly::rows(x)))
        }

        fn sum_of_squares(&self, x: &[f64]) -> f64 {
            let rows = Poorly::rows(x);
            (0..4).map(|i| rows[(i, 2)].powi(2)).sum()
        }

        fn degrees_of_freedom(&self) -> f64 {
            2.0
        }
    }

    #[test]
    fn a_direction_below_the_rounding_of_the_sum_is_minimised_too() {
        let found = minimise(&Poorly, &[0.3, 0.3], &Scaling::Physical(vec![1.0; 2])).unwrap();
        assert!((found.x[0] - 1.0).abs() < 1e-12, "{:?}", found.x);
        // The standard uncertainty of x with this residual: the Jacobian has the length √5 there.
        let u = (found.sum_of_squares / Poorly.degrees_of_freedom() / 5.0).sqrt();
        assert!(found.x[1].abs() < 1e-10 * u, "{:?}, u = {u}", found.x);
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

        fn linearise(&self, x: &[f64]) -> Result<Triangle, Diagnostic> {
            Ok(Triangle::of(self.rows(x[0])))
        }

        fn sum_of_squares(&self, x: &[f64]) -> f64 {
            let rows = self.rows(x[0]);
            (0..2).map(|i| rows[(i, 1)].powi(2)).sum()
        }

        fn degrees_of_freedom(&self) -> f64 {
            1.0
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
