//! What the readings leave open: null-space directions, and readings that are excluded.

use abbe::identify::results::{DeterminedByPrior, Outlier, Unobservable};
use abbe::model::words::counted;

use super::number::{micrometres, with_symbols};
use super::table::{Table, cells};

/// One sentence for each combination that leaves every reading unchanged.
pub fn sentences(directions: &[Unobservable]) -> Vec<String> {
    directions.iter().map(|item| with_symbols(&item.why)).collect()
}

/// The heading of errors that only set-up priors separate from the set-up.
pub const BY_PRIOR: &str = "Determined by the set-up priors only, because the readings alone do not separate them:";

/// One sentence for each error that only set-up priors separate from the set-up.
pub fn by_prior(errors: &[DeterminedByPrior]) -> Vec<String> {
    errors.iter().map(|item| with_symbols(&item.why)).collect()
}

/// The readings that are excluded as outliers.
pub fn outliers<'o>(outliers: impl ExactSizeIterator<Item = &'o Outlier>) -> Table {
    let is_are = if outliers.len() == 1 { "is" } else { "are" };
    let title = format!("{} {is_are} excluded as outliers", counted(outliers.len(), "reading"));
    let rows = outliers.map(|o| cells![&o.test, &o.file, o.line.to_string(), micrometres(o.residual_um)]);
    Table::new(["test", "file", ">line", ">residual"], rows).titled(title)
}
