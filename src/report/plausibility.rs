//! Conflicts between the readings and the statements of the session, and their possible causes.

use abbe::identify::plausibility::{ConflictKind, Plausibility, Suggestion};

use super::number::{micrometres, unit};
use super::table::{Cell, Table, cells};

/// What contradicts the session and what may have caused it.
pub struct Conflicts {
    /// Conflicts other than those of the set-up, one sentence each.
    pub sentences: Vec<String>,
    /// Set-up parameters that the readings move too far.
    pub setup: Table,
    /// The possible cause, or an introduction to `causes`.
    pub explanation: String,
    /// Possible causes, if there are several.
    pub causes: Vec<String>,
}

/// The conflicts; `None` without one.
pub fn conflicts(plausibility: &Plausibility) -> Option<Conflicts> {
    if plausibility.conflicts.is_empty() {
        return None;
    }
    let other = plausibility.conflicts.iter().filter(|c| c.kind != ConflictKind::SetupParameter);
    let rows = plausibility.conflicts.iter().filter_map(|conflict| {
        let pull = conflict.pull?;
        let value = Cell::fixed(conflict.value, 1);
        let stated = Cell::exact(conflict.stated);
        Some(cells![&conflict.subject, value, stated, unit(&conflict.unit), Cell::fixed(pull, 1)])
    });
    let columns = ["set-up parameter", ">estimate", ">stated u", "unit", ">pull"];
    let cause = |cause: &Suggestion| format!("{} (residual {})", cause.words, micrometres(cause.rms_um));
    let (explanation, causes) = match plausibility.suggestions.as_slice() {
        [] => ("No single mistake among those tried explains this.".to_string(), Vec::new()),
        [one] => (format!("Explained if {}.", cause(one)), Vec::new()),
        several => (
            "Explained by one of these, which the readings do not separate:".to_string(),
            several.iter().map(cause).collect(),
        ),
    };
    Some(Conflicts {
        sentences: other.map(|conflict| conflict.words.clone()).collect(),
        setup: Table::new(columns, rows),
        explanation,
        causes,
    })
}
