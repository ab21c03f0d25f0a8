//! The readings of a session as figures, and the sections of them that several reports share: residuals, traces,
//! correlations, sensitivities, the machine.
//!
//! - [`sky`], [`workspace`]: residuals where independent poses are;
//! - [`plots`]: deviations and residuals of each test; [`curves`]: derived quantities; [`residuals`]: their section;
//! - [`abscissae`]: what they are plotted against; [`decimate`]: decimation that keeps extremes;
//! - [`embed`]: data of the interactive figures of a page.

pub mod abscissae;
pub mod curves;
pub mod decimate;
pub mod embed;
pub mod plots;
pub mod residuals;
pub mod sky;
pub mod workspace;

use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use abbe::identify::results::Estimate;
use abbe::identify::series::{Cause, correlation};
use abbe::model::Diagnostic;
use abbe::model::component::ErrorName;
use abbe::model::effect::Component;
use abbe::model::parameter_id::EffectId;
use serde_json::json;

use self::plots::SessionPlots;
use self::residuals::{omitted_tests, unaffected};
use super::block::{Report, Text};
use super::figure::matrix::matrix;
use super::figure::{Figure, chain};
use super::number::{unit, value_and_u, with_minus_signs};

/// Maximum number of rows of a correlation map.
const MAX_CORRELATED: usize = 40;

/// Adds the data of the interactive figures, with one slider per error and effect, and all readings.
pub fn add_data(report: &mut Report, session: &SessionPlots<'_>, parameters: &[Estimate]) {
    let mut data = embed::data(session);
    let sliders: Vec<serde_json::Value> = embed::sliders(session)
        .into_iter()
        .map(|k| {
            let share = &session.series.shares[k];
            let is_same = |p: &&Estimate| {
                p.id == share.id || EffectId::parse(&p.id).is_some_and(|effect| effect.to_string() == share.id)
            };
            let value = parameters.iter().find(is_same).map(|p| {
                let (value, u) = value_and_u(p.value, p.u);
                with_minus_signs(&format!(" {value} ± {u} {}", unit(&p.unit)))
            });
            let label = match share.cause {
                Cause::Setup => "set-up: balls and bar".to_string(),
                Cause::Unseen => "confounded parameters".to_string(),
                Cause::Error | Cause::Effect => format!("{}{}", share.id, value.unwrap_or_default()),
            };
            json!({"id": share.id, "label": label})
        })
        .collect();
    data["sliders"] = sliders.into();
    report.data = data;
    report.readings = embed::readings(session);
}

/// The section of deviations from nominal with switches and sliders. Tests that the model does not change are folded.
pub fn traces(report: &mut Report, session: &SessionPlots<'_>) {
    report.section("Traces");
    report.page(Text::Controls);
    let reference = if session.series.vectors {
        "the nominal machine with the fitted set-up"
    } else {
        "the nominal machine and set-up"
    };
    let most = match session.series.shares.len() {
        count if count > embed::MAX_SLIDERS => {
            format!("The {} largest contributions have a slider. ", embed::MAX_SLIDERS)
        }
        _ => String::new(),
    };
    report.page(Text::Note(format!(
        "Deviation: observed reading minus the reading of {reference}. A slider scales the contribution J·β of one error \
         or effect to the readings. The contributions are linearised at the solution; the linearisation error is at most \
         {:.3} µm. {most}The plots show a part of the readings; all extremes are included.",
        session.series.second_order_um
    )));
    let (affected, folded) = unaffected(session);
    let figures = |number: usize| session.polar_deviation(number).into_iter().chain(session.deviations(number));
    report.figures(affected.into_iter().flat_map(figures));
    report.page(omitted_tests(session));
    if let Some((heading, numbers)) = folded {
        report.page(Text::Fold(heading));
        report.figures(numbers.into_iter().flat_map(figures));
    }
}

/// The section of the correlations of the errors and effects of a fit.
pub fn correlations(report: &mut Report, problem: &Problem, fit: &Fit) {
    let (mut ids, mut rows) = correlation(problem, fit);
    let all = ids.len();
    if all < 2 {
        return;
    }
    ids.truncate(MAX_CORRELATED);
    rows.truncate(MAX_CORRELATED);
    let rows: Vec<_> = rows.iter().map(|row| row.iter().take(MAX_CORRELATED).copied().map(Some).collect()).collect();
    report.section("Correlation");
    report.page("Strongly correlated errors are poorly separable. A confounded parameter has no value of its own.");
    if all > MAX_CORRELATED {
        report.page(Text::Note(format!("The map shows the first {MAX_CORRELATED} of {all} parameters.")));
    }
    report.figures([correlation_map(&ids, &rows)]);
}

/// A correlation map.
pub fn correlation_map(ids: &[String], rows: &[Vec<Option<f64>>]) -> Figure {
    Figure::new(
        "correlation",
        "Correlation",
        "Below the diagonal: the area of a symbol is the magnitude. Above the diagonal: the value, if it fits.",
        matrix("correlation", ids, rows),
    )
}

/// The sections of the sensitivity of each test and of the machine.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn model(report: &mut Report, problem: &Problem, beta: &[f64]) -> Result<(), Diagnostic> {
    report.section("Sensitivity of each test");
    report.figures(curves::sensitivities(problem, beta)?);
    machine(report, problem);
    Ok(())
}

/// The section of the kinematic chain with the estimated errors.
pub fn machine(report: &mut Report, problem: &Problem) {
    report.section("Machine");
    report.figures([chain(problem)]);
}

/// The kinematic chain with the estimated errors.
pub fn chain(problem: &Problem) -> Figure {
    let errors = problem.parameters.list.iter().filter_map(|parameter| parameter.id.error());
    let effects = problem.parameters.effect_ids.iter().filter_map(|id| match &id.component {
        Component::Axis(name) => Some((name, id.to_string())),
        _ => None,
    });
    let errors: Vec<(&ErrorName, String)> = errors.map(|name| (name, name.to_string())).chain(effects).collect();
    chain::figure(&problem.session.machine, &errors)
}
