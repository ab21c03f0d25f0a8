//! Conflicts between readings and session, near the top of a report.

use abbe::identify::plausibility::Plausibility;
use maud::html;

use super::document::{Document, list};
use super::readings::um;

/// Adds a section where readings contradict the session.
pub fn section(document: &mut Document, plausibility: &Plausibility) {
    if plausibility.conflicts.is_empty() {
        return;
    }
    let conflicts = plausibility
        .conflicts
        .iter()
        .map(|conflict| conflict.words.clone());
    let suggestions = (plausibility.suggestions.iter())
        .map(|suggestion| format!("{} (residual {})", suggestion.words, um(suggestion.rms_um)));
    let lead = match plausibility.suggestions.len() {
        0 => "No single mistake that is tried explains this.",
        1 => "This would be explained if",
        _ => "This would be explained by one of these, which the readings do not separate:",
    };
    document.section(
        "The readings contradict the session",
        html! {
            (list(conflicts))
            p { (lead) }
            @if !plausibility.suggestions.is_empty() { (list(suggestions)) }
        },
    );
}
