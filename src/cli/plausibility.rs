//! Conflicts between the readings and the session, printed before the results.

use abbe::identify::plausibility::{ConflictKind, Plausibility};

use super::table;

/// Prints the conflicts and their possible causes, if there are any.
pub fn print(plausibility: &Plausibility) {
    if plausibility.conflicts.is_empty() {
        return;
    }
    say!("The readings contradict the session:");
    for conflict in (plausibility.conflicts.iter()).filter(|c| c.kind != ConflictKind::SetupParameter) {
        say!("  {}", conflict.words);
    }
    let rows: Vec<Vec<String>> = (plausibility.conflicts.iter())
        .filter_map(|conflict| {
            let pull = conflict.pull?;
            Some(vec![
                conflict.subject.clone(),
                format!("{:.1}", conflict.value),
                format!("{}", conflict.stated),
                table::unit(&conflict.unit),
                format!("{pull:.1}"),
            ])
        })
        .collect();
    if !rows.is_empty() {
        table::print(&["set-up parameter", "estimate", "stated u", "unit", "pull"], &rows);
    }
    match plausibility.suggestions.as_slice() {
        [] => say!("No single mistake among those tried explains this."),
        [one] => say!("Explained if {} (residual {}).", one.words, table::micrometres(one.rms_um)),
        several => {
            say!("Explained by one of these, which the readings do not separate:");
            for suggestion in several {
                say!("  {} (residual {})", suggestion.words, table::micrometres(suggestion.rms_um));
            }
        }
    }
    say!("");
}
