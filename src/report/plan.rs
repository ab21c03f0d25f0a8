//! The report of `abbe plan`.

use abbe::identify::IdentifyError;
use abbe::identify::plan::candidate_tests;
use abbe::identify::plan::results::{ErrorAnalysis, PlanAnalysis};
use abbe::identify::problem::Problem;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::curves;
use super::document::{Document, list, prose, table};
use super::plot::Plot;
use super::plot::bars::{self, Fill};
use super::readings::{self, um, unit, value_and_u};

/// Rows of a table at most; the JSON holds all.
const MAX_ROWS: usize = 30;

/// How a plan is judged.
pub fn method(analysis: &PlanAnalysis) -> Markup {
    html! {
        p {
            "The nominal machine is linearised at every planned state; uncertainties follow from noise (" (um(analysis.noise_um))
            " a reading) and from what is known of the set-up, by the law of propagation of uncertainty (JCGM 100, JCGM 102)."
        }
    }
}

/// The report.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn document(problem: &Problem<'_>, analysis: &PlanAnalysis) -> Result<Document, IdentifyError> {
    let seen = analysis.errors.iter().filter(|error| error.u.is_some()).count();
    let mut document = Document {
        title: format!("Plan for {}", problem.session.machine.name),
        verdict: format!(
            "{seen} of {} would be identified by {} in {}{}.",
            counted(analysis.errors.len(), "error"),
            counted(analysis.readings, "reading"),
            counted(analysis.tests.len(), "test"),
            analysis
                .moving_min
                .map_or(String::new(), |min| format!(", {min:.0} min of movement")),
        ),
        ..Document::default()
    };
    let plots = uncertainties(&analysis.errors);
    let shown = document.show(plots);
    let rows: Vec<Vec<String>> = analysis.errors.iter().map(row).collect();
    document.section(
        "Predicted uncertainty",
        html! {
            (shown)
            (table(&["error", "u (k=1)", "unit", "others known", "largest sensitivity", "where it comes from"], &rows))
        },
    );
    let beta = vec![0.0; problem.parameters.list.len()];
    let section = curves::patterns(&mut document, problem, &beta)?;
    document.section("What each error does to each test", section);
    let section = other_explanations(&mut document, analysis);
    document.section("What else it could be", section);
    document.section(
        "What to measure next",
        next(analysis, candidate_tests::has_candidates(problem)),
    );
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    Ok(document)
}

fn uncertainties(errors: &[ErrorAnalysis]) -> Vec<Plot> {
    let mut units: Vec<&str> = errors.iter().map(|error| error.unit.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    units
        .into_iter()
        .map(|name| {
            let rows: Vec<(String, f64, Fill)> = errors
                .iter()
                .filter(|error| error.unit == name)
                .filter_map(|error| Some((error, error.u?)))
                .flat_map(|(error, u)| {
                    let known = error.conditional_u.unwrap_or(u);
                    [
                        (error.id.clone(), u, Fill::Named),
                        (format!("{}, others known", error.id), known, Fill::Alias),
                    ]
                })
                .take(2 * MAX_ROWS)
                .collect();
            bars::bars(
                format!("uncertainty-{}", name.replace('/', "-per-")),
                format!("Predicted standard uncertainty, {}", unit(name)),
                "And what it would be if all other errors were known.".to_string(),
                &format!("u (k=1), {}", unit(name)),
                &rows,
                &[
                    ("key-named", "by this plan"),
                    ("key-alias", "if the others were known"),
                ],
            )
        })
        .collect()
}

fn row(error: &ErrorAnalysis) -> Vec<String> {
    let figure = |u: Option<f64>| u.map_or("not seen".to_string(), |u| value_and_u(u, u).0);
    let budget: Vec<String> = error
        .budget
        .iter()
        .take(3)
        .map(|part| format!("{} {:.0} %", part.source, 100.0 * part.share))
        .collect();
    vec![
        error.id.clone(),
        figure(error.u),
        unit(&error.unit),
        figure(error.conditional_u),
        format!(
            "{:.3} µm/{} in {}",
            error.sensitivity.largest,
            unit(&error.unit),
            error.sensitivity.largest_in_test
        )
        .replace('-', "\u{2212}"),
        budget.join(", "),
    ]
}

fn other_explanations(document: &mut Document, analysis: &PlanAnalysis) -> Markup {
    let ids = &analysis.correlation.ids;
    let shown = if ids.len() > 1 && ids.len() <= 60 {
        document.show([readings::map(ids, &analysis.correlation.matrix)])
    } else {
        html! {}
    };
    let hidden = analysis.effects.as_ref().map(|effects| {
        effects
            .effects
            .iter()
            .filter(|effect| effect.verdict == "confounded" && !effect.biases.is_empty())
            .take(MAX_ROWS)
            .map(|effect| {
                let biases = effect.biases.iter().take(2);
                let biases: Vec<String> = biases
                    .map(|bias| format!("{} {:.3} {}", bias.id, bias.per_unit, unit(&bias.unit)))
                    .collect();
                vec![
                    effect.id.clone(),
                    format!("{:.2} %", 100.0 * effect.residual_share),
                    biases.join(", "),
                ]
            })
            .collect::<Vec<_>>()
    });
    html! {
        (shown)
        (readings::unobservable(&analysis.unidentifiable))
        @if !analysis.determined_by_prior.is_empty() {
            h3 { "Held by what is known of the set-up, not by readings" }
            (list(analysis.determined_by_prior.iter().map(|held| held.why.clone())))
        }
        @if !analysis.nearly_collinear.is_empty() {
            h3 { "Told apart, but badly" }
            (list(analysis.nearly_collinear.iter().map(|near| near.why.clone())))
        }
        @if let Some(hidden) = hidden.filter(|hidden| !hidden.is_empty()) {
            h3 { "Effects that would hide, and what they bias" }
            (table(&["effect", "share that survives the fit", "bias a unit"], &hidden))
        }
    }
}

fn next(analysis: &PlanAnalysis, offered: bool) -> Markup {
    html! {
        @if !analysis.leave_one_out.is_empty() {
            h3 { "What each test contributes" }
            (list(analysis.leave_one_out.iter().map(|without| without.why.clone())))
        }
        @if offered {
            p {
            (prose("`abbe plan SESSION --improve 1` names the test that lowers the uncertainties most for its time, `--separate A,B` the one that tells two \
                    effects apart."))
            }
        }
        @if !analysis.warnings.is_empty() { h3 { "Warnings" } (list(analysis.warnings.iter().cloned())) }
    }
}
