//! Results of a found effect: name, numbers of the shape, parameters, curve.

use abbe_identify::fit::Fit;
use abbe_identify::parameters::Parameter;
use abbe_identify::problem::Problem;
use abbe_identify::results::Estimate;
use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::effect::description::{explanations, meaning};
use abbe_model::effect::{Effect, Shape};
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::Prior;
use faer::Mat;

use super::curve::{curve_of, curve_units};
use super::prediction::Predictions;
use super::{HeldOut, TraceFindings};
use crate::candidates::library::Family;
use crate::result::{AliasResult, EffectName, EffectResult, LargestOrder, PriorResult, ShapeParameter};

/// Largest exponent of a likelihood ratio that is a finite number.
const LARGEST_EXPONENT: f64 = 700.0;

/// The name of an effect in results.
pub fn effect_name(machine: &Machine, effect: &Effect) -> EffectName {
    EffectName {
        component: effect.component.to_string(),
        driver: effect.driver.to_string(),
        shape: effect.shape.word().to_string(),
        order: effect.shape.order(),
        tests: effect.tests.clone(),
        meaning: meaning(machine, effect).to_string(),
    }
}

/// A found effect with the results that its report needs.
pub(super) struct Found<'f> {
    /// Index among the effects of the model.
    pub number: usize,
    /// Index among the effects that the search has selected.
    pub selected: usize,
    /// Its candidate.
    pub candidate: usize,
    /// The model with the found effects and their aliases.
    pub after: &'f Problem,
    /// Its fit.
    pub after_fit: &'f Fit,
    /// All parameters after the search; their `u` cover the changes by aliases.
    pub parameters: &'f [Estimate],
    /// Decrease of the residual by the effect, µm.
    pub rms_gain_um: f64,
    /// The effects with which it is confounded.
    pub alias_effects: &'f [Effect],
    /// Increase of χ² and of the prior cost by each of these in its place.
    pub costs: &'f [[f64; 2]],
    /// The variants of the effect, then those of each of its aliases.
    pub variants: &'f [Vec<Effect>],
    /// The left-out tests that the effect and its aliases predict.
    pub predicted: &'f Predictions,
}

/// The results of a found effect.
pub(super) fn result(
    findings: &TraceFindings<'_>,
    families: &[Family],
    held_out: &HeldOut<'_>,
    found: &Found<'_>,
) -> Result<EffectResult, Diagnostic> {
    let (after, search) = (found.after, findings.search);
    let taken = search.selected()[found.selected];
    let candidate = &search.candidates[found.candidate];
    let number = found.number + findings.before.parameters.effects.len();
    let described = described(after, found.after_fit, number, found.parameters)?;
    let aliases: Vec<&Effect> = found.alias_effects.iter().collect();
    let mut explained = explained_by(described, after, &candidate.effect, &aliases, found.costs);
    let machine = &after.session.machine;
    let mut variants = found.variants.iter().map(|own| own.iter().map(|own| effect_name(machine, own)).collect());
    explained.variants = variants.next().unwrap_or_default();
    explained.aliases.iter_mut().zip(variants).for_each(|(alias, variants)| alias.variants = variants);
    Ok(EffectResult {
        family: families.get(candidate.family).map(|family| family.name.clone()).unwrap_or_default(),
        p_value: taken.p_value,
        rms_gain_um: found.rms_gain_um,
        heldout_rms_um: held_out.um(found.selected + 1),
        left_out_test_rms_um: found.predicted.found_um,
        aliases_left_out_test_rms_um: match found.predicted.found_um {
            Some(_) => found.predicted.aliases_um.clone(),
            None => Vec::new(),
        },
        ..explained
    })
}

/// The result of an effect with its aliases. `costs` are the increases of χ² and of the prior cost by each of these in its
/// place.
pub(super) fn explained_by(
    of_effect: EffectResult,
    problem: &Problem,
    effect: &Effect,
    aliases: &[&Effect],
    costs: &[[f64; 2]],
) -> EffectResult {
    let machine = &problem.session.machine;
    let alike = std::iter::once(effect).chain(aliases.iter().copied());
    let meanings: Vec<_> = alike.map(|effect| meaning(machine, effect)).collect();
    let ratio = |logarithm: f64| logarithm.min(LARGEST_EXPONENT).exp();
    let alias = |(effect, [delta_chi2, prior_cost]): (&&Effect, &[f64; 2])| AliasResult {
        name: effect_name(machine, effect),
        shape_parameters: shape_parameters_of(problem, effect, &[]),
        delta_chi2: *delta_chi2,
        likelihood_ratio: ratio(-0.5 * delta_chi2),
        prior_cost: *prior_cost,
        probability_ratio: ratio(-0.5 * delta_chi2 - prior_cost),
        variants: Vec::new(),
    };
    EffectResult {
        unique: aliases.is_empty(),
        explanation_count: meanings.len(),
        explanations: explanations(&meanings),
        aliases: aliases.iter().zip(costs).map(alias).collect(),
        ..of_effect
    }
}

/// The `number`-th effect of a fitted problem without the results of a search: name, numbers, parameters, prior, curve.
///
/// # Errors
/// If the model cannot be evaluated.
pub(super) fn described(
    problem: &Problem,
    fit: &Fit,
    number: usize,
    parameters: &[Estimate],
) -> Result<EffectResult, Diagnostic> {
    let (machine, effect) = (&problem.session.machine, &problem.parameters.effects[number]);
    let (curve_at_unit, curve_unit) = curve_units(problem, effect);
    let meaning = meaning(machine, effect);
    let own = fit.positions.iter().filter(|position| position.effect == number);
    let intervals: Vec<Option<[f64; 2]>> = own.map(|position| position.interval_95).collect();
    Ok(EffectResult {
        unit: problem.unit(),
        name: effect_name(machine, effect),
        family: String::new(),
        shape_parameters: shape_parameters_of(problem, effect, &intervals),
        parameters: parameters_of(problem, parameters, number),
        prior: prior_of(problem, fit, number),
        curve: curve_of(problem, fit, number),
        curve_at_unit,
        curve_unit,
        p_value: 1.0,
        rms_gain_um: 0.0,
        heldout_rms_um: 0.0,
        unique: true,
        variants: Vec::new(),
        explanation_count: 1,
        explanations: explanations(&[meaning]),
        aliases: Vec::new(),
        left_out_test_rms_um: None,
        aliases_left_out_test_rms_um: Vec::new(),
        separated_by: None,
        separation: None,
        separating_tests: Vec::new(),
    })
}

/// The prior of the coefficients of the `number`-th effect; `None` without one.
fn prior_of(problem: &Problem, fit: &Fit, number: usize) -> Option<PriorResult> {
    let own = |parameter: &&Parameter| parameter.coefficient_of() == Some(number);
    let first = problem.parameters.list.iter().find(own)?;
    let Prior::Gaussian(scale) = first.prior else { return None };
    let effect = &problem.parameters.effects[number];
    Some(PriorResult {
        scale: scale * first.unit.display_per_internal,
        unit: first.unit.name.clone(),
        family: effect.family(),
        effective_parameters: effective_parameters(problem, &fit.covariance, number)?,
        coefficients: effect.shape.coefficients(),
        largest_order: largest_order(problem, fit, number),
    })
}

/// The order of a spectrum with the largest amplitude; `None` for other shapes and for a single order.
fn largest_order(problem: &Problem, fit: &Fit, number: usize) -> Option<LargestOrder> {
    let Shape::Spectrum(spectrum) = problem.parameters.effects[number].shape else { return None };
    let own = |parameter: &Parameter| parameter.coefficient_of() == Some(number);
    let first = problem.parameters.list.iter().position(own)?;
    let display = problem.parameters.list[first].unit.display_per_internal;
    let squares: Vec<f64> =
        (0..spectrum.orders).map(|k| fit.beta[first + 2 * k].powi(2) + fit.beta[first + 2 * k + 1].powi(2)).collect();
    let (place, largest) = squares.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mean = (squares.iter().sum::<f64>() - largest) / spectrum.orders.checked_sub(1)? as f64;
    if mean <= 0.0 {
        return None;
    }
    let below = 1.0 - (-largest / mean).exp();
    Some(LargestOrder {
        order: place + 1,
        amplitude: largest.sqrt() * display,
        p_value: 1.0 - below.powi(spectrum.orders as i32),
    })
}

/// The parameters of the `number`-th effect.
fn parameters_of(problem: &Problem, parameters: &[Estimate], number: usize) -> Vec<Estimate> {
    let effect = problem.parameters.effect_ids.get(number);
    let is_own =
        |p: &&Estimate| p.id.parse::<ParameterId>().is_ok_and(|id| id.effect().is_some() && id.effect() == effect);
    parameters.iter().filter(is_own).cloned().collect()
}

/// The numbers and positions of the shape of an effect, with the intervals of the positions.
fn shape_parameters_of(problem: &Problem, effect: &Effect, of_positions: &[Option<[f64; 2]>]) -> Vec<ShapeParameter> {
    let unit = effect.driver_unit(&problem.session.machine);
    let number = |(name, values): (&str, Vec<f64>)| ShapeParameter {
        name: name.to_string(),
        values: values.into_iter().map(|value| unit.to_display(value)).collect(),
        intervals_95: of_positions.iter().map(|ends| ends.map(|ends| ends.map(|end| unit.to_display(end)))).collect(),
        // The number of a lag is its time constant.
        unit: if effect.shape.lag_s().is_some() { "s" } else { unit.result() }.to_string(),
    };
    effect.shape.reported().into_iter().map(number).collect()
}

/// Effective number of parameters of an effect with a prior: `m − Σ C_jj/τ²`. `None` for an effect without one.
pub(crate) fn effective_parameters(problem: &Problem, covariance: &Mat<f64>, effect: usize) -> Option<f64> {
    let mut effective = 0.0;
    let list = problem.parameters.list.iter().enumerate();
    for (j, parameter) in list.filter(|(_, parameter)| parameter.coefficient_of() == Some(effect)) {
        let Prior::Gaussian(scale) = parameter.prior else { return None };
        effective += 1.0 - (covariance[(j, j)] / (scale * scale)).min(1.0);
    }
    Some(effective)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::fit::prepare;
    use abbe_model::driver::Driver;
    use abbe_model::effect::shape::Polynomial;
    use abbe_model::effect::{CoefficientPrior, Component};

    use super::*;

    /// A coefficient whose variance is a quarter of that of its prior counts as three quarters. Effects count each their own.
    #[test]
    fn effective_parameters_are_those_of_one_effect() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let (mut problem, _) = prepare(&abbe_files::session(&file, &ReadOptions::default()).unwrap(), 1).unwrap();
        let scales = [Some(1e-3), Some(2e-3), None];
        for (name, scale) in ["EXC", "EYC", "EZC"].into_iter().zip(scales) {
            let shape = Shape::Polynomial(Polynomial { degree: 2, scale: 1.0 });
            let effect = Effect::new(Component::parse(name).unwrap(), Driver::parse("C"), shape);
            let prior = scale.map_or(CoefficientPrior::Flat, CoefficientPrior::Scale);
            problem.add_effect(&Effect { prior, ..effect }).unwrap();
        }
        let count = problem.parameters.list.len();
        let covariance = Mat::from_fn(count, count, |i, j| if i == j { 2.5e-7 } else { 0.0 });
        let coefficients = problem.parameters.effects[0].shape.coefficients() as f64;
        let effective = [0, 1, 2].map(|effect| effective_parameters(&problem, &covariance, effect));
        assert!((effective[0].unwrap() - 0.75 * coefficients).abs() < 1e-9, "{effective:?}");
        assert!((effective[1].unwrap() - 0.9375 * coefficients).abs() < 1e-9, "{effective:?}");
        assert_eq!(effective[2], None);
    }
}
