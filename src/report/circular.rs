//! Ball-bar figures by ISO 230-4, and the diagnosis of machine faults.
//!
//! ISO 230-4:2022 uses the terms circular and radial *error*. The edition of 2005 used *deviation*, and the symbols are
//! from there. The hysteresis is from the edition of 1996.

use abbe::identify::circular::CircularTest;
use maud::{Markup, html};

use super::document::{list, table};
use super::format::{typeset, um};
use crate::cli::circular::{FAULTS, fault_rows, heading};

/// Figures and diagnosis of each test.
pub fn section(tests: &[CircularTest]) -> Markup {
    html! {
        p {
            "Terms of ISO 230-4:2022, symbols of the edition of 2005 in brackets; all figures in µm. The figures describe the readings without any correction \
             by the fit. Centre and radius are those of the least-squares circle."
        }
        @for test in tests {
            h3 { (heading(test)) }
            (table(
                &["direction", "runs", "circular error (G)", "maximum radial error (F max)", "minimum radial error (F min)"],
                &typeset(crate::cli::circular::direction_rows(test)),
            ))
            @let both = both(test);
            @if !both.is_empty() { (table(&["both directions", "µm"], &typeset(both))) }
            @if !test.diagnosis.is_empty() {
                (table(&FAULTS, &typeset(test.diagnosis.iter().flat_map(fault_rows).collect())))
                @if let Some(rms) = test.diagnosis_rms_um { p { "Residual after the diagnosis: " (um(rms)) " rms." } }
            }
            @if !test.not_identifiable.is_empty() { (list(test.not_identifiable.iter().cloned())) }
        }
    }
}

/// Figures of both directions together.
fn both(test: &CircularTest) -> Vec<Vec<String>> {
    [
        ("bidirectional circular error (G(b))", test.bidirectional_circular_deviation_um),
        ("mean bidirectional radial error (D)", test.mean_bidirectional_radial_deviation_um),
        ("circular hysteresis (H, edition of 1996)", test.hysteresis_um),
    ]
    .into_iter()
    .filter_map(|(name, value)| Some(vec![name.to_string(), format!("{:.2}", value?)]))
    .collect()
}
