//! The trace of a session: the search with its noise model, its start, and its result.

use std::sync::atomic::{AtomicBool, Ordering};

use abbe_identify::circular;
use abbe_identify::error::INTERRUPTED;
use abbe_identify::fit::{Fit, fit, prepare, prepare_with};
use abbe_identify::numerics::parallel;
use abbe_identify::problem::Problem;
use abbe_identify::tolerance::conformity;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Session;

use crate::candidates::columns::{Columns, EffectColumns};
use crate::candidates::gram::{DrawSource, Gram, MAX_KEPT_DRAWS};
use crate::constants::{BLOCK, MAX_AT_THE_SAME_TIME, SINGLE};
use crate::implausible::Contradicted;
use crate::interrupt::Interrupt;
use crate::judge::RefittedModel;
use crate::noise_model::estimate_noise_model;
use crate::null::Draws;
use crate::policy::{Policy, SIGNIFICANCE};
use crate::progress::Progress;
use crate::remainder::Structure;
use crate::result::{PosesEnded, TraceResult};
use crate::search::{SearchRecord, search_and_refit};
use crate::start::Start;
use crate::state::SearchState;
use crate::{alias, judge, neighbours, poses, remainder, result, screening};

/// Options of a trace.
#[derive(Clone, Debug)]
pub struct TraceOptions {
    /// Seed of the folds and the null draws.
    pub seed: u64,
    /// Maximum number of effects. `None`: until the held-out error stops improving.
    pub max_effects: Option<usize>,
    /// If not empty, only candidates whose identifier contains one of these strings are searched.
    pub only: Vec<String>,
    /// Candidates whose identifier contains one of these strings are excluded.
    pub exclude: Vec<String>,
    /// Number of null draws.
    pub draws: usize,
    /// Probability that the trace accepts an effect on readings without structure, if the null distribution is exact.
    /// The noise model is estimated, which increases this probability. The documentation of the method gives measured
    /// rates.
    pub significance: f64,
    /// Explanations that the user accepts, each by the identifier of a found effect or of one of its aliases, which then
    /// takes its place. Uncertainties do not cover the other explanations.
    pub assume: Vec<String>,
}

impl Default for TraceOptions {
    fn default() -> Self {
        TraceOptions {
            seed: 1,
            max_effects: None,
            only: Vec::new(),
            exclude: Vec::new(),
            draws: 199,
            significance: SIGNIFICANCE,
            assume: Vec::new(),
        }
    }
}

impl TraceOptions {
    /// The number of null draws: the requested number, but at least as many as the significance level needs.
    pub(crate) fn null_draw_count(&self) -> usize {
        let least = (1.0 / self.significance.max(1e-6)).ceil() as usize;
        self.draws.max(least - 1)
    }
}

/// One addition of the search.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchStep {
    /// Identifier of the added effect. A later round may have removed or exchanged it.
    pub id: String,
    /// Number of effects after this addition.
    pub effects: usize,
    /// Held-out rms after this addition, µm.
    pub heldout_um: f64,
}

/// The outcome of a trace: the models before and after, and the result.
pub struct TraceOutcome {
    /// The declared model.
    pub before: Problem,
    /// The fit of the declared model.
    pub before_fit: Fit,
    /// The model with the found effects.
    pub after: Problem,
    /// The fit of the model with the found effects.
    pub after_fit: Fit,
    /// The found effects.
    pub effects: Vec<Effect>,
    /// For each found effect its aliases, nearest first. Those that predict left-out tests clearly worse come last.
    pub alias_effects: Vec<Vec<Effect>>,
    /// For each found effect the competing explanations, best first.
    pub competing_effects: Vec<Vec<alias::CompetingEffect>>,
    /// The additions of the search, in order.
    pub steps: Vec<SearchStep>,
    /// The best candidate that was not significant when the search ended.
    pub(crate) strongest: Option<Effect>,
    /// The result as it is reported.
    pub result: TraceResult,
}

impl TraceOutcome {
    /// A trace that was interrupted before its search began. It contains the declared model only.
    pub(super) fn unsearched(problem: Problem, fit: Fit) -> Result<TraceOutcome, Diagnostic> {
        let mut result = result::unsearched(&problem, &fit)?;
        result.mark_interrupted();
        Ok(TraceOutcome::of_declared(problem, fit, result))
    }

    /// A trace that contains the declared model only, with its result.
    pub(super) fn of_declared(problem: Problem, fit: Fit, result: TraceResult) -> TraceOutcome {
        TraceOutcome {
            after: problem.clone(),
            after_fit: fit.clone(),
            before: problem,
            before_fit: fit,
            effects: Vec::new(),
            alias_effects: Vec::new(),
            competing_effects: Vec::new(),
            steps: Vec::new(),
            strongest: None,
            result,
        }
    }
}

/// Finds the unmodelled effects behind the residual of a session.
///
/// `progress` receives the progress and returns whether to continue. If it returns `false`, the trace ends within a
/// fraction of a second after the fit of the declared model. It then returns the effects found so far and marks the
/// result as interrupted.
///
/// # Errors
/// If the session cannot be fitted.
pub fn trace(
    session: &Session,
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<TraceOutcome, Diagnostic> {
    // Once the caller has stopped the trace, it is not asked again by computations that run at the same time.
    let stopped = AtomicBool::new(false);
    let progress = &|event: Progress| {
        let asks = matches!(event, Progress::Working);
        if asks && stopped.load(Ordering::Relaxed) {
            return false;
        }
        let should_continue = progress(event);
        stopped.fetch_or(!should_continue, Ordering::Relaxed);
        should_continue
    };
    progress(Progress::Fitting);
    let mut found = without_conformity(session, options, progress)?;
    let after = &found.after;
    let circular = circular::of_session(&after.session, after.noise.sigma_mm, &after.rejected);
    found.result.conformity = conformity(&after.session, &found.result.after, &circular);
    Ok(found)
}

/// The trace without its decisions of conformity.
fn without_conformity(
    session: &Session,
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<TraceOutcome, Diagnostic> {
    let (problem, fitted) = prepare(session, options.seed)?;
    let contradicted = Contradicted::of(&problem, &fitted)?;
    contradicted.report(progress);
    if contradicted.forbids_search() {
        return contradicted.outcome_without_search(problem, fitted);
    }
    if let Some((problem_freed, fit_freed)) = &contradicted.freed {
        let mut found = with_noise_of_repeats(problem_freed.clone(), fit_freed.clone(), options, progress)?;
        if found.result.interrupted || contradicted.contradicted_by(&problem, &fitted, &found.effects)? {
            contradicted.add_warnings(&mut found.result);
            result::with_declared(&mut found, problem, fitted)?;
            return Ok(found);
        }
        // The effects found without the set-up priors explain the apparent contradiction. The search therefore runs
        // with these priors.
        let mut found = with_noise_of_repeats(problem, fitted, options, progress)?;
        contradicted.with_priors().beside(&found).add_warnings(&mut found.result);
        return Ok(found);
    }
    let mut found = with_noise_of_repeats(problem, fitted, options, progress)?;
    contradicted.beside(&found).add_warnings(&mut found.result);
    Ok(found)
}

/// Searches with the noise model estimated from repeats. Searches once more if the found effects change that noise
/// model.
fn with_noise_of_repeats(
    mut problem: Problem,
    mut before_fit: Fit,
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<TraceOutcome, Diagnostic> {
    before_fit = with_noise_model(&mut problem, before_fit)?;
    let residuals = before_fit.residuals.clone();
    let mut first = trace_with(problem, before_fit, &residuals, options, progress)?;
    let mut first = match with_noise_less_strongest(&first, options, progress)? {
        // The first search is complete, although the repeated one is not.
        Some(again) if again.result.interrupted => {
            first.result.mark_interrupted();
            return Ok(first);
        }
        Some(again) => again,
        None => first,
    };
    // Variation between runs counts as noise as long as the model lacks its cause. Among few poses an outlier that shows
    // only beside the found effects can hide further ones.
    let mut problem = first.before.clone();
    if first.result.interrupted || first.effects.is_empty() {
        return Ok(first);
    }
    let outliers = Policy::of(&problem).folds_follow && problem.rejected != first.after.rejected;
    if outliers {
        problem.rejected.clone_from(&first.after.rejected);
    }
    if !estimate_noise_model(&mut problem, &first.after_fit.residuals) && !outliers {
        return Ok(first);
    }
    let before_fit = fit(&problem, Some(&first.before_fit.beta))?;
    let again = trace_with(problem, before_fit, &first.after_fit.residuals, options, progress)?;
    if !again.result.interrupted {
        return Ok(again);
    }
    // The first search is complete, although its noise model is less accurate.
    first.result.mark_interrupted();
    Ok(first)
}

/// The fit with the noise model estimated from repeats, if they change it.
fn with_noise_model(problem: &mut Problem, found: Fit) -> Result<Fit, Diagnostic> {
    match estimate_noise_model(problem, &found.residuals) {
        true => fit(problem, Some(&found.beta)),
        false => Ok(found),
    }
}

/// The structure in the residual of a fit, as a trace would find it before its search; `None` if there are too few poses
/// for the test.
///
/// # Errors
/// If the model cannot be evaluated.
pub(crate) fn structure_of_fit(problem: &Problem, fit: &Fit, seed: u64) -> Result<Option<Structure>, Diagnostic> {
    let options = TraceOptions { seed, ..TraceOptions::default() };
    let mut problem = problem.clone();
    let fit = with_noise_model(&mut problem, fit.clone())?;
    match Policy::of(&problem).tests_structure {
        true => judge::structure(&problem, &fit, &options, seed, &|| true).map(Some),
        false => structure_of_poses(&problem, &fit, &options),
    }
}

/// Searches again with the noise that remains beside the best candidate, if no effect was found in autocorrelated noise and
/// this candidate changes that noise. An effect that acts in one of two runs, such as a warm-up, counts as slow noise, and
/// can raise the threshold above its own score. In noise alone the best candidate leaves the noise model as it is. Returns
/// `None` if this search finds nothing either, unless it was interrupted.
fn with_noise_less_strongest(
    first: &TraceOutcome,
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Option<TraceOutcome>, Diagnostic> {
    let mut problem = first.before.clone();
    let Some(strongest) = &first.strongest else { return Ok(None) };
    if first.result.interrupted || !first.effects.is_empty() || problem.noise.ar_coefficients.is_empty() {
        return Ok(None);
    }
    let (_, beside) = prepare_with(&problem.session, std::slice::from_ref(strongest), options.seed)?;
    if !estimate_noise_model(&mut problem, &beside.residuals) {
        return Ok(None);
    }
    let before_fit = fit(&problem, Some(&first.before_fit.beta))?;
    let again = trace_with(problem, before_fit, &beside.residuals, options, progress)?;
    Ok((again.result.interrupted || !again.effects.is_empty()).then_some(again))
}

/// Traces with a given noise model. The null distribution is drawn from the repeats in the residuals `pure`.
fn trace_with(
    problem: Problem,
    before_fit: Fit,
    pure: &[Vec<f64>],
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<TraceOutcome, Diagnostic> {
    match trace_or_interrupted(&problem, &before_fit, pure, options, progress) {
        Err(error) if error.code == INTERRUPTED => TraceOutcome::unsearched(problem, before_fit),
        traced => traced,
    }
}

/// Traces with a given noise model, and returns `INTERRUPTED` if it was interrupted before the search
/// began.
fn trace_or_interrupted(
    problem: &Problem,
    before_fit: &Fit,
    pure: &[Vec<f64>],
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<TraceOutcome, Diagnostic> {
    let interrupt = Interrupt(progress);
    interrupt.check()?;
    let policy = Policy::of(problem);
    let policy = Policy {
        significance: options.significance,
        max_effects: options.max_effects.unwrap_or(policy.max_effects),
        ..policy
    };
    if policy.families
        && let Some(found) = poses::search(problem, before_fit, options, policy, interrupt)?
    {
        progress(Progress::Judging);
        let structure = |problem: &Problem, fit: &Fit| match found.interrupted {
            true => Ok(None),
            false => structure_of_poses(problem, fit, options),
        };
        let (before, after) =
            parallel::both(|| structure(problem, before_fit), || structure(&found.problem, &found.fit));
        let ended = PosesEnded {
            stopped_early: found.effects.len() >= policy.max_effects,
            structures: [before?, after?],
            warnings: screening::unused_exclusions(problem, options, &poses::proposed_ids(problem))?,
        };
        return result::outcome_of_poses(problem, before_fit, found, ended);
    }
    let readings = Columns::of_readings(problem);
    let start = Start::of(problem, &readings, before_fit)?;
    interrupt.check()?;
    let null = |block: usize| {
        let (count, seed, progress) = (options.null_draw_count(), options.seed, Some(progress));
        let (columns, whitened) = (&readings, start.residual.as_slice());
        Draws { problem, columns, residuals: pure, whitened, count, block, seed, progress }
    };
    let (singles, blocks) = (null(SINGLE), null(BLOCK));
    let should_continue = || interrupt.check().is_ok();
    let structure_before = || remainder::structure(problem, &start, &singles, &should_continue);
    let structure_before = || policy.tests_structure.then(structure_before).transpose();
    // In a long session the arrays of the structure test are freed before those of the library are formed.
    let tested = (readings.rows() > MAX_AT_THE_SAME_TIME).then(structure_before);
    let columns = Columns::new(problem, &before_fit.beta);
    let searched = screening::searched_candidates(problem, &columns, options)?;
    let candidate_count = searched.len();
    progress(Progress::Screening(candidate_count));
    let (reserve, candidates): (Vec<_>, Vec<_>) = searched.into_iter().partition(|candidate| candidate.last_resort);
    let column_sets: Vec<EffectColumns> = candidates.iter().map(|candidate| candidate.columns.clone()).collect();
    let gram = || {
        let mut gram = Gram::new(&columns, column_sets, start.model.clone(), &start.residual, start.prior());
        gram.prepare(&[], &should_continue)?;
        gram.take_draws(&blocks, Some(MAX_KEPT_DRAWS), &should_continue)?;
        Ok::<_, Diagnostic>(gram)
    };
    let (structure_before, gram) = match tested {
        Some(tested) => (tested, gram()),
        None => parallel::both(structure_before, gram),
    };
    let (gram, structure_before) = (gram?, structure_before?);
    interrupt.check()?;
    let unwhitened = start.unwhitened(&columns, &before_fit.beta, problem.noise.sigma_mm)?;
    let mut search = SearchState::new(&columns, candidates, reserve, gram, unwhitened, policy)?;
    search.interrupt = Some(interrupt);
    let gains = search.model_without(None)?.gains(&|candidate| !search.candidates[candidate].last_resort)?;
    let observable = gains.iter().filter(|gain| gain.freedom > 0).count();

    let mut record =
        SearchRecord { steps: Vec::new(), noise_um: problem.noise.sigma_mm * 1e3, strongest: None, progress };
    let structure_before = structure_before.as_ref();
    let judge = |search: &SearchState<'_>| RefittedModel::of(problem, before_fit, search, options, structure_before);
    let found = match search_and_refit(&mut search, &mut record, judge) {
        Err(error) if error.code == INTERRUPTED => {
            search.roll_back();
            None
        }
        found => Some(found?),
    };
    let interrupted = found.is_none();
    // The report of the selected effects is not interrupted.
    search.interrupt = None;
    let (ended, judged) = match found {
        Some((p_value, judged)) => (Some(p_value), judged),
        // The effects found so far are fitted. Their residual is not tested for structure.
        None => (None, RefittedModel::of(problem, before_fit, &search, options, None)?),
    };
    search.tune_aliases()?;
    let RefittedModel { after, after_fit, structure: structure_after, .. } = judged;
    let [structure_before, structure_after] = match policy.tests_structure || interrupted {
        true => [structure_before.cloned(), structure_after],
        false => [structure_of_poses(problem, before_fit, options)?, structure_of_poses(&after, &after_fit, options)?],
    };
    let reported = result::report(&result::TraceFindings {
        before: problem,
        before_fit,
        after: &after,
        after_fit: &after_fit,
        search: &search,
        assume: &options.assume,
        seed: options.seed,
        structure_before: structure_before.as_ref(),
        structure_after: structure_after.as_ref(),
        last_p_value: ended.unwrap_or(1.0),
        stopped_early: ended.is_none() || search.selected().len() >= policy.max_effects,
        interrupted,
        candidates: candidate_count,
        candidates_seen: observable,
        warnings: screening::unused_exclusions(problem, options, &[])?,
    })?;
    drop(search);
    drop(columns);
    Ok(TraceOutcome {
        before: problem.clone(),
        before_fit: before_fit.clone(),
        effects: reported.after.parameters.effects[problem.parameters.effects.len()..].to_vec(),
        after: reported.after,
        after_fit: reported.after_fit,
        alias_effects: reported.alias_effects,
        competing_effects: reported.competing_effects,
        steps: record.steps,
        strongest: record.strongest,
        result: reported.result,
    })
}

/// The structure in the residual of a fit to independent poses; `None` if there are too few for the test.
///
/// # Errors
/// If the model cannot be evaluated.
fn structure_of_poses(problem: &Problem, fit: &Fit, options: &TraceOptions) -> Result<Option<Structure>, Diagnostic> {
    let columns = Columns::new(problem, &fit.beta);
    let start = Start::of(problem, &columns, fit)?;
    let (count, seed) = (options.null_draw_count(), options.seed.wrapping_add(2));
    let (residuals, whitened, block) = (&fit.residuals, &start.residual, SINGLE);
    let draws = Draws { problem, columns: &columns, residuals, whitened, count, block, seed, progress: None };
    Ok(neighbours::structure(problem, &columns, start.model.as_ref().as_ref(), &start.residual, draws.draws()))
}
