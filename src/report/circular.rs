//! Ball-bar figures of ISO 230-4 and the classical diagnosis.
//!
//! The edition of 2022 speaks of circular and radial *errors* where that of 2005 had *deviations*; the symbols are those of 2005. Hysteresis was left out
//! after the edition of 1996.

use abbe::identify::circular::CircularTest;
use maud::{Markup, html};

use super::document::{list, table};
use super::readings::{typeset, um};
use crate::cli::circular::{FAULTS, fault_rows, heading};

/// A part for each test.
pub fn section(tests: &[CircularTest]) -> Markup {
    html! {
        p {
            "ISO 230-4:2022 by name, symbols of the edition of 2005 in brackets; µm. Figures are of the readings as they are: nothing that the fit identifies is taken off. \
             Centre and range are those of the least-squares circle."
        }
        @for test in tests {
            h3 { (heading(test)) }
            (table(
                &["direction", "runs", "circular error (G)", "radial error, greatest (F max)", "radial error, least (F min)"],
                &typeset(crate::cli::circular::direction_rows(test)),
            ))
            @let both = both(test);
            @if !both.is_empty() { (table(&["both directions", "µm"], &typeset(both))) }
            @if !test.diagnosis.is_empty() {
                (table(&FAULTS, &typeset(test.diagnosis.iter().flat_map(fault_rows).collect())))
                @if let Some(rms) = test.diagnosis_rms_um { p { "The faults leave " (um(rms)) " rms." } }
            }
            @if !test.not_identifiable.is_empty() { (list(test.not_identifiable.iter().cloned())) }
        }
    }
}

/// The figures of both directions together.
fn both(test: &CircularTest) -> Vec<Vec<String>> {
    [
        (
            "bidirectional circular error (G(b))",
            test.bidirectional_circular_deviation_um,
        ),
        (
            "mean bidirectional radial error (D)",
            test.mean_bidirectional_radial_deviation_um,
        ),
        ("circular hysteresis (H, edition of 1996)", test.hysteresis_um),
    ]
    .into_iter()
    .filter_map(|(name, value)| Some(vec![name.to_string(), format!("{:.2}", value?)]))
    .collect()
}
