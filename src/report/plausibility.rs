//! Conflicts between the readings and the statements of the session.

use abbe::identify::plausibility::Plausibility;
use maud::html;

use super::document::{Document, list};
use super::format::um;

/// Adds a section if the readings contradict the session.
pub fn section(document: &mut Document, plausibility: &Plausibility) {
    if plausibility.conflicts.is_empty() {
        return;
    }
    let conflicts = plausibility.conflicts.iter().map(|conflict| conflict.words.clone());
    let suggestions = (plausibility.suggestions.iter())
        .map(|suggestion| format!("{} (residual {})", suggestion.words, um(suggestion.rms_um)));
    let introduction = match plausibility.suggestions.len() {
        0 => "No single mistake among those examined explains the conflict.",
        1 => "Possible cause:",
        _ => "Possible causes, which the readings do not separate:",
    };
    document.section(
        "Conflict between readings and session",
        html! {
            (list(conflicts))
            p { (introduction) }
            @if !plausibility.suggestions.is_empty() { (list(suggestions)) }
        },
    );
}
