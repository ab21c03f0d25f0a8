//! Verdict of a trace and the residual of its model.

use super::TraceFindings;
use crate::results::{EffectResult, Remainder};
use crate::trace::constants::EXPLAINED_SHARE;

/// The verdict, and the residual of the model with the found effects.
pub(super) fn verdict(findings: &TraceFindings<'_>, effects: &[EffectResult]) -> (String, Remainder) {
    if findings.interrupted {
        return (String::new(), not_examined());
    }
    let Some(after) = findings.structure_after else {
        let word = match (effects.is_empty(), findings.stopped_early) {
            (true, _) => "clean",
            (false, false) => "explained",
            (false, true) => "partly-explained",
        };
        let remainder = Remainder { structured: false, p_value: findings.last_p_value, place: None };
        return (word.to_string(), remainder);
    };
    let structured = after.is_significant();
    let remainder =
        Remainder { structured, p_value: after.p_value, place: structured.then(|| after.description.clone()) };
    let before = findings.structure_before.map_or(0.0, |structure| structure.excess);
    let share = if before > 0.0 { after.excess / before } else { 0.0 };
    let word = word(!effects.is_empty(), structured, share);
    (word.to_string(), remainder)
}

/// Description of the residual of an interrupted trace.
pub(super) fn not_examined() -> Remainder {
    Remainder { structured: false, p_value: 1.0, place: Some("not examined: the trace was interrupted".to_string()) }
}

/// What is said of a search along runs: whether it found anything, whether structure remains, and what share of its
/// excess over noise.
fn word(found: bool, structured: bool, share: f64) -> &'static str {
    match (found, structured) {
        (false, false) => "clean",
        (false, true) => "unexplained",
        (true, false) => "explained",
        (true, true) if share < EXPLAINED_SHARE => "partly-explained",
        (true, true) => "unexplained",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_says_whether_most_of_the_structure_is_explained() {
        for (found, structured, share, verdict) in [
            (false, false, 0.0, "clean"),
            (false, true, 1.0, "unexplained"),
            (true, false, 0.9, "explained"),
            (true, true, 0.2, "partly-explained"),
            (true, true, 0.8, "unexplained"),
        ] {
            assert_eq!(word(found, structured, share), verdict);
        }
    }
}
