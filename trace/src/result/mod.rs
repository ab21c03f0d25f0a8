//! Results of a finished search.

mod build;
mod curve;
mod effect;
mod poses;
mod prediction;
mod reported;
mod verdict;

use abbe_identify::fit::{self, Fit, JudgedBy, prepare_with};
use abbe_identify::problem::Problem;
use abbe_identify::results::{Estimate, ParameterChange};
use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::words::listed;
pub(super) use build::unsearched;
use build::{Model, Searched, Statements, build};
pub use effect::effect_name;
pub(super) use effect::effective_parameters;
use faer::prelude::Solve;
use faer::{Mat, Side};
pub(super) use poses::{PosesEnded, outcome_of_poses};
pub use reported::{
    AliasResult, AlternativeResult, CurvePoint, EffectName, EffectResult, LargestOrder, PriorResult, RejectedCandidate,
    Remainder, SeparatingTestResult, SeparationResult, ShapeParameter, TraceResult,
};
use verdict::verdict;

use super::TraceOutcome;
use super::alias::{self, Alias, CompetingEffect};
use super::judge::{noise_is_from_search, with_noise_of_fit};
use super::remainder::Structure;
use super::state::{ALL, SearchState};
use crate::candidates::gain::Projected;
use crate::candidates::library;
use crate::constants::MORE_PROBABLE;
use crate::paired::HeldOutDecrease;

/// Share of a signal that remains beside the declared model below which the model contains it.
const CONTAINED: f64 = 0.01;
/// Decrease of χ² up to which an effect explains nothing: that of one coefficient of 2 standard uncertainties.
const EXPLAINS_NOTHING: f64 = 4.0;

/// The end state of a search.
pub(super) struct TraceFindings<'f> {
    pub before: &'f Problem,
    pub before_fit: &'f Fit,
    pub after: &'f Problem,
    pub after_fit: &'f Fit,
    pub search: &'f SearchState<'f>,
    /// Explanations that the user accepts.
    pub assume: &'f [String],
    /// Seed of the folds.
    pub seed: u64,
    pub structure_before: Option<&'f Structure>,
    pub structure_after: Option<&'f Structure>,
    pub last_p_value: f64,
    /// Whether the search was ended by its cap or by an interruption, not by the evidence.
    pub stopped_early: bool,
    /// Whether it was interrupted.
    pub interrupted: bool,
    pub candidates: usize,
    pub candidates_seen: usize,
    /// Warnings about the options.
    pub warnings: Vec<String>,
}

/// The result, with the data that reports need.
pub(super) struct ReportedEffect {
    pub after: Problem,
    pub after_fit: Fit,
    pub result: TraceResult,
    pub alias_effects: Vec<Vec<Effect>>,
    pub competing_effects: Vec<Vec<CompetingEffect>>,
}

/// The result, and for each effect its aliases and the best competing effects.
pub(super) fn report(findings: &TraceFindings<'_>) -> Result<ReportedEffect, Diagnostic> {
    let TraceFindings { before, before_fit, search, .. } = findings;
    // On the readings that are not excluded after the search.
    let by_last = Some(JudgedBy { readings: findings.after, heldout_mm: None });
    let of_fit = with_noise_of_fit(before, before_fit)?;
    let (declared, declared_fit) = of_fit.as_ref().map_or((*before, *before_fit), |(problem, fit)| (problem, fit));
    let declared = Model::of(declared, declared_fit, false, by_last)?;
    let held_out = HeldOut::of(search, declared.figures.fit.heldout_rms_um);
    let mut alias_effects: Vec<Vec<Effect>> = Vec::new();
    let mut competing_effects = Vec::new();
    let mut gains = Vec::new();
    let mut chosen_candidates = Vec::new();
    let mut predicted = Vec::new();
    let mut costs = Vec::new();
    let (mut covered, mut variants) = (Vec::new(), Vec::new());
    let variance = residual_variance(findings);
    let folds = &search.selection.branches[ALL].folds;
    for (k, taken) in search.selected().iter().enumerate() {
        // Beside the explanations that are named of the effects before it.
        let before_it = chosen_candidates.iter().map(|(candidate, _)| *candidate);
        let after_it = search.selected()[k + 1..].iter().map(|selected| selected.candidate);
        let model = search.model_of(&before_it.chain(after_it).collect::<Vec<_>>(), folds)?;
        let (mut aliases, of_effect) = alias::aliases(search, k, &model, variance)?;
        let mut of_tests = prediction::predictions(findings, k, &mut aliases)?;
        competing_effects.push(of_effect);
        let assumed = assumed(findings, taken.candidate, &aliases);
        let place = assumed.unwrap_or_else(|| most_probable(search, taken.candidate, &aliases, &of_tests));
        let found = place.map_or(taken.candidate, |place| exchange(taken.candidate, place, &mut aliases));
        match (place, assumed) {
            // The left-out tests were predicted with the other effect in the model.
            (Some(_), Some(_)) => of_tests = prediction::Predictions::none(&aliases),
            (Some(place), None) => of_tests.exchange(place),
            (None, _) => {}
        }
        chosen_candidates.push((found, assumed.is_some()));
        let effect_of = |alias: &Alias| search.effect(alias.candidate).clone();
        // Uncertainties cover variants too.
        covered.push(aliases.iter().map(effect_of).collect::<Vec<Effect>>());
        let own = |alias: &Alias| alias.variant_of.is_none();
        of_tests.keep(|place| own(&aliases[place]));
        predicted.push(of_tests);
        let heads: Vec<&Alias> = aliases.iter().filter(|alias| own(alias)).collect();
        alias_effects.push(heads.iter().map(|alias| effect_of(alias)).collect());
        costs.push(heads.iter().map(|alias| [alias.delta_chi2, alias.prior_cost]).collect::<Vec<_>>());
        let variants_of = |head: usize| -> Vec<Effect> {
            aliases.iter().filter(|alias| alias.variant_of == Some(head)).map(effect_of).collect()
        };
        let each = std::iter::once(found).chain(heads.iter().map(|alias| alias.candidate));
        variants.push(each.map(variants_of).collect::<Vec<_>>());
        gains.push(model.gain(taken.candidate)?.gain);
    }
    let mut kept: Vec<usize> = (0..chosen_candidates.len()).collect();
    let (mut after, mut after_fit) = match kept.is_empty() {
        true => (declared.problem.clone(), declared.fit.clone()),
        false => with_aliases(findings, &chosen_candidates, &covered, &kept)?,
    };
    // An explanation that takes the place of an effect may leave nothing to another one.
    let explains = |k: &usize| explained(&after, &after_fit, before.parameters.effects.len() + k) > EXPLAINS_NOTHING;
    let explaining: Vec<usize> = kept.iter().copied().filter(explains).collect();
    if explaining.len() < kept.len() {
        kept = explaining;
        (after, after_fit) = with_aliases(findings, &chosen_candidates, &covered, &kept)?;
        let mut place = 0..;
        alias_effects.retain(|_| place.next().is_some_and(|k| kept.contains(&k)));
        let mut place = 0..;
        competing_effects.retain(|_| place.next().is_some_and(|k| kept.contains(&k)));
    }
    let (after, after_fit) = (&after, &after_fit);
    let (verdict, remainder) = verdict(findings, !kept.is_empty());
    let of_search = Some(JudgedBy { readings: after, heldout_mm: Some(held_out.last_um() * 1e-3) });
    let found = Model::of(after, after_fit, remainder.structured, of_search)?;
    let families = library::families()?;
    let result = |(number, k): (usize, &usize)| {
        let k = *k;
        let reported = effect::Found {
            number,
            selected: k,
            candidate: chosen_candidates[k].0,
            after,
            after_fit,
            parameters: &found.figures.parameters,
            rms_gain_um: (gains[k] / held_out.rows).sqrt() * before.noise.sigma_mm * 1e3,
            alias_effects: &alias_effects[number],
            costs: &costs[k],
            variants: &variants[k],
            predicted: &predicted[k],
        };
        effect::result(findings, &families, &held_out, &reported)
    };
    let effects: Vec<EffectResult> = kept.iter().enumerate().map(result).collect::<Result<_, _>>()?;
    let mut warnings = not_assumed(findings, after);
    warnings.extend(findings.warnings.iter().cloned());
    let statements = Statements {
        verdict,
        remainder,
        residual_before: residual_before(before, findings.structure_before, !search.selected().is_empty()),
        rejected: candidates(&before.session.machine, search, &held_out),
        candidates: [findings.candidates, findings.candidates_seen],
        searched: Searched { families: searched_families(search, &families), presumed: presumed(search, before)? },
        interrupted: findings.interrupted,
        warnings,
    };
    let result = build(declared, found, statements, effects);
    let (after, after_fit) = (after.clone(), after_fit.clone());
    Ok(ReportedEffect { after, after_fit, result, alias_effects, competing_effects })
}

/// States the fit of the session as the model before, in place of one without priors that the readings contradict.
///
/// # Errors
/// If the model cannot be evaluated.
pub(super) fn with_declared(found: &mut TraceOutcome, problem: Problem, fit: Fit) -> Result<(), Diagnostic> {
    let by_last = Some(JudgedBy { readings: &found.after, heldout_mm: None });
    let before = Model::of(&problem, &fit, false, by_last)?.figures;
    found.result.changed_parameters = changed_parameters(&before.parameters, &found.result.after.parameters);
    found.result.before = before;
    (found.before, found.before_fit) = (problem, fit);
    Ok(())
}

/// The families of the detectable candidates of a search.
fn searched_families(search: &SearchState<'_>, families: &[library::Family]) -> Vec<String> {
    let has_members = |number: usize| search.candidates.iter().any(|own| own.family == number && own.detectable);
    families.iter().enumerate().filter(|(number, _)| has_members(*number)).map(|(_, own)| own.name.clone()).collect()
}

/// The precessions of rotary axes that the declared model contains, with the location errors that rest on their absence: a
/// forward precession of order 2 reads as a constant tilt.
fn presumed(search: &SearchState<'_>, before: &Problem) -> Result<Vec<String>, Diagnostic> {
    let list = &before.parameters.list;
    let declared = search.model_of(&[], &search.selection.branches[ALL].folds)?;
    let mut found: Vec<(Vec<String>, Vec<String>)> = Vec::new();
    for (number, candidate) in search.candidates.iter().enumerate().filter(|(_, own)| own.tuned_on.is_empty()) {
        let effect = &candidate.effect;
        let (Shape::Precession(_), Component::Axis(name)) = (&effect.shape, &effect.component) else { continue };
        let Projected { d, own, .. } = declared.projected(number)?;
        let has_signal = (0..own.nrows()).all(|k| own[(k, k)] > 1.0);
        if !has_signal || (0..d.nrows()).any(|k| d[(k, k)] > CONTAINED * own[(k, k)]) {
            continue;
        }
        let is_of_axis = |error: &&ErrorName| {
            error.kind == ErrorKind::Location
                && error.axis == name.axis
                && error.freedom.is_angle() == name.freedom.is_angle()
        };
        let errors = list.iter().filter_map(|own| own.id.error()).filter(is_of_axis);
        let errors: Vec<String> = errors.map(ToString::to_string).collect();
        match found.iter_mut().find(|(same, _)| *same == errors) {
            _ if errors.is_empty() => {}
            Some((_, precessions)) => precessions.push(effect.id()),
            None => found.push((errors, vec![effect.id()])),
        }
    }
    let words = |(errors, precessions): &(Vec<String>, Vec<String>)| {
        format!("{} presume that there is no {}", listed(errors, "and"), listed(precessions, "or"))
    };
    Ok(found.iter().map(words).collect())
}

/// The structure of the residual of the declared model, in words.
fn residual_before(before: &Problem, structure: Option<&Structure>, found: bool) -> String {
    let words = match structure {
        Some(structure) if structure.is_significant() => return structure.description.clone(),
        Some(_) if before.folds.kind.is_poses() => "neighbouring poses do not deviate alike",
        // Detectors examine one test at a time; the search sums the evidence of all tests for one effect.
        Some(_) if found => "structure that no single test shows beyond noise; the search over all tests finds it",
        Some(_) => "no structure beyond noise",
        None => "not tested: too few poses",
    };
    words.to_string()
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
    // The evidence uses the noise of the search.
    relative_variance(&findings.after_fit.residuals, findings.before.noise.sigma_mm, findings.search.columns.rows())
}

/// Variance of residuals, by test, mm, over that of the noise; at least 1. `rows` is the number of residuals that count.
fn relative_variance(residuals: &[Vec<f64>], sigma_mm: f64, rows: usize) -> f64 {
    let sum: f64 = residuals.iter().flatten().map(|v| (v / sigma_mm).powi(2)).sum();
    (sum / rows.max(1) as f64).max(1.0)
}

/// Warnings about explanations that the user accepts and that explain no effect.
fn not_assumed(findings: &TraceFindings<'_>, after: &Problem) -> Vec<String> {
    let assumed: Vec<String> = after.parameters.effects.iter().filter(|one| one.assumed).map(Effect::id).collect();
    let open = findings.assume.iter().filter(|id| !assumed.contains(id));
    open.map(|id| format!("\"{id}\" is not assumed: no effect that was found is explained by it")).collect()
}

/// Whether the user accepts an explanation of an effect, and its place among the aliases if it is not the found effect.
fn assumed(findings: &TraceFindings<'_>, found: usize, aliases: &[Alias]) -> Option<Option<usize>> {
    let is_assumed = |candidate: usize| findings.assume.contains(&findings.search.effect(candidate).id());
    if is_assumed(found) {
        return Some(None);
    }
    aliases.iter().position(|alias| is_assumed(alias.candidate)).map(Some)
}

/// The place of the alias that is more probable than the found effect, and that predicts left-out tests no worse. A staircase
/// takes no place of a shape with fewer steps: with enough steps it approximates any shape.
fn most_probable(
    search: &SearchState<'_>,
    found: usize,
    aliases: &[Alias],
    of_tests: &prediction::Predictions,
) -> Option<usize> {
    let ratio = |place: &usize| aliases[*place].ln_probability_ratio();
    let steps = |candidate: usize| search.effect(candidate).shape.positions().len();
    (0..aliases.len())
        .filter(|place| steps(aliases[*place].candidate) <= steps(found).max(1))
        .filter(|place| aliases[*place].variant_of.is_none() && ratio(place) > MORE_PROBABLE)
        .filter(|place| !of_tests.is_worse(*place))
        .max_by(|a, b| ratio(a).total_cmp(&ratio(b)))
}

/// Names the alias at a place in place of the found effect, which becomes the first of the aliases. Returns its candidate.
fn exchange(found: usize, place: usize, aliases: &mut Vec<Alias>) -> usize {
    let chosen = aliases.remove(place);
    let is_variant = chosen.variant_of == Some(found);
    for alias in aliases.iter_mut() {
        alias.delta_chi2 -= chosen.delta_chi2;
        alias.prior_cost -= chosen.prior_cost;
        if is_variant && alias.variant_of == Some(found) {
            alias.variant_of = Some(chosen.candidate);
        }
    }
    let replaced = Alias {
        candidate: found,
        delta_chi2: -chosen.delta_chi2,
        prior_cost: -chosen.prior_cost,
        variant_of: is_variant.then_some(chosen.candidate),
        ..chosen
    };
    aliases.insert(0, replaced);
    chosen.candidate
}

/// The model with the found effects, which now have their aliases: uncertainties cover these, unless the effect is
/// assumed. `chosen` is the candidate of each effect, and whether the user accepts it; those that are `kept` are in the model.
///
/// # Errors
/// If an alias cannot be evaluated, or the model with an accepted alias cannot be fitted.
fn with_aliases(
    findings: &TraceFindings<'_>,
    chosen: &[(usize, bool)],
    alias_effects: &[Vec<Effect>],
    kept: &[usize],
) -> Result<(Problem, Fit), Diagnostic> {
    let search = findings.search;
    let effects: Vec<Effect> = (kept.iter())
        .map(|k| Effect {
            aliases: alias_effects[*k].clone(),
            assumed: chosen[*k].1,
            ..search.effect(chosen[*k].0).clone().with_estimated_numbers()
        })
        .collect();
    let as_found = kept.len() == search.selected().len()
        && search.selected().iter().zip(chosen).all(|(found, chosen)| found.candidate == chosen.0);
    if !as_found {
        let (mut after, mut fitted) = prepare_with(&findings.before.session, &effects, findings.seed)?;
        if noise_is_from_search(&findings.before.noise, &after.noise) {
            after.noise = findings.before.noise.clone();
            fitted = fit::refit(&mut after, &fitted)?;
        }
        return Ok((after, fitted));
    }
    let (mut after, mut fitted) = (findings.after.clone(), findings.after_fit.clone());
    let declared = findings.before.parameters.effects.len();
    for (own, found) in after.parameters.effects[declared..].iter_mut().zip(effects) {
        // The numbers of its shape have been estimated.
        *own = Effect { shape: own.shape.clone(), ..found };
    }
    fitted.aliases = fit::aliases_at_solution(&after, &fitted.beta)?;
    Ok((after, fitted))
}

/// What an effect explains in addition to the rest of the model: the increase of χ² of readings and priors without it,
/// `bᵀ C⁻¹ b` with the covariance `C` of its coefficients `b`.
fn explained(problem: &Problem, fit: &Fit, number: usize) -> f64 {
    let list = &problem.parameters.list;
    let own = |j: &usize| list[*j].coefficient_of() == Some(number);
    let own: Vec<usize> = (0..list.len()).filter(own).collect();
    let size = |k: usize| list[own[k]].size;
    let covariance = Mat::from_fn(own.len(), own.len(), |i, k| fit.covariance[(own[i], own[k])] / (size(i) * size(k)));
    let b = Mat::from_fn(own.len(), 1, |k, _| fit.beta[own[k]] / size(k));
    // Without a covariance of full rank nothing is said against the effect.
    let Ok(factor) = covariance.llt(Side::Lower) else { return f64::INFINITY };
    (b.transpose() * factor.solve(&b))[(0, 0)]
}

/// Parameters that changed by more than their standard uncertainty.
fn changed_parameters(before: &[Estimate], after: &[Estimate]) -> Vec<ParameterChange> {
    before
        .iter()
        .filter_map(|b| {
            let a = after.iter().find(|a| a.id == b.id)?;
            ((a.value - b.value).abs() > a.u).then(|| ParameterChange {
                id: a.id.clone(),
                value: a.value - b.value,
                u: a.u,
                unit: a.unit.clone(),
            })
        })
        .collect()
}

/// Candidates beyond the null distribution of the search that are rejected, because the held-out error does not
/// decrease by more than its standard error.
fn candidates(machine: &Machine, search: &SearchState<'_>, held_out: &HeldOut<'_>) -> Vec<RejectedCandidate> {
    let rejected = search.rejected.iter().map(|rejected| {
        let (heldout_decrease_um, u_heldout_decrease_um) = held_out.decrease_um(rejected.decrease);
        RejectedCandidate {
            name: effect_name(machine, search.effect(rejected.selected.candidate)),
            p_value: rejected.selected.p_value,
            heldout_decrease_um,
            u_heldout_decrease_um,
        }
    });
    rejected.collect()
}

impl HeldOut<'_> {
    /// A decrease of the sum of squares as a decrease of the rms, with its standard error: `Δ(rms²) = 2 rms Δrms`.
    fn decrease_um(&self, fall: HeldOutDecrease) -> (f64, f64) {
        let by_um = |by: f64| {
            let squares_um = by / self.rows * self.scale_um * self.scale_um;
            squares_um / (2.0 * self.last_um()).max(f64::MIN_POSITIVE)
        };
        (by_um(fall.by), by_um(fall.standard_error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variance_is_relative_to_that_of_the_noise() {
        let residuals = [vec![0.003, -0.001], vec![0.002, 0.0]];
        assert!((relative_variance(&residuals, 1e-3, 4) - 3.5).abs() < 1e-12);
        assert!((relative_variance(&residuals, 1e-3, 5) - 2.8).abs() < 1e-12);
        assert_eq!(relative_variance(&residuals, 1.0, 4), 1.0);
    }

    #[test]
    fn parameters_that_change_by_more_than_their_uncertainty_are_listed() {
        let parameter = |id: &str, value: f64, u: f64| Estimate::new(id, value, u, "um");
        let before = [parameter("EX0C", 3.0, 0.1), parameter("EY0C", 3.0, 0.1), parameter("EZ0A", 1.0, 0.1)];
        let after = [parameter("EX0C", 1.0, 1.5), parameter("EY0C", 1.0, 2.5)];
        let changed = changed_parameters(&before, &after);
        assert_eq!(changed.len(), 1);
        assert_eq!((changed[0].id.as_str(), changed[0].value, changed[0].u), ("EX0C", -2.0, 1.5));
    }

    /// A line and a wave explain a parabola together. Where the parabola takes the place of the line, as a more probable alias
    /// does, the wave explains nothing.
    #[test]
    fn an_effect_that_explains_nothing_beside_an_exchanged_one_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let mut rows = "run,x_mm,deviation_um\n".to_string();
        for (run, k) in (0..34).map(|row| (1 + row / 17, if row < 17 { row } else { 33 - row })) {
            let x = 25.0 * f64::from(k) - 200.0;
            let noise = 0.05 * (12.9898 * x + f64::from(run)).sin();
            rows += &format!("{run},{x},{:.4}\n", 0.03 * x + 1e-4 * x * x + noise);
        }
        std::fs::write(folder.path().join("x.csv"), rows).unwrap();
        let shapes = ["\"polynomial\"\norder = 1", "\"polynomial\"\norder = 2", "\"periodic\"\nperiod_mm = 400"];
        let [line, parabola, wave] = shapes.map(|shape| {
            let text = format!(
                "[machine]\nchain = \"w b X Y Z t\"\naxis.X = {{}}\naxis.Y = {{}}\naxis.Z = {{}}\n\
                 [instrument]\nkind = \"laser\"\nnoise_um = 0.05\n[unknowns]\nerrors = []\n\
                 [[effect]]\ncomponent = \"EXX\"\nshape = {shape}\n\
                 [[test]]\nname = \"LX\"\ndata = \"x.csv\"\nreflector_mm = [0, 0, 0]\nbeam = [1, 0, 0]\n"
            );
            let file = folder.path().join("session.toml");
            std::fs::write(&file, text).unwrap();
            abbe_files::session(&file, &abbe_files::ReadOptions::default()).unwrap()
        });
        let mut session = line.clone();
        session.effects.clear();
        let explains = |other: &abbe_model::session::Session| {
            let effects = [other.effects[0].clone(), wave.effects[0].clone()];
            let (problem, fit) = prepare_with(&session, &effects, 1).unwrap();
            [0, 1].map(|number| explained(&problem, &fit, number) > EXPLAINS_NOTHING)
        };
        assert_eq!(explains(&line), [true, true]);
        assert_eq!(explains(&parabola), [true, false]);
    }
}
