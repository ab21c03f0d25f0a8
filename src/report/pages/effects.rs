//! Effects that a trace has found, each beside its competing explanations.

use abbe::identify::results::{EffectName, EffectResult, SeparatingTestResult, TraceResult};
use abbe::identify::trace::TraceOutcome;
use abbe::identify::trace::alias::CompetingEffect;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::Document;
use crate::printers::html::{capitalised, integer, list, with_minus_signs};
use crate::report::effect::name;
use crate::report::figure::bars::{Bars, Fill};
use crate::report::figure::lines::{Axis, Lines, Mark, Name, Series};
use crate::report::figure::scale::{Scale, span};
use crate::report::figure::{Chart, Figure, Quantity};
use crate::report::number::{micrometres, p_value, shape_number, unit, value_and_u};
use crate::report::{trace as present, uniqueness};

/// Maximum number of effects that are shown unfolded.
const MAX_OPEN: usize = 4;
/// Maximum number of effects with a plot of their competing explanations.
const MAX_RANKED: usize = 12;
/// Number of additions up to which the points of the convergence plot have names.
const MAX_NAMED: usize = 8;

/// Found effects, rejected candidates, remaining structure and convergence of the search.
pub fn section(document: &mut Document, trace: &TraceOutcome) -> Markup {
    let result = &trace.result;
    let blocks: Vec<Markup> = result
        .effects
        .iter()
        .enumerate()
        .map(|(number, effect)| {
            let competing = trace.competing_effects.get(number).filter(|_| number < MAX_RANKED);
            let id = trace.effects.get(number).map(|effect| effect.id()).unwrap_or_default();
            block(document, result, effect, competing.map(|all| (all.as_slice(), id.as_str())))
        })
        .collect();
    let convergence = (!trace.steps.is_empty()).then(|| convergence(trace));
    let shown = document.show(convergence);
    html! {
        @if result.effects.is_empty() { p { "The search added no effect." } }
        @for (number, (block, effect)) in blocks.iter().zip(&result.effects).enumerate() {
            @if number < MAX_OPEN {
                h3 { (heading(number, effect)) }
                (block)
            } @else {
                details { summary { (heading(number, effect)) } (block) }
            }
        }
        @if !result.rejected_candidates.is_empty() {
            h3 { "Rejected candidates" }
            (list(present::rejected(result)))
        }
        @if let Some(remainder) = present::remainder(result) {
            h3 { "Remaining structure" }
            p { (remainder) "." }
        }
        (shown)
    }
}

fn heading(number: usize, effect: &EffectResult) -> String {
    format!("{}. {}", number + 1, effect.name.meaning)
}

/// An effect: its values on the left, its competing explanations on the right.
fn block(
    document: &mut Document,
    result: &TraceResult,
    effect: &EffectResult,
    competing: Option<(&[CompetingEffect], &str)>,
) -> Markup {
    let curve = (!effect.curve.is_empty()).then(|| curve(effect));
    let ranking = competing.map(|(effects, id)| ranking(effects, id));
    let (left, right): (Vec<Figure>, Vec<Figure>) = if effect.unique {
        (curve.into_iter().collect(), ranking.into_iter().collect())
    } else {
        (curve.into_iter().chain(ranking).collect(), Vec::new())
    };
    let [left, right] = [document.show(left), document.show(right)];
    html! {
        div class="halves" {
            div {
                dl {
                    dt { "Effect" } dd { (name(&effect.name)) }
                    dt { "Estimate" } dd { (estimate(effect)) }
                    @if let Some(prior) = &effect.prior { dt { "Prior" } dd { (present::prior(prior)) } }
                    dt { "Explains" } dd { (micrometres(effect.rms_gain_um)) " rms (" (p_value(effect.p_value)) ")" }
                    dt { "Held-out rms" } dd { (micrometres(effect.heldout_rms_um)) " with this effect" }
                    dt { "Family" } dd { (effect.family) }
                }
                (left)
            }
            div {
                (alternatives(effect, result.candidates_detectable))
                (right)
            }
        }
    }
}

/// Coefficients with their standard uncertainties, and chosen numbers of the shape.
fn estimate(effect: &EffectResult) -> String {
    if !effect.curve.is_empty() && effect.prior.is_none() {
        return "nonparametric curve, see the plot".to_string();
    }
    let values = effect.parameters.iter().map(|parameter| {
        let (value, u) = value_and_u(parameter.value, parameter.u);
        // The text after the last dot is the coefficient, unless the component contains the dot:
        // `spindle_ball.y~time:drift`.
        let coefficient = parameter.id.rsplit_once('.').map_or("", |(_, coefficient)| coefficient);
        let coefficient = if coefficient.contains('~') { "" } else { coefficient };
        let separator = if coefficient.ends_with(|c: char| c.is_ascii_digit()) { ":" } else { "" };
        with_minus_signs(format!("{coefficient}{separator} {value} ± {u} {}", unit(&parameter.unit)).trim())
    });
    let numbers = effect.shape_parameters.iter().map(|number| with_minus_signs(&shape_number(number)));
    values.chain(numbers).collect::<Vec<_>>().join(", ")
}

/// Explanations that the readings do not separate, with the separation from each that further tests achieve.
fn alternatives(effect: &EffectResult, screened: usize) -> Markup {
    if effect.prior.is_some() {
        return html! {
            h4 { (capitalised(&uniqueness::standing(effect, screened))) }
        };
    }
    if effect.unique {
        return html! {
            h4 { "Unique explanation" }
            p { "No other of the " (integer(screened)) " candidates explains the residual as well in place of this effect." }
        };
    }
    let tests = &effect.separating_tests;
    html! {
        h4 { (capitalised(&uniqueness::standing(effect, screened))) }
        div class="scroll" {
            table {
                thead {
                    tr {
                        th class="word-column" { "explanation" }
                        th class="word-column" { "in place of the selected effect" }
                        @if effect.left_out_test_rms_um.is_some() { th class="word-column" { "left-out test" } }
                        @for number in 1..=tests.len() { th class="word-column" { "with test " (number) } }
                    }
                }
                tbody {
                    @let selected = vec!["selected".to_string(); tests.len()];
                    (explanation(&effect.name, "selected", &with_prediction(effect, None, selected)))
                    @for (place, alias) in effect.aliases.iter().enumerate() {
                        @let separations = tests.iter().map(|test| separation(&alias.name, test)).collect();
                        @let cells = with_prediction(effect, Some(place), separations);
                        (explanation(&alias.name, &uniqueness::likelihood(alias), &cells))
                    }
                }
            }
        }
        @if tests.is_empty() {
            p { "No proposed test separates these explanations." }
        } @else {
            @for (number, test) in tests.iter().enumerate() {
                p { b { "Test " (number + 1) ": " } (test.test) " (" (format!("{:.0}", test.duration_min)) " min)." }
            }
            p class="note" {
                "Separation from the selected effect in standard deviations: by the present readings → with the test. A test separates from 3 σ on."
            }
        }
    }
}

/// The cells of an explanation: the rms of the left-out tests that it predicts, if any can be left out, and `cells`.
fn with_prediction(effect: &EffectResult, alias: Option<usize>, mut cells: Vec<String>) -> Vec<String> {
    if effect.left_out_test_rms_um.is_some() {
        let um = match alias {
            Some(place) => effect.aliases_left_out_test_rms_um.get(place).copied().flatten(),
            None => effect.left_out_test_rms_um,
        };
        cells.insert(0, um.map_or("–".to_string(), micrometres));
    }
    cells
}

/// A row of the table of explanations: the effect, its likelihood, and what each test achieves.
fn explanation(effect: &EffectName, likelihood: &str, outcomes: &[String]) -> Markup {
    html! {
        tr {
            td class="word-column long" { (effect.meaning) br; span class="note" { (name(effect)) } }
            td class="word-column" { (likelihood) }
            @for outcome in outcomes { td class="word-column" { (outcome) } }
        }
    }
}

/// Separation of the selected effect from an alternative by a test.
fn separation(alias: &EffectName, test: &SeparatingTestResult) -> String {
    let found = test.alternatives.iter().find(|alternative| &alternative.name == alias);
    found.map_or("separated before".to_string(), |alternative| {
        let sign = if alternative.separated { "✓" } else { "✗ not separated:" };
        format!("{sign} {:.1} → {:.1} σ", alternative.before_sigma, alternative.after_sigma)
    })
}

/// Nonparametric curve with a band of ± 2 u.
fn curve(effect: &EffectResult) -> Figure {
    let line = |multiple: f64| {
        let points = effect.curve.iter();
        points.map(|p| (p.at, p.value + multiple * p.u)).collect::<Vec<_>>()
    };
    let values = effect.curve.iter().flat_map(|p| [p.value - 2.0 * p.u, p.value + 2.0 * p.u]);
    let name = &effect.name;
    let mut series = vec![
        Series::new("curve", "after", Mark::Line, line(0.0)),
        Series::new("± 2 u", "found-line", Mark::Line, line(2.0)),
        Series::new("± 2 u", "found-line", Mark::Line, line(-2.0)),
    ];
    // A point for each value of the driver without a reading nearby.
    let extrapolated: Vec<(f64, f64)> =
        effect.curve.iter().filter(|p| p.extrapolated).map(|p| (p.at, p.value)).collect();
    let mut caption = "The curve excludes the components that are collinear with location errors.".to_string();
    if !extrapolated.is_empty() {
        caption += " Points: no reading lies nearby; the prior determines the curve.";
        series.push(Series::new("extrapolated", "dot-before", Mark::Dots, extrapolated));
    }
    let lines = Lines::new(
        Axis::new(&name.driver, &effect.curve_at_unit, Scale::over(span(effect.curve.iter().map(|p| p.at)), 8)),
        Axis::new(&name.component, &effect.curve_unit, Scale::with_zero(span(values), 6)),
        series,
    );
    Figure::new(
        format!("curve-{}-{}", name.component, name.driver),
        format!("{} over {}", name.component, name.driver),
        caption,
        Chart::Lines(lines),
    )
}

/// Held-out error after each addition of the search.
fn convergence(trace: &TraceOutcome) -> Figure {
    let before = trace.result.before.heldout_rms_um;
    let mut points = vec![(0.0, before)];
    points.extend(trace.steps.iter().enumerate().map(|(k, step)| (k as f64 + 1.0, step.heldout_rms_um)));
    let maximum = points.iter().map(|p| p.1).fold(0.0, f64::max);
    let steps = trace.steps.len() as f64;
    let shown = trace.steps.len() <= MAX_NAMED;
    let names = trace.steps.iter().map(|step| Name {
        text: step.id.clone(),
        note: format!("{}, {}", micrometres(step.heldout_rms_um), counted(step.effects, "effect")),
        shown,
    });
    // Names need space to the right of the last point.
    let x = Scale::over([0.0, if shown { 1.5 * steps } else { steps + 0.5 }], 10);
    let mut series =
        vec![Series { names: names.collect(), ..Series::new("held-out rms", "after", Mark::Line, points) }];
    let noise = trace.result.noise_um;
    if noise < maximum {
        let level = x.values.map(|at| (at, noise)).to_vec();
        series.push(Series::new("noise of a reading", "found-line", Mark::Line, level));
    }
    let lines = Lines::new(
        Axis::new("additions", "", Scale { step: x.step.max(1.0), ..x }),
        Axis::new("held-out rms", "um", Scale::rounded([0.0, maximum * 1.05], 5)),
        series,
    );
    Figure::new(
        "convergence",
        "Convergence of the search",
        "Held-out error after each addition. Later steps can exchange an added effect.",
        Chart::Lines(lines),
    )
}

/// Evidence of the competing explanations of an effect.
fn ranking(competing: &[CompetingEffect], id: &str) -> Figure {
    let rows = competing.iter().map(|effect| {
        let fill = match (effect.named, effect.alias) {
            (true, _) => Fill::Named,
            (false, true) => Fill::Alias,
            (false, false) => Fill::Other,
        };
        (effect.id.clone(), effect.evidence, fill)
    });
    Figure::new(
        format!("ranking-{id}"),
        format!("Competing explanations of {id}"),
        "Evidence together with the rest of the model: −ln P minus the complexity penalty.",
        Chart::Bars(Bars {
            quantity: Quantity::new("evidence, −ln P", ""),
            rows: rows.collect(),
            labels: vec![(Fill::Named, "selected"), (Fill::Alias, "indistinguishable"), (Fill::Other, "rejected")],
        }),
    )
}
