//! Base parameters: a minimal set of numbers that predicts the same readings as the whole set.
//!
//! Parameters that are not separable have no values of their own. A *gauge* holds one parameter of each null-space
//! direction at its nominal value; the others, the base parameters, then have values. The held parameters are the
//! pivots of the null space in a stated order of preference, by QR with pivoting of its rows (Gautier, M.: Numerical
//! calculation of the base inertial parameters of robots, J. Robotic Systems 8 (1991) 485; Khalil & Dombre, Modeling,
//! Identification and Control of Robots, 2002, ch. 5 and 11).
//!
//! The estimate `β` moves along the exact null directions until the held parameters are at nominal. Its predictions
//! stay as they are, which Gauss–Newton steps on the differences of predictions ensure beyond first order:
//!
//! ```text
//! L(β′) = L(β),   β′ = 0 for the held parameters
//! ```
//!
//! Directions that the readings determine by less than their noise are no exact null directions. They stay at nominal
//! as combinations, as in the fit.

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use faer::Mat;
use schemars::JsonSchema;
use serde::Serialize;

use super::Fit;
use crate::error;
use crate::numerics::null_space::{MIN_PIVOT, echelon};
use crate::numerics::solve::Svd;
use crate::numerics::triangle::Triangle;
use crate::parameter_description::parameter_meaning;
use crate::parameters::{Parameter, kind, natural};
use crate::problem::Problem;
use crate::results::Estimate;

/// A minimal set of numbers that predicts the same readings as all parameters together.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BaseResult {
    /// The base parameters, each coefficient of a harmonic by itself.
    pub parameters: Vec<Estimate>,
    /// The parameters that are held at nominal.
    pub held_at_nominal: Vec<String>,
    /// Number of combinations that stay at nominal, since the readings determine them by less than their noise.
    pub combinations_at_nominal: usize,
    /// Largest change of a predicted reading against the fit, µm: rounding.
    pub prediction_change_um: f64,
}

/// Which parameters are held at nominal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gauge {
    /// Location errors before coefficients of effects before set-up parameters; among location errors those across the
    /// direction of their axis before those along or about it. Base parameters are then preferably a joint's own
    /// offset and angle, in order from the tool to the bed.
    OwnDirection,
    /// The same order with the set-up in units 1000 times as large, so that a location error is held however far its target
    /// is: the set-up keeps its values.
    Machine,
    /// Location errors before coefficients before set-up parameters, by identifier: the pivots of the null space in the
    /// result of a fit.
    Identifier,
    /// Set-up parameters before coefficients before location errors.
    SetUp,
}

/// Component of the direction of an axis above which an error in this direction is one along or about the axis. Directions
/// of robots have components of rounding across them.
const OWN_SHARE: f64 = 0.5;

/// Physical size of a quantity of the set-up under [`Gauge::Machine`], in its own physical sizes.
const LARGE: f64 = 1e3;

impl Gauge {
    /// The parameters in the order in which they are preferably held.
    fn preference(self, machine: &Machine, list: &[Parameter]) -> Vec<usize> {
        let kind = |parameter: &Parameter| {
            let kind = kind(&parameter.id);
            if self == Gauge::SetUp { 2 - kind } else { kind }
        };
        let own = |parameter: &Parameter| {
            let name = parameter.id.error().filter(|_| matches!(self, Gauge::OwnDirection | Gauge::Machine));
            let axis = name.and_then(|name| machine.axis_index(&name.axis));
            name.zip(axis)
                .is_some_and(|(name, axis)| machine.axes[axis].direction[name.freedom.index() % 3].abs() > OWN_SHARE)
        };
        let mut order: Vec<usize> = (0..list.len()).collect();
        order.sort_by_cached_key(|j| (kind(&list[*j]), own(&list[*j]), natural(&list[*j].id.to_string())));
        order
    }
}

/// The base parameters of a fit, in internal units.
#[derive(Clone, Debug)]
pub struct BaseParameters {
    /// The parameters that are held at nominal, in ascending order.
    pub held: Vec<usize>,
    /// Values of all parameters; 0 for the held ones.
    pub beta: Vec<f64>,
    /// Covariance of all parameters, with the fit's factor on uncertainties; 0 for the held ones.
    pub covariance: Mat<f64>,
    /// The change of each parameter per unit of a held one, internal units, without a change of any reading: parameters ×
    /// parameters, the identity but for the columns of the held ones.
    pub transfer: Mat<f64>,
    /// Number of directions that stay at nominal as combinations: the readings determine them by less than their noise.
    pub held_combinations: usize,
    /// The directions that the readings determine by less than their noise, or not at all, at `beta`: orthonormal, in
    /// scaled parameters, parameters × directions.
    pub null_space: Mat<f64>,
    /// Largest difference of a predicted reading from that of the fit, mm.
    pub prediction_change_mm: f64,
}

/// Largest difference of a prediction at which the iteration ends, mm.
const SAME_PREDICTION_MM: f64 = 1e-12;
/// Maximum number of iterations.
const MAX_STEPS: usize = 20;

/// The base parameters of a fit under a gauge.
///
/// # Errors
/// If the model cannot be evaluated, or the null space has no stable parametrisation.
pub fn base_parameters(problem: &Problem, fit: &Fit, gauge: Gauge) -> Result<BaseParameters, Diagnostic> {
    let list = &problem.parameters.list;
    let is_large = |parameter: &Parameter| gauge == Gauge::Machine && parameter.id.is_setup();
    let size = |parameter: &Parameter| parameter.size * if is_large(parameter) { LARGE } else { 1.0 };
    let sizes: Vec<f64> = list.iter().map(size).collect();
    let preference = gauge.preference(&problem.session.machine, list);
    let at_solution = directions_at(problem, &fit.beta, &fit.triangles, &sizes)?;
    let exact_rank = at_solution.numerical_rank();
    let exact = at_solution.right().subcols(exact_rank, list.len() - exact_rank).to_owned();
    let (combinations, mut held) = echelon(exact.as_ref(), &preference, MIN_PIVOT);
    if held.len() < exact.ncols() {
        let found = "the null space of these readings has none that is stable";
        return Err(error::not_applicable("base parametrisation", found, "add tests or remove parameters"));
    }
    // First order: along the null space until the held parameters are at nominal.
    let mut beta = fit.beta.clone();
    let mut transfer = Mat::<f64>::identity(list.len(), list.len());
    for (combination, pivot) in combinations.iter().zip(&held) {
        for (j, share) in combination.iter().enumerate() {
            let share = share * sizes[j] / sizes[*pivot];
            beta[j] -= fit.beta[*pivot] * share;
            transfer[(j, *pivot)] -= share;
        }
    }
    held.sort_unstable();
    held.iter().for_each(|pivot| beta[*pivot] = 0.0);
    let prediction_change_mm = restore_predictions(problem, fit, &held, &mut beta)?;
    let mut covariance = &transfer * fit.whole_covariance() * transfer.transpose();
    for pivot in &held {
        for j in 0..list.len() {
            covariance[(j, *pivot)] = 0.0;
            covariance[(*pivot, j)] = 0.0;
        }
    }
    let held_combinations = fit.rank.null_space.ncols().saturating_sub(exact.ncols());
    // The least determined directions depend on the place in the null space.
    let triangles = problem.triangles(&beta)?;
    let at_base = directions_at(problem, &beta, &triangles, &problem.parameters.sizes())?;
    let identifiable = fit.rank.identifiable_basis.ncols().min(exact_rank);
    let null_space = at_base.right().subcols(identifiable, list.len() - identifiable).to_owned();
    Ok(BaseParameters { held, beta, covariance, transfer, held_combinations, null_space, prediction_change_mm })
}

impl BaseParameters {
    /// The estimate of a parameter, in its display unit.
    pub fn estimate(&self, problem: &Problem, parameter: usize) -> Estimate {
        let known = &problem.parameters.list[parameter];
        let display = known.unit.display_per_internal;
        let value = problem.parameters.value(parameter, &self.beta) * display;
        let u = self.covariance[(parameter, parameter)].max(0.0).sqrt() * display;
        Estimate::new(known.id.clone(), value, u, &known.unit.name)
            .with_meaning(parameter_meaning(problem, parameter, None))
    }
}

/// The base parameters of a fit under [`Gauge::OwnDirection`], in display units.
///
/// # Errors
/// As [`base_parameters`].
pub fn report(problem: &Problem, fit: &Fit) -> Result<BaseResult, Diagnostic> {
    let base = base_parameters(problem, fit, Gauge::OwnDirection)?;
    let list = &problem.parameters.list;
    let kept = (0..list.len()).filter(|j| !base.held.contains(j));
    Ok(BaseResult {
        parameters: kept.map(|j| base.estimate(problem, j)).collect(),
        held_at_nominal: base.held.iter().map(|j| list[*j].id.to_string()).collect(),
        combinations_at_nominal: base.held_combinations,
        prediction_change_um: base.prediction_change_mm * 1e3,
    })
}

/// The directions of the parameters at a point, scaled by these sizes, the best determined first. Those whose singular value is a
/// rounding error change no reading at all. A direction that is null at the nominal machine only changes readings at
/// the solution.
fn directions_at(problem: &Problem, beta: &[f64], triangles: &[Triangle], sizes: &[f64]) -> Result<Svd, Diagnostic> {
    let r = problem.prior_triangle(beta).merged(triangles).r();
    Svd::of(Mat::from_fn(r.nrows(), sizes.len(), |i, j| r[(i, j)] * sizes[j]).as_ref())
}

/// Moves the parameters that are not held until the predictions are those of the fit. Returns the largest remaining
/// difference, mm.
fn restore_predictions(problem: &Problem, fit: &Fit, held: &[usize], beta: &mut [f64]) -> Result<f64, Diagnostic> {
    let sizes = problem.parameters.sizes();
    let free: Vec<usize> = (0..sizes.len()).filter(|j| !held.contains(j)).collect();
    // The predictions of the fit in place of the readings.
    let mut predicted = problem.clone();
    for (test, residuals) in predicted.tests.iter_mut().zip(&fit.residuals) {
        if let Some(readings) = &mut test.readings {
            let observed = &mut Arc::make_mut(readings).observed;
            observed.iter_mut().zip(residuals).for_each(|(observed, residual)| *observed -= residual);
        }
    }
    let largest = |beta: &[f64]| {
        predicted.residuals(beta).into_iter().flatten().fold(0.0_f64, |largest, change| largest.max(change.abs()))
    };
    let mut change = largest(beta);
    for _ in 0..MAX_STEPS {
        if change < SAME_PREDICTION_MM {
            break;
        }
        let (r, c, _) = Triangle::new(sizes.len()).merged(&predicted.triangles(beta)?).parts();
        let scaled = Mat::from_fn(r.nrows(), free.len(), |i, k| r[(i, free[k])] * sizes[free[k]]);
        let step = Svd::of(scaled.as_ref())?.solve(&c, 0.0);
        let mut next = beta.to_vec();
        free.iter().zip(&step).for_each(|(j, step)| next[*j] += step * sizes[*j]);
        let after = largest(&next);
        if after >= change {
            break;
        }
        beta.copy_from_slice(&next);
        change = after;
    }
    Ok(change)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;

    use super::*;
    use crate::fit::prepare;

    /// All location errors of both rotary axes, of which the readings do not separate some. Three gauges hold different
    /// parameters and predict the same readings, with the same uncertainty of every reading.
    #[test]
    fn predictions_do_not_depend_on_the_gauge() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let names =
            ["X", "Y", "Z", "A", "B", "C"].into_iter().flat_map(|freedom| ["A", "C"].map(|axis| (freedom, axis)));
        session.unknowns =
            names.filter_map(|(f, axis)| abbe_model::component::ErrorName::parse(&format!("E{f}0{axis}"))).collect();
        let (problem, fit) = prepare(&session, 1).unwrap();
        let held_by_fit = fit.rank.null_space.ncols();
        assert!(held_by_fit > 0);
        let block = &problem.blocks()[0];
        let u_of = |beta: &[f64], covariance: &Mat<f64>| {
            let rows = problem.rows(&problem.slot_values(beta), block).unwrap();
            let jacobian = rows.subcols(0, beta.len()).to_owned();
            let variance = &jacobian * covariance * jacobian.transpose();
            (0..rows.nrows()).map(|i| variance[(i, i)].sqrt()).collect::<Vec<f64>>()
        };
        let expected_u = u_of(&fit.beta, &fit.covariance);
        let mut all_held = Vec::new();
        for gauge in [Gauge::OwnDirection, Gauge::Machine, Gauge::Identifier, Gauge::SetUp] {
            let base = base_parameters(&problem, &fit, gauge).unwrap();
            assert!(base.prediction_change_mm < 1e-9, "{gauge:?}: {:e}", base.prediction_change_mm);
            let residuals = problem.residuals(&base.beta);
            for (new, old) in residuals.iter().flatten().zip(fit.residuals.iter().flatten()) {
                assert!((new - old).abs() < 1e-9, "{gauge:?}: {new} {old}");
            }
            let u = u_of(&base.beta, &base.covariance);
            for (u, expected) in u.iter().zip(&expected_u) {
                assert!((u / (expected * fit.u_enlargement) - 1.0).abs() < 1e-3, "{gauge:?}: {u} {expected}");
            }
            assert!(base.held.iter().all(|j| base.beta[*j] == 0.0 && base.covariance[(*j, *j)] == 0.0));
            assert_eq!(base.held.len() + base.held_combinations, held_by_fit);
            all_held.push(base.held);
        }
        assert_ne!(all_held[0], all_held[3]);
    }
}
