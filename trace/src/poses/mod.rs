//! The search on independent poses. Families of effects and single effects compete on one figure: the held-out error over
//! blocks of joint space.
//!
//! Groups of families are added first ([`groups`]), then single effects ([`single_effects`]), then groups again. A curve of
//! all orders explains whatever a joint does about its own axis, at the price of many coefficients. Where few orders are
//! the truth, they predict better: the search is repeated without the spectra, and its model is chosen unless the spectra
//! lower the held-out error by more than the standard error of the difference. With very many poses it is not repeated.
//!
//! At the end an effect without which the held-out error does not rise by more than the standard error of the rise is
//! removed. What is chosen depends on the readings and not on the noise that the session states, since the noise of a
//! family is estimated from the residual.

mod aliases;
mod groups;
mod single_effects;

use abbe_identify::error::{INTERRUPTED, NO_CONVERGENCE};
use abbe_identify::fit::families::FoldEquations;
use abbe_identify::fit::{Fit, NearMinimum, prepare_with, with_families_linearised};
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::effect::Effect;

use super::candidates::columns::Columns;
use super::constants::HIGHEST_ORDER_OF_SPECTRA;
use super::interrupt::Interrupt;
use super::policy::{Policy, has_few_poses};
use super::result::effective_parameters;
use super::{Progress, TraceOptions};
use crate::paired::HeldOutDecrease;
pub(super) use aliases::PoseAlias;
pub(super) use groups::proposed_ids;
use single_effects::{Ended, Library, Limits};

/// A model with the effects that the search accepted.
#[derive(Clone)]
struct PoseModel {
    /// The problem with their effects.
    problem: Problem,
    /// Its estimates.
    near: NearMinimum,
    /// The effects, in the order of the parameters.
    effects: Vec<AcceptedEffect>,
    /// Number of effects in the proposed groups.
    proposed: usize,
}

/// An accepted effect.
#[derive(Clone, Debug)]
pub(super) struct AcceptedEffect {
    pub effect: Effect,
    /// What its group is, in words.
    pub group: String,
    /// Whether it was added alone, not as a member of a group.
    pub is_single: bool,
    /// Of a family: probability of at least the decrease of the held-out error by its group, if the group has no effect.
    /// Of a single effect: probability of a gain as large among all candidates, with the inflated noise.
    pub p_value: f64,
    /// Held-out rms with its group and those before it, mm.
    pub heldout_rms_mm: f64,
    /// Of a single effect: its aliases, the most probable first.
    pub aliases: Vec<PoseAlias>,
}

/// The outcome of a search.
pub(super) struct PoseSearch {
    /// The problem with the accepted effects.
    pub problem: Problem,
    /// Its fit.
    pub fit: Fit,
    /// The effects, in the order of the parameters.
    pub effects: Vec<AcceptedEffect>,
    /// Number of effects in the proposed groups.
    pub proposed: usize,
    /// Number of single effects that were screened.
    pub candidates: usize,
    /// Number of those that the readings would show.
    pub detectable: usize,
    /// p-value of the best single effect that was not added.
    pub last_p_value: f64,
    /// Whether the caller interrupted the search.
    pub interrupted: bool,
}

impl PoseModel {
    fn of(problem: &Problem, fit: &Fit) -> PoseModel {
        let near = NearMinimum {
            beta: fit.beta.clone(),
            residuals: fit.residuals.clone(),
            held_out_rms_mm: fit.held_out.rms_mm,
            inflation: None,
        };
        PoseModel { problem: problem.clone(), near, effects: Vec::new(), proposed: 0 }
    }

    /// The model without some of its effects.
    ///
    /// # Errors
    /// If it cannot be fitted.
    fn without(&self, declared: (&Problem, &Fit), removed: &[usize]) -> Result<PoseModel, Diagnostic> {
        let (mut problem, first) = (declared.0.clone(), declared.0.parameters.list.len());
        let mut effects = Vec::new();
        let mut beta = self.near.beta[..first].to_vec();
        let mut next = first;
        for (k, accepted) in self.effects.iter().enumerate() {
            let own = next..next + accepted.effect.shape.coefficients();
            next = own.end;
            if !removed.contains(&k) {
                problem.add_effect(&accepted.effect)?;
                effects.push(accepted.clone());
                beta.extend(&self.near.beta[own]);
            }
        }
        let (problem, near) = with_families_linearised(problem, beta, self.near.inflation)?;
        Ok(PoseModel { problem, near, effects, proposed: self.proposed })
    }
}

/// Searches families and single effects for a fitted problem. `None` if no family remains, or if the fit has no degree of
/// freedom: single effects alone are found by the search of the library.
///
/// # Errors
/// If a model cannot be fitted, or `INTERRUPTED` before a group was accepted.
pub(super) fn search(
    problem: &Problem,
    fit: &Fit,
    options: &TraceOptions,
    policy: Policy,
    interrupt: Interrupt<'_>,
) -> Result<Option<PoseSearch>, Diagnostic> {
    // Without a degree of freedom nothing is left to explain, and the noise that families need has no estimate.
    if problem.scalars() <= fit.rank.identifiable_basis.ncols() {
        return Ok(None);
    }
    let most = policy.max_effects;
    let mut with = PoseModel::of(problem, fit);
    let may_repeat = !has_few_poses(problem) && !determines_spectra(problem);
    let has_groups = groups::add(&mut with, options, true, most, interrupt)?
        || may_repeat && groups::add(&mut with, options, false, most, interrupt)?;
    if !has_groups {
        return Ok(None);
    }
    for (k, accepted) in with.effects.iter().enumerate() {
        let held_out_um = accepted.heldout_rms_mm * 1e3;
        (interrupt.0)(Progress::SelectedEffect(k + 1, accepted.effect.id(), held_out_um, problem.unit()));
    }
    let columns = Columns::new(problem, &fit.beta);
    let library = Library::of(problem, &columns, fit, options)?;
    (interrupt.0)(Progress::Screening(library.count()));
    let limits = Limits { effects: most, significance: policy.significance, to_reach_mm: None };
    let ended = complete((problem, fit), &mut with, &library, options, true, limits, interrupt);
    let mut chosen = PoseSearch::of(with, &library, ended, options.seed)?;
    if may_repeat && !chosen.interrupted {
        let mut without = PoseModel::of(problem, fit);
        let limits = Limits { to_reach_mm: Some(chosen.fit.held_out.rms_mm), ..limits };
        let ended = groups::add(&mut without, options, false, most, interrupt).and_then(|has_groups| {
            if !has_groups {
                (without.problem, without.near) =
                    with_families_linearised(without.problem.clone(), fit.beta.clone(), None)?;
            }
            complete((problem, fit), &mut without, &library, options, false, limits, interrupt)
        });
        match PoseSearch::of(without, &library, ended, options.seed) {
            // A model that cannot be fitted takes no place of one that can.
            Err(error) if error.code == NO_CONVERGENCE => {}
            found => {
                let single = found?;
                // An interrupted repetition says nothing of what single effects could reach.
                chosen.interrupted = single.interrupted;
                if !single.interrupted && !chosen.predicts_better_than(&single) {
                    chosen = single;
                }
            }
        }
    }
    if !chosen.has_families() {
        return Ok(None);
    }
    if !chosen.interrupted {
        match aliases::find(&mut chosen, &library, interrupt) {
            Err(error) if error.code == INTERRUPTED => chosen.interrupted = true,
            found => found?,
        }
    }
    Ok(Some(chosen))
}

/// Effective number of parameters below which a member of a family explains nothing.
const EXPLAINS_NOTHING: f64 = 0.05;
/// Share of the coefficients of the spectra of all joints in the scalar readings below which a curve of all orders predicts
/// as well as the few orders that it has: needless coefficients raise the held-out error by half of this share.
const NEGLIGIBLE_COEFFICIENTS: f64 = 0.05;

/// Whether the readings determine the spectra of all joints so well that single effects cannot predict better.
fn determines_spectra(problem: &Problem) -> bool {
    let joints = problem.session.machine.axes.iter().filter(|axis| axis.kind == AxisKind::Rotary).count();
    let coefficients = 2 * HIGHEST_ORDER_OF_SPECTRA * joints;
    coefficients as f64 <= NEGLIGIBLE_COEFFICIENTS * problem.scalars() as f64
}

impl PoseSearch {
    /// The fit of a session with the effects of a model, and how its search ended. The effects accepted before an interruption
    /// remain.
    ///
    /// # Errors
    /// If the search ended with an error, or the model cannot be fitted.
    fn of(
        model: PoseModel,
        library: &Library<'_>,
        ended: Result<Ended, Diagnostic>,
        seed: u64,
    ) -> Result<PoseSearch, Diagnostic> {
        let (ended, interrupted) = match ended {
            Err(error) if error.code == INTERRUPTED => (Ended { detectable: 0, last_p_value: 1.0 }, true),
            ended => (ended?, false),
        };
        let Ended { detectable, last_p_value } = ended;
        let PoseModel { problem, mut effects, proposed, .. } = model;
        let own: Vec<Effect> = effects.iter().map(|accepted| accepted.effect.clone()).collect();
        let declared = problem.parameters.effects.len() - own.len();
        let (mut problem, mut fit) = prepare_with(&problem.session, &own, seed)?;
        // A member of a family that has only its prior explains nothing.
        let determined = |k: usize| effective_parameters(&problem, &fit.covariance, declared + k);
        let idle = |k: usize| determined(k).is_some_and(|effective| effective < EXPLAINS_NOTHING);
        let kept: Vec<bool> = (0..own.len()).map(|k| !idle(k)).collect();
        if kept.contains(&false) {
            let mut is_kept = kept.iter();
            effects.retain(|_| is_kept.next() == Some(&true));
            let own: Vec<Effect> = effects.iter().map(|accepted| accepted.effect.clone()).collect();
            (problem, fit) = prepare_with(&problem.session, &own, seed)?;
        }
        let candidates = library.count();
        Ok(PoseSearch { problem, fit, effects, proposed, candidates, detectable, last_p_value, interrupted })
    }

    fn has_families(&self) -> bool {
        self.effects.iter().any(|accepted| !accepted.is_single)
    }

    /// Whether its held-out error is lower than that of another model by more than the standard error of the difference.
    fn predicts_better_than(&self, other: &PoseSearch) -> bool {
        HeldOutDecrease::over_blocks(&other.held_out_of_folds(self), &self.held_out_of_folds(other)).is_significant()
    }

    /// Sums of squares of the held-out residuals of the folds, mm², over the readings that another model counts too.
    fn held_out_of_folds(&self, other: &PoseSearch) -> Vec<f64> {
        let folds = &self.problem.folds;
        let mut sums = vec![0.0; folds.count];
        for (test, of_row) in folds.of_row.iter().enumerate() {
            let channels = self.problem.channels(test);
            for (i, value) in self.fit.held_out.residuals[test].iter().enumerate() {
                if self.problem.counts(test, i) && other.problem.counts(test, i) {
                    sums[of_row[i / channels]] += value * value;
                }
            }
        }
        sums
    }
}

/// Adds single effects, then groups, until neither lowers the held-out error, and removes what does not pay.
fn complete(
    declared: (&Problem, &Fit),
    model: &mut PoseModel,
    library: &Library<'_>,
    options: &TraceOptions,
    spectra: bool,
    limits: Limits,
    interrupt: Interrupt<'_>,
) -> Result<Ended, Diagnostic> {
    loop {
        let before = model.effects.len();
        let ended = single_effects::add(model, library, limits, interrupt)?;
        if model.effects.len() == before || !groups::add(model, options, spectra, limits.effects, interrupt)? {
            remove_needless(declared, model, interrupt)?;
            return Ok(ended);
        }
    }
}

/// Removes effects without which the held-out error does not rise by more than the standard error of the difference, the
/// one with the smallest rise first. The members of a group with one prior scale stay or go together.
fn remove_needless(
    declared: (&Problem, &Fit),
    model: &mut PoseModel,
    interrupt: Interrupt<'_>,
) -> Result<(), Diagnostic> {
    loop {
        interrupt.check()?;
        let (problem, list) = (&model.problem, &model.problem.parameters.list);
        let first = declared.0.parameters.effects.len();
        let found = |j: usize| list[j].coefficient_of().and_then(|effect| effect.checked_sub(first));
        // A parameter that is left out keeps its value, which is zero then.
        let beta: Vec<f64> =
            model.near.beta.iter().enumerate().map(|(j, b)| if found(j).is_some() { 0.0 } else { *b }).collect();
        let equations = FoldEquations::of(problem, &beta)?;
        let with = equations.held_out_at_present(problem)?;
        let mut least: Option<(Vec<usize>, f64)> = None;
        for members in together(&model.effects) {
            let stays = |j: &usize| found(*j).is_none_or(|effect| !members.contains(&effect));
            let kept: Vec<usize> = (0..list.len()).filter(stays).collect();
            let without = equations.with_parameters(&kept).held_out_at_present(problem)?;
            let rise = HeldOutDecrease::over_blocks(&without, &with);
            if !rise.is_significant() && least.as_ref().is_none_or(|(_, by)| rise.by < *by) {
                least = Some((members, rise.by));
            }
        }
        let Some((members, _)) = least else { return Ok(()) };
        *model = model.without(declared, &members)?;
    }
}

/// The effects that are removed together, by index: the members of a group with a common prior scale, each other effect
/// alone.
fn together(effects: &[AcceptedEffect]) -> Vec<Vec<usize>> {
    let mut sets: Vec<(Option<String>, Vec<usize>)> = Vec::new();
    for (k, accepted) in effects.iter().enumerate() {
        let family = accepted.effect.family();
        match sets.iter_mut().find(|(of, _)| of.is_some() && *of == family) {
            Some((_, members)) => members.push(k),
            None => sets.push((family, vec![k])),
        }
    }
    sets.into_iter().map(|(_, members)| members).collect()
}
