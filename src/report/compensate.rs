//! Corrected commands: what became of the rows.

use std::path::Path;

use abbe::apply::correction::stream::Summary;
use abbe::identify::model_file::{IdentifiedModel, ModelParameter};
use abbe::model::pose::Aim;
use abbe::model::words::{counted, first_of, with_exponent};

use super::block::Report;
use super::number::fixed;
use super::table::{Cell, Table, cells};

/// The report of corrected commands in this file; `of_model`, whether the tool point is that of the model.
pub fn report(file: &Path, summary: &Summary, aim: Aim, of_model: bool, warnings: Vec<String>) -> Report {
    let mut report = Report::new("Corrected commands");
    report.warnings = warnings;
    report.method =
        "The machine with its errors puts the tool where the machine without errors would be at the commanded \
                     positions."
            .to_string();
    let [x, y, z] = summary.tool_mm.map(|mm| fixed(mm, 3));
    report.opening(
        "",
        [
            format!("{}: {}", file.display(), headline(summary, aim)),
            format!(
                "Tool point [{x}, {y}, {z}] mm in the tool frame{}.",
                if of_model { ", from the model" } else { "" }
            ),
        ],
    );
    report.key(states(summary));
    report.key(marked(summary));
    report
}

/// What was done, in a line.
fn headline(summary: &Summary, aim: Aim) -> String {
    let part = match aim {
        Aim::Position => "position",
        Aim::PositionAndAxis => "position and direction of the tool",
        Aim::Pose => "position and orientation of the tool",
    };
    match summary.largest_remaining_um {
        Some(_) => format!("{}, {part} corrected", counted(summary.rows, "row")),
        None => format!("{}, no command changed", counted(summary.rows, "row")),
    }
}

/// Number of rows by state, and the largest errors.
fn states(summary: &Summary) -> Table {
    let mut rows: Vec<Vec<Cell>> = summary
        .states
        .iter()
        .map(|count| cells![format!("rows {}", count.state), count.rows.to_string(), ""])
        .collect();
    let mut size = |name: &str, um: Option<f64>, arcsec: Option<f64>| {
        if let (Some(um), Some(arcsec)) = (um, arcsec) {
            let figure = |value: f64| if value < 1e-3 { with_exponent(value, 1) } else { format!("{value:.3}") };
            rows.push(cells![name, format!("{} µm", figure(um)), format!("{}″", figure(arcsec))]);
        }
    };
    size("largest error at the commands", Some(summary.largest_error_um), Some(summary.largest_error_arcsec));
    let name = match summary.without_command() {
        0 => "largest remaining error of all rows".to_string(),
        none => {
            let rows = summary.rows - none;
            let have = if rows == 1 { "has" } else { "have" };
            format!("largest remaining error of the {} that {have} a command", counted(rows, "row"))
        }
    };
    size(&name, summary.largest_remaining_um, summary.largest_remaining_arcsec);
    Table::new(["", ">position", ">orientation"], rows)
}

/// The first rows that are not simply corrected.
fn marked(summary: &Summary) -> Table {
    let rows = summary.marked.iter().map(|row| cells![row.line.to_string(), row.state, row.fault.clone()]);
    Table::new([">line", "state", ""], rows).titled("Rows that are marked")
}

/// A warning if the tool point of the model is the target of the instrument, which no one stated and the fit placed.
pub fn fitted_tool(model: &IdentifiedModel) -> Option<String> {
    let is_of_tool = |own: &ModelParameter| matches!(own.id.thing(), Some("target" | "spindle_ball"));
    // Its orientation does not move the point.
    let free = |own: &&ModelParameter| is_of_tool(own) && own.unit == "um" && own.prior_u.is_none() && !own.held;
    let placed: Vec<String> = (model.parameters.iter().filter(free))
        .map(|own| format!("{} by {:.1} µm", own.id, own.value * own.display_per_internal))
        .collect();
    (!placed.is_empty()).then(|| {
        format!(
            "the tool point is the target of the instrument, which the fit placed ({}): --tool-mm states the point of the tool",
            first_of(&placed, MAX_NAMED, ", ", "further coordinate")
        )
    })
}

/// Coordinates that the warning names.
const MAX_NAMED: usize = 3;
