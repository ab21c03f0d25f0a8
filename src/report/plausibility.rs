//! Conflicts between the readings and the statements of the session, and their possible causes.

use abbe::identify::plausibility::{ConflictKind, Plausibility, Suggestion};

use super::block::{Report, Text};
use super::number::{micrometres, unit};
use super::table::{Cell, Table, cells};

/// What the readings contradict, in a sentence; `None` if nothing.
pub fn headline(plausibility: &Plausibility) -> Option<String> {
    let subjects: Vec<&str> = plausibility.conflicts.iter().map(|conflict| conflict.subject.as_str()).collect();
    let named = subjects.iter().any(|subject| *subject != "session");
    match (subjects.is_empty(), named) {
        (true, _) => None,
        (false, true) => Some(format!("The readings contradict the session: {}.", subjects.join(", "))),
        (false, false) => Some("The readings contradict the session.".to_string()),
    }
}

/// The section of conflicts, if the readings contradict the session.
pub fn section(report: &mut Report, plausibility: &Plausibility) {
    if plausibility.conflicts.is_empty() {
        return;
    }
    report.section("Conflict between readings and session");
    report.key("The readings contradict what the session states:");
    let other = plausibility.conflicts.iter().filter(|c| c.kind != ConflictKind::SetupParameter);
    report.key(Text::List(other.map(|conflict| conflict.words.clone()).collect()));
    let rows = plausibility.conflicts.iter().filter_map(|conflict| {
        let pull = conflict.pull?;
        let value = Cell::fixed(conflict.value, 1);
        let stated = Cell::exact(conflict.stated);
        Some(cells![&conflict.subject, value, stated, unit(&conflict.unit), Cell::fixed(pull, 1)])
    });
    report.key(Table::new(["set-up parameter", ">estimate", ">stated u", "unit", ">pull"], rows));
    let cause = |cause: &Suggestion| format!("{} (residual {})", cause.words, micrometres(cause.rms_um));
    match plausibility.suggestions.as_slice() {
        // A unit is named with the conflict.
        [] if plausibility.conflicts.iter().all(|conflict| conflict.kind == ConflictKind::Unit) => {}
        [] => report.key("No single mistake among those tried explains this."),
        [one] => report.key(format!("Explained if {}.", cause(one))),
        several => {
            report.key("Explained by one of these, which the readings do not separate:");
            report.key(Text::List(several.iter().map(cause).collect()));
        }
    }
}
