//! Results of a finished search.

mod curve;
mod effect;
mod families;
mod prediction;
mod rejected;
mod unsearched;
mod verdict;

use abbe_model::effect::Effect;

use super::alias::{self, Alias, CompetingEffect};
use super::remainder::Structure;
use super::start::Start;
use super::state::SearchState;
use crate::candidates::library;
use crate::error::IdentifyError;
use crate::fit::{self, Fit};
use crate::heldout::figures::cross_validation;
use crate::heldout::{mislabelled_runs, rms_mm};
use crate::noise;
use crate::plausibility::Plausibility;
use crate::problem::Problem;
use crate::results::{
    ChangedParameter, EffectResult, ModelResult, ParameterResult, TraceResult, phases_follow_amplitudes,
};
pub(crate) use effect::effect_name;
pub(super) use families::{FamiliesEnded, outcome_with_families};
pub(super) use unsearched::unsearched;
use verdict::{not_examined, verdict};

/// The end state of a search.
pub(super) struct TraceFindings<'f> {
    pub before: &'f Problem,
    pub before_fit: &'f Fit,
    pub after: &'f Problem,
    pub after_fit: &'f Fit,
    pub search: &'f SearchState<'f>,
    pub start: &'f Start,
    pub structure_before: Option<&'f Structure>,
    pub structure_after: Option<&'f Structure>,
    pub last_p_value: f64,
    /// Whether the search was ended by its cap or by an interruption, not by the evidence.
    pub stopped_early: bool,
    /// Whether it was interrupted.
    pub interrupted: bool,
    pub candidates: usize,
    pub candidates_seen: usize,
}

/// The result, with the data that reports need.
pub(super) struct ReportedEffect {
    pub result: TraceResult,
    pub alias_effects: Vec<Vec<Effect>>,
    pub competing_effects: Vec<Vec<CompetingEffect>>,
}

/// The result, and for each effect its aliases and the best competing effects.
pub(super) fn report(findings: &TraceFindings<'_>) -> Result<ReportedEffect, IdentifyError> {
    let TraceFindings { before, before_fit, after, after_fit, search, .. } = findings;
    let before_result = before_result(findings)?;
    let held_out = HeldOut::of(search, before_result.heldout_rms_um);
    let mut after_result = model_result(after, after_fit, held_out.last_um() * 1e-3)?;

    let mut alias_effects: Vec<Vec<Effect>> = Vec::new();
    let mut competing_effects = Vec::new();
    let mut gains = Vec::new();
    let mut moves = Vec::new();
    let mut predicted = Vec::new();
    let mut delta_chi2 = Vec::new();
    let variance = residual_variance(findings);
    for (k, taken) in search.selected().iter().enumerate() {
        let model = search.model_without(Some(k))?;
        let (mut aliases, of_effect) = alias::aliases(search, k, &model, variance)?;
        predicted.push(prediction::predictions(findings, k, &mut aliases)?);
        competing_effects.push(of_effect);
        let named = model.with_candidate(taken.candidate)?.0;
        let effect_of = |alias: &Alias| search.effect(alias.candidate).clone();
        alias_effects.push(aliases.iter().map(effect_of).collect());
        delta_chi2.push(aliases.iter().map(|alias| alias.delta_chi2).collect::<Vec<_>>());
        let in_its_place = |alias: &Alias| moves_by(findings, k, &alias.model_coefficients, &named);
        moves.push(aliases.iter().map(in_its_place).collect::<Vec<_>>());
        gains.push(model.gain(taken.candidate)?.gain);
    }
    cover(&mut after_result.parameters, after, after_fit, &moves);
    after_result.covariance = fit::covariance_of_parameters(after, after_fit, &after_result.parameters);
    let families = library::families()?;
    let effects: Vec<EffectResult> = (0..moves.len())
        .map(|k| {
            let reported = effect::Found {
                number: k,
                parameters: &after_result.parameters,
                moves: &moves,
                rms_gain_um: (gains[k] / held_out.rows).sqrt() * before.noise.sigma_mm * 1e3,
                alias_effects: &alias_effects[k],
                delta_chi2: &delta_chi2[k],
                predicted: &predicted[k],
            };
            effect::result(findings, &families, &held_out, &reported)
        })
        .collect();
    let (verdict, remainder) = verdict(findings, &effects);
    let mut warnings = before.session.warnings.clone();
    warnings.extend(noise::stated_against_repeats(before, &before_fit.residuals));
    warnings.extend(mislabelled_runs(&before.tests));
    let changed_parameters = changed_parameters(&before_result.parameters, &after_result.parameters);
    let unique = effects.iter().all(|effect| effect.unique);
    let mut result = TraceResult {
        verdict,
        interrupted: false,
        time_limit_s: None,
        unique,
        noise_um: after.noise.sigma_mm * 1e3,
        noise_source: after.noise.source.word().to_string(),
        noise_ar_coefficients: after.noise.ar_coefficients.clone(),
        readings: after.readings(),
        heldout_by: before.folds.kind.words().to_string(),
        before: before_result,
        after: after_result,
        effects,
        remainder,
        residual_before: match findings.structure_before {
            Some(structure) if structure.is_significant() => structure.description.clone(),
            // Detectors examine one test at a time; the search sums the evidence of all tests for one effect.
            Some(_) if !search.selected().is_empty() => {
                "structure that no single test shows beyond noise; the search over all tests finds it".to_string()
            }
            Some(_) => "no structure beyond noise".to_string(),
            None => "independent poses: structure is looked for effect by effect".to_string(),
        },
        rejected_candidates: rejected::candidates(&before.session.machine, search, &held_out),
        changed_parameters,
        candidates: findings.candidates,
        candidates_detectable: findings.candidates_seen,
        unobservable: fit::unobservable(after, &after_fit.rank),
        null_space: fit::null_space(after, &after_fit.rank),
        outliers: fit::outliers(after, after_fit),
        conformity: None,
        plausibility: Plausibility::default(),
        warnings,
        about: before.session.about.iter().cloned().collect(),
    };
    if findings.interrupted {
        result.mark_interrupted();
    }
    Ok(ReportedEffect { result, alias_effects, competing_effects })
}

/// Held-out errors in µm. The held-out error of the declared model converts whitened sums of squares to µm.
struct HeldOut<'s> {
    sums: &'s [f64],
    /// Whitened rows.
    rows: f64,
    scale_um: f64,
}

impl<'s> HeldOut<'s> {
    fn of(search: &'s SearchState<'_>, before_um: f64) -> HeldOut<'s> {
        let rows = search.columns.rows().max(1) as f64;
        let first = search.selection.held_out.first().copied().unwrap_or(1.0);
        HeldOut {
            sums: &search.selection.held_out,
            rows,
            scale_um: before_um / (first / rows).sqrt().max(f64::MIN_POSITIVE),
        }
    }

    /// With this number of effects.
    fn um(&self, effects: usize) -> f64 {
        let sum = self.sums.get(effects).or(self.sums.last());
        (sum.copied().unwrap_or(1.0) / self.rows).sqrt() * self.scale_um
    }

    fn last_um(&self) -> f64 {
        self.um(self.sums.len())
    }
}

/// Variance for the comparison of aliases, relative to that of the noise. For poses it is that of the remaining
/// residual.
fn residual_variance(findings: &TraceFindings<'_>) -> f64 {
    if !findings.search.policy.in_residual_variance {
        return 1.0;
    }
    let residuals = findings.after_fit.residuals.iter().flatten();
    // The evidence uses the noise of the search.
    let sigma_mm = findings.before.noise.sigma_mm;
    let sum: f64 = residuals.map(|v| (v / sigma_mm).powi(2)).sum();
    (sum / findings.search.columns.rows().max(1) as f64).max(1.0)
}

/// The declared model, on the readings that are not excluded after the search.
fn before_result(findings: &TraceFindings<'_>) -> Result<ModelResult, IdentifyError> {
    let (before, fit, after) = (findings.before, findings.before_fit, findings.after);
    let result = model_result(before, fit, fit.held_out.rms_mm)?;
    if before.rejected == after.rejected {
        return Ok(result);
    }
    let [rms_um, heldout_rms_um] =
        [&fit.residuals, &fit.held_out.residuals].map(|residuals| rms_mm(after, residuals) * 1e3);
    let in_3d = |rms: f64| result.rms_3d_um.map(|_| rms * 3.0_f64.sqrt());
    let cross_validation = cross_validation(before, fit, heldout_rms_um * 1e-3, after)?;
    Ok(ModelResult {
        rms_um,
        heldout_rms_um,
        rms_3d_um: in_3d(rms_um),
        heldout_rms_3d_um: in_3d(heldout_rms_um),
        cross_validation,
        ..result
    })
}

pub(super) fn model_result(problem: &Problem, fit: &Fit, held_out_mm: f64) -> Result<ModelResult, IdentifyError> {
    let three = problem.coordinates() == 3;
    let rms = rms_mm(problem, &fit.residuals) * 1e3;
    let held = held_out_mm * 1e3;
    let in_3d = |rms: f64| three.then(|| rms * 3.0_f64.sqrt());
    let parameters = fit::parameters(problem, fit);
    Ok(ModelResult {
        cross_validation: cross_validation(problem, fit, held_out_mm, problem)?,
        rms_um: rms,
        heldout_rms_um: held,
        rms_3d_um: in_3d(rms),
        heldout_rms_3d_um: in_3d(held),
        noise_um: problem.noise.sigma_mm * 1e3,
        rank: fit.rank.identifiable_basis.ncols(),
        parameter_count: fit.beta.len(),
        chi_square: fit.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        identifiable: fit::ids(&parameters),
        covariance: fit::covariance_of_parameters(problem, fit, &parameters),
        parameters,
    })
}

/// Changes of the parameters after the search, internal units: by found effect, by alias that replaces it, by
/// parameter.
type Moves = [Vec<Vec<f64>>];

/// Changes of functions of the parameters: the root sum of squares over the effects of the largest change by one of
/// their aliases.
fn alias_shifts(moves: &Moves, present: &[f64], values: impl Fn(&[f64]) -> Vec<f64>, beta: &[f64]) -> Vec<f64> {
    let mut squares = vec![0.0; present.len()];
    for of_effect in moves {
        let mut largest = vec![0.0_f64; present.len()];
        for moves in of_effect {
            let moved: Vec<f64> = beta.iter().zip(moves).map(|(value, by)| value + by).collect();
            for (most, (moved, present)) in largest.iter_mut().zip(values(&moved).iter().zip(present)) {
                *most = most.max((moved - present).abs());
            }
        }
        squares.iter_mut().zip(largest).for_each(|(sum, most)| *sum += most * most);
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// Enlarges the uncertainties to cover the changes by aliases.
fn cover(parameters: &mut [ParameterResult], problem: &Problem, fit: &Fit, moves: &Moves) {
    let quantities = fit::quantities(problem, &fit.rank);
    let values = |beta: &[f64]| {
        let mut values = Vec::with_capacity(parameters.len());
        fit::values_at(problem, fit, &quantities, beta, |value| values.push(value));
        values
    };
    let moved = alias_shifts(moves, &values(&fit.beta), values, &fit.beta);
    for (parameter, moved) in parameters.iter_mut().zip(moved) {
        let mut u = parameter.u.hypot(moved);
        if parameter.id.ends_with(".phase") {
            u = u.min(fit::u_of_undetermined_phase_deg());
        }
        parameter.set_u(u);
    }
    phases_follow_amplitudes(parameters);
}

/// Changes of the parameters if an alias replaces the `k`-th effect, internal units. `in_place` and `named` are the
/// coefficients of the model without that effect, fitted together with the alias and with the effect. The coefficients
/// of the effect itself do not change: the alias has none of them.
fn moves_by(findings: &TraceFindings<'_>, k: usize, in_place: &[f64], named: &[f64]) -> Vec<f64> {
    let (search, to_unknowns) = (findings.search, &findings.start.to_parameters);
    let by: Vec<f64> = in_place.iter().zip(named).map(|(a, b)| a - b).collect();
    let (of_declared, of_found) = by.split_at(search.moments.rank());
    // The parameters of the declared model come first, then the found effects in their order.
    let mut moves: Vec<f64> = (0..to_unknowns.nrows())
        .map(|j| of_declared.iter().enumerate().map(|(k, by)| to_unknowns[(j, k)] * by).sum())
        .collect();
    let mut of_found = of_found.iter();
    for (l, taken) in search.selected().iter().enumerate() {
        for _ in 0..search.moments.count(taken.candidate) {
            let by = if l == k { None } else { of_found.next() };
            moves.push(by.copied().unwrap_or(0.0));
        }
    }
    debug_assert_eq!(moves.len(), findings.after_fit.beta.len());
    moves
}

/// Parameters that changed by more than their standard uncertainty.
fn changed_parameters(before: &[ParameterResult], after: &[ParameterResult]) -> Vec<ChangedParameter> {
    before
        .iter()
        .filter_map(|b| {
            let a = after.iter().find(|a| a.id == b.id)?;
            ((a.value - b.value).abs() > a.u).then(|| ChangedParameter {
                id: a.id.clone(),
                change: a.value - b.value,
                u: a.u,
                unit: a.unit.clone(),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_that_change_by_more_than_their_uncertainty_are_listed() {
        let parameter = |id: &str, value: f64, u: f64| ParameterResult::new(id, value, u, "um");
        let before = [parameter("EX0C", 3.0, 0.1), parameter("EY0C", 3.0, 0.1), parameter("EZ0A", 1.0, 0.1)];
        let after = [parameter("EX0C", 1.0, 1.5), parameter("EY0C", 1.0, 2.5)];
        let changed = changed_parameters(&before, &after);
        assert_eq!(changed.len(), 1);
        assert_eq!((changed[0].id.as_str(), changed[0].change, changed[0].u), ("EX0C", -2.0, 1.5));
    }
}
