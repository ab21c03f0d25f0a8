//! The single mistakes that remove the conflicts, found by a refit with each. The likelihood decides which are listed,
//! the evidence decides their order.

use abbe_model::session::Session;

use super::hypotheses::{self, Hypothesis};
use super::quick_fit::{Trial, thinned, trial};
use super::results::{Conflict, Suggestion, SuggestionKind};
use crate::noise::{Noise, NoiseSource};
use crate::numerics::parallel;
use crate::problem::Problem;

/// Number of readings that are refitted with each mistake.
const MAX_READINGS: usize = 1500;
/// Least decrease of χ² by a listed mistake: a likelihood ratio of 150.
const MIN_FALL: f64 = 10.0;
/// Maximum number of mistakes that are listed.
const MAX_LISTED: usize = 10;
/// Up to this number all mistakes that free parameters are tried, beyond it those whose parameters are contradicted.
const MAX_HYPOTHESES: usize = 40;
/// If the noise of every fit exceeds the assumed variance by more than this factor, the fits are repeated with the
/// larger variance.
const MAX_EXCESS: f64 = 1.2;
/// Scores that differ by less than the reciprocal of this are equal.
const TIED: f64 = 100.0;
/// Least factor by which a mistake that is suggested from the residual alone lowers χ².
const LOWERED: f64 = 4.0;
/// Least χ²/ν of readings in another unit. Readings that are scaled down leave less than any noise, whatever is wrong with them.
const LEAST_OF_UNIT: f64 = 0.5;

/// The mistakes that remove the conflicts of a session whose instrument reads between table and tool, the most probable
/// first. Without conflicts only those that need no further parameter and explain most of the residual.
///
/// A mistake is listed if the readings do not reject it: its χ² exceeds the least χ² of all mistakes by no more than
/// `allowed`. What the readings do not reject is ordered by evidence, which depends on the prior volume of the
/// parameters that a mistake frees; that volume decides nothing else.
pub(super) fn suggestions(problem: &Problem, conflicts: &[Conflict], allowed: f64) -> Vec<Suggestion> {
    let by_residual = conflicts.is_empty();
    let sigma_mm = problem.noise.sigma_mm;
    let stated = thinned(problem, MAX_READINGS);
    let mut list = hypotheses::of_two_sides(&stated);
    let many = list.iter().filter(|one| !needs_no_parameter(one.kind)).count() > MAX_HYPOTHESES;
    // The noise of repeats is in the unit of the readings, and does not tell which it is.
    let is_stated = problem.noise.source == NoiseSource::Stated;
    list.retain(|one| is_stated || one.factor == 1.0);
    list.retain(|one| {
        needs_no_parameter(one.kind) || !(by_residual || many && !is_contradicted(one, problem, conflicts))
    });
    let (mut base, mut tried) = trials(&stated, list, sigma_mm);
    if by_residual {
        // Readings that are scaled leave a residual that is scaled with them.
        let lowers = |factor: f64, found: &Trial| found.rms_mm.powi(2) * LOWERED < (factor * base.rms_mm).powi(2);
        tried.retain(|(one, found)| {
            found.chi_square * LOWERED < base.chi_square && (one.factor == 1.0 || lowers(one.factor, found))
        });
    }
    // The residual of the best fit is noise that no mistake explains. The priors keep their weight.
    let excess = (tried.iter()).map(|(_, found)| found.excess).fold(base.excess, f64::min);
    if excess > MAX_EXCESS {
        let list = tried.into_iter().map(|(hypothesis, _)| hypothesis).collect();
        (base, tried) = trials(&stated, list, sigma_mm * excess.sqrt());
    }
    let least = (tried.iter()).map(|(_, found)| found.chi_square).fold(base.chi_square, f64::min);
    let mut listed: Vec<(i64, Suggestion)> = (tried.into_iter())
        .filter(|(_, found)| found.chi_square - least <= allowed && base.chi_square - found.chi_square >= MIN_FALL)
        .map(|(hypothesis, found)| {
            let suggestion = Suggestion {
                kind: hypothesis.kind,
                subject: hypothesis.subject,
                rms_um: found.rms_mm * 1e3,
                words: hypothesis.words,
            };
            ((found.score() * TIED).round() as i64, suggestion)
        })
        .collect();
    // Stable: equal scores keep the order in which mistakes are tried.
    listed.sort_by_key(|(score, _)| *score);
    listed.truncate(MAX_LISTED);
    listed.into_iter().map(|(_, suggestion)| suggestion).collect()
}

/// Fits the session as it is stated, and with each mistake that can be fitted. Readings `z = f·y` in another unit have the density
/// `p(z)·f` for each reading, so that `−2·N·ln f` is added to their χ².
fn trials(stated: &Session, list: Vec<Hypothesis>, sigma_mm: f64) -> (Trial, Vec<(Hypothesis, Trial)>) {
    let noise = Noise::white(sigma_mm, NoiseSource::Stated);
    // If the session as stated cannot be fitted, every mistake that can be fitted is better.
    let base = trial(stated, &noise).unwrap_or(Trial {
        chi_square: f64::INFINITY,
        excess: f64::INFINITY,
        ratio: f64::INFINITY,
        readings: 0,
        rms_mm: f64::INFINITY,
        cost: 0.0,
    });
    let found = parallel::map(list.len(), &|k| {
        let (factor, found) = (list[k].factor, trial(&list[k].session, &noise)?);
        let chi_square = found.chi_square - 2.0 * found.readings as f64 * factor.ln();
        (factor == 1.0 || found.ratio >= LEAST_OF_UNIT).then_some(Trial { chi_square, ..found })
    });
    (base, list.into_iter().zip(found).filter_map(|(hypothesis, found)| Some((hypothesis, found?))).collect())
}

/// Whether a mistake is about something whose parameters the readings contradict.
fn is_contradicted(hypothesis: &Hypothesis, problem: &Problem, conflicts: &[Conflict]) -> bool {
    let group = |id: &str| id.split_once('[').map(|(_, group)| group.trim_end_matches(']').to_string());
    let test = problem.tests.iter().find(|test| test.name == hypothesis.subject);
    conflicts.iter().any(|conflict| match (hypothesis.kind, test) {
        (SuggestionKind::OtherSession | SuggestionKind::SetupMoved, Some(test)) => group(&conflict.subject)
            .is_some_and(|group| [&test.setup, &test.spindle_setup, &test.bar_setup].contains(&&group)),
        _ => {
            let thing = hypothesis.subject.split('[').next().unwrap_or_default();
            let groups = group(&hypothesis.subject).unwrap_or_default();
            let of_conflict = group(&conflict.subject).unwrap_or_default();
            conflict.subject.starts_with(thing) && groups.split('+').any(|group| group == of_conflict)
        }
    })
}

/// Whether a mistake changes a statement and frees nothing.
fn needs_no_parameter(kind: SuggestionKind) -> bool {
    !matches!(kind, SuggestionKind::WrongSetup | SuggestionKind::SetupMoved | SuggestionKind::OtherSession)
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use abbe_files::ReadOptions;

    use super::*;

    /// The residual alone names no mistake that frees a parameter: freeing a set-up always lowers χ².
    #[test]
    fn the_residual_alone_frees_no_parameter() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        // One test is 2 mm too short throughout, as with another bar.
        let readings = session.tests[1].readings.as_mut().unwrap();
        Arc::make_mut(readings).observed.iter_mut().for_each(|observed| *observed -= 2.0);
        let problem = Problem::new(&session, Noise::white(1e-3, NoiseSource::Stated), 1).unwrap();
        let allowed = super::super::Pulls::default().allowed();
        let told = suggestions(&problem, &[], allowed);
        assert!(told.iter().all(|one| needs_no_parameter(one.kind)), "{told:?}");
        // The same hypotheses are tried where a conflict is about the test.
        let tried = hypotheses::of_two_sides(&session);
        let other = |one: &&Hypothesis| one.kind == SuggestionKind::OtherSession;
        assert_eq!(tried.iter().filter(other).count(), session.tests.len());
        session.tests.truncate(2);
        assert_eq!(hypotheses::of_two_sides(&session).iter().filter(other).count(), 2);
        session.tests.truncate(1);
        assert_eq!(hypotheses::of_two_sides(&session).iter().filter(other).count(), 0);
    }
}
