//! Sections that the reports of a fit and of a trace share.

use abbe::identify::fit::Fit;
use abbe::identify::problem::Problem;
use abbe::identify::results::{ModelResult, ParameterResult, Rejected, Unobservable};
use abbe::identify::views::patterns::TestPatterns;
use abbe::identify::views::spectrum::Spectrum;
use abbe::identify::views::{Cause, Views, correlation};
use maud::{Markup, html};
use serde_json::json;

use super::document::{Document, list, table};
use super::drawn::{Drawn, MOST_TESTS};
use super::embed;
use super::plot::bars::{self, Row, Value};
use super::plot::lines::{ACROSS, Lines, Mark, Series, UP};
use super::plot::polar::{Round, Trace, drawing};
use super::plot::scale::{Scale, place, polyline, text};
use super::plot::{Plot, chain, cut, heat};

/// The most unknowns of one unit in one plot.
const MOST_ROWS: usize = 30;
/// The most rows of a map of correlations.
const MOST_CORRELATED: usize = 40;

/// A residual figure as words.
pub fn um(value: f64) -> String {
    crate::cli::table::micrometres(value)
}

/// A unit as people write it.
pub fn unit(name: &str) -> String {
    name.replace("um", "µm").replace("deg", "°")
}

/// A value and its uncertainty, rounded alike, with a minus that is one.
pub fn value_and_u(value: f64, u: f64) -> (String, String) {
    let (value, u) = crate::cli::table::value_and_u(value, u);
    (value.replace('-', "\u{2212}"), u)
}

/// What the page moves: the data, and a slider for each error and effect.
pub fn live(document: &mut Document, drawn: &Drawn<'_>, parameters: &[ParameterResult]) {
    let mut data = embed::data(drawn);
    let sliders: Vec<serde_json::Value> = embed::sliders(drawn)
        .into_iter()
        .map(|k| {
            let share = &drawn.views.shares[k];
            let of = |p: &&ParameterResult| {
                p.id == share.id
                    || p.id
                        .strip_prefix(&share.id)
                        .is_some_and(|rest| rest.starts_with('.'))
            };
            let value = parameters.iter().find(of).map(|p| {
                let (value, u) = value_and_u(p.value, p.u);
                format!(" {value} ± {u} {}", unit(&p.unit))
            });
            let words = match share.cause {
                Cause::Setup => "set-up: balls and bar".to_string(),
                Cause::Unseen => "not told apart, together".to_string(),
                Cause::Error | Cause::Effect => format!("{}{}", share.id, value.unwrap_or_default()),
            };
            json!({"id": share.id, "words": words})
        })
        .collect();
    data["sliders"] = sliders.into();
    document.data = data;
    document.table = embed::table(drawn);
}

/// Table of residuals before and after, and the residuals of each test beside one another.
pub fn before_and_after(
    document: &mut Document,
    drawn: &Drawn<'_>,
    rows: &[(&str, &ModelResult)],
    words: [&str; 2],
) -> Markup {
    let three = drawn.views.coordinates == 3;
    let figures: Vec<Vec<String>> = rows
        .iter()
        .map(|(name, model)| {
            let mut row = vec![name.to_string(), um(model.rms_um), um(model.heldout_rms_um)];
            if let (Some(rms), Some(held)) = (model.rms_3d_um, model.heldout_rms_3d_um) {
                row.extend([um(rms), um(held)]);
            }
            row
        })
        .collect();
    let mut header = vec!["residual", "rms", "held out"];
    if three {
        header.extend(["length rms", "length held out"]);
    }
    let pairs: Vec<Plot> = drawn
        .tests()
        .filter_map(|(number, _)| drawn.residual_circles(number, words))
        .flatten()
        .collect();
    let shown = if pairs.is_empty() {
        document.show([histogram(drawn, words)])
    } else {
        document.show(pairs)
    };
    html! { (table(&header, &figures)) (shown) (left_out_note(drawn.views)) }
}

/// What is said where tests are not drawn one by one.
pub fn left_out_note(views: &Views) -> Markup {
    html! {
        @if views.tests.len() > MOST_TESTS {
            p class="note" { "The first " (MOST_TESTS) " of " (views.tests.len()) " tests are drawn one by one; the readings of all are in the data." }
        }
    }
}

/// How many readings have how long a residual.
fn histogram(drawn: &Drawn<'_>, words: [&str; 2]) -> Plot {
    const CLASSES: usize = 60;
    let all = |after: bool| -> Vec<f64> {
        drawn
            .views
            .tests
            .iter()
            .flat_map(|test| {
                let values = if after { &test.after_um } else { &test.before_um };
                abbe::identify::views::lengths(values, drawn.views.coordinates)
            })
            .map(f64::abs)
            .collect()
    };
    let [before, after] = [all(false), all(true)];
    let most = before.iter().chain(&after).copied().fold(0.0, f64::max);
    let counted = |values: &[f64]| -> Vec<(f64, f64)> {
        let mut counts = vec![0.0; CLASSES];
        for value in values {
            counts[((value / most * CLASSES as f64) as usize).min(CLASSES - 1)] += 1.0;
        }
        let width = most / CLASSES as f64;
        let steps = counts
            .into_iter()
            .enumerate()
            .flat_map(|(k, count)| [(k as f64 * width, count), ((k + 1) as f64 * width, count)]);
        steps.collect()
    };
    let [before, after] = [counted(&before), counted(&after)];
    let highest = before.iter().chain(&after).map(|p| p.1).fold(0.0, f64::max);
    Lines {
        name: "residual-lengths".to_string(),
        title: "How many readings have how large a residual".to_string(),
        caption: "All tests together.".to_string(),
        x: (Scale::over(0.0, most, ACROSS, 7), "residual, µm".to_string()),
        y: (Scale::rounded(0.0, highest, UP, 5), "readings".to_string()),
        series: vec![
            Series {
                class: "before",
                live: None,
                mark: Mark::Line,
                points: before,
            },
            Series {
                class: "after",
                live: None,
                mark: Mark::Line,
                points: after,
            },
        ],
        legend: vec![("before", words[0].to_string()), ("after", words[1].to_string())],
        over: html! {},
    }
    .plot()
}

/// Traces with their controls.
pub fn traces(document: &mut Document, drawn: &Drawn<'_>) -> Markup {
    let plots: Vec<Plot> = drawn
        .tests()
        .flat_map(|(number, _)| drawn.trace(number).into_iter().chain(drawn.deviations(number)))
        .collect();
    let shown = document.show(plots);
    let three = drawn.views.coordinates == 3;
    html! {
        div class="controls needs-script" id="controls" hidden {}
        p class="note" {
            @if three {
                "Observed less what the nominal machine would read with the fitted set-up. "
            } @else {
                "Observed less what the nominal machine and set-up would read. "
            }
            "The sliders take each error and effect out of the readings by its share J·β, which was computed beforehand and is linear; all shares and the \
             residual together miss the readings by at most " (format!("{:.3}", drawn.views.second_order_um)) " µm. "
            @if drawn.views.shares.len() > embed::MOST_SLIDERS { "Only the " (embed::MOST_SLIDERS) " with the largest shares have one. " }
            "Points are thinned for drawing so that no peak is lost."
        }
        (shown)
    }
}

/// Parameters with bars of uncertainty, by unit; and as a table.
pub fn parameters(
    document: &mut Document,
    after: &[ParameterResult],
    before: Option<&[ParameterResult]>,
) -> Markup {
    let mut units: Vec<&str> = after.iter().map(|p| p.unit.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    let value = |p: &ParameterResult| Value {
        value: p.value,
        u: p.u,
    };
    let mut plots = Vec::new();
    for unit_name in units {
        let rows: Vec<Row> = after
            .iter()
            .filter(|p| p.unit == unit_name)
            .map(|p| Row {
                name: p.id.clone(),
                before: before
                    .and_then(|list| list.iter().find(|b| b.id == p.id))
                    .map(value),
                after: Some(value(p)),
            })
            .collect();
        let parts = rows.len().div_ceil(MOST_ROWS);
        for (number, rows) in rows.chunks(MOST_ROWS).enumerate() {
            let of = if parts > 1 {
                format!(" ({} of {parts})", number + 1)
            } else {
                String::new()
            };
            plots.push(bars::values(
                format!("parameters-{}-{}", unit_name.replace('/', "-per-"), number + 1),
                format!("Parameters in {}{of}", unit(unit_name)),
                "Whiskers are two standard uncertainties either way.".to_string(),
                &unit(unit_name),
                rows,
            ));
        }
    }
    let rows: Vec<Vec<String>> = after
        .iter()
        .map(|p| {
            let (value, u) = value_and_u(p.value, p.u);
            let was = before
                .and_then(|list| list.iter().find(|b| b.id == p.id))
                .map(|b| {
                    let (value, u) = value_and_u(b.value, b.u);
                    format!("{value} ± {u}")
                });
            let mut row = vec![p.id.clone(), value, u, unit(&p.unit)];
            if before.is_some() {
                row.push(was.unwrap_or_default());
            }
            row
        })
        .collect();
    let mut header = vec!["parameter", "value", "u (k=1)", "unit"];
    if before.is_some() {
        header.push("before");
    }
    let shown = document.show(plots);
    html! { (shown) details open[rows.len() <= 40] { summary { "As a table" } (table(&header, &rows)) } }
}

/// Residual plots: along each test, over time, and by order.
pub fn residuals(document: &mut Document, drawn: &Drawn<'_>, spectra: &[Spectrum]) -> Markup {
    let mut plots: Vec<Plot> = drawn
        .tests()
        .flat_map(|(number, _)| drawn.residuals(number))
        .collect();
    plots.push(drawn.over_time());
    let effects = &drawn.problem.parameters.effects;
    // One height for all, so that a wave in one test stands out against the others.
    let highest = spectra
        .iter()
        .flat_map(|spectrum| spectrum.before_um.iter().chain(&spectrum.after_um))
        .copied()
        .fold(0.0, f64::max);
    plots.extend(
        spectra
            .iter()
            .take(2 * MOST_TESTS)
            .map(|spectrum| spectrum_plot(spectrum, highest, effects)),
    );
    document.show(plots)
}

fn spectrum_plot(spectrum: &Spectrum, highest: f64, effects: &[abbe::model::effect::Effect]) -> Plot {
    let orders = spectrum.before_um.len() as f64;
    let x = Scale {
        step: 5.0,
        ..Scale::over(0.0, orders + 1.0, ACROSS, 8)
    };
    // A fifth of the height stays free for the names of found orders.
    let y = Scale::over(0.0, (highest * 1.25).max(1e-6), UP, 5);
    let stems = |values: &[f64], shift: f64| -> Vec<(f64, f64)> {
        values
            .iter()
            .enumerate()
            .map(|(k, v)| (k as f64 + 1.0 + shift, *v))
            .collect()
    };
    let mut found: Vec<(f64, String)> = effects
        .iter()
        .filter(|effect| effect.driver.to_string() == spectrum.over && effect.acts_in(&spectrum.of))
        .filter_map(|effect| match effect.shape {
            abbe::model::effect::Shape::Harmonic { order } => Some((order, effect.id())),
            _ => None,
        })
        .filter(|(order, _)| *order <= orders)
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let over = html! {
        @for (number, (order, id)) in found.iter().enumerate() {
            @let (at, down) = (x.at(*order), UP[1] + 12.0 + 12.0 * (number % 3) as f64);
            @let stem = spectrum.before_um.iter().zip(&spectrum.after_um).nth((order.round() as usize).saturating_sub(1));
            @let top = y.at(stem.map_or(0.0, |(before, after)| before.max(*after)));
            path class="found-line" d=(polyline([(at, (top - 3.0).max(down + 2.0)), (at, down + 2.0)])) {}
            path class="found" d=(format!("M{} {}l-4 8h8z", place(at), UP[0])) {}
            text class=(if at > 400.0 { "small right" } else { "small" }) x=(place(if at > 400.0 { at - 4.0 } else { at + 4.0 })) y=(place(down)) { title { (id) } (cut(id, 24)) }
        }
    };
    let mut legend = vec![("before", "before".to_string()), ("after", "after".to_string())];
    if !found.is_empty() {
        legend.push(("found-line", "found order".to_string()));
    }
    Lines {
        name: format!("spectrum-{}-{}", spectrum.of, spectrum.over),
        title: format!("{}: residual by order over {}", spectrum.of, spectrum.over),
        caption: "Amplitude of the wave that each order explains by itself.".to_string(),
        x: (x, format!("order, cycles a turn of {}", spectrum.over)),
        y: (y, "amplitude, µm".to_string()),
        series: vec![
            Series {
                class: "before",
                live: None,
                mark: Mark::Stems,
                points: stems(&spectrum.before_um, -0.16),
            },
            Series {
                class: "after",
                live: None,
                mark: Mark::Stems,
                points: stems(&spectrum.after_um, 0.16),
            },
        ],
        legend,
        over,
    }
    .plot()
}

/// What one error at a time does to each test: 10 µm and 0.01° (Table 3.1 of the thesis), 5 µm a division (its Figs. 3.7, 3.8).
pub fn patterns(document: &mut Document, patterns: &[TestPatterns]) -> Markup {
    const DIVISION_UM: f64 = 5.0;
    let mut plots = Vec::new();
    for test in patterns.iter().take(MOST_TESTS) {
        if test.columns.is_empty() {
            continue;
        }
        if test.way.is_angle {
            for chunk in test.columns.chunks(12) {
                plots.push(small_circles(test, chunk, DIVISION_UM));
            }
        }
        for chunk in test.columns.chunks(8) {
            plots.push(curves(test, chunk));
        }
    }
    document.show(plots)
}

/// By how much an error of this unit is drawn, and in words.
fn amount(unit_name: &str) -> Option<(f64, &'static str)> {
    match unit_name {
        "um" => Some((10.0, "10 µm")),
        "arcsec" => Some((36.0, "0.01°")),
        _ => None,
    }
}

fn small_circles(test: &TestPatterns, columns: &[abbe::identify::views::patterns::Pattern], um: f64) -> Plot {
    let round = Round::SMALL;
    let across = 3;
    let drawn: Vec<_> = columns
        .iter()
        .filter_map(|c| Some((c, amount(&c.unit)?)))
        .collect();
    let rows = drawn.len().div_ceil(across).max(1);
    let high = round.side + 22.0;
    let inner = html! {
        @for (number, (column, (size, words))) in drawn.iter().enumerate() {
            @let x = (number % across) as f64 * round.side;
            @let y = (number / across) as f64 * high;
            g transform=(format!("translate({x} {y})")) {
                @let points = test.way.values.iter().zip(&column.values).map(|(angle, value)| (*angle, value * size)).collect();
                (drawing(round, um, &[Trace { class: "forward", number: None, points }]))
                text class="middle" x=(round.side / 2.0) y=(round.side + 8.0) { (cut(&column.id, 18)) " = " (words) }
            }
        }
    };
    Plot::still(
        format!("patterns-{}", test.test),
        format!("{}: the trace of one error at a time", test.test),
        format!(
            "{} µm a division; first order. What no reading of the test changes with is left out.",
            text(um, um)
        ),
        [round.side * across as f64, high * rows as f64 + 6.0],
        inner,
    )
}

fn curves(test: &TestPatterns, columns: &[abbe::identify::views::patterns::Pattern]) -> Plot {
    const CLASSES: [&str; 8] = ["c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7"];
    let ways = super::plot::lines::span(test.way.values.iter().copied());
    let values = super::plot::lines::span(columns.iter().flat_map(|c| c.values.iter().copied()));
    let x = Scale::over(ways[0], ways[1], ACROSS, 9);
    let x = if test.way.is_angle { x.in_degrees() } else { x };
    let points = |column: &abbe::identify::views::patterns::Pattern| {
        test.way
            .values
            .iter()
            .copied()
            .zip(column.values.iter().copied())
            .collect()
    };
    Lines {
        name: format!("sensitivity-{}", test.test),
        title: format!("{}: sensitivity", test.test),
        caption: "µm of reading for a unit of each error, along the first run.".to_string(),
        x: (
            x,
            format!(
                "{}, {}",
                test.way.name,
                if test.way.is_angle { "°" } else { "mm" }
            ),
        ),
        y: (
            Scale::rounded(values[0].min(0.0), values[1].max(0.0), UP, 6),
            "µm a unit".to_string(),
        ),
        series: columns
            .iter()
            .zip(CLASSES)
            .map(|(column, class)| Series {
                class,
                live: None,
                mark: Mark::Line,
                points: points(column),
            })
            .collect(),
        legend: columns
            .iter()
            .zip(CLASSES)
            .map(|(c, class)| (class, format!("{}, per {}", cut(&c.id, 20), unit(&c.unit))))
            .collect(),
        over: html! {},
    }
    .plot()
}

/// The map of correlations of a fit.
pub fn correlations(document: &mut Document, problem: &Problem<'_>, fit: &Fit) -> Markup {
    let (mut ids, mut matrix) = correlation(problem, fit);
    let all = ids.len();
    ids.truncate(MOST_CORRELATED);
    matrix.truncate(MOST_CORRELATED);
    let matrix: Vec<Vec<Option<f64>>> = matrix
        .into_iter()
        .map(|row| row.into_iter().take(MOST_CORRELATED).map(Some).collect())
        .collect();
    if ids.len() < 2 {
        return html! { p { "Fewer than two errors are identified." } };
    }
    let shown = document.show([map(&ids, &matrix)]);
    html! {
        (shown)
        @if all > MOST_CORRELATED { p class="note" { "The first " (MOST_CORRELATED) " of " (all) " are drawn." } }
    }
}

/// A map of correlations.
pub fn map(ids: &[String], matrix: &[Vec<Option<f64>>]) -> Plot {
    heat::map(
        "correlation".to_string(),
        "Correlation".to_string(),
        "The area of a sign is the size of the correlation; above the diagonal its value, where there is room.".to_string(),
        ids,
        matrix,
    )
}

/// The machine with what is identified.
pub fn machine(document: &mut Document, problem: &Problem<'_>) -> Markup {
    let list = problem.parameters.list.iter();
    let mut errors: Vec<String> = list
        .filter(|p| p.role == abbe::identify::parameters::Role::Error)
        .map(|p| p.id.clone())
        .collect();
    errors.extend(problem.parameters.effect_ids.iter().cloned());
    document.show([chain::plot(&problem.session.machine, &errors)])
}

/// What cannot be told apart.
pub fn unobservable(items: &[Unobservable]) -> Markup {
    html! {
        @if !items.is_empty() {
            h3 { "Not seen by these readings" }
            (list(items.iter().map(|item| item.why.clone())))
        }
    }
}

/// What was left out, and what a user should know.
pub fn warnings(rejected: &[Rejected], warnings: &[String]) -> Markup {
    let rows: Vec<Vec<String>> = rejected
        .iter()
        .map(|r| {
            vec![
                r.test.clone(),
                r.file.clone(),
                r.line.to_string(),
                um(r.residual_um),
            ]
        })
        .collect();
    html! {
        @if !rows.is_empty() { h3 { "Left out as wild" } (table(&["test", "file", "line", "residual"], &rows)) }
        @if !warnings.is_empty() { h3 { "Warnings" } (list(warnings.iter().cloned())) }
    }
}
