//! Report of `abbe fit`.

use abbe::identify::IdentifyError;
use abbe::identify::fit::Fit;
use abbe::identify::plan::candidate_tests;
use abbe::identify::problem::Problem;
use abbe::identify::results::{FitResult, GoodnessVerdict};
use abbe::identify::series::{spectrum, views};
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::{Document, KeyFigure};
use super::plots::SessionPlots;
use super::summary::{self, Quality, noise_sentence};
use super::{curves, readings, residuals, sections, values};
use crate::printers::html::prose;
use crate::report::number::micrometres;
use crate::report::parameters::Estimates;

/// Method of a fit.
fn method(result: &FitResult) -> String {
    format!(
        "Least squares on the kinematic chain. All parameters are estimated together in the identifiable subspace. The \
         covariance follows from the law of propagation of uncertainty (JCGM 100, JCGM 102). {}. Held-out error: each \
         fold leaves out {}.",
        noise_sentence(result.noise_um, result.noise_source),
        result.heldout_by
    )
}

/// The report.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn document(problem: &Problem, fit: &Fit, result: &FitResult) -> Result<Document, IdentifyError> {
    let series = views(problem, fit, None)?;
    let session = SessionPlots::new(problem, &series);
    let spectra = spectrum::spectra(problem, &series);
    let mut document = Document {
        title: format!("Fit of {}", problem.session.machine.name),
        verdict: verdict(result),
        key_figures: key_figures(problem, result),
        warnings: result.warnings.clone(),
        method: method(result),
        ..Document::default()
    };
    readings::add_data(&mut document, &session, &result.parameters);
    sections::conflicts(&mut document, &result.plausibility);
    let section = values::section(&mut document, &Estimates::new(problem, fit, &result.parameters), None);
    document.section("Values", section);
    sections::conformity(&mut document, result.conformity.as_ref());
    let before = if session.is_polar() { "nominal machine and set-up" } else { "nominal machine, fitted set-up" };
    let section = residuals::section(&mut document, &session, &spectra, [before, "fit"]);
    document.section("Residuals", section);
    document.section("Next test", next(result, candidate_tests::has_candidates(problem)));
    let section = readings::traces(&mut document, &session);
    document.section("Traces", section);
    if !result.circular.is_empty() {
        document.section("Ball-bar figures", sections::ball_bar(&result.circular));
    }
    let section = readings::correlations(&mut document, problem, fit);
    document.section(
        "Correlation and confounding",
        html! { (section) (sections::confounded(&result.unobservable)) (sections::outliers(&result.outliers)) },
    );
    let plots = curves::sensitivities(problem, &fit.beta)?;
    let section = document.show(plots);
    document.section("Sensitivity of each test", section);
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    Ok(document)
}

/// Verdict in two sentences: identifiability, and agreement of residual and noise.
fn verdict(result: &FitResult) -> String {
    let identifiable = match result.parameter_count.saturating_sub(result.rank) {
        0 => format!("All {} are identifiable.", counted(result.parameter_count, "parameter")),
        _ => format!(
            "{} of {} identifiable (numerical rank {}).",
            result.identifiable.len(),
            counted(result.parameter_count, "parameter"),
            result.rank
        ),
    };
    let agreement = match result.outcome.goodness.verdict {
        GoodnessVerdict::NotJudged => "The noise is estimated from the residual, so that the residual cannot test the model. `abbe trace` searches for unmodelled effects.".to_string(),
        GoodnessVerdict::Exceeds | GoodnessVerdict::Structured => format!(
            "The residual exceeds the noise by a factor of {:.2}: the model lacks an effect, and its estimates are not to be quoted.",
            result.u_enlargement
        ),
        GoodnessVerdict::NoiseOverstated => "The residual is smaller than the noise: the noise is overstated.".to_string(),
        GoodnessVerdict::Agrees => "The residual agrees with the noise.".to_string(),
    };
    format!("{identifiable} {agreement}")
}

/// Key figures of the summary.
fn key_figures(problem: &Problem, result: &FitResult) -> Vec<KeyFigure> {
    let quality = Quality {
        chi_square: result.chi_square,
        degrees_of_freedom: result.degrees_of_freedom,
        heldout_rms_um: result.heldout_rms_um,
        heldout_rms_3d_um: result.heldout_rms_3d_um,
        cross_validation: &result.cross_validation,
        rank: result.rank,
        parameters: result.parameter_count,
        noise_um: result.noise_um,
        noise_source: result.noise_source,
    };
    let mut figures = vec![
        summary::chi_square(&quality, None),
        summary::held_out(&quality, None),
        summary::rank(result.rank, result.parameter_count),
    ];
    let length = result.rms_3d_um.map_or("scalar readings".to_string(), |rms| format!("vector: {}", micrometres(rms)));
    figures.push(KeyFigure::new("Residual rms", micrometres(result.rms_um), length));
    figures.push(summary::readings(problem, result.readings, result.outliers.len()));
    figures
}

/// Proposals for the next step.
fn next(result: &FitResult, has_candidates: bool) -> Markup {
    let remaining = match result.unobservable.len() {
        1 => "1 null-space direction remains".to_string(),
        many => format!("{many} null-space directions remain"),
    };
    html! {
        @if result.u_enlargement > 1.0 {
            p { (prose("Run `abbe trace` on this session first: it searches for the effect behind the residual.")) }
        }
        @match (result.unobservable.is_empty(), has_candidates) {
            (true, true) => p {
                (prose("All parameters are identifiable. `abbe plan SESSION --improve 1` proposes the test that reduces the uncertainties most."))
            },
            (true, false) => p { "All parameters are identifiable." },
            (false, true) => p {
                (remaining) (prose(". `abbe plan SESSION --improve 1` proposes the fastest test that makes further parameters identifiable."))
            },
            (false, false) => p { (remaining) ". A further test has to move axes that these tests leave at rest." },
        }
    }
}
