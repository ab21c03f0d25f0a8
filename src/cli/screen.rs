//! Parts of the first screens of `fit` and `trace`: what is folded without `--all`, the next steps.

use std::path::Path;

use abbe::identify::circular::CircularTest;
use abbe::identify::plausibility::Plausibility;
use abbe::identify::results::{DeterminedByPrior, Goodness, Outlier, Statements, Unobservable};
use abbe::identify::tolerance::Conformity;
use abbe::model::words::counted;

use super::{SessionArguments, output};
use crate::report::confounded::BY_PRIOR;
use crate::report::fit::reservation;
use crate::report::parameters::{self, Estimates};
use crate::report::plausibility::conflicts;
use crate::report::statements as present;
use crate::report::table::Table;
use crate::report::{circular, conformity, confounded};

/// Entries of a long list that the first screen shows.
const MAX_LISTED: usize = 3;
/// Errors that the first screen shows.
const MAX_ERRORS: usize = 20;
/// Circular tests that the first screen shows.
const MAX_CIRCULAR: usize = 6;

/// Prints the first lines of a list and the number of the others; every line with `all`.
pub fn list(lines: &[String], indent: &str, all: bool) {
    // One line more costs no more room than the number of the others.
    let shown = if all || lines.len() <= MAX_LISTED + 1 { lines.len() } else { MAX_LISTED };
    for line in &lines[..shown] {
        say!("{indent}{line}");
    }
    if shown < lines.len() {
        say!("{indent}… {} more; --all lists them", lines.len() - shown);
    }
}

/// Prints the errors in a table and the set-up parameters in one line; the set-up parameters in a table too with `all`.
pub fn print_estimates(estimates: &Estimates<'_>, goodness: Goodness, all: bool) {
    let shown = estimates.most_significant(if all { usize::MAX } else { MAX_ERRORS });
    if !shown.is_empty() {
        output::print(&parameters::table(&shown, None));
        if shown.len() < estimates.errors.len() {
            say!("  … {} less significant; --all lists them", estimates.errors.len() - shown.len());
        }
        if let Some(reservation) = reservation(goodness) {
            say!("  {reservation}");
        }
    }
    if all && !estimates.setup.is_empty() {
        output::print(&estimates.setup_table(None));
    } else {
        print_folded_setup(estimates);
    }
}

/// Prints the set-up parameters in one line.
pub fn print_folded_setup(estimates: &Estimates<'_>) {
    if !estimates.setup.is_empty() {
        say!("  {}; --all lists them", estimates.setup_in_short());
    }
}

/// Prints the conflicts between readings and session, if there are any.
pub fn print_conflicts(plausibility: &Plausibility) {
    let Some(found) = conflicts(plausibility) else {
        return;
    };
    say!("The readings contradict the session:");
    found.sentences.iter().for_each(|sentence| say!("  {sentence}"));
    if !found.setup.rows.is_empty() {
        output::print(&found.setup);
    }
    say!("{}", found.explanation);
    found.causes.iter().for_each(|cause| say!("  {cause}"));
    say!("");
}

/// Prints the figures of circular tests, one row per test; with `all`, the figures of each direction, the diagnosis and
/// its limitations.
pub fn print_circular(tests: &[CircularTest], all: bool) {
    if !all && !tests.is_empty() {
        say!("\nBall-bar figures (ISO 230-4); --all lists directions, diagnosis and limitations:");
        let mut table = circular::summary(tests);
        fold_rows(&mut table, MAX_CIRCULAR, "");
        output::print(&table);
        return;
    }
    for test in tests {
        say!("\n{}", circular::heading(test));
        circular::tables(test).iter().for_each(output::print);
        test.not_identifiable.iter().for_each(|line| say!("  limitation: {line}"));
    }
}

/// Prints the decisions of conformity, if the session states limits.
pub fn print_conformity(found: Option<&Conformity>) {
    if let Some(found) = found {
        say!("\nConformity: {}", conformity::sentence(found));
        output::print(&conformity::table(found));
    }
}

/// Keeps the first rows of a table, and notes the number of the others.
fn fold_rows(table: &mut Table, max: usize, how: &str) {
    let more = table.rows.len().saturating_sub(max);
    if more > 0 {
        table.rows.truncate(max);
        table.notes.push(format!("… {more} more{how}"));
    }
}

/// Prints what the readings leave open: null-space directions, errors that set-up priors determine, then outliers. One
/// line where there is nothing.
pub fn print_missing(null_space: &[Unobservable], by_prior: &[DeterminedByPrior], outliers: &[Outlier], all: bool) {
    if null_space.is_empty() && by_prior.is_empty() && outliers.is_empty() {
        say!("\nNo parameters are confounded. No reading is an outlier.");
        return;
    }
    if null_space.is_empty() && by_prior.is_empty() {
        say!("\nNo parameters are confounded.");
    }
    if !by_prior.is_empty() {
        say!("\n{BY_PRIOR}");
        let errors: Vec<&str> = by_prior.iter().map(|item| item.error.as_str()).collect();
        match all {
            true => list(&confounded::by_prior(by_prior), "  ", all),
            false => say!("  {}; --all lists with what they are confounded", errors.join(", ")),
        }
    }
    if !null_space.is_empty() {
        let directions = counted(null_space.len(), "null-space direction");
        say!("\nConfounded: {directions} (a combination that leaves every reading unchanged)");
        list(&confounded::sentences(null_space), "  ", all);
    }
    if outliers.is_empty() {
        return;
    }
    let mut sorted: Vec<&Outlier> = outliers.iter().collect();
    if !all {
        sorted.sort_by(|a, b| b.residual_um.abs().total_cmp(&a.residual_um.abs()));
    }
    let mut table = confounded::outliers(sorted.into_iter());
    if !all && table.rows.len() > MAX_LISTED + 1 {
        fold_rows(&mut table, MAX_LISTED, "; --all lists them");
    }
    output::print(&table);
}

/// The session file that the proposed commands write, and another for a session of this name.
const NEXT: &str = "next.toml";
const AFTER_NEXT: &str = "after-next.toml";

/// Prints the three statements that answer first: is it good, what to correct, what to measure next.
pub fn print_statements(of: &str, statements: &Statements, degrees_of_freedom: usize, session: &SessionArguments) {
    say!("{}", present::good(of, &statements.good, degrees_of_freedom));
    say!("{}", present::correct(statements));
    let is_next = session.session.file_name().is_some_and(|name| name == NEXT);
    let next = if is_next { AFTER_NEXT } else { NEXT };
    for line in present::measure(statements, next, |verb, options| command(verb, session, options)) {
        say!("{line}");
    }
    say!("");
}

/// Prints the line of each axis, with `all`.
pub fn print_corrections(statements: &Statements, all: bool) {
    if all && !statements.correct.is_empty() {
        output::print(&present::corrections(statements));
    }
}

/// A next step: what to type or to do, and what it is for.
pub type Step = (String, String);

/// Prints what to do next.
pub fn print_next(steps: &[Step]) {
    if steps.is_empty() {
        return;
    }
    say!("\nNext:");
    let width = steps.iter().map(|(step, _)| step.chars().count()).max().unwrap_or(0);
    for (step, purpose) in steps {
        let padding = " ".repeat(width - step.chars().count());
        say!("  {step}{padding}  {purpose}");
    }
}

/// A command line of `abbe` on a session.
pub fn command(verb: &str, session: &SessionArguments, options: &str) -> String {
    let quoted = |path: &Path| {
        let path = path.display().to_string();
        if path.contains(char::is_whitespace) { format!("\"{path}\"") } else { path }
    };
    let mut words = vec!["abbe".to_string(), verb.to_string(), quoted(&session.session)];
    if let Some(data) = &session.data {
        words.push(format!("--data {}", quoted(data)));
    }
    if session.allow_outside {
        words.push("--allow-outside".to_string());
    }
    if !options.is_empty() {
        words.push(options.to_string());
    }
    words.join(" ")
}
