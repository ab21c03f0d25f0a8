//! Screens the library for a session: which effects apply to its readings, and which are observable in addition to the
//! declared parameters.

use abbe_identify::error::NOT_IN_THE_LIBRARY;
use abbe_identify::fit::prepare;
use abbe_identify::numerics::parallel;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Session;

use super::TraceOptions;
use super::start::Start;
use crate::candidates::candidate::Candidate;
use crate::candidates::columns::{Columns, EffectColumns};
use crate::candidates::gain::TrainedModel;
use crate::candidates::gram::Gram;
use crate::candidates::library::{self, LibraryEffect};

/// An effect of the library, screened for a session.
#[derive(Clone, Debug)]
pub struct ScreenedEffect {
    /// Its identifier.
    pub id: String,
    /// The effect.
    pub effect: Effect,
    /// Index of its family in the library.
    pub family: usize,
    /// Whether the effect is observable in addition to the declared parameters.
    pub observable: bool,
}

/// The library's effects for which the session has driver data, in the order of the library.
///
/// # Errors
/// If the session cannot be fitted.
pub fn screened_effects(session: &Session, options: &TraceOptions) -> Result<Vec<ScreenedEffect>, Diagnostic> {
    let (problem, fit) = prepare(session, options.seed)?;
    let columns = Columns::new(&problem, &fit.beta);
    let start = Start::of(&problem, &columns, &fit)?;
    let prior = start.prior();
    let searched = searched_candidates(&problem, &columns, options)?;
    let column_sets: Vec<EffectColumns> = searched.iter().map(|candidate| candidate.columns.clone()).collect();
    let gram = Gram::new(&columns, column_sets, start.model, &start.residual, prior);
    let folds: Vec<usize> = (0..columns.fold_rows.len()).collect();
    let trained = TrainedModel::new(&gram, &[], &folds)?;
    Ok(searched
        .iter()
        .zip(trained.gains(&|_| true)?)
        .map(|(candidate, gain)| ScreenedEffect {
            id: candidate.effect.id(),
            effect: candidate.effect.clone(),
            family: candidate.family,
            observable: gain.freedom > 0,
        })
        .collect())
}

/// The requested candidates for which the data have driver values, in the order of the library, with their basis
/// columns.
///
/// # Errors
/// If a requested string occurs in no identifier: a misspelt string would otherwise look like an absent effect.
pub(super) fn searched_candidates(
    problem: &Problem,
    columns: &Columns<'_>,
    options: &TraceOptions,
) -> Result<Vec<Candidate>, Diagnostic> {
    let mut candidates = library::candidates(problem)?;
    if let Some(text) = matching_no_candidate(&candidates, &options.only).next() {
        return Err(Diagnostic::coded(
            NOT_IN_THE_LIBRARY,
            format!(
                "no candidate effect of this session contains `{text}` in its identifier; identifiers look like EZC~C:h2"
            ),
        ));
    }
    let all = candidates.len();
    candidates.retain(|candidate| is_requested(options, &candidate.effect.id()));
    if candidates.is_empty() && all > 0 {
        return Err(Diagnostic::identification(
            "no candidate effects remain: the exclusions remove every selected effect; exclude fewer effects",
        ));
    }
    let column_sets = parallel::map(candidates.len(), &|k| columns.effect_columns(&candidates[k].effect));
    let found = candidates.into_iter().zip(column_sets);
    Ok(found.filter_map(|(member, columns)| Some(Candidate::of(member, columns?))).collect())
}

/// A warning for each exclusion that matches no candidate. `in_groups` are the identifiers of the effects that are
/// proposed in groups beside them.
pub(super) fn unused_exclusions(
    problem: &Problem,
    options: &TraceOptions,
    in_groups: &[String],
) -> Result<Vec<String>, Diagnostic> {
    let candidates = library::candidates(problem)?;
    let is_in_groups = |text: &&String| in_groups.iter().any(|id| id.contains(text.as_str()));
    Ok(matching_no_candidate(&candidates, &options.exclude)
        .filter(|text| !is_in_groups(text))
        .map(|text| format!("`{text}` excludes nothing: no candidate of this session has it in its identifier"))
        .collect())
}

/// The texts that occur in no candidate's identifier.
fn matching_no_candidate<'t>(candidates: &[LibraryEffect], texts: &'t [String]) -> impl Iterator<Item = &'t String> {
    let ids: Vec<String> = candidates.iter().map(|candidate| candidate.effect.id()).collect();
    texts.iter().filter(move |text| !ids.iter().any(|id| id.contains(text.as_str())))
}

/// Whether the caller asks for a candidate of this identifier.
pub(super) fn is_requested(options: &TraceOptions, id: &str) -> bool {
    let matches = |patterns: &[String]| patterns.iter().any(|pattern| id.contains(pattern.as_str()));
    (options.only.is_empty() || matches(&options.only)) && !matches(&options.exclude)
}
