//! Report of `abbe validate`.

use abbe::identify::validate::{Validation, ValidationResult};
use abbe::model::session::Session;
use abbe::model::words::counted;
use maud::html;

use super::document::{Document, KeyFigure};
use super::validate_plots as plots;
use crate::printers::html::{folded, table};
use crate::report::number::micrometres;
use crate::report::validate as present;

/// Method of a validation.
const METHOD: &str = "The errors of the machine are those of the saved model. Only the set-up of this session is \
     estimated, with its priors, and again for each machine that is compared. The predicted variance of a residual is \
     that of the noise plus that of the model's covariance, after projection on the set-up. Consistent: the residual is \
     as large as predicted (ratio at most 1.05, or p at least 0.001), the 95 % intervals cover at least 90 % of the \
     readings, and no parameter has moved (generalised least squares, 0.5 % over all parameters, Bonferroni).";

/// The report.
pub fn document(session: &Session, validation: &Validation) -> Document {
    let result = &validation.result;
    let mut document = Document {
        title: format!("Validation of a model of {}", session.machine.name),
        word: result.verdict.to_string(),
        verdict: format!("{}.", crate::printers::html::capitalised(&present::sentence(result))),
        key_figures: figures(result),
        warnings: result.warnings.clone(),
        method: METHOD.to_string(),
        ..Document::default()
    };
    let shown = document.show(plots::of_machines(result));
    document.section(
        "Residuals",
        html! { p { (present::readings(result)) "." } (table(&present::residuals(result))) (shown) },
    );
    let shown = document.show(plots::of_tests(validation));
    document.section("Tests", shown);
    if result.moved.is_empty() {
        document.section("Moved parameters", html! { p { "No parameter of the machine has moved significantly." } });
    } else {
        document.section("Moved parameters", table(&present::moved(result)));
    }
    if !result.without.is_empty() {
        let shown = document.show(plots::of_effects(result));
        document.section("Effects", html! { (shown) (table(&present::without(result))) });
    }
    let heading = counted(result.set_up.len(), "parameter");
    document.section("Set-up", folded(&heading, &table(&present::set_up(result))));
    document
}

/// Key figures of the summary.
fn figures(result: &ValidationResult) -> Vec<KeyFigure> {
    let model = &result.model;
    let inside = format!("{} inside the range of the model", result.readings_in_range);
    let mut figures = vec![
        KeyFigure::new(
            "Residual rms",
            micrometres(model.rms.rms_um),
            format!("predicted: {}", micrometres(model.predicted_rms_um)),
        ),
        KeyFigure::new(
            "Location errors alone",
            micrometres(result.locations.rms_um),
            format!("nominal machine: {}", micrometres(result.nominal.rms_um)),
        ),
        KeyFigure::new(
            "Inside the 95 % intervals",
            format!("{:.1} %", 100.0 * model.coverage_95),
            "of scalar readings",
        ),
        KeyFigure::new("Readings", result.readings.to_string(), inside),
    ];
    if let Some(length) = model.rms.rms_3d_um {
        figures.insert(1, KeyFigure::new("Residual vector", micrometres(length), "rms length"));
    }
    figures
}
