//! Studies: power, false claims, coverage.

use abbe::fleet::study::draw::Draw;
use abbe::fleet::study::summary::{Cell as Draws, Rate, StudyResult};
use abbe::model::words::counted;

use super::block::Report;
use super::number::fixed;
use super::table::{Cell, Table, cells};

/// A proportion with its standard error in per cent; nothing of none.
fn percent(rate: &Rate) -> String {
    match rate.of {
        0 => String::new(),
        _ => format!("{} ± {} %", fixed(100.0 * rate.rate, 1), fixed(100.0 * rate.u, 1)),
    }
}

/// The report of a study; `failed`, the first draw without a result.
pub fn report(result: &StudyResult, failed: Option<&Draw>) -> Report {
    let mut report = Report::new("Study");
    report.method = "Every combination of plan, effect and noise is simulated and analysed. Each proportion has its \
                     standard error."
        .to_string();
    report.values = cells(&result.cells);
    report.opening("", [format!("{}.", counted(result.draws, "draw"))]);
    for (heading, draws) in [
        ("Combinations", &result.cells),
        ("Effects over all plans and noise", &result.effects),
        ("Plans, best first", &result.ranking),
    ] {
        report.section(heading);
        report.key(cells(draws));
    }
    if let Some(draw) = failed {
        let message = draw.error.as_deref().unwrap_or_default();
        report.section("Draws without a result");
        report.key(format!("The first draw without a result, {} in {}: {message}", draw.effect, draw.plan));
    }
    report
}

/// Cells of a study.
fn cells(draws: &[Draws]) -> Table {
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
    Table::new(headings, rows)
}
