//! Close the loop: from what a fitted model leaves over to the effect that it lacks.
//!
//! 1. Noise first: size and memory from repeats ([`crate::noise`]), wild readings left out by name ([`crate::outliers`]).
//! 2. The library of effects ([`library`]) is laid over the session ([`columns`]) and multiplied once with model, residual and null draws
//!    ([`moments`]).
//! 3. The search ([`search`]) adds, lets go and exchanges effects; its p-values come from the same search on readings without structure
//!    ([`null`]).
//! 4. For each effect, what would look the same ([`alias`]); for the rest, whether it has structure ([`remainder`]).
//! 5. Everything is refitted together, and reported before and after on readings that neither fit nor search saw.

pub mod alias;
pub mod columns;
pub mod compose;
mod exchange;
mod fewer;
pub mod further;
pub mod library;
pub mod moments;
pub mod null;
pub mod remainder;
mod report;
pub mod score;
pub mod search;
pub mod sharpen;
pub mod tail;
pub mod trial;
mod visible;

use abbe_model::effect::Effect;
use abbe_model::session::Session;

use faer::Mat;
use rayon::prelude::*;

use crate::error::IdentifyError;
use crate::fit::{Fit, fit, in_directions, prepare};
use crate::heldout::FoldKind;
use crate::noise::{NoiseSource, PureError};
use crate::problem::Problem;
use crate::results::TraceResult;
use crate::triangle::Triangle;
use columns::{Columns, Layout};
use library::Candidate;
use moments::Moments;
use score::PriorMoments;
use search::{Plain, Round, Search, Stop};

/// What a user can ask of a trace.
#[derive(Clone, Debug)]
pub struct TraceOptions {
    /// Seed of folds and null draws.
    pub seed: u64,
    /// The most effects; `None` for as many as earn their place.
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
    Taken(usize, String, f64),
    /// The found effects are being refitted and judged.
    Judging,
}

/// Sessions along runs have few effects; more than this says that something else is meant.
const MOST_ALONG_RUNS: usize = 12;
/// Poses of a robot have many.
const MOST_OF_POSES: usize = 200;
/// Up to this many effects exchanges are tried after each addition, beyond it after each eighth.
const EXCHANGED_EACH_ROUND: usize = 14;
const EXCHANGED_EACH: usize = 8;
/// Share of the structure's excess over noise that may remain for the found effects to count as the explanation.
const EXPLAINED_SHARE: f64 = 0.5;
/// Significance below which a remainder counts as structured.
const STRUCTURED: f64 = 0.01;

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
    pub look_alikes: Vec<Vec<Effect>>,
    /// For each of them what stands highest in its place, the best first.
    pub rivals: Vec<Vec<alias::Rival>>,
    /// How the search came to them.
    pub steps: Vec<Step>,
    /// As it is reported.
    pub result: TraceResult,
}

/// Closes the loop on a session.
///
/// # Errors
/// If the session cannot be fitted.
pub fn trace<'a>(
    session: &'a Session,
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Trace<'a>, IdentifyError> {
    progress(Progress::Fitting);
    let (mut problem, mut before_fit) = prepare(session, options.seed)?;
    if give_noise_memory(&mut problem, &before_fit.residuals) {
        before_fit = fit(&problem, Some(&before_fit.beta))?;
    }
    let residuals = before_fit.residuals.clone();
    let first = trace_with(problem, before_fit, &residuals, options, progress)?;
    // What moved between runs was taken for noise as long as the model lacked it.
    let mut problem = first.before.clone();
    if first.effects.is_empty() || !give_noise_memory(&mut problem, &first.after_fit.residuals) {
        return Ok(first);
    }
    let before_fit = fit(&problem, Some(&first.before_fit.beta))?;
    let residuals = first.after_fit.residuals;
    trace_with(problem, before_fit, &residuals, options, progress)
}

/// Closes the loop with a given noise; `pure` are the residuals whose repeats show it.
fn trace_with<'a>(
    problem: Problem<'a>,
    before_fit: Fit,
    pure: &[Vec<f64>],
    options: &TraceOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Trace<'a>, IdentifyError> {
    let poses = problem.folds.kind == FoldKind::Poses;
    let columns = Columns::new(&problem, &before_fit.beta)?;
    let start = Start::of(&problem, &columns, &before_fit)?;
    let null = |block: usize| {
        let (count, seed) = (draws_of(options), options.seed);
        null::draws(&problem, &columns, pure, &start.residual, count, block, seed)
    };
    let structure_before = || {
        let (model, prior) = (start.model.clone(), start.prior());
        let draws = null(null::SINGLE);
        remainder::structure(&problem, &columns, model, &start.residual, draws, &prior)
    };
    let (draws, structure_before) = rayon::join(|| null(null::BLOCK), || (!poses).then(structure_before));

    let mut candidates = library::candidates(&problem)?;
    candidates.retain(|candidate| chosen(options, &candidate.effect.id()));
    let (reserve, candidates): (Vec<_>, Vec<_>) = candidates
        .into_par_iter()
        .filter_map(|candidate| {
            columns
                .layout(&candidate.effect)
                .map(|layout| (candidate, layout))
        })
        .collect::<Vec<_>>()
        .into_iter()
        .partition(|(candidate, _)| candidate.last_resort);
    let (candidates, layouts): (Vec<Candidate>, Vec<Layout>) = candidates.into_iter().unzip();
    let looked_for = candidates.len() + reserve.len();
    progress(Progress::Screening(looked_for));
    let (model, prior) = (start.model.clone(), start.prior());
    let moments = Moments::new(&columns, &layouts, model, &start.residual, draws);
    let stop = Stop {
        significance: options.significance,
        most: options
            .max_effects
            .unwrap_or(if poses { MOST_OF_POSES } else { MOST_ALONG_RUNS }),
        in_residual_variance: poses,
    };
    let plain = start.plain(&columns, &before_fit.beta, problem.noise.sigma_mm)?;
    let mut search = Search::new(&columns, candidates, layouts, moments, prior, plain, stop);
    let seen = search
        .model_without(None)
        .gains()
        .iter()
        .filter(|gain| gain.freedom > 0)
        .count();
    search.reserve = reserve;
    let scale_um = problem.noise.sigma_mm * 1e3;
    let rms_um = |sum: f64| (sum / columns.rows().max(1) as f64).sqrt() * scale_um;
    let mut steps = Vec::new();
    let mut ended = search_on(&mut search, &rms_um, &mut steps, progress);
    progress(Progress::Judging);
    let mut judged = judge(&problem, &before_fit, &search, options, structure_before.as_ref())?;
    let unexplained = judged
        .structure
        .as_ref()
        .is_none_or(|structure| structure.p_value <= STRUCTURED);
    if unexplained && ended.is_some() && search.taken().len() < stop.most {
        // Nothing simpler is left: free curves.
        search.bring_reserve();
        search.last_resort = true;
        let taken = search.taken().len();
        ended = search_on(&mut search, &rms_um, &mut steps, progress);
        if search.taken().len() != taken {
            judged = judge(&problem, &before_fit, &search, options, structure_before.as_ref())?;
        }
    }
    let structured = |judged: &Judged<'_>| {
        let structure = judged.structure.as_ref();
        structure.is_some_and(|structure| structure.p_value <= STRUCTURED)
    };
    if !poses && search.disown(structured(&judged)) {
        judged = judge(&problem, &before_fit, &search, options, structure_before.as_ref())?;
    }
    let Judged {
        after,
        after_fit,
        effects,
        structure: structure_after,
    } = judged;
    let reported = report::report(&report::Findings {
        before: &problem,
        before_fit: &before_fit,
        after: &after,
        after_fit: &after_fit,
        search: &search,
        start: &start,
        structure_before: structure_before.as_ref(),
        structure_after: structure_after.as_ref(),
        last_p_value: ended.unwrap_or(1.0),
        stopped_early: ended.is_none() || search.taken().len() >= stop.most,
        candidates: looked_for,
        candidates_seen: seen,
    })?;
    drop(search);
    drop(columns);
    Ok(Trace {
        before: problem,
        before_fit,
        after,
        after_fit,
        effects,
        look_alikes: reported.look_alikes,
        rivals: reported.rivals,
        steps,
        result: reported.result,
    })
}

/// Rounds until nothing earns its place any more: the p-value of the best that was not taken. `None` if the user has seen enough.
fn search_on(
    search: &mut Search<'_>,
    rms_um: &dyn Fn(f64) -> f64,
    steps: &mut Vec<Step>,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Option<f64> {
    // Effects that are put down to one make room for others; that must end.
    let mut rounds = 0;
    loop {
        rounds += 1;
        if rounds > search.most_rounds() {
            return Some(1.0);
        }
        match search.round() {
            Round::Done { .. } if search.retune() || search.regroup() => {}
            Round::Done { p_value } => return Some(p_value),
            Round::Added { candidate } => {
                // Every exchange costs a model an effect; among many effects the gain is small and a sweep now and then will do.
                let taken = search.taken().len();
                if taken <= EXCHANGED_EACH_ROUND || taken.is_multiple_of(EXCHANGED_EACH) {
                    search.exchange();
                }
                search.merge();
                let held_out = search.held_out.last().copied().unwrap_or(0.0);
                let id = search.candidates[candidate].effect.id();
                steps.push(Step {
                    id: id.clone(),
                    effects: search.taken().len(),
                    heldout_rms_um: rms_um(held_out),
                });
                if !progress(Progress::Taken(search.taken().len(), id, rms_um(held_out))) {
                    return None;
                }
            }
        }
    }
}

/// The model with what the search has taken, refitted, and what it leaves.
struct Judged<'a> {
    after: Problem<'a>,
    after_fit: Fit,
    effects: Vec<Effect>,
    structure: Option<remainder::Structure>,
}

fn judge<'a>(
    problem: &Problem<'a>,
    before_fit: &Fit,
    search: &Search<'_>,
    options: &TraceOptions,
    structure_before: Option<&remainder::Structure>,
) -> Result<Judged<'a>, IdentifyError> {
    let effects: Vec<Effect> = search
        .taken()
        .iter()
        .map(|taken| search.candidates[taken.candidate].effect.clone())
        .collect();
    if effects.is_empty() {
        return Ok(Judged {
            after: problem.clone(),
            after_fit: before_fit.clone(),
            effects,
            structure: structure_before.cloned(),
        });
    }
    let mut after = problem.clone();
    for effect in &effects {
        after.add_effect(effect)?;
    }
    let after_fit = fit(&after, Some(&start_of(&after, before_fit)))?;
    let structure = match structure_before {
        None => None,
        Some(_) => {
            let columns = Columns::new(&after, &after_fit.beta)?;
            let end = Start::of(&after, &columns, &after_fit)?;
            let seed = options.seed.wrapping_add(1);
            let draws = null::draws(
                &after,
                &columns,
                &after_fit.residuals,
                &end.residual,
                draws_of(options),
                null::SINGLE,
                seed,
            );
            let prior = end.prior();
            Some(remainder::structure(
                &after,
                &columns,
                end.model,
                &end.residual,
                draws,
                &prior,
            ))
        }
    };
    Ok(Judged {
        after,
        after_fit,
        effects,
        structure,
    })
}

/// As many draws as are asked for, and as many as the significance needs: fewer could not show it.
fn draws_of(options: &TraceOptions) -> usize {
    let least = (1.0 / options.significance.max(1e-6)).ceil() as usize;
    options.draws.max(least - 1)
}

fn chosen(options: &TraceOptions, id: &str) -> bool {
    let matches = |patterns: &[String]| patterns.iter().any(|pattern| id.contains(pattern.as_str()));
    (options.only.is_empty() || matches(&options.only)) && !matches(&options.exclude)
}

/// The declared model's unknowns, and zeros for the effects' coefficients.
fn start_of(after: &Problem<'_>, before: &Fit) -> Vec<f64> {
    let mut start = vec![0.0; after.parameters.list.len()];
    start[..before.beta.len()].copy_from_slice(&before.beta);
    start
}

/// Takes size and memory of the noise from repeats, where there are enough. Returns whether that changed them by more than estimates of the noise
/// scatter anyway.
fn give_noise_memory(problem: &mut Problem<'_>, residuals: &[Vec<f64>]) -> bool {
    if problem.folds.kind == FoldKind::Poses {
        return false;
    }
    let kept = |test: usize, row: usize| !problem.rejected[test][row];
    let pure = PureError::of(&problem.tests, residuals, kept).without_waves(&problem.tests, kept);
    let Some(memory) = pure.memory(&problem.tests, kept) else {
        return false;
    };
    let mut noise = problem.noise.clone();
    noise.memory = memory.coefficients;
    noise.memory_u = memory.sum_u;
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
            .all(|(a, b)| (a - b).abs() < 0.02);
    if same_memory && (noise.sigma_mm / present.sigma_mm - 1.0).abs() < 0.02 {
        return false;
    }
    problem.noise = noise;
    true
}

/// The fitted model as the search takes it: orthonormal columns and the residual, whitened, in the order of the folds.
pub struct Start {
    /// Rows × rank.
    pub model: Mat<f64>,
    /// One a row.
    pub residual: Vec<f64>,
    /// Orthonormal coordinates to unknowns in inside units: unknowns × rank.
    pub to_unknowns: Mat<f64>,
    prior_rows: Mat<f64>,
    prior_residual: Vec<f64>,
}

impl Start {
    fn of(problem: &Problem<'_>, columns: &Columns<'_, '_>, fit: &Fit) -> Result<Start, IdentifyError> {
        let unknowns = fit.beta.len();
        let basis = &fit.rank.seen;
        let rank = basis.ncols();
        let rows = columns.model_rows(&fit.beta)?;
        let residual = (0..rows.nrows()).map(|i| rows[(i, unknowns)]).collect();
        let prior = problem.prior_triangle(&fit.beta);
        let mut whole = Triangle::new(unknowns);
        whole.merge(&prior);
        fit.triangles.iter().for_each(|triangle| whole.merge(triangle));
        let (r, _, _) = in_directions(&whole, basis).parts();
        let inverse = inverse_of_triangle(&r);
        let to_unknowns = basis * &inverse;
        let model = rows.as_ref().subcols(0, unknowns) * &to_unknowns;
        let (of_prior, prior_residual, _) = prior.parts();
        let prior_rows = &of_prior * &to_unknowns;
        debug_assert_eq!(model.ncols(), rank);
        Ok(Start {
            model,
            residual,
            to_unknowns,
            prior_rows,
            prior_residual,
        })
    }

    fn plain(&self, columns: &Columns<'_, '_>, beta: &[f64], sigma_mm: f64) -> Result<Plain, IdentifyError> {
        let rows = columns.plain_model_rows(beta)?;
        let unknowns = beta.len();
        let base = rows.as_ref().subcols(0, unknowns) * &self.to_unknowns;
        Ok(Plain {
            base: Mat::from_fn(base.nrows(), base.ncols(), |i, j| base[(i, j)] / sigma_mm),
            residual: (0..rows.nrows())
                .map(|i| rows[(i, unknowns)] / sigma_mm)
                .collect(),
            folds: columns.plain_folds(),
            sigma_mm,
        })
    }

    fn prior(&self) -> PriorMoments {
        let rank = self.to_unknowns.ncols();
        PriorMoments {
            base: self.prior_rows.transpose() * &self.prior_rows,
            base_y: (0..rank)
                .map(|k| {
                    let with = |i: usize| self.prior_rows[(i, k)] * self.prior_residual[i];
                    (0..self.prior_rows.nrows()).map(with).sum()
                })
                .collect(),
        }
    }
}

/// The inverse of an upper triangle by back substitution.
fn inverse_of_triangle(r: &Mat<f64>) -> Mat<f64> {
    let n = r.nrows();
    let mut inverse = Mat::zeros(n, n);
    for column in 0..n {
        for i in (0..=column).rev() {
            let unit = if i == column { 1.0 } else { 0.0 };
            let sum: f64 = (i + 1..=column).map(|k| r[(i, k)] * inverse[(k, column)]).sum();
            inverse[(i, column)] = if r[(i, i)] != 0.0 {
                (unit - sum) / r[(i, i)]
            } else {
                0.0
            };
        }
    }
    inverse
}

/// An entry of the library as laid out for a session.
#[derive(Clone, Debug)]
pub struct ListEntry {
    /// Its identifier.
    pub id: String,
    /// Index of its family.
    pub family: usize,
    /// Whether the session's readings can see it beside the declared unknowns.
    pub seen: bool,
}

/// The library as laid out for a session, with which entries its readings can see.
///
/// # Errors
/// If the session cannot be fitted.
pub fn list(session: &Session, options: &TraceOptions) -> Result<Vec<ListEntry>, IdentifyError> {
    let (problem, fit) = prepare(session, options.seed)?;
    let columns = Columns::new(&problem, &fit.beta)?;
    let start = Start::of(&problem, &columns, &fit)?;
    let prior = start.prior();
    let (candidates, layouts): (Vec<Candidate>, Vec<Layout>) = library::candidates(&problem)?
        .into_iter()
        .filter(|candidate| chosen(options, &candidate.effect.id()))
        .filter_map(|candidate| {
            columns
                .layout(&candidate.effect)
                .map(|layout| (candidate, layout))
        })
        .unzip();
    let none = Mat::zeros(columns.rows(), 0);
    let moments = Moments::new(&columns, &layouts, start.model, &start.residual, none);
    let rank = moments.base();
    let folds = (0..columns.fold_rows.len()).collect();
    let trained = score::Trained::new(&moments, &prior, (0..rank).collect(), folds);
    Ok(candidates
        .into_iter()
        .zip(trained.gains())
        .map(|(candidate, gain)| ListEntry {
            id: candidate.effect.id(),
            family: candidate.family,
            seen: gain.freedom > 0,
        })
        .collect())
}
