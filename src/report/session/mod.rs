//! The readings of a session as figures, and the sections of them that several reports share: residuals, traces,
//! correlations, sensitivities, the machine.
//!
//! - [`sky`]: residuals where directions are;
//! - [`plots`]: deviations and residuals of each test; [`curves`]: derived quantities;
//! - [`embed`]: data of the interactive figures of a page.

pub mod curves;
pub mod embed;
pub mod plots;
pub mod sky;

use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use abbe::identify::results::Estimate;
use abbe::identify::series::places::{View, views};
use abbe::identify::series::spectrum::Spectrum;
use abbe::identify::series::{Cause, correlation};
use abbe::model::Diagnostic;
use abbe::model::component::ErrorName;
use abbe::model::effect::Component;
use abbe::model::parameter_id::EffectId;
use abbe::model::words::counted;
use serde_json::json;

use self::plots::{MAX_TESTS, SessionPlots};
use super::block::{Report, Text};
use super::figure::bubbles::bubbles;
use super::figure::matrix::matrix;
use super::figure::{Figure, Quantity, chain};
use super::number::{integer, micrometres, unit, value_and_u, with_minus_signs};
use super::table::{Table, cells, numbers, words};

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

/// Residuals of every test before and after, by the names of the two models. Tests that do not change are folded.
pub fn residuals(report: &mut Report, session: &SessionPlots<'_>, spectra: &[Spectrum], models: [&str; 2]) {
    let amplitudes = spectra.iter().flat_map(|spectrum| spectrum.before_um.iter().chain(&spectrum.after_um));
    let maximum = amplitudes.copied().fold(0.0, f64::max);
    let is_polar = session.is_polar() && session.tests().any(|(_, test)| test.way.is_angle);
    let of_test = |number: usize| -> Vec<Figure> {
        let polar = session.polar_residuals(number, models).unwrap_or_default();
        polar.into_iter().chain(straight(session, number, spectra, maximum)).collect()
    };
    let places = [("On the sky", sky::panels(session)), ("Over the workspace", over_places(session))];
    let mut places = places.into_iter().filter(|(_, drawn)| !drawn.is_empty()).peekable();
    let has_places = places.peek().is_some();
    for (heading, drawn) in places {
        report.page(Text::Heading(heading.to_string()));
        report.figures(drawn);
    }
    if has_places {
        report.page(Text::Heading("Each test".to_string()));
    }
    let (affected, folded) = unaffected(session);
    for number in affected {
        if is_polar {
            report.page(Text::Heading(session.series.tests[number].name.clone()));
        }
        report.figures(of_test(number));
    }
    report.page(omitted_tests(session));
    if let Some((heading, numbers)) = folded {
        report.page(Text::Fold(heading));
        report.figures(numbers.into_iter().flat_map(of_test));
    }
    report.page(Text::Heading("All tests".to_string()));
    report.detail(test_table(session, models));
    report.figures([curves::over_time(session)]);
    report.figures((!is_polar).then(|| curves::histogram(session, models)));
}

/// The numbers of the tests whose residual the model changes; of the others, if there are any, their numbers under a
/// heading that names them.
fn unaffected(session: &SessionPlots<'_>) -> (Vec<usize>, Option<(String, Vec<usize>)>) {
    let numbers = session.tests().map(|(number, _)| number);
    let (affected, others): (Vec<usize>, Vec<usize>) = numbers.partition(|number| session.is_affected(*number));
    let names: Vec<&str> = others.iter().map(|number| session.series.tests[*number].name.as_str()).collect();
    let heading = format!("{} without a change of the residual: {}", counted(names.len(), "test"), names.join(", "));
    (affected, (!others.is_empty()).then_some((heading, others)))
}

/// Figures of one test with straight axes: residuals, and their spectra on one scale.
fn straight(session: &SessionPlots<'_>, number: usize, spectra: &[Spectrum], maximum_um: f64) -> Vec<Figure> {
    let name = &session.series.tests[number].name;
    let effects = &session.problem.parameters.effects;
    let own = spectra.iter().filter(|spectrum| &spectrum.of == name);
    let own = own.map(|spectrum| curves::spectrum_plot(spectrum, maximum_um, effects));
    session.residuals(number).into_iter().chain(own).collect()
}

/// Readings and RMS residuals of every test.
pub fn test_table(session: &SessionPlots<'_>, models: [&str; 2]) -> Table {
    let has_change = session.has_change();
    let rows = session.series.tests.iter().enumerate().map(|(number, test)| {
        let [before, after] = session.rms_um(number).map(micrometres);
        let mut row = cells![&test.name, integer(test.after_um.len() / test.channels), after];
        if has_change {
            row.insert(2, before.into());
        }
        row
    });
    let [before, after] = models.map(|model| numbers(format!("rms, {model}")));
    let mut columns = vec![words("test"), numbers("readings"), after];
    if has_change {
        columns.insert(2, before);
    }
    Table::new(columns, rows)
}

/// A note about tests without plots of their own.
fn omitted_tests(session: &SessionPlots<'_>) -> Text {
    let tests = session.series.tests.len();
    let note = format!("Plots are shown for the first {MAX_TESTS} of {tests} tests. The data contain all tests.");
    Text::List(if tests > MAX_TESTS { vec![note] } else { Vec::new() })
}

/// Two views before and after; none for readings along runs and for directions of the sky.
fn over_places(session: &SessionPlots<'_>) -> Vec<Figure> {
    let are_directions = session.problem.models.iter().all(|model| model.channels().iter().all(|one| one.is_angle()));
    if are_directions {
        return Vec::new();
    }
    views(session.problem, session.series).iter().map(|view| over_place(session, view)).collect()
}

fn over_place(session: &SessionPlots<'_>, view: &View) -> Figure {
    let [first, second] = &view.names;
    let size = Quantity::new("residual", session.series.unit.name());
    let place = if view.unit == "mm" { "the nominal place of the target in R" } else { "both joints" };
    Figure::new(
        format!("residual-over-{first}-{second}"),
        format!("Residual over {first} and {second}"),
        format!("Diameter: rms length of the residual in a cell, over {place}."),
        bubbles(view, &size, session.has_change()),
    )
}
