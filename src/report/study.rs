//! Studies: power, false claims, coverage.

use abbe::fleet::study::summary::{Cell as Draws, Rate};

use super::number::fixed;
use super::table::{Cell, Table, cells};

/// A proportion with its standard error in per cent; nothing of none.
fn percent(rate: &Rate) -> String {
    match rate.of {
        0 => String::new(),
        _ => format!("{} ± {} %", fixed(100.0 * rate.rate, 1), fixed(100.0 * rate.u, 1)),
    }
}

/// Cells of a study.
pub fn cells(title: &str, draws: &[Draws]) -> Table {
    let rows = draws.iter().map(|cell| {
        cells![
            cell.plan.clone(),
            cell.effect.clone(),
            cell.noise.clone(),
            cell.draws.to_string(),
            cell.failed.to_string(),
            cell.not_observed.to_string(),
            percent(&cell.found),
            percent(&cell.named),
            percent(&cell.false_claims),
            percent(&cell.coverage),
            Cell::fixed(cell.pull_rms, 2),
            Cell::fixed(cell.undetermined, 1),
            cell.mean_u.map_or_else(String::new, |u| fixed(u, 3))
        ]
    });
    let headings = [
        "plan",
        "effect",
        "noise",
        ">draws",
        ">failed",
        ">not observed",
        ">found",
        ">of these named",
        ">false claim",
        ">coverage of 95 %",
        ">rms pull",
        ">undetermined",
        ">mean u",
    ];
    let mut table = Table::new(headings, rows.collect::<Vec<_>>());
    title.clone_into(&mut table.title);
    table
}
