//! Report of `abbe trace`.

use abbe::identify::IdentifyError;
use abbe::identify::plan::candidate_tests;
use abbe::identify::results::{GoodnessVerdict, ModelResult, TraceResult, TraceVerdict};
use abbe::identify::series::{spectrum, views};
use abbe::identify::trace::TraceOutcome;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::{Document, KeyFigure};
use super::plots::SessionPlots;
use super::summary::{self, Quality, noise_sentence};
use super::{curves, effects, readings, residuals, sections, values};
use crate::printers::html::{capitalised, folded, integer, list, prose};
use crate::report::effect::name;
use crate::report::parameters::Estimates;
use crate::report::{trace as present, uniqueness};

/// Method of a trace.
fn method(result: &TraceResult) -> String {
    format!(
        "The search screens {} candidate effects of the library against the residual of the declared model. {} of them \
         are detectable in these readings. An effect is added if the same search rarely finds an effect as good in \
         readings without structure. All parameters are then refitted together. {}. Held-out error: each fold leaves \
         out {}; the search is repeated in each fold.",
        integer(result.candidates),
        integer(result.candidates_detectable),
        noise_sentence(result.noise_um, result.noise_source),
        result.heldout_by
    )
}

/// What remains of the residual.
fn remains(result: &TraceResult) -> &'static str {
    match result.outcome.goodness.verdict {
        GoodnessVerdict::Exceeds if !result.remainder.structured => {
            "The residual exceeds the noise: the model lacks an effect, and its estimates are not to be quoted."
        }
        _ => "Structure remains: the model lacks an effect, and its estimates are not to be quoted.",
    }
}

/// Verdict as a sentence.
fn verdict(result: &TraceResult) -> String {
    let subject = match result.effects.len() {
        1 => "1 effect explains".to_string(),
        n => format!("{n} effects explain"),
    };
    let sentence = match result.verdict {
        TraceVerdict::Clean => "The residual of the declared model agrees with noise.".to_string(),
        TraceVerdict::Incomplete => format!("The search was {}. Effects may be missing.", result.interruption()),
        TraceVerdict::Explained => format!("{subject} the residual of the declared model."),
        TraceVerdict::PartlyExplained => {
            format!("{subject} a part of the residual of the declared model. {}", remains(result))
        }
        TraceVerdict::NotJudged => format!(
            "{} No noise is stated and no reading repeats, so that whether the remaining residual is noise cannot be judged.",
            match result.effects.len() {
                0 => "The search finds no effect.".to_string(),
                _ => format!("{subject} a part of the residual of the declared model."),
            }
        ),
        TraceVerdict::Unexplained => format!("No effect of the library explains the residual. {}", remains(result)),
    };
    match uniqueness::headline(result) {
        Some(headline) => format!("{sentence} {}.", capitalised(&headline)),
        None => sentence,
    }
}

/// The report.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn document(trace: &TraceOutcome) -> Result<Document, IdentifyError> {
    let result = &trace.result;
    let problem = &trace.after;
    let series = views(problem, &trace.after_fit, Some(&trace.before_fit.residuals))?;
    let session = SessionPlots::new(problem, &series);
    let spectra = spectrum::spectra(problem, &series);
    let mut document = Document {
        title: format!("Trace of {}", problem.session.machine.name),
        word: result.verdict.to_string(),
        verdict: verdict(result),
        key_figures: key_figures(trace),
        warnings: result.warnings.clone(),
        method: method(result),
        ..Document::default()
    };
    readings::add_data(&mut document, &session, &result.after.parameters);
    sections::conflicts(&mut document, &result.plausibility);
    let estimates = Estimates::new(problem, &trace.after_fit, &result.after.parameters);
    let before = (!result.effects.is_empty()).then_some(result.before.parameters.as_slice());
    let section = values::section(&mut document, &estimates, before);
    document.section("Values", html! { (section) (changes(&estimates, result)) });
    sections::conformity(&mut document, result.conformity.as_ref());
    let section = residuals::section(
        &mut document,
        &session,
        &spectra,
        if result.effects.is_empty() { ["declared model"; 2] } else { ["declared model", "with the found effects"] },
    );
    document.section(
        "Residuals",
        html! {
            p { "Structure of the residual of the declared model: " (result.residual_before) "." }
            (section)
        },
    );
    let section = effects::section(&mut document, trace);
    document.section("Effects and competing explanations", section);
    document.section("Next test", next(result, candidate_tests::has_candidates(problem)));
    let section = readings::traces(&mut document, &session);
    document.section("Traces", section);
    let section = readings::correlations(&mut document, problem, &trace.after_fit);
    document.section(
        "Correlation and confounding",
        html! { (section) (sections::confounded(&result.unobservable)) (sections::outliers(&result.outliers)) },
    );
    let plots = curves::sensitivities(problem, &trace.after_fit.beta)?;
    let section = document.show(plots);
    document.section("Sensitivity of each test", section);
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    Ok(document)
}

/// Quality of a model of a trace.
fn quality<'r>(result: &'r TraceResult, model: &'r ModelResult) -> Quality<'r> {
    Quality {
        chi_square: model.chi_square,
        degrees_of_freedom: model.degrees_of_freedom,
        heldout_rms_um: model.heldout_rms_um,
        heldout_rms_3d_um: model.heldout_rms_3d_um,
        cross_validation: &model.cross_validation,
        rank: model.rank,
        parameters: model.parameter_count,
        noise_um: model.noise_um,
        noise_source: result.noise_source,
    }
}

/// Key figures of the summary.
fn key_figures(trace: &TraceOutcome) -> Vec<KeyFigure> {
    let result = &trace.result;
    let [before, after] = [&result.before, &result.after].map(|model| quality(result, model));
    let mut figures = vec![
        summary::chi_square(&after, Some(&before)),
        summary::held_out(&after, Some(&before)),
        summary::rank(after.rank, after.parameters),
    ];
    let unique = result.effects.iter().filter(|effect| effect.unique).count();
    match result.effects.as_slice() {
        [] => {}
        [one] if one.unique => figures.push(KeyFigure::new(
            "Uniqueness",
            "unique",
            format!("among {} detectable candidates", integer(result.candidates_detectable)),
        )),
        [one] => figures.push(KeyFigure::new(
            "Uniqueness",
            format!("1 of {}", one.explanation_count),
            "indistinguishable explanations",
        )),
        many => figures.push(KeyFigure::new("Uniqueness", format!("{unique} of {}", many.len()), "effects are unique")),
    }
    let (structure, relation) =
        if result.remainder.structured { ("significant", "≤") } else { ("not significant", "=") };
    figures.push(KeyFigure::new(
        "Remaining structure",
        structure,
        format!("p {relation} {:.3}", result.remainder.p_value),
    ));
    figures.push(summary::readings(&trace.after, result.readings, result.outliers.len()));
    figures
}

/// Parameters that changed when the effects were added: the bias of the declared model.
fn changes(estimates: &Estimates<'_>, result: &TraceResult) -> Markup {
    let (setup, values): (Vec<_>, Vec<_>) =
        present::changes(result).into_iter().partition(|(id, _)| estimates.is_setup(id));
    let sentences = |changes: Vec<(&str, String)>| list(changes.into_iter().map(|(_, sentence)| sentence));
    html! {
        @if !result.changed_parameters.is_empty() {
            h3 { "Changes by more than the standard uncertainty when the effects were added" }
            @if !values.is_empty() { (sentences(values)) }
            @if !setup.is_empty() { (folded(&counted(setup.len(), "set-up parameter"), &sentences(setup))) }
        }
    }
}

/// Tests that separate the found effects from their alternatives.
fn next(result: &TraceResult, has_candidates: bool) -> Markup {
    let mut tests: Vec<String> = Vec::new();
    for (number, effect) in result.effects.iter().enumerate() {
        let sentences = uniqueness::tests(effect, name).join("; ");
        if !sentences.is_empty() {
            tests.push(format!("{}. {}: {sentences}.", number + 1, effect.name.meaning));
        }
    }
    html! {
        @if !tests.is_empty() {
            (list(tests))
        } @else if result.effects.is_empty() {
            p { "There is no effect to separate from alternatives." }
        } @else {
            p { "Every found effect is unique. No further test is needed to separate it from alternatives." }
        }
        @if has_candidates && !result.unobservable.is_empty() {
            p { (prose("`abbe plan SESSION --improve 1` proposes the fastest test that makes further parameters identifiable.")) }
        }
    }
}
