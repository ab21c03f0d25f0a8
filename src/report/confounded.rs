//! What the readings leave open: null-space directions, and readings that are excluded.

use abbe::identify::results::{DeterminedByPrior, Finding, ModelResult, Outlier, Unobservable};
use abbe::model::unit::Unit;
use abbe::model::words::counted;

use super::block::{Level, Report, Text};
use super::number::{of_readings, with_symbols};
use super::table::{Table, cells};

/// Outliers that a terminal shows without `--all`.
const MAX_OUTLIERS: usize = 3;

/// One sentence for each combination that is not identifiable.
pub fn sentences(directions: &[Unobservable]) -> Vec<String> {
    directions.iter().map(|item| with_symbols(&item.why)).collect()
}

/// The heading of errors that only set-up priors separate from the set-up.
pub const BY_PRIOR: &str = "Determined by the set-up priors only, because the readings alone do not separate them:";

/// One sentence for each error that only set-up priors separate from the set-up.
pub fn by_prior(errors: &[DeterminedByPrior]) -> Vec<String> {
    errors.iter().map(|item| with_symbols(&item.why)).collect()
}

/// The section of null-space directions, of errors that set-up priors determine, and of outliers. One sentence where
/// there is nothing.
pub fn section(report: &mut Report, model: &ModelResult) {
    let ModelResult { unobservable, outliers, outcome, .. } = model;
    let prior = &outcome.determined_by_prior;
    report.section("Confounded parameters and outliers");
    match (unobservable.is_empty() && prior.is_empty(), outliers.is_empty()) {
        (true, true) => report.key("No parameters are confounded. No reading is an outlier."),
        (true, false) => report.key("No parameters are confounded."),
        (false, _) => {}
    }
    if !prior.is_empty() {
        let errors: Vec<&str> = prior.iter().map(|item| item.error.as_str()).collect();
        report.key(Text::Heading(BY_PRIOR.to_string()));
        report.brief(Text::Note(errors.join(", ")));
        report.detail(Text::List(by_prior(prior)));
    }
    let groups = [
        (
            Finding::Structural,
            "Confounded",
            "null-space direction",
            "a combination that leaves every reading unchanged",
        ),
        (Finding::Weak, "Weakly determined", "combination", "it changes readings by less than their noise"),
    ];
    for (finding, word, noun, meaning) in groups {
        let found: Vec<Unobservable> = unobservable.iter().filter(|one| one.finding == finding).cloned().collect();
        if !found.is_empty() {
            let heading = format!("{word}: {} ({meaning})", counted(found.len(), noun));
            report.headed(Level::Key, heading, Text::List(sentences(&found)));
        }
    }
    report.key(self::outliers(outliers, model.noise.unit));
}

/// The readings that are excluded as outliers; without `--all`, those with the largest residual.
fn outliers(outliers: &[Outlier], unit: Unit) -> Table {
    let firsts = outliers.iter().filter(|outlier| outlier.first_at_reversal).count();
    let readings = counted(outliers.len(), "reading");
    let begin = "a run that begins where an axis reverses: its lost motion there is not known";
    let title = match (outliers.len(), firsts) {
        (1, 0) => format!("{readings} is excluded as an outlier"),
        (_, 0) => format!("{readings} are excluded as outliers"),
        (1, _) => format!("{readings} is excluded, as the first of {begin}"),
        (all, firsts) if firsts == all => format!("{readings} are excluded, each as the first of {begin}"),
        (_, firsts) => format!("{readings} are excluded as outliers, {firsts} of them the first of {begin}"),
    };
    let rows = outliers.iter().map(|o| cells![&o.test, &o.file, o.line.to_string(), of_readings(o.residual_um, unit)]);
    let mut table = Table::new(["test", "file", ">line", ">residual"], rows).titled(title);
    if outliers.len() > MAX_OUTLIERS + 1 {
        let mut order: Vec<usize> = (0..outliers.len()).collect();
        order.sort_by(|a, b| outliers[*b].residual_um.abs().total_cmp(&outliers[*a].residual_um.abs()));
        order.truncate(MAX_OUTLIERS);
        table.key_rows = Some(order);
    }
    table
}
