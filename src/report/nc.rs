//! The NC programs of a session.

use abbe::codegen::nc::{Control, NcFile, Run};
use abbe::model::session::Session;

use super::block::Report;
use super::table::{Table, cells};

/// The report of programs: `main`, and one for each of the tests that have one.
pub fn report(session: &Session, programs: &[NcFile], runs: &[Run], control: &dyn Control) -> Report {
    let mut report = Report::new(format!("NC programs for {}", session.machine.name));
    let tests = std::iter::once("all tests").chain(runs.iter().map(|run| run.test.as_str()));
    let rows = programs.iter().zip(tests);
    let rows = rows.map(|((name, text), test)| cells![name, test, text.lines().count().to_string()]);
    report.key(Table::new(["program", "test", ">lines"], rows));
    if !control.is_run() {
        report.section("");
        report.key(format!("The form for {} has not been run on a control.", control.word()));
    }
    report.section("");
    report.key("Try each program in single block and without the instrument before it is trusted.");
    report
}
