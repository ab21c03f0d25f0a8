//! The bias of each error by undeclared effects, coefficient by coefficient, with what remains visible in the residual.
//!
//! The readings change by `c` per unit of an undeclared coefficient. With `J` the Jacobian of the estimated parameters,
//! `W` the weights and `P` the information of the priors,
//!
//! ```text
//! b = (JᵀWJ + P)⁻¹ JᵀW c      bias of the estimates per unit of the coefficient
//! e = c − J b                 what remains in the residual
//! ```
//!
//! Non-identifiable combinations keep their nominal value, as in a fit.

use std::collections::BTreeMap;
use std::sync::Arc;

use abbe_identify::error;
use abbe_identify::linear::{Linearisation, is_of_interest};
use abbe_identify::numerics::ranking::largest_first;
use abbe_identify::problem::Problem;
use abbe_identify::unit::ParameterUnit;
use abbe_model::Diagnostic;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::effect::shape::Harmonic;
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::parameter_id::{EffectId, ParameterId, Part};
use abbe_trace::candidates::columns::Columns;
use abbe_trace::candidates::library;
use faer::Mat;
use schemars::JsonSchema;
use serde::Serialize;

/// Highest order of the harmonics among the usual effects.
const MAX_ORDER: f64 = 2.0;
/// A bias below this share of the largest of all is a rounding error.
const ROUNDING_SHARE: f64 = 1e-9;

/// The biases of all identifiable errors by some effects.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BiasTable {
    /// The errors: the columns.
    pub errors: Vec<BiasedError>,
    /// The coefficients of the effects: the rows.
    pub rows: Vec<BiasRow>,
}

/// An error that the plan identifies.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BiasedError {
    /// Identifier: `EX0C`.
    pub id: String,
    /// Its unit: `um`, `arcsec`.
    pub unit: String,
}

/// The biases by one coefficient of an undeclared effect.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BiasRow {
    /// The effect: `EZC~C:h2`.
    pub effect: String,
    /// The coefficient: `EZC~C:h2.cos`.
    pub id: String,
    /// Unit of the coefficient.
    pub unit: String,
    /// Bias of each error, in its unit per unit of the coefficient.
    pub bias: Vec<f64>,
    /// Root mean square change of a reading per unit of the coefficient, µm.
    pub signal_um: f64,
    /// Root mean square of what remains in the residual, µm per unit of the coefficient.
    pub residual_um: f64,
}

impl BiasRow {
    /// The largest bias, without its sign.
    pub fn largest(&self) -> f64 {
        self.bias.iter().fold(0.0, |most, bias| bias.abs().max(most))
    }
}

impl BiasTable {
    /// The rows of the `count` effects with the largest bias, in descending order. An effect keeps all its
    /// coefficients.
    pub fn largest(mut self, count: usize) -> BiasTable {
        let mut largest: BTreeMap<&str, f64> = BTreeMap::new();
        for row in &self.rows {
            let most = largest.entry(&row.effect).or_default();
            *most = most.max(row.largest());
        }
        let mut order: Vec<(&str, f64)> = largest.into_iter().collect();
        order.sort_by(|a, b| largest_first((a.1, a.0), (b.1, b.0)));
        let rank: BTreeMap<String, usize> =
            order.iter().take(count).enumerate().map(|(place, (effect, _))| (effect.to_string(), place)).collect();
        self.rows.retain(|row| rank.contains_key(&row.effect));
        self.rows.sort_by_key(|row| rank[&row.effect]);
        self
    }
}

/// The effects that a bias table usually lists: location errors that the plan does not estimate, and harmonics of
/// orders 1 and 2 of each error motion over its own axis. Only those that the library has for this plan.
///
/// # Errors
/// If the library cannot be read.
pub fn usual_effects(problem: &Problem) -> Result<Vec<Effect>, Diagnostic> {
    let candidates = library::candidates(problem)?.into_iter().map(|candidate| candidate.effect);
    Ok(candidates.filter(is_usual).collect())
}

fn is_usual(effect: &Effect) -> bool {
    let Component::Axis(ErrorName { axis, kind, .. }) = &effect.component else { return false };
    match &effect.shape {
        Shape::Constant => *kind == ErrorKind::Location,
        Shape::Harmonic(Harmonic { order }) => *order <= MAX_ORDER && effect.driver.to_string() == *axis,
        _ => false,
    }
}

/// The biases by undeclared effects. Effects that change no reading are omitted.
///
/// # Errors
/// If the model or the columns of an effect cannot be computed.
pub fn bias_table(problem: &Problem, effects: &[Effect]) -> Result<BiasTable, Diagnostic> {
    let list = &problem.parameters.list;
    let nominal = vec![0.0; list.len()];
    let linear = Linearisation::of(problem, &nominal)?;
    let columns = Columns::new(problem, &nominal);
    let model = columns.model_rows(&nominal)?;
    let jacobian = model.as_ref().subcols(0, list.len());
    let errors: Vec<usize> =
        (0..list.len()).filter(|j| is_of_interest(&list[*j]) && linear.rank.is_identifiable(*j)).collect();
    let root = (columns.rows().max(1) as f64).sqrt();
    let whitened_um = problem.noise.innovation_mm() * problem.noise.inflation.sqrt() * 1e3;
    let mut rows = Vec::new();
    for effect in effects {
        let Some(set) = columns.effect_columns(effect) else {
            let (of, what) =
                (format!("`{}`: a test of the plan", effect.id()), format!("column for `{}`", effect.driver));
            let remedy = "give the column, or leave the effect out".to_string();
            return Err(error::missing(of, what, remedy));
        };
        let mut changes = Mat::zeros(columns.rows(), set.count);
        columns.fill(&[&set], changes.as_mut());
        let moved = &linear.covariance * (jacobian.transpose() * &changes);
        let remaining = &changes - jacobian * &moved;
        let id = Arc::new(EffectId::of(effect, 1));
        for (k, name) in effect.shape.coefficient_names().into_iter().enumerate() {
            let unit = ParameterUnit::of_effect(&problem.session, effect, k);
            let rms_um =
                |column: faer::ColRef<'_, f64>| column.norm_l2() / root * whitened_um / unit.display_per_internal;
            let signal_um = rms_um(changes.col(k));
            if signal_um == 0.0 {
                continue;
            }
            let bias = |j: &usize| moved[(*j, k)] * list[*j].unit.display_per_internal / unit.display_per_internal;
            rows.push(BiasRow {
                effect: effect.id(),
                id: ParameterId::Effect(Arc::clone(&id), Part::Coefficient(name)).to_string(),
                bias: errors.iter().map(bias).collect(),
                signal_um,
                residual_um: rms_um(remaining.col(k)),
                unit: unit.name,
            });
        }
    }
    let most = rows.iter().map(BiasRow::largest).fold(0.0, f64::max);
    let rounding = |value: &mut f64| *value = if value.abs() < ROUNDING_SHARE * most { 0.0 } else { *value };
    rows.iter_mut().flat_map(|row| &mut row.bias).for_each(rounding);
    let errors = errors.iter().map(|j| BiasedError { id: list[*j].id.to_string(), unit: list[*j].unit.name.clone() });
    Ok(BiasTable { errors: errors.collect(), rows })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::fit;
    use abbe_identify::noise::{Noise, NoiseSource};
    use abbe_identify::quantity::Given;
    use abbe_identify::simulate::{Simulation, simulate};

    use super::*;
    use crate::states;

    /// A session is simulated with 1 µm (1″) of each usual effect of a plan and fitted without it. The estimates are
    /// the biases of the table, and the residual is what the table says remains, both within 1 %.
    #[test]
    fn biases_are_those_of_fits_of_simulated_sessions() {
        for (name, count) in [("hermle-c600u/chapter5.toml", 8), ("r-test/plan.toml", 3)] {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions").join(name);
            let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
            session.resolution_mm = None;
            let sigma = session.noise_mm.unwrap();
            let plan = states::complete(&session, true).unwrap();
            let problem = states::problem_by_test(&plan, Noise::white(sigma, NoiseSource::Stated)).unwrap();
            let effects = usual_effects(&problem).unwrap();
            let table = bias_table(&problem, &effects).unwrap().largest(count);
            assert!(table.rows.len() >= count, "{name}: {} rows", table.rows.len());
            let every = std::env::var_os("ABBE_ALL_BIASES").is_some();
            for row in table.rows.iter().filter(|row| every || !row.id.ends_with(".sin")) {
                let mut with = session.clone();
                with.effects.extend(effects.iter().filter(|effect| effect.id() == row.effect).cloned());
                let given = vec![Given { id: row.id.clone(), value: 1.0, unit: row.unit.clone() }];
                let simulation = Simulation { given, noise_mm: Some(0.0), ..Simulation::default() };
                let readings = simulate(&with, &simulation).unwrap().readings;
                let (problem, found) = fit::prepare(&session.clone().with_readings(readings), 1).unwrap();
                let parameters = fit::parameters(&problem, &found);
                let largest = row.largest();
                for (error, bias) in table.errors.iter().zip(&row.bias) {
                    let fitted = parameters.iter().find(|parameter| parameter.id == error.id).unwrap().value;
                    assert!(
                        (fitted - bias).abs() <= 0.01 * bias.abs() + 1e-3 * largest,
                        "{name}: {} on {}: {fitted} {bias}",
                        row.id,
                        error.id
                    );
                }
                let residuals: Vec<f64> = found.residuals.iter().flatten().copied().collect();
                let rms_um = (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt() * 1e3;
                assert!((rms_um - row.residual_um).abs() <= 0.01 * row.signal_um, "{name}: {}", row.id);
            }
        }
    }
}
