//! The parameters of the machine that have changed since the model was saved.
//!
//! A change `δ` of parameter `i` adds `J̃·eᵢ·δ` to the residual, whose covariance is `V = I + J̃·C·J̃ᵀ`. Generalised
//! least squares gives, with the information `S = J̃ᵀJ̃` of the session and its gradient `g = J̃ᵀr`,
//!
//! ```text
//! P = S·(I + C·S)⁻¹,   y = (I + S·C)⁻¹·g,   δ̂ = yᵢ/Pᵢᵢ,   u² = s²/Pᵢᵢ
//! ```
//!
//! `s²` is the variance of the residual that no parameter of the model can explain, at least 1. Changes are added one
//! by one, the most significant first, as long as the next one is significant at the level over all parameters
//! (Bonferroni).

use abbe_identify::numerics::solve::solve_square;
use abbe_identify::numerics::symmetric::pseudo_inverse;
use abbe_identify::numerics::tails::normal_tail;
use abbe_model::Diagnostic;
use faer::Mat;

use super::known::{KnownErrors, Linearised};
use crate::validate::MovedParameter;

/// Probability that a change is stated of a machine that has not changed.
const SIGNIFICANCE: f64 = 0.005;
/// Largest difference of χ² between a change and its alternatives.
const NEARLY: f64 = 4.0;
/// Least share of a parameter's information that must remain beside the selected ones.
const LEAST_SHARE: f64 = 1e-6;

/// The changed parameters, the most significant first.
///
/// # Errors
/// If the factor has entries that are not finite.
pub(super) fn moved(known: &KnownErrors<'_>, at: &Linearised) -> Result<Vec<MovedParameter>, Diagnostic> {
    let (r, c, rest) = at.machine.parts();
    let count = c.len();
    // Parameters in units of their physical size: angles and lengths have entries of a similar magnitude.
    let size = |i: usize| known.model.parameters[known.carried[i]].size;
    let r = Mat::from_fn(r.nrows(), count, |i, j| r[(i, j)] * size(j));
    let covariance = Mat::from_fn(count, count, |i, j| at.covariance[(i, j)] / (size(i) * size(j)));
    let information = r.transpose() * &r;
    let gradient = r.transpose() * Mat::from_fn(count, 1, |i, _| c[i]);
    let v = Mat::<f64>::identity(count, count) + &information * &covariance;
    let p = solve_square(v.as_ref(), information.as_ref());
    let y = solve_square(v.as_ref(), gradient.as_ref());
    let variance = (rest / at.freedom.saturating_sub(count).max(1) as f64).max(1.0);
    let candidates: Vec<usize> = (0..count).filter(|i| !known.model.parameters[known.carried[*i]].held).collect();
    let is_significant = |z: f64| two_sided(z / variance.sqrt(), candidates.len()) < SIGNIFICANCE;
    let mut selected: Vec<usize> = Vec::new();
    while let Some((next, z)) = best(&p, &y, &selected, &candidates)? {
        if !is_significant(z) {
            break;
        }
        selected.push(next);
    }
    // A change that later ones explain is withdrawn.
    let mut changes = changes_of(&p, &y, &selected)?;
    while let Some(k) = (0..selected.len()).min_by(|a, b| changes[*a].z().total_cmp(&changes[*b].z())) {
        if is_significant(changes[k].z()) {
            break;
        }
        selected.remove(k);
        changes = changes_of(&p, &y, &selected)?;
    }
    let mut alternatives = Vec::with_capacity(selected.len());
    for i in &selected {
        let others: Vec<usize> = selected.iter().copied().filter(|j| j != i).collect();
        alternatives.push(alternatives_of(*i, &separate(&p, &y, &others, &candidates)?));
    }
    let id = |i: usize| known.model.parameters[known.carried[i]].id.to_string();
    let mut moved: Vec<MovedParameter> = selected
        .iter()
        .zip(&changes)
        .zip(&alternatives)
        .map(|((i, change), alternatives)| {
            let parameter = &known.model.parameters[known.carried[*i]];
            MovedParameter {
                change: parameter.change(change.value * parameter.size, change.u * variance.sqrt() * parameter.size),
                p_value: two_sided(change.z() / variance.sqrt(), candidates.len()),
                alternatives: alternatives.iter().map(|j| id(*j)).collect(),
            }
        })
        .collect();
    let ratio = |moved: &MovedParameter| (moved.change.value / moved.change.u).abs();
    moved.sort_by(|a, b| ratio(b).total_cmp(&ratio(a)));
    Ok(moved)
}

/// A change in units of the physical size, and its standard uncertainty for a residual variance of 1.
struct Change {
    value: f64,
    u: f64,
}

impl Change {
    fn z(&self) -> f64 {
        (self.value / self.u).abs()
    }
}

/// The changes of the selected parameters, estimated together.
fn changes_of(p: &Mat<f64>, y: &Mat<f64>, selected: &[usize]) -> Result<Vec<Change>, Diagnostic> {
    let inverse = inverse_at(p, selected)?;
    let value = |k: usize| -> f64 { (0..selected.len()).map(|l| inverse[(k, l)] * y[(selected[l], 0)]).sum() };
    Ok((0..selected.len()).map(|k| Change { value: value(k), u: inverse[(k, k)].sqrt() }).collect())
}

/// The probability of a larger standard normal value by chance, in one of `count` tests.
fn two_sided(z: f64, count: usize) -> f64 {
    (2.0 * normal_tail(z.abs()) * count as f64).min(1.0)
}

/// The most significant change beside the selected ones, and its value over its uncertainty.
fn best(
    p: &Mat<f64>,
    y: &Mat<f64>,
    selected: &[usize],
    candidates: &[usize],
) -> Result<Option<(usize, f64)>, Diagnostic> {
    let found = separate(p, y, selected, candidates)?.into_iter();
    Ok(found.max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs())))
}

/// Each candidate beside the selected parameters, with its change over the uncertainty of the change.
fn separate(
    p: &Mat<f64>,
    y: &Mat<f64>,
    selected: &[usize],
    candidates: &[usize],
) -> Result<Vec<(usize, f64)>, Diagnostic> {
    let inverse = inverse_at(p, selected)?;
    let found = candidates.iter().filter(|i| !selected.contains(i)).filter_map(|&i| {
        let shares = |k: usize| -> f64 { (0..selected.len()).map(|l| inverse[(k, l)] * p[(selected[l], i)]).sum() };
        let (mut information, mut gradient) = (p[(i, i)], y[(i, 0)]);
        for (k, j) in selected.iter().enumerate() {
            information -= shares(k) * p[(*j, i)];
            gradient -= shares(k) * y[(*j, 0)];
        }
        // Beside collinear parameters nothing of its own remains.
        let is_separable = information > LEAST_SHARE * p[(i, i)] && information > 0.0;
        is_separable.then(|| (i, gradient / information.sqrt()))
    });
    Ok(found.collect())
}

/// The candidates that explain the readings nearly as well as one of them, the best first.
fn alternatives_of(chosen: usize, found: &[(usize, f64)]) -> Vec<usize> {
    let gain = found.iter().find(|(i, _)| *i == chosen).map_or(f64::INFINITY, |(_, z)| z * z);
    let mut others: Vec<&(usize, f64)> =
        found.iter().filter(|(i, z)| *i != chosen && z * z > gain - NEARLY && z * z > NEARLY).collect();
    others.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    others.into_iter().map(|(i, _)| *i).collect()
}

/// The inverse of `P` over the selected parameters, by way of a matrix with ones on its diagonal.
fn inverse_at(p: &Mat<f64>, selected: &[usize]) -> Result<Mat<f64>, Diagnostic> {
    let root = |i: usize| p[(selected[i], selected[i])].sqrt();
    let part = |i: usize, j: usize| 0.5 * (p[(selected[i], selected[j])] + p[(selected[j], selected[i])]);
    let count = selected.len();
    let inverse = pseudo_inverse(Mat::from_fn(count, count, |i, j| part(i, j) / (root(i) * root(j))).as_ref())?;
    Ok(Mat::from_fn(count, count, |i, j| inverse[(i, j)] / (root(i) * root(j))))
}
