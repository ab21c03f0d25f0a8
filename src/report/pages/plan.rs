//! Report of `abbe plan`.

use abbe::identify::IdentifyError;
use abbe::identify::plan::candidate_tests;
use abbe::identify::plan::results::{ErrorAnalysis, PlanAnalysis};
use abbe::identify::problem::Problem;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::{Document, KeyFigure};
use super::{curves, readings, sections, summary};
use crate::printers::html::{capitalised, folded, integer, list, prose, table};
use crate::report::figure::bars::{Bars, Fill};
use crate::report::figure::{Chart, Figure, Quantity};
use crate::report::fit::noise;
use crate::report::number::{micrometres, three_digits, unit, units, with_symbols};
use crate::report::plan::{self as present, effects};

/// Maximum number of errors of a plot. The JSON result contains all errors.
const MAX_ROWS: usize = 30;

/// Method of the analysis.
fn method(analysis: &PlanAnalysis) -> String {
    format!(
        "The model is linearised at the nominal machine and every planned state. The uncertainties follow from the \
         noise ({} per reading, {}) and from the priors of the set-up by the law of propagation of uncertainty (JCGM \
         100, JCGM 102).",
        micrometres(analysis.noise_um),
        analysis.noise_source
    )
}

/// The report.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn document(problem: &Problem, analysis: &PlanAnalysis) -> Result<Document, IdentifyError> {
    let identifiable = analysis.errors.iter().filter(|error| error.u.is_some()).count();
    let mut document = Document {
        title: format!("Plan for {}", problem.session.machine.name),
        verdict: format!(
            "{identifiable} of {} identifiable from {} in {}{}.{}",
            counted(analysis.errors.len(), "error"),
            counted(analysis.readings, "reading"),
            counted(analysis.tests.len(), "test"),
            analysis.moving_min.map_or(String::new(), |min| format!(", {min:.0} min of movement")),
            limit(analysis),
        ),
        key_figures: key_figures(problem, analysis),
        warnings: analysis.warnings.clone(),
        method: method(analysis),
        ..Document::default()
    };
    let plots = uncertainties(&analysis.errors);
    let shown = document.show(plots);
    document.section(
        "Predicted uncertainty",
        html! {
            (table(&present::uncertainties(&analysis.errors)))
            (shown)
            (table(&present::sensitivity(&analysis.errors)))
            (table(&present::budgets(&analysis.errors)))
        },
    );
    let section = confounding(&mut document, analysis);
    document.section("Correlation and confounding", section);
    document.section("Next test", next(analysis, candidate_tests::has_candidates(problem)));
    let beta = vec![0.0; problem.parameters.list.len()];
    let plots = curves::sensitivities(problem, &beta)?;
    let section = document.show(plots);
    document.section("Sensitivity of each test", section);
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    Ok(document)
}

/// Key figures of the summary.
fn key_figures(problem: &Problem, analysis: &PlanAnalysis) -> Vec<KeyFigure> {
    let identifiable = analysis.errors.iter().filter(|error| error.u.is_some()).count();
    let mut figures = vec![
        KeyFigure::new("Identifiable errors", format!("{identifiable} of {}", analysis.errors.len()), ""),
        summary::rank(analysis.rank, analysis.parameter_count),
    ];
    figures.extend(worst(analysis).into_iter().map(|error| {
        let u = error.u.unwrap_or_default();
        let figure = format!("{}: u = {} {}", error.id, three_digits(u), unit(&error.unit));
        KeyFigure::new("Worst determined", figure, contribution(error))
    }));
    figures.push(KeyFigure::new(
        "Condition number",
        format!("{:.1}", analysis.indices.condition_number),
        "scaled Jacobian of the errors",
    ));
    figures.push(KeyFigure::new(
        "Readings",
        integer(analysis.readings),
        format!("{}; {}", counted(problem.tests.len(), "test"), noise(analysis.noise_um, analysis.noise_source)),
    ));
    figures
}

/// The identifiable error with the largest standard uncertainty in each unit.
fn worst(analysis: &PlanAnalysis) -> Vec<&ErrorAnalysis> {
    let mut worst: Vec<&ErrorAnalysis> = Vec::new();
    for error in analysis.errors.iter().filter(|error| error.u.is_some()) {
        match worst.iter_mut().find(|other| other.unit == error.unit) {
            Some(other) if error.u > other.u => *other = error,
            Some(_) => {}
            None => worst.push(error),
        }
    }
    worst
}

/// The largest contribution to the variance of an error.
fn contribution(error: &ErrorAnalysis) -> String {
    error
        .budget
        .first()
        .map_or(String::new(), |part| format!("{:.0} % of the variance from {}", 100.0 * part.share, part.source))
}

/// Sentences about the worst determined errors.
fn limit(analysis: &PlanAnalysis) -> String {
    let sentences = worst(analysis).into_iter().map(|error| {
        format!(" {} is the worst determined error in {}: {}.", error.id, unit(&error.unit), contribution(error))
    });
    sentences.collect()
}

/// Plots of the predicted standard uncertainties, one for each unit.
pub fn uncertainties(errors: &[ErrorAnalysis]) -> Vec<Figure> {
    units(errors.iter().map(|error| error.unit.as_str()))
        .into_iter()
        .map(|name| {
            let rows: Vec<(String, f64, Fill)> = errors
                .iter()
                .filter(|error| error.unit == name)
                .filter_map(|error| Some((error, error.u?)))
                .flat_map(|(error, u)| {
                    let known = error.conditional_u.unwrap_or(u);
                    [(error.id.clone(), u, Fill::Named), (format!("{}, conditional", error.id), known, Fill::Alias)]
                })
                .take(2 * MAX_ROWS)
                .collect();
            Figure::new(
                format!("uncertainty-{}", name.replace('/', "-per-")),
                format!("Predicted standard uncertainty, {}", unit(name)),
                "Conditional: if all other errors were known.",
                Chart::Bars(Bars {
                    quantity: Quantity::new("u (k\u{a0}=\u{a0}1)", name),
                    rows,
                    labels: vec![(Fill::Named, "predicted"), (Fill::Alias, "conditional")],
                }),
            )
        })
        .collect()
}

fn confounding(document: &mut Document, analysis: &PlanAnalysis) -> Markup {
    let ids = &analysis.correlation.ids;
    let shown = if ids.len() > 1 && ids.len() <= 60 {
        document.show([readings::correlation_map(ids.clone(), analysis.correlation.matrix.clone())])
    } else {
        html! {}
    };
    html! {
        (shown)
        (sections::confounded(&analysis.unidentifiable))
        @if !analysis.determined_by_prior.is_empty() {
            h3 { "Errors determined by the set-up priors only" }
            (list(analysis.determined_by_prior.iter().map(|error| capitalised(&with_symbols(&error.why)))))
        }
        @if !analysis.nearly_collinear.is_empty() {
            h3 { "Poorly separable errors" }
            (list(analysis.nearly_collinear.iter().map(|errors| capitalised(&with_symbols(&errors.why)))))
        }
        @if let Some((found, counts)) = analysis.effects.as_ref().map(|found| (found, effects::counts(found))) {
            @if counts.confounded > 0 {
                h3 { "Effects confounded with errors" }
                (folded(
                    &counted(counts.confounded, "effect"),
                    &html! { (table(&effects::confounded(found))) (table(&effects::by_error(found))) },
                ))
            }
        }
    }
}

fn next(analysis: &PlanAnalysis, has_candidates: bool) -> Markup {
    html! {
        @if !analysis.leave_one_out.is_empty() {
            h3 { "Contribution of each test" }
            (list(analysis.leave_one_out.iter().map(|without| capitalised(&without.why))))
        }
        @if has_candidates {
            p {
                (prose("`abbe plan SESSION --improve 1` proposes the test that reduces the largest uncertainty most. \
                        `abbe plan SESSION --separate A,B` proposes the test that best separates two effects."))
            }
        }
    }
}
