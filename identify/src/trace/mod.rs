//! Find the unmodelled effect behind the residual of a fitted model.
//!
//! 1. Noise first: size and memory from repeats ([`crate::noise`]), outliers left out by name ([`crate::outliers`]).
//! 2. The library of effects ([`library`]) is laid over the session (`columns`) and multiplied once with model, residual and null draws (`moments`).
//! 3. The search (`search`) adds, removes and exchanges effects; its p-values come from the same search on readings without structure (`null`).
//!    An effect is claimed where its p-value is below the level of significance and the held-out error falls by more than the standard error of the fall,
//!    which follows from paired differences over runs, blocks or poses (`paired`).
//! 4. Everything is refitted together (`judge`), and reported before and after (`report`) on readings that neither fit nor search saw.
//! 5. For each effect, what would look the same ([`alias`]); for the rest, whether it has structure (`remainder`).

pub mod alias;
mod chi_square_tail;
pub(crate) mod columns;
mod compose;
mod description_length;
mod implausible;
mod interrupt;
mod judge;
pub mod library;
mod moments;
mod null;
mod observable;
mod paired;
mod refine;
mod remainder;
mod result;
mod rounds;
mod score;
pub mod screening;
mod search;
pub mod separating_tests;
mod start;
mod swap;
mod tuning;

use abbe_model::effect::Effect;
use abbe_model::session::Session;

use crate::error::IdentifyError;
use crate::fit::{Fit, fit, prepare};
use crate::heldout::FoldKind;
use crate::noise::{NoiseSource, PureError};
use crate::problem::Problem;
use crate::results::TraceResult;
use columns::{Columns, Layout};
use implausible::Contradicted;
use interrupt::Interrupt;
use judge::RefittedModel;
use library::Candidate;
use moments::Moments;
use rounds::{Account, search_on};
use search::{Search, Stop};
use start::Start;

/// What a user can ask of a trace.
#[derive(Clone, Debug)]
pub struct TraceOptions {
    /// Seed of folds and null draws.
    pub seed: u64,
    /// The most effects; `None` for default: until the held-out error stops improving.
    pub max_effects: Option<usize>,
    /// If not empty, only candidates whose identifier contains one of these.
    pub only: Vec<String>,
    /// Candidates whose identifier contains one of these are left out.
    pub exclude: Vec<String>,
    /// Number of null draws.
    pub draws: usize,
    /// Probability that a session without structure is claimed to have an effect, if the null were exact. What is estimated of the noise makes it larger: see
    /// the rates in the documentation of the method.
    pub significance: f64,
}

impl Default for TraceOptions {
    fn default() -> Self {
        TraceOptions {
            seed: 1,
            max_effects: None,
            only: Vec::new(),
            exclude: Vec::new(),
            draws: 199,
            significance: 0.005,
        }
    }
}

/// How far a trace has come, for those who wait.
#[derive(Clone, Debug)]
pub enum Progress {
    /// The declared model is being fitted.
    Fitting,
    /// The library is being multiplied with the readings: how many candidates.
    Screening(usize),
    /// An effect was taken: its number, its identifier, the held-out rms in µm.
    SelectedEffect(usize, String, f64),
    /// The found effects are being refitted and judged.
    Judging,
    /// Nothing new: asked often, so that an end is heeded soon.
    Working,
}

/// Sessions along runs have few effects; more than this says that something else is meant.
const MAX_ALONG_RUNS: usize = 12;
/// Poses of a robot have many.
const MAX_OF_POSES: usize = 200;

/// One addition of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The effect that was added, by its identifier; later rounds may have let it go or exchanged it.
    pub id: String,
    /// How many effects there were then.
    pub effects: usize,
    /// Held-out rms then, µm.
    pub heldout_rms_um: f64,
}

/// Everything that a trace knows when it ends.
pub struct Trace<'a> {
    /// The declared model.
    pub before: Problem<'a>,
    /// Its fit.
    pub before_fit: Fit,
    /// The model with the found effects.
    pub after: Problem<'a>,
    /// Its fit.
    pub after_fit: Fit,
    /// The found effects.
    pub effects: Vec<Effect>,
    /// For each of them what the readings cannot tell from it, nearest first.
    pub alias_effects: Vec<Vec<Effect>>,
    /// For each of them what stands highest in its place, the best first.
    pub competing_effects: Vec<Vec<alias::CompetingEffect>>,
    /// How the search came to them.
    pub steps: Vec<Step>,
    /// As it is reported.
    pub result: TraceResult,
}

/// Closes the loop on a session. `progress` is told how far it has come and says whether to go on; where it says no, the trace ends within a fraction of a
/// second after the fit of the declared model, with the effects found until then, and is marked as interrupted.
///
/// # Errors
/// If the session cannot be fitted.
pub fn trace<'a>(
    session: &'a Session,
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Trace<'a>, IdentifyError> {
    progress(Progress::Fitting);
    let (problem, fitted) = prepare(session, options.seed)?;
    let contradicted = Contradicted::of(&problem, &fitted)?;
    if contradicted.stops() {
        return Ok(contradicted.stopped(problem, fitted));
    }
    if let Some((problem_freed, fit_freed)) = &contradicted.freed {
        let mut found = with_noise_of_repeats(problem_freed.clone(), fit_freed.clone(), options, progress)?;
        if found.result.interrupted || contradicted.contradicted_by(&problem, &fitted, &found.effects)? {
            contradicted.tell(&mut found.result);
            return Ok(found);
        }
        // The effects that were found without the set-up explain what seemed wrong with it.
        return with_noise_of_repeats(problem, fitted, options, progress);
    }
    let mut found = with_noise_of_repeats(problem, fitted, options, progress)?;
    contradicted.tell(&mut found.result);
    Ok(found)
}

/// Searches with the noise that repeats show, and once more where the effects that are found change it.
fn with_noise_of_repeats<'a>(
    mut problem: Problem<'a>,
    mut before_fit: Fit,
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Trace<'a>, IdentifyError> {
    if give_noise_autocorrelation(&mut problem, &before_fit.residuals) {
        before_fit = fit(&problem, Some(&before_fit.beta))?;
    }
    let residuals = before_fit.residuals.clone();
    let first = trace_with(problem, before_fit, &residuals, options, progress)?;
    // What moved between runs was taken for noise as long as the model lacked it.
    let mut problem = first.before.clone();
    if first.result.interrupted
        || first.effects.is_empty()
        || !give_noise_autocorrelation(&mut problem, &first.after_fit.residuals)
    {
        return Ok(first);
    }
    let before_fit = fit(&problem, Some(&first.before_fit.beta))?;
    let again = trace_with(problem, before_fit, &first.after_fit.residuals, options, progress)?;
    if !again.result.interrupted {
        return Ok(again);
    }
    // The first search is whole, if with a noise that is less well known.
    let mut first = first;
    first.result.mark_interrupted();
    Ok(first)
}

/// Closes the loop with a given noise; `pure` are the residuals whose repeats show it.
fn trace_with<'a>(
    problem: Problem<'a>,
    before_fit: Fit,
    pure: &[Vec<f64>],
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Trace<'a>, IdentifyError> {
    match searched(&problem, &before_fit, pure, options, progress) {
        Err(IdentifyError::Interrupted) => Ok(Trace::unsearched(problem, before_fit)),
        searched => searched,
    }
}

/// The same, and [`IdentifyError::Interrupted`] if it was interrupted before the search began.
fn searched<'a>(
    problem: &Problem<'a>,
    before_fit: &Fit,
    pure: &[Vec<f64>],
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Trace<'a>, IdentifyError> {
    let interrupt = Interrupt(progress);
    interrupt.check()?;
    let poses = problem.folds.kind == FoldKind::Poses;
    let columns = Columns::new(problem, &before_fit.beta);
    let start = Start::of(problem, &columns, before_fit)?;
    interrupt.check()?;
    let null = |block: usize| {
        let (count, seed) = (draws_of(options), options.seed);
        null::draws(problem, &columns, pure, &start.residual, count, block, seed)
    };
    let structure_before = || {
        let (model, prior) = (start.model.clone(), start.prior());
        let draws = null(null::SINGLE);
        remainder::structure(problem, &columns, model, &start.residual, draws, &prior)
    };
    let (draws, structure_before) = rayon::join(|| null(null::BLOCK), || (!poses).then(structure_before));

    let structure_before = structure_before.transpose()?;
    interrupt.check()?;

    let laid = screening::laid(problem, &columns, options)?;
    let looked_for = laid.len();
    progress(Progress::Screening(looked_for));
    let (reserve, laid): (Vec<_>, Vec<_>) =
        laid.into_iter().partition(|(candidate, _)| candidate.last_resort);
    let (candidates, layouts): (Vec<Candidate>, Vec<Layout>) = laid.into_iter().unzip();
    let (model, prior) = (start.model.clone(), start.prior());
    let go_on = || interrupt.check().is_ok();
    let moments = Moments::new(&columns, &layouts, model, &start.residual, draws, &go_on)
        .ok_or(IdentifyError::Interrupted)?;
    let most = if poses { MAX_OF_POSES } else { MAX_ALONG_RUNS };
    let stop = Stop {
        significance: options.significance,
        most: options.max_effects.unwrap_or(most),
        in_residual_variance: poses,
    };
    let plain = start.plain(&columns, &before_fit.beta, problem.noise.sigma_mm)?;
    let mut search = Search::new(&columns, candidates, layouts, moments, prior, plain, stop)?;
    search.reserve = reserve;
    search.interrupt = Some(interrupt);
    let gains = search.model_without(None)?.gains();
    let seen = gains.iter().filter(|gain| gain.freedom > 0).count();

    let mut account = Account {
        steps: Vec::new(),
        noise_um: problem.noise.sigma_mm * 1e3,
        progress,
    };
    let structure_before = structure_before.as_ref();
    let judge =
        |search: &Search<'_>| RefittedModel::of(problem, before_fit, search, options, structure_before);
    let found = match found(&mut search, &mut account, judge) {
        Err(IdentifyError::Interrupted) => {
            search.roll_back();
            None
        }
        found => Some(found?),
    };
    let interrupted = found.is_none();
    // What the search came to is reported whole.
    search.interrupt = None;
    let (ended, judged) = match found {
        Some((p_value, judged)) => (Some(p_value), judged),
        // The effects found until then are fitted; what they leave is not looked at.
        None => (
            None,
            RefittedModel::of(problem, before_fit, &search, options, None)?,
        ),
    };
    let RefittedModel {
        after,
        after_fit,
        effects,
        structure: structure_after,
    } = judged;
    let mut reported = result::report(&result::TraceFindings {
        before: problem,
        before_fit,
        after: &after,
        after_fit: &after_fit,
        search: &search,
        start: &start,
        structure_before,
        structure_after: structure_after.as_ref(),
        last_p_value: ended.unwrap_or(1.0),
        stopped_early: ended.is_none() || search.taken().len() >= stop.most,
        interrupted,
        candidates: looked_for,
        candidates_seen: seen,
    })?;
    reported
        .result
        .warnings
        .extend(screening::unused_exclusions(problem, options)?);
    drop(search);
    drop(columns);
    Ok(Trace {
        before: problem.clone(),
        before_fit: before_fit.clone(),
        after,
        after_fit,
        effects,
        alias_effects: reported.alias_effects,
        competing_effects: reported.competing_effects,
        steps: account.steps,
        result: reported.result,
    })
}

/// Searches and judges; where structure remains that nothing simpler explains, searches on with free curves; gives back what explains nothing. Returns how
/// the search ended ([`search_on`]) and what it came to.
///
/// # Errors
/// [`IdentifyError::Interrupted`] if the user has seen enough.
fn found<'a>(
    search: &mut Search<'_>,
    account: &mut Account<'_>,
    judge: impl Fn(&Search<'_>) -> Result<RefittedModel<'a>, IdentifyError>,
) -> Result<(f64, RefittedModel<'a>), IdentifyError> {
    let mut ended = search_on(search, account)?;
    (account.progress)(Progress::Judging);
    let mut judged = judge(search)?;
    // Among poses structure is looked for effect by effect, and never ends.
    let poses = search.stop.in_residual_variance;
    if (poses || judged.is_structured()) && search.taken().len() < search.stop.most {
        search.add_reserve_candidates();
        search.last_resort = true;
        ended = search_on(search, account)?;
        if !judged.is_of(search) {
            judged = judge(search)?;
        }
    }
    if !poses {
        search.withdraw(judged.is_structured())?;
        search.withdraw_all_unless_better()?;
        if !judged.is_of(search) {
            judged = judge(search)?;
        }
    }
    Ok((ended, judged))
}

/// As many draws as are asked for, and as many as the significance needs: fewer could not show it.
fn draws_of(options: &TraceOptions) -> usize {
    let least = (1.0 / options.significance.max(1e-6)).ceil() as usize;
    options.draws.max(least - 1)
}

/// By how much estimates of a coefficient of the memory, and relatively of the size of the noise, scatter anyway.
const SCATTER: f64 = 0.02;

/// Takes size and autocorrelation of the noise from repeats, where there are enough. Returns whether that changed them by more than estimates of the noise
/// scatter anyway.
fn give_noise_autocorrelation(problem: &mut Problem<'_>, residuals: &[Vec<f64>]) -> bool {
    if problem.folds.kind == FoldKind::Poses {
        return false;
    }
    let kept = |test: usize, row: usize| !problem.rejected[test][row];
    let pure = PureError::of(&problem.tests, residuals, kept).without_waves(&problem.tests, kept);
    let Some(memory) = pure.autocorrelation(&problem.tests, kept) else {
        return false;
    };
    let mut noise = problem.noise.clone();
    noise.memory = memory.coefficients;
    noise.ar_sum_u = memory.sum_u;
    if let Some(sigma) = pure.sigma_mm() {
        noise.sigma_mm = sigma * memory.inflation;
        noise.source = NoiseSource::Repeats;
    }
    let present = &problem.noise;
    let same_memory = noise.memory.len() == present.memory.len()
        && noise
            .memory
            .iter()
            .zip(&present.memory)
            .all(|(a, b)| (a - b).abs() < SCATTER);
    if same_memory && (noise.sigma_mm / present.sigma_mm - 1.0).abs() < SCATTER {
        return false;
    }
    problem.noise = noise;
    true
}
