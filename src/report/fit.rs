//! The report of `abbe fit`.

use abbe::identify::IdentifyError;
use abbe::identify::fit::Fit;
use abbe::identify::plan::candidate_tests;
use abbe::identify::problem::Problem;
use abbe::identify::results::{FitResult, ModelResult};
use abbe::identify::series::{spectrum, views};
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::{Document, prose};
use super::plausibility;
use super::plots::Drawn;
use super::readings::{self, sentence_of_noise, um};
use super::{circular, curves};

/// How a fit was made.
pub fn method(result: &FitResult) -> Markup {
    html! {
        p {
            "Least squares on the kinematic chain, all unknowns at once, in the directions that the readings see; covariance by the law of propagation \
             of uncertainty (JCGM 100, JCGM 102). " (sentence_of_noise(result.noise_um, &result.noise_source)) "; held out: leaving out " (result.heldout_by) "."
        }
    }
}

/// The report.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn document(problem: &Problem<'_>, fit: &Fit, result: &FitResult) -> Result<Document, IdentifyError> {
    let views = views(problem, fit, None)?;
    let drawn = Drawn::new(problem, &views);
    let spectra = spectrum::spectra(problem, &views);
    let excess = if result.noise_source == "residual" {
        "The uncertainties follow from this very residual, which cannot say whether the model lacks anything; `abbe trace` looks for that.".to_string()
    } else if result.u_enlargement > 1.0 {
        format!(
            "The residual is {:.2} times what noise would leave: something is missing from the model, and `abbe trace` looks for it.",
            result.u_enlargement
        )
    } else {
        "The residual is what noise would leave.".to_string()
    };
    let mut document = Document {
        title: format!("Fit of {}", problem.session.machine.name),
        verdict: format!(
            "{} of {} unknowns or combinations of them are identified from {}; they leave {} ({} held out). {excess}",
            result.rank,
            result.parameter_count,
            counted(result.readings, "reading"),
            um(result.rms_um),
            um(result.heldout_rms_um),
        ),
        ..Document::default()
    };
    readings::live(&mut document, &drawn, &result.parameters);
    plausibility::section(&mut document, &result.plausibility);
    let nominal = nominal_result(&drawn);
    let fitted = ModelResult {
        rms_um: result.rms_um,
        heldout_rms_um: result.heldout_rms_um,
        rms_3d_um: result.rms_3d_um,
        heldout_rms_3d_um: result.heldout_rms_3d_um,
        noise_um: result.noise_um,
        ..ModelResult::default()
    };
    let section = readings::before_and_after(
        &mut document,
        &drawn,
        &[
            (
                if drawn.is_round() {
                    "nominal machine and set-up"
                } else {
                    "nominal machine, fitted set-up"
                },
                &nominal,
            ),
            ("fitted", &fitted),
        ],
        [
            "before, deviation of the nominal machine",
            "after, residual of the fit",
        ],
    );
    document.section("Before and after", section);
    let section = readings::traces(&mut document, &drawn);
    document.section("Traces", section);
    let section = readings::parameters(&mut document, &result.parameters, None);
    document.section("Parameters", section);
    let section = readings::residuals(&mut document, &drawn, &spectra);
    document.section("Residuals", section);
    if !result.circular.is_empty() {
        document.section("Ball-bar figures", circular::section(&result.circular));
    }
    let correlations = readings::correlations(&mut document, problem, fit);
    document.section(
        "What else it could be",
        html! {
            p { "Errors that are strongly correlated are separated only by small differences; a confounded combination is not returned as a number." }
            (correlations)
            (readings::unobservable(&result.unobservable))
        },
    );
    let patterns = curves::patterns(&mut document, problem, &fit.beta)?;
    document.section(
        "What to measure next",
        html! {
            p {
                @if result.u_enlargement > 1.0 { (prose("First `abbe trace` on the same session. ")) }
                @if !candidate_tests::has_candidates(problem) {
                    @if !result.unobservable.is_empty() {
                        "A test that makes the rest identifiable has to move what these tests leave standing: "
                        (result.unobservable.len()) (if result.unobservable.len() == 1 { " combination" } else { " combinations" }) " of parameters."
                    }
                } @else if result.unobservable.is_empty() {
                    (prose("Every parameter is identifiable; `abbe plan SESSION --improve 1` names the test that lowers the uncertainties most."))
                } @else {
                    (prose("`abbe plan SESSION --improve 1` names the cheapest test that makes identifiable what these readings do not: "))
                    (result.unobservable.len()) (if result.unobservable.len() == 1 { " combination." } else { " combinations." })
                }
            }
            (readings::warnings(&result.outliers, &result.warnings))
        },
    );
    document.section("What each error does to each test", patterns);
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    Ok(document)
}

/// The deviation of the nominal machine as a model; nothing was fitted, so held out is no different.
fn nominal_result(drawn: &Drawn<'_>) -> ModelResult {
    let rms_um = drawn.views.rms_before_um(drawn.problem);
    let rms_3d_um = (drawn.views.coordinates == 3).then(|| rms_um * 3.0_f64.sqrt());
    ModelResult {
        rms_um,
        heldout_rms_um: rms_um,
        rms_3d_um,
        heldout_rms_3d_um: rms_3d_um,
        noise_um: drawn.problem.noise.sigma_mm * 1e3,
        ..ModelResult::default()
    }
}
