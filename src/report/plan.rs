//! Report of `abbe plan`.

use abbe::identify::IdentifyError;
use abbe::identify::plan::candidate_tests;
use abbe::identify::plan::results::{ErrorAnalysis, PlanAnalysis};
use abbe::identify::problem::Problem;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::curves;
use super::document::{Document, KeyFigure, capitalised, folded, list, prose, table};
use super::format::{integer, typeset, um, unit, units, value_and_u};
use super::plot::Plot;
use super::plot::bars::{self, Fill};
use super::{readings, summary};

/// Maximum number of rows of a table. The JSON result contains all rows.
const MAX_ROWS: usize = 30;

/// Method of the analysis.
pub fn method(analysis: &PlanAnalysis) -> Markup {
    html! {
        p {
            "The model is linearised at the nominal machine and every planned state. The uncertainties follow from the noise (" (um(analysis.noise_um))
            " per reading) and from the priors of the set-up by the law of propagation of uncertainty (JCGM 100, JCGM 102)."
        }
    }
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
        figures: figures(problem, analysis),
        warnings: analysis.warnings.clone(),
        ..Document::default()
    };
    let plots = uncertainties(&analysis.errors);
    let shown = document.show(plots);
    let rows: Vec<Vec<String>> = analysis.errors.iter().map(row).collect();
    document.section(
        "Predicted uncertainty",
        html! {
            (table(
                &["error", "u (k\u{a0}=\u{a0}1)", "unit", "conditional u", "largest sensitivity", "largest contributions to the variance"],
                &rows,
            ))
            p class="note" { "Conditional u: standard uncertainty if all other errors were known." }
            (shown)
        },
    );
    let section = confounding(&mut document, analysis);
    document.section("Correlation and confounding", section);
    document.section("Next test", next(analysis, candidate_tests::has_candidates(problem)));
    let beta = vec![0.0; problem.parameters.list.len()];
    let section = curves::sensitivities(&mut document, problem, &beta)?;
    document.section("Sensitivity of each test", section);
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    Ok(document)
}

/// Key figures of the summary.
fn figures(problem: &Problem, analysis: &PlanAnalysis) -> Vec<KeyFigure> {
    let identifiable = analysis.errors.iter().filter(|error| error.u.is_some()).count();
    let mut figures = vec![
        KeyFigure::new("Identifiable errors", format!("{identifiable} of {}", analysis.errors.len()), ""),
        summary::rank(analysis.rank, analysis.parameter_count),
    ];
    figures.extend(worst(analysis).into_iter().map(|error| {
        let u = error.u.unwrap_or_default();
        let figure = format!("{}: u = {} {}", error.id, value_and_u(u, u).0, unit(&error.unit));
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
        format!("{}; noise {}", counted(problem.tests.len(), "test"), um(analysis.noise_um)),
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
fn uncertainties(errors: &[ErrorAnalysis]) -> Vec<Plot> {
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
            bars::bars(
                format!("uncertainty-{}", name.replace('/', "-per-")),
                format!("Predicted standard uncertainty, {}", unit(name)),
                "Conditional: if all other errors were known.".to_string(),
                &format!("u (k\u{a0}=\u{a0}1), {}", unit(name)),
                &rows,
                &[("key-named", "predicted"), ("key-alias", "conditional")],
            )
        })
        .collect()
}

/// A row of the table of predicted uncertainties.
fn row(error: &ErrorAnalysis) -> Vec<String> {
    let figure = |u: Option<f64>| u.map_or("not identifiable".to_string(), |u| value_and_u(u, u).0);
    let budget: Vec<String> =
        error.budget.iter().take(3).map(|part| format!("{} {:.0} %", part.source, 100.0 * part.share)).collect();
    vec![
        error.id.clone(),
        figure(error.u),
        unit(&error.unit),
        figure(error.conditional_u),
        format!("{:.3} µm/{} in {}", error.sensitivity.largest, unit(&error.unit), error.sensitivity.largest_in_test)
            .replace('-', "\u{2212}"),
        budget.join(", "),
    ]
}

fn confounding(document: &mut Document, analysis: &PlanAnalysis) -> Markup {
    let ids = &analysis.correlation.ids;
    let shown = if ids.len() > 1 && ids.len() <= 60 {
        document.show([readings::correlation_map(ids, &analysis.correlation.matrix)])
    } else {
        html! {}
    };
    let confounded = analysis.effects.as_ref().map(|effects| {
        effects
            .effects
            .iter()
            .filter(|effect| effect.verdict.starts_with("confounded") && !effect.biases.is_empty())
            .take(MAX_ROWS)
            .map(|effect| {
                let biases = effect.biases.iter().take(2);
                let biases: Vec<String> =
                    biases.map(|bias| format!("{} {:.3} {}", bias.id, bias.per_unit, unit(&bias.unit))).collect();
                vec![effect.id.clone(), format!("{:.2} %", 100.0 * effect.residual_share), biases.join(", ")]
            })
            .collect::<Vec<_>>()
    });
    html! {
        (shown)
        (readings::confounded(&analysis.unidentifiable))
        @if !analysis.determined_by_prior.is_empty() {
            h3 { "Errors determined by the set-up priors only" }
            (list(analysis.determined_by_prior.iter().map(|error| capitalised(&error.why))))
        }
        @if !analysis.nearly_collinear.is_empty() {
            h3 { "Poorly separable errors" }
            (list(analysis.nearly_collinear.iter().map(|errors| capitalised(&errors.why))))
        }
        @if let Some(confounded) = confounded.filter(|rows| !rows.is_empty()) {
            h3 { "Effects confounded with errors" }
            (folded(
                &counted(confounded.len(), "effect"),
                &table(&["effect", "share of the signal in the residual", "bias per unit of the effect"], &typeset(confounded)),
            ))
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
