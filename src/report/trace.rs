//! The report of `abbe trace`.

use abbe::identify::IdentifyError;
use abbe::identify::plan::candidate_tests;
use abbe::identify::results::{EffectName, EffectResult, TraceResult};
use abbe::identify::series::{spectrum, views};
use abbe::identify::trace::TraceOutcome;
use abbe::identify::trace::alias::CompetingEffect;
use maud::{Markup, html};

use super::curves;
use super::document::{Document, list, prose, table};
use super::plausibility;
use super::plot::bars::{self, Fill};
use super::plot::lines::{ACROSS, Lines, Mark, Series, UP, span};
use super::plot::scale::{Scale, place, polyline};
use super::plot::{Plot, cut};
use super::plots::Drawn;
use super::readings::{self, sentence_of_noise, um, unit, value_and_u};
use crate::cli::table::shape_number;
use crate::cli::trace::name;
use crate::cli::uniqueness;

/// Effects whose rivals are drawn.
const MAX_RANKED: usize = 12;

/// How a trace was made.
pub fn method(result: &TraceResult) -> Markup {
    html! {
        p {
            "The residual of the declared model is searched for " (result.candidates) " effects of the library, of which \
             these readings can see " (result.candidates_detectable)
            ". An effect is added if readings without structure seldom let the whole search find as good; everything is then refitted together. "
            (sentence_of_noise(result.noise_um, &result.noise_source)) "; held out: leaving out " (result.heldout_by) ", search included."
        }
    }
}

fn sentence(result: &TraceResult) -> String {
    let noise = match result.noise_source.as_str() {
        "residual" => String::new(),
        _ => format!("; the noise is {}", um(result.noise_um)),
    };
    let figures = format!(
        "held-out residual {} before, {} after{noise}.",
        um(result.before.heldout_rms_um),
        um(result.after.heldout_rms_um)
    );
    let count = match result.effects.len() {
        1 => "One effect of the library accounts".to_string(),
        n => format!("{n} effects of the library account"),
    };
    match result.verdict.as_str() {
        "clean" => format!(
            "The declared model leaves nothing beyond noise: {} held out{}.",
            um(result.before.heldout_rms_um),
            noise.replace("; the noise is", ", noise")
        ),
        "incomplete" => format!("The trace was {}: {figures}", result.interruption()),
        "explained" => format!("{count} for what the declared model left: {figures}"),
        "partly-explained" => {
            format!("{count} for a part of what the declared model left: {figures}")
        }
        _ => format!("There is structure, and nothing in the library accounts for it: {figures}"),
    }
}

/// The report.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn document(trace: &TraceOutcome<'_>) -> Result<Document, IdentifyError> {
    let result = &trace.result;
    let problem = &trace.after;
    let views = views(problem, &trace.after_fit, Some(&trace.before_fit.residuals))?;
    let drawn = Drawn::new(problem, &views);
    let spectra = spectrum::spectra(problem, &views);
    let mut document = Document {
        title: format!("Trace of {}", problem.session.machine.name),
        word: result.verdict.clone(),
        verdict: match uniqueness::headline(result) {
            Some(headline) => format!("{} {}.", sentence(result), capital(&headline)),
            None => sentence(result),
        },
        ..Document::default()
    };
    readings::live(&mut document, &drawn, &result.after.parameters);
    plausibility::section(&mut document, &result.plausibility);
    let figures = readings::before_and_after(
        &mut document,
        &drawn,
        &[("before", &result.before), ("after", &result.after)],
        [
            "before, residual of the declared model",
            "after, with what was found",
        ],
    );
    document.section(
        "Before and after",
        html! {
            p { "The declared model leaves: " (result.residual_before) "." }
            (figures)
        },
    );
    let section = effects(&mut document, trace);
    document.section("What was found", section);
    let section = readings::traces(&mut document, &drawn);
    document.section("Traces", section);
    let section = readings::parameters(
        &mut document,
        &result.after.parameters,
        Some(&result.before.parameters),
    );
    let moved = result.changed_parameters.iter().map(|moved| {
        let (by, u) = value_and_u(moved.change, moved.u);
        format!("{} moved by {by} {} (u {u})", moved.id, unit(&moved.unit))
    });
    document.section(
        "Parameters",
        html! {
            (section)
            @if !result.changed_parameters.is_empty() { h3 { "Moved by more than their uncertainty when the effects were added" } (list(moved)) }
        },
    );
    let section = readings::residuals(&mut document, &drawn, &spectra);
    document.section("Residuals", section);
    let section = other_explanations(&mut document, trace);
    document.section("What else it could be", section);
    document.section(
        "What to measure next",
        next(result, candidate_tests::has_candidates(problem)),
    );
    let section = curves::patterns(&mut document, problem, &trace.after_fit.beta)?;
    document.section("What each error does to each test", section);
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    Ok(document)
}

fn effects(document: &mut Document, trace: &TraceOutcome<'_>) -> Markup {
    let result = &trace.result;
    let shown = if trace.steps.is_empty() {
        html! {}
    } else {
        document.show([convergence(trace)])
    };
    let rows: Vec<Vec<String>> = result.effects.iter().enumerate().map(row).collect();
    html! {
        @if result.effects.is_empty() { p { "No effect was added." } }
        @if !rows.is_empty() {
            (table(&["", "effect", "in words", "found", "explains, rms", "p ≤", "explanations", "family"], &rows))
        }
        @for (number, effect) in result.effects.iter().enumerate().filter(|(_, effect)| !effect.unique) {
            (alternatives(number, effect, result))
        }
        @if result.remainder.structured {
            p { "Structure remains (p ≤ " (format!("{:.3}", result.remainder.p_value)) "): " (result.remainder.place.as_deref().unwrap_or("")) "." }
        }
        (shown)
        (curves(document, &result.effects))
    }
}

/// A found effect as a row of a table.
fn row((number, effect): (usize, &EffectResult)) -> Vec<String> {
    let numbers = effect
        .shape_parameters
        .iter()
        .map(|number| unit(&shape_number(number)));
    let values: Vec<String> = effect
        .parameters
        .iter()
        .map(|p| {
            let (value, u) = value_and_u(p.value, p.u);
            // A component may have a dot of its own: `spindle_ball.y~time:drift`.
            let what = p.id.rsplit_once('.').map_or("", |(_, what)| what);
            let what = if what.contains('~') { "" } else { what };
            format!("{what} {value} ± {u} {}", unit(&p.unit))
                .trim()
                .to_string()
        })
        .chain(numbers)
        .collect();
    vec![
        (number + 1).to_string(),
        name(&effect.name),
        effect.name.meaning.clone(),
        if effect.curve.is_empty() {
            values.join(", ")
        } else {
            "a curve, drawn below".to_string()
        },
        um(effect.rms_gain_um),
        format!("{:.3}", effect.p_value),
        if effect.unique {
            "unique".to_string()
        } else {
            format!("1 of {}", effect.explanation_count)
        },
        effect.family.clone(),
    ]
}

/// What the readings do not separate from a found effect, and the tests that would.
fn alternatives(number: usize, effect: &EffectResult, result: &TraceResult) -> Markup {
    let named = |effect: &EffectName| format!("{} ({})", effect.meaning, name(effect));
    let all = std::iter::once(&effect.name).chain(&effect.aliases).map(named);
    html! {
        h3 { (number + 1) ". " (uniqueness::standing(effect, result.candidates_detectable)) }
        (list(all))
        @for sentence in uniqueness::tests(effect, name) { p { (capital(&sentence)) "." } }
    }
}

/// With a capital letter.
fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// Free curves with their band.
fn curves(document: &mut Document, effects: &[EffectResult]) -> Markup {
    let plots: Vec<Plot> = effects
        .iter()
        .filter(|effect| !effect.curve.is_empty())
        .map(|effect| {
            let line = |shift: f64| {
                effect
                    .curve
                    .iter()
                    .map(|p| (p.at, p.value + shift * p.u))
                    .collect::<Vec<_>>()
            };
            let [low, high] = span(effect.curve.iter().map(|p| p.at));
            let [least, most] = span(
                effect
                    .curve
                    .iter()
                    .flat_map(|p| [p.value - 2.0 * p.u, p.value + 2.0 * p.u]),
            );
            let series = [("after", 0.0), ("found-line", 2.0), ("found-line", -2.0)];
            Lines {
                name: format!("curve-{}-{}", effect.name.component, effect.name.driver),
                title: format!("{} over {}", effect.name.component, effect.name.driver),
                caption: "What location errors can absorb of a curve is not in it.".to_string(),
                x: (
                    Scale::over(low, high, ACROSS, 8),
                    format!("{}, {}", effect.name.driver, unit(&effect.curve_at_unit)),
                ),
                y: (
                    Scale::rounded(least.min(0.0), most.max(0.0), UP, 6),
                    format!("{}, {}", effect.name.component, unit(&effect.curve_unit)),
                ),
                series: series
                    .iter()
                    .map(|(class, shift)| Series {
                        class,
                        live: None,
                        mark: Mark::Line,
                        points: line(*shift),
                    })
                    .collect(),
                legend: vec![("after", "curve".into()), ("found-line", "± 2 u".into())],
                over: html! {},
            }
            .plot()
        })
        .collect();
    document.show(plots)
}

/// How the held-out error fell while the search took effects up.
fn convergence(trace: &TraceOutcome<'_>) -> Plot {
    let before = trace.result.before.heldout_rms_um;
    let mut points = vec![(0.0, before)];
    points.extend(
        trace
            .steps
            .iter()
            .enumerate()
            .map(|(k, step)| (k as f64 + 1.0, step.heldout_rms_um)),
    );
    let most = points.iter().map(|p| p.1).fold(0.0, f64::max);
    let steps = trace.steps.len() as f64;
    // Names stand to the right of the points as long as they have room.
    let named = trace.steps.len() <= 8;
    let wide = if named { 1.5 * steps } else { steps + 0.5 };
    let x = Scale::over(0.0, wide, ACROSS, 10);
    let x = Scale {
        step: x.step.max(1.0),
        ..x
    };
    let y = Scale::rounded(0.0, most * 1.05, UP, 5);
    let over = html! {
        @for (number, step) in trace.steps.iter().enumerate() {
            @let (at, high) = (x.at(number as f64 + 1.0), y.at(step.heldout_rms_um));
            circle class="dot-after" cx=(place(at)) cy=(place(high)) r="3.4" {
                title { (step.id) ": " (um(step.heldout_rms_um)) ", " (step.effects) " effects" }
            }
            @if named {
                text class="small" x=(place(at + 6.0)) y=(place(high - 7.0)) { (cut(&step.id, 26)) }
            }
        }
        @let noise = y.at(trace.result.noise_um);
        @if trace.result.noise_um < most {
            path class="found-line" d=(polyline([(ACROSS[0], noise), (ACROSS[1], noise)])) {}
        }
    };
    let mut legend = vec![("after", "held-out rms".to_string())];
    if trace.result.noise_um < most {
        legend.push(("found-line", "noise of a reading".to_string()));
    }
    Lines {
        name: "convergence".to_string(),
        title: "Convergence of the search".to_string(),
        caption: "Held-out error after each addition; what was added may have been exchanged later."
            .to_string(),
        x: (x, "additions".to_string()),
        y: (y, "held-out rms, µm".to_string()),
        series: vec![Series {
            class: "after",
            live: None,
            mark: Mark::Line,
            points,
        }],
        legend,
        over,
    }
    .plot()
}

fn other_explanations(document: &mut Document, trace: &TraceOutcome<'_>) -> Markup {
    let result = &trace.result;
    let plots: Vec<Plot> = trace
        .competing_effects
        .iter()
        .zip(&trace.effects)
        .take(MAX_RANKED)
        .map(|(competing_effects, effect)| ranking(competing_effects, &effect.id()))
        .collect();
    let shown = document.show(plots);
    let correlations = readings::correlations(document, &trace.after, &trace.after_fit);
    html! {
        @if result.effects.iter().all(|effect| effect.unique) && !result.effects.is_empty() {
            p { "No other candidate of the library explains as much in the place of what was found." }
        }
        (shown)
        (correlations)
        (readings::unobservable(&result.unobservable))
    }
}

/// The competing explanations of an effect.
fn ranking(competing_effects: &[CompetingEffect], id: &str) -> Plot {
    let rows: Vec<(String, f64, Fill)> = competing_effects
        .iter()
        .map(|rival| {
            let fill = if rival.named {
                Fill::Named
            } else if rival.alias {
                Fill::Alias
            } else {
                Fill::Other
            };
            (rival.id.clone(), rival.evidence, fill)
        })
        .collect();
    bars::bars(
        format!("ranking-{id}"),
        format!("Competing explanations of {id}"),
        "Evidence beside the rest of the model, −ln P, minus the complexity penalty.".to_string(),
        "evidence, −ln P",
        &rows,
        &[
            ("key-named", "named"),
            ("key-alias", "indistinguishable"),
            ("key-other", "rejected"),
        ],
    )
}

fn next(result: &TraceResult, offered: bool) -> Markup {
    let mut tests: Vec<String> = Vec::new();
    for (number, effect) in result.effects.iter().enumerate() {
        let sentences = uniqueness::tests(effect, name).into_iter();
        tests.extend(
            sentences.map(|sentence| format!("{}. {}: {sentence}.", number + 1, effect.name.meaning)),
        );
    }
    html! {
        @if tests.is_empty() {
            p {
                "Nothing that was found has another explanation that a further test could separate from it. "
                @if offered && !result.unobservable.is_empty() {
                    (prose("`abbe plan SESSION --improve 1` names the cheapest test that sees what these readings do not."))
                }
            }
        } @else { (list(tests)) }
        (readings::warnings(&result.outliers, &result.warnings))
    }
}
