//! Verdict of a trace and the residual of its model.

use abbe_identify::results::TraceVerdict;

use super::TraceFindings;
use crate::constants::EXPLAINED_SHARE;
use crate::remainder::Structure;
use crate::result::Remainder;

/// The verdict of the search, and the residual of the model with the found effects, if it has found any.
pub(super) fn verdict(findings: &TraceFindings<'_>, found: bool) -> (TraceVerdict, Remainder) {
    if findings.interrupted {
        return (TraceVerdict::Incomplete, not_examined());
    }
    if !findings.search.policy.tests_structure {
        return of_poses(found, findings.stopped_early, findings.structure_after, findings.last_p_value);
    }
    let Some(after) = findings.structure_after else {
        return (TraceVerdict::Incomplete, not_examined());
    };
    let remainder = remainder(after);
    let structured = remainder.structured;
    let before = findings.structure_before.map_or(0.0, |structure| structure.excess);
    let share = if before > 0.0 { after.excess / before } else { 0.0 };
    let word = word(found, structured, share);
    (word, remainder)
}

fn remainder(structure: &Structure) -> Remainder {
    let structured = structure.is_significant();
    Remainder { structured, p_value: structure.p_value, place: structured.then(|| structure.description.clone()) }
}

/// The verdict of a search on independent poses. `structure` is that of the residual of the last model, `None` if there are
/// too few poses to test it; `last_p_value` is that of the best effect that was not added.
pub(super) fn of_poses(
    found: bool,
    stopped_early: bool,
    structure: Option<&Structure>,
    last_p_value: f64,
) -> (TraceVerdict, Remainder) {
    let untested = Remainder { structured: false, p_value: last_p_value, place: None };
    let remainder = structure.map_or(untested, remainder);
    let word = match (found, remainder.structured) {
        (false, false) => TraceVerdict::Clean,
        (false, true) => TraceVerdict::Unexplained,
        (true, false) if !stopped_early => TraceVerdict::Explained,
        (true, _) => TraceVerdict::PartlyExplained,
    };
    (word, remainder)
}

/// Description of the residual of an interrupted trace.
pub(super) fn not_examined() -> Remainder {
    Remainder { structured: false, p_value: 1.0, place: Some("not examined: the trace was interrupted".to_string()) }
}

/// What is said of a search along runs: whether it found anything, whether structure remains, and what share of its
/// excess over noise.
fn word(found: bool, structured: bool, share: f64) -> TraceVerdict {
    match (found, structured) {
        (false, false) => TraceVerdict::Clean,
        (false, true) => TraceVerdict::Unexplained,
        (true, false) => TraceVerdict::Explained,
        (true, true) if share < EXPLAINED_SHARE => TraceVerdict::PartlyExplained,
        (true, true) => TraceVerdict::Unexplained,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_says_whether_most_of_the_structure_is_explained() {
        for (found, structured, share, verdict) in [
            (false, false, 0.0, TraceVerdict::Clean),
            (false, true, 1.0, TraceVerdict::Unexplained),
            (true, false, 0.9, TraceVerdict::Explained),
            (true, true, 0.2, TraceVerdict::PartlyExplained),
            (true, true, 0.8, TraceVerdict::Unexplained),
        ] {
            assert_eq!(word(found, structured, share), verdict);
        }
    }
}
