//! Differences between models of one machine: before and after a compensation, a collision, a year.
//!
//! ```text
//! δ = β_B − β_A,    Cov(δ) = C_A + C_B − C_AB − C_ABᵀ
//! ```
//!
//! `C_AB` is not zero if both sessions share a set-up, such as a bar with its calibrated length. Parameters that one of
//! the two sessions does not separate have no difference of their own. Both models are brought to one gauge first: it
//! holds the pivots of both null spaces together.
//!
//! A difference is significant if Holm's step-down procedure rejects that it is zero (Holm, S.: A simple sequentially
//! rejective multiple test procedure, Scand. J. Statist. 6 (1979) 65), so that the probability of any false claim is at
//! most the level.
//!
//! - `inputs`: sessions and models with the same parameters; `shared`: the covariance of two models with a common
//!   set-up, which the readings test; `gauge`: one gauge for both; `single`: one change that explains all differences;
//! - [`workspace`]: the volumetric error of each model over the common range;
//! - [`results`]: the reported comparison.

mod gauge;
mod inputs;
pub mod results;
mod shared;
mod single;
pub mod workspace;

use std::collections::BTreeMap;

use abbe_identify::error;
use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use faer::Mat;

use abbe_identify::model_file::IdentifiedModel;
use abbe_identify::numerics::symmetric::Symmetric;
use abbe_identify::numerics::tails::{chi_square_tail, normal_tail};
use abbe_trace::validate::machine::differences;
pub use inputs::{Input, compare_inputs};
pub use results::ComparisonStatement;
use results::{Comparison, Difference, NotComparable, OnlyIn, Pair};
use shared::SharedDifference;

/// Probability of any false claim of a difference between two models, if the caller states none.
pub const SIGNIFICANCE: f64 = 0.05;
/// Eigenvalues of a covariance in units of its variances below this share of the largest one are rounding.
const LEAST_EIGENVALUE: f64 = 1e-9;

/// What is compared, and how.
#[derive(Clone, Debug)]
pub struct CompareOptions {
    /// Probability of any false claim of a difference between two models.
    pub significance: f64,
    /// Set-up quantities that are the same objects in both sessions: `bar`, `workpiece_ball`, `spindle_ball`. `None`:
    /// bars of the same name with the same prior. Those that the readings show to be different objects are not shared.
    pub shared: Option<Vec<String>>,
    /// Places along each axis at which the volumetric error is evaluated; 0 for none.
    pub places: usize,
}

impl Default for CompareOptions {
    fn default() -> Self {
        CompareOptions { significance: SIGNIFICANCE, shared: None, places: workspace::PLACES }
    }
}

/// A model with its name in results.
pub struct Named<'m> {
    /// The file.
    pub name: String,
    /// The model.
    pub model: &'m IdentifiedModel,
}

/// Checks that two inputs, each with its name, are of one machine.
///
/// # Errors
/// If chain, axes, rotation convention or gravity differ, with what differs.
pub fn one_machine(a: (&str, &Machine), b: (&str, &Machine)) -> Result<(), Diagnostic> {
    let apart = differences(a.1, b.1, [a.0, b.0]);
    if apart.is_empty() {
        return Ok(());
    }
    let (one, other) = (b.0.to_string(), a.0.to_string());
    Err(error::unlike(one, "of one machine with", other, apart.join("; ")))
}

/// Two models in which nothing can be compared.
fn apart(a: &Named<'_>, b: &Named<'_>, difference: &str) -> Diagnostic {
    let (one, other) = (b.name.clone(), a.name.clone());
    error::unlike(one, "comparable with", other, difference)
}

/// Compares each model with the first one.
///
/// # Errors
/// If there are fewer than two models, they are not of one machine, or nothing in them can be compared.
pub fn compare(models: &[Named<'_>], options: &CompareOptions) -> Result<Comparison, Diagnostic> {
    let (Some(first), Some(others @ [_, ..])) = (models.first(), models.get(1..)) else {
        let (purpose, found) = ("a comparison", models.len());
        return Err(error::too_few(purpose, "models or sessions", 2, found));
    };
    let mut comparison = Comparison {
        significance: options.significance,
        inputs: models.iter().map(|named| named.name.clone()).collect(),
        ..Comparison::default()
    };
    for other in others {
        one_machine((&first.name, &first.model.machine), (&other.name, &other.model.machine))?;
        let pair = pair(first, other, options)?;
        comparison.differences.extend(pair.differences);
        comparison.pairs.push(pair.summary);
    }
    if options.places > 0 {
        let models: Vec<&IdentifiedModel> = models.iter().map(|named| named.model).collect();
        comparison.workspace = workspace::evaluate(&models, options.places)?;
    }
    Ok(comparison)
}

/// The comparison of two models.
struct Compared {
    differences: Vec<Difference>,
    summary: Pair,
}

fn pair(a: &Named<'_>, b: &Named<'_>, options: &CompareOptions) -> Result<Compared, Diagnostic> {
    let common = common(a.model, b.model);
    if common.is_empty() {
        return Err(apart(a, b, "no parameter of the machine is in common; identify the same errors in both"));
    }
    let SharedDifference { mut delta, mut covariance, shared, refuted } =
        shared::difference(a.model, b.model, &common, options.shared.as_deref())?;
    let (held, transfer) = gauge::one_gauge(a.model, b.model, &common, &mut delta, &mut covariance)?;
    let id = |k: usize| a.model.parameters[common[k].0].id.to_string();
    let mut differences = Vec::new();
    for k in (0..common.len()).filter(|k| !held.contains(k)) {
        let u = covariance[(k, k)].max(0.0).sqrt();
        if u == 0.0 {
            continue;
        }
        differences.push(Difference {
            from: a.name.clone(),
            to: b.name.clone(),
            change: a.model.parameters[common[k].0].change(delta[k], u),
            p_value: (2.0 * normal_tail((delta[k] / u).abs())).min(1.0),
            significant: false,
        });
    }
    holm(&mut differences, options.significance);
    let kept: Vec<usize> = (0..common.len()).filter(|k| !held.contains(k) && covariance[(*k, *k)] > 0.0).collect();
    if kept.is_empty() {
        let difference = "no parameter of the machine is determined by both, so nothing can be compared; measure what \
                          separates the errors, or identify fewer of them";
        return Err(apart(a, b, difference));
    }
    let metric = Metric::of(&covariance, &kept)?;
    let chi_square: f64 = metric.whitened(&delta).iter().map(|value| value * value).sum();
    let degrees_of_freedom = metric.rank();
    let only = |own: &IdentifiedModel, of: &Named<'_>, side: fn(&(usize, usize)) -> usize| -> Vec<OnlyIn> {
        let missing = own.carried_parameters().into_iter().filter(|j| !common.iter().any(|pair| side(pair) == *j));
        let mut ids: BTreeMap<String, ()> = BTreeMap::new();
        for j in missing.filter(|j| !own.parameters[*j].held) {
            let absent = &own.parameters[j];
            let id = absent.effect.map_or_else(|| absent.id.to_string(), |effect| own.effects[effect].id());
            ids.insert(id, ());
        }
        ids.into_keys().map(|id| OnlyIn { id, model: of.name.clone() }).collect()
    };
    let mut only_in = only(a.model, a, |pair| pair.0);
    only_in.extend(only(b.model, b, |pair| pair.1));
    differences.sort_by(|x, y| x.p_value.total_cmp(&y.p_value));
    let significant = differences.iter().filter(|difference| difference.significant).count();
    let single_changes = match significant {
        0 => Vec::new(),
        _ => single::explanations(a, &common, &delta, &transfer, &metric),
    };
    let summary = Pair {
        from: a.name.clone(),
        to: b.name.clone(),
        compared: kept.len(),
        judged: true,
        significant,
        single_changes,
        chi_square,
        degrees_of_freedom,
        p_value: chi_square_tail(chi_square, degrees_of_freedom as f64),
        shared_setup: shared,
        not_shared: refuted,
        not_comparable: held.iter().map(|k| NotComparable { id: id(*k) }).collect(),
        only_in,
    };
    Ok(Compared { differences, summary })
}

/// The parameters of the machine that both models have, by index in each.
fn common(a: &IdentifiedModel, b: &IdentifiedModel) -> Vec<(usize, usize)> {
    let carried = b.carried_parameters();
    let same = |i: usize, j: usize| {
        let (p, q) = (&a.parameters[i], &b.parameters[j]);
        p.id == q.id
            && match (p.effect, q.effect) {
                (Some(e), Some(f)) => a.effects[e].is_same_but_for_numbers(&b.effects[f]),
                _ => true,
            }
    };
    let pairs = a.carried_parameters().into_iter();
    pairs.filter_map(|i| carried.iter().copied().find(|j| same(i, *j)).map(|j| (i, j))).collect()
}

/// Holm's procedure: the smallest p-value against `level/n`, the next against `level/(n − 1)`, … until one is not
/// rejected.
fn holm(differences: &mut [Difference], level: f64) {
    let mut order: Vec<usize> = (0..differences.len()).collect();
    order.sort_by(|i, j| differences[*i].p_value.total_cmp(&differences[*j].p_value));
    let count = order.len();
    for (rank, index) in order.into_iter().enumerate() {
        if differences[index].p_value * (count - rank) as f64 > level {
            break;
        }
        differences[index].significant = true;
    }
}

/// The metric of `Cov(δ)⁺` over the kept parameters.
struct Metric<'k> {
    kept: &'k [usize],
    /// One row for each direction that the covariance determines.
    root: Vec<Vec<f64>>,
}

impl Metric<'_> {
    fn of<'k>(covariance: &Mat<f64>, kept: &'k [usize]) -> Result<Metric<'k>, Diagnostic> {
        let u: Vec<f64> = kept.iter().map(|k| covariance[(*k, *k)].sqrt()).collect();
        let scaled = Mat::from_fn(kept.len(), kept.len(), |i, j| covariance[(kept[i], kept[j])] / (u[i] * u[j]));
        let eigen = Symmetric::of(scaled.as_ref())?;
        let largest = eigen.values.iter().copied().fold(0.0, f64::max);
        let directions = eigen.values.iter().zip(eigen.vectors.col_iter());
        let directions = directions.filter(|(value, _)| **value > LEAST_EIGENVALUE * largest);
        let row = |value: f64, vector: &[f64]| vector.iter().zip(&u).map(|(v, u)| v / (u * value.sqrt())).collect();
        let root =
            directions.map(|(value, vector)| row(*value, &vector.iter().copied().collect::<Vec<f64>>())).collect();
        Ok(Metric { kept, root })
    }

    /// Number of directions.
    fn rank(&self) -> usize {
        self.root.len()
    }

    /// A vector over the common parameters in independent units of its uncertainty.
    fn whitened(&self, of: &[f64]) -> Vec<f64> {
        let along = |row: &Vec<f64>| self.kept.iter().zip(row).map(|(k, share)| of[*k] * share).sum();
        self.root.iter().map(along).collect()
    }
}

#[cfg(test)]
mod tests;
