//! What a run did.

use abbe::fleet::run::RunResult;
use abbe::model::words::counted;

use super::block::{Report, Text};
use super::table::{Table, cells};

/// Failed sessions that a terminal lists without `--all`.
const MAX_ROWS: usize = 10;

/// The report of a run.
pub fn report(result: &RunResult) -> Report {
    let mut report = Report::new("Run");
    report.method =
        "Each session is fitted and traced once; the name of its result is the SHA-256 of its inputs.".into();
    report.warnings.extend(result.shared_ids.iter().map(|shared| {
        format!(
            "sessions of different content have the identifier `{}`: {}; results of all are kept",
            shared.session_id,
            shared.files.join(", ")
        )
    }));
    report.opening(
        "",
        [format!(
            "{}: {}, {} analysed, {} kept, {} without a result",
            result.out,
            counted(result.sessions, "session"),
            result.computed,
            result.kept,
            result.failed.len()
        )],
    );
    if !result.forgotten.is_empty() {
        let forgotten = counted(result.forgotten.len(), "session");
        report.key(Text::Note(format!("{forgotten} of earlier runs left: the file is no longer there")));
    }
    let rows = result.failed.iter().map(|failed| {
        let first = failed.message.lines().next().unwrap_or_default();
        cells![&failed.file, first]
    });
    report.key(Table::new(["session", "why"], rows).folded(MAX_ROWS));
    report
}
