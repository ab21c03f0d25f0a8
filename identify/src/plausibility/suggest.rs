//! Which single mistake would remove the conflicts: a refit with each, compared by evidence.

use rayon::prelude::*;

use super::hypotheses::{self, Hypothesis};
use super::quick_fit::{Trial, thinned, trial};
use super::results::{Conflict, Suggestion, SuggestionKind};
use crate::noise::{Noise, NoiseSource};
use crate::problem::Problem;

/// Readings that are refitted with each mistake.
const MAX_READINGS: usize = 1500;
/// By how much a mistake has to raise twice the logarithm of the evidence: odds of 20,000 to 1.
const MIN_RISE: f64 = 20.0;
/// Mistakes whose evidence is within this of the best (odds of 150 to 1) are listed too.
const NOT_SEPARABLE: f64 = 10.0;
/// The most that are listed.
const MAX_LISTED: usize = 5;
/// Up to so many things of the set-up all of them are tried, beyond it those whose parameters are contradicted.
const MAX_HYPOTHESES: usize = 40;
/// By how much a mistake has to lower χ² for it to be suggested on the residual alone.
const LOWERED: f64 = 4.0;

/// The mistakes that remove the conflicts of a session whose instrument reads between table and tool, the most probable first. Without conflicts
/// only those that need no further parameter and explain most of the residual.
pub(super) fn suggestions(problem: &Problem<'_>, conflicts: &[Conflict]) -> Vec<Suggestion> {
    let by_residual = conflicts.is_empty();
    let noise = Noise::white(problem.noise.sigma_mm, NoiseSource::Stated);
    let stated = thinned(problem, MAX_READINGS);
    // Where even the first steps fail, anything that fits is better.
    let base = trial(&stated, &noise).unwrap_or(Trial {
        chi_square: f64::INFINITY,
        freedom: 1.0,
        rms_mm: f64::INFINITY,
        cost: 0.0,
    });
    let mut list = hypotheses::of_two_sides(&stated);
    let many = list.iter().filter(|one| !needs_no_parameter(one.kind)).count() > MAX_HYPOTHESES;
    list.retain(|one| {
        needs_no_parameter(one.kind) || !(by_residual || many && !is_contradicted(one, problem, conflicts))
    });
    let mut tried: Vec<(Hypothesis, Trial)> = list
        .into_par_iter()
        .filter_map(|hypothesis| trial(&hypothesis.session, &noise).map(|found| (hypothesis, found)))
        .collect();
    if by_residual {
        tried.retain(|(_, found)| found.chi_square * LOWERED < base.chi_square);
    }
    // What even the best leaves is not for a mistake of the session to explain.
    let excess = |found: &Trial| (found.chi_square / found.freedom).max(1.0);
    let scale = tried
        .iter()
        .map(|(_, found)| excess(found))
        .fold(excess(&base), f64::min);
    let mut scored: Vec<(f64, Suggestion)> = (tried.into_iter())
        .map(|(hypothesis, found)| {
            let suggestion = Suggestion {
                kind: hypothesis.kind,
                subject: hypothesis.subject,
                rms_um: found.rms_mm * 1e3,
                words: hypothesis.words,
            };
            (found.score(scale), suggestion)
        })
        .filter(|(score, _)| *score < base.score(scale) - MIN_RISE)
        .collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best = scored.first().map_or(0.0, |(score, _)| *score);
    (scored.into_iter())
        .take_while(|(score, _)| *score <= best + NOT_SEPARABLE)
        .take(MAX_LISTED)
        .map(|(_, suggestion)| suggestion)
        .collect()
}

/// Whether a mistake is about something whose parameters the readings contradict.
fn is_contradicted(hypothesis: &Hypothesis, problem: &Problem<'_>, conflicts: &[Conflict]) -> bool {
    let group = |id: &str| {
        id.split_once('[')
            .map(|(_, group)| group.trim_end_matches(']').to_string())
    };
    let test = problem.tests.iter().find(|test| test.name == hypothesis.subject);
    conflicts.iter().any(|conflict| match (hypothesis.kind, test) {
        (SuggestionKind::OtherSession, Some(test)) => group(&conflict.subject)
            .is_some_and(|group| [&test.setup, &test.spindle_setup, &test.bar_setup].contains(&&group)),
        _ => {
            let thing = hypothesis.subject.split('[').next().unwrap_or_default();
            conflict.subject.starts_with(thing) && group(&conflict.subject) == group(&hypothesis.subject)
        }
    })
}

/// Whether a mistake changes a statement and frees nothing.
fn needs_no_parameter(kind: SuggestionKind) -> bool {
    !matches!(kind, SuggestionKind::WrongSetup | SuggestionKind::OtherSession)
}
