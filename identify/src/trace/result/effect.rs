//! Results of a found effect: name, numbers of the shape, parameters, curve.

use abbe_model::chain::Machine;
use abbe_model::driver::DriverSample;
use abbe_model::effect::Effect;

use super::super::prediction::Predictions;
use super::{HeldOut, Moves, TraceFindings, alias_shifts};
use crate::candidates::library::Family;
use crate::fit::Fit;
use crate::parameters::Role;
use crate::problem::Problem;
use crate::results::{CurvePoint, EffectName, EffectResult, ParameterResult, ShapeParameter};
use abbe_model::effect::description::{explanations, meaning};

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
    /// Index among the found effects.
    pub number: usize,
    /// All parameters after the search; their `u` cover the changes by aliases.
    pub parameters: &'f [ParameterResult],
    /// Changes of the parameters by the aliases of each found effect.
    pub moves: &'f Moves,
    /// Decrease of the residual by the effect, µm.
    pub rms_gain_um: f64,
    /// The effects with which it is confounded.
    pub alias_effects: &'f [Effect],
    /// The left-out tests that the effect and its aliases predict.
    pub predicted: &'f Predictions,
}

/// The results of a found effect.
pub(super) fn result(
    findings: &TraceFindings<'_>,
    families: &[Family],
    held_out: &HeldOut<'_>,
    found: &Found<'_>,
) -> EffectResult {
    let (after, search) = (findings.after, findings.search);
    let taken = search.selected()[found.number];
    let candidate = &search.candidates[taken.candidate];
    let number = found.number + findings.before.parameters.effects.len();
    let (curve_at_unit, curve_unit) = curve_units(after, &candidate.effect);
    let machine = &after.session.machine;
    let alike = std::iter::once(&candidate.effect).chain(found.alias_effects);
    let meanings: Vec<_> = alike.map(|effect| meaning(machine, effect)).collect();
    EffectResult {
        name: effect_name(machine, &candidate.effect),
        family: families.get(candidate.family).map(|family| family.name.clone()).unwrap_or_default(),
        shape_parameters: shape_parameters_of(after, &candidate.effect),
        parameters: parameters_of(after, found.parameters, number),
        curve: curve_of(after, findings.after_fit, number, found.moves),
        curve_at_unit,
        curve_unit,
        p_value: taken.p_value,
        rms_gain_um: found.rms_gain_um,
        heldout_rms_um: held_out.um(found.number + 1),
        unique: found.alias_effects.is_empty(),
        explanation_count: meanings.len(),
        explanations: explanations(&meanings),
        aliases: (found.alias_effects.iter()).map(|effect| effect_name(machine, effect)).collect(),
        left_out_test_rms_um: found.predicted.found_um,
        aliases_left_out_test_rms_um: match found.predicted.found_um {
            Some(_) => found.predicted.aliases_um.clone(),
            None => Vec::new(),
        },
        separated_by: None,
        separation: None,
        separating_tests: Vec::new(),
    }
}

/// The parameters of the `number`-th effect.
fn parameters_of(problem: &Problem, parameters: &[ParameterResult], number: usize) -> Vec<ParameterResult> {
    let Some(id) = problem.parameters.effect_ids.get(number) else {
        return Vec::new();
    };
    let is_own = |p: &&ParameterResult| {
        p.id.strip_prefix(id.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    parameters.iter().filter(is_own).cloned().collect()
}

/// Number of points of a reported curve.
const CURVE_POINTS: usize = 73;

/// The points of a nonparametric curve with their standard uncertainty; empty for other shapes.
fn curve_of(problem: &Problem, fit: &Fit, number: usize, moves: &Moves) -> Vec<CurvePoint> {
    let Some(effect) = problem.parameters.effects.get(number) else {
        return Vec::new();
    };
    let Some([from, to]) = effect.shape.curve_ends() else {
        return Vec::new();
    };
    let places: Vec<usize> = (0..problem.parameters.list.len())
        .filter(|j| matches!(problem.parameters.list[*j].role, Role::Coefficient { effect, .. } if effect == number))
        .collect();
    let Some(first) = places.first() else {
        return Vec::new();
    };
    let outside = problem.parameters.list[*first].unit.display_per_internal;
    let at_outside = effect.driver_unit(&problem.session.machine).to_display(1.0);
    (0..CURVE_POINTS)
        .map(|k| {
            let q = from + (to - from) * k as f64 / (CURVE_POINTS - 1) as f64;
            let mut basis = Vec::new();
            effect.shape.basis(&DriverSample { value: q, ..DriverSample::default() }, &mut basis);
            let value_at = |beta: &[f64]| -> f64 { basis.iter().zip(&places).map(|(b, j)| b * beta[*j]).sum() };
            let value = value_at(&fit.beta);
            let variance: f64 = basis
                .iter()
                .zip(&places)
                .flat_map(|(b, j)| basis.iter().zip(&places).map(move |(c, l)| (b, j, c, l)))
                .map(|(b, j, c, l)| b * c * fit.covariance[(*j, *l)])
                .sum();
            let moved = alias_shifts(moves, &[value], |beta| vec![value_at(beta)], &fit.beta);
            CurvePoint {
                at: q * at_outside,
                value: value * outside,
                u: (variance.max(0.0).sqrt() * fit.u_enlargement).hypot(moved[0]) * outside,
            }
        })
        .collect()
}

/// Units of the positions and values of a curve; empty for other shapes.
fn curve_units(problem: &Problem, effect: &Effect) -> (String, String) {
    if effect.shape.curve_ends().is_none() {
        return (String::new(), String::new());
    }
    (
        effect.driver_unit(&problem.session.machine).result.to_string(),
        crate::unit::Unit::of_effect(&problem.session, effect, 0).name,
    )
}

/// The numbers and positions of the shape of an effect.
fn shape_parameters_of(problem: &Problem, effect: &Effect) -> Vec<ShapeParameter> {
    let unit = effect.driver_unit(&problem.session.machine);
    let number = |(name, values): (&str, Vec<f64>)| ShapeParameter {
        name: name.to_string(),
        values: values.into_iter().map(|value| unit.to_display(value)).collect(),
        unit: unit.result.to_string(),
    };
    effect.shape.reported().into_iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_model::driver::Driver;
    use abbe_model::effect::shape::Curve;
    use abbe_model::effect::{Component, Shape};
    use abbe_model::files::{self, ReadOptions};

    use super::*;
    use crate::fit::{fit, prepare};

    #[test]
    fn the_band_of_a_curve_is_enlarged_as_every_uncertainty_is_and_covers_what_aliases_move() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = files::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, _) = prepare(&session, 1).unwrap();
        let turn = 360_f64.to_radians();
        problem
            .add_effect(&Effect::new(
                Component::parse("EZC").unwrap(),
                Driver::parse("C"),
                Shape::Curve(Curve { from: 0.0, to: turn, intervals: 6, closed: false }),
            ))
            .unwrap();
        let mut fit = fit(&problem, None).unwrap();
        let number = problem.parameters.effects.len() - 1;
        fit.u_enlargement = 1.0;
        let by_noise = curve_of(&problem, &fit, number, &[]);
        fit.u_enlargement = 1.5;
        let enlarged = curve_of(&problem, &fit, number, &[]);
        assert_eq!(by_noise.len(), CURVE_POINTS);
        for (by_noise, enlarged) in by_noise.iter().zip(&enlarged) {
            assert!(by_noise.u > 0.0);
            assert!((enlarged.u / by_noise.u - 1.5).abs() < 1e-12);
            assert_eq!(enlarged.value, by_noise.value);
        }

        // The splines sum to one: an alias that changes all coefficients by 1 µm changes the curve by 1 µm.
        let of_curve =
            |j: usize| matches!(problem.parameters.list[j].role, Role::Coefficient { effect, .. } if effect == number);
        let alias: Vec<f64> = (0..fit.beta.len()).map(|j| if of_curve(j) { 1e-3 } else { 0.0 }).collect();
        let covered = curve_of(&problem, &fit, number, &[vec![alias]]);
        for (enlarged, covered) in enlarged.iter().zip(&covered) {
            assert!((covered.u - enlarged.u.hypot(1.0)).abs() < 1e-9);
            assert_eq!(covered.value, enlarged.value);
        }
    }
}
