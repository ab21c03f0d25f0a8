//! Plots of what stands behind the readings: orders, lengths, and what one error at a time does.

use abbe::identify::IdentifyError;
use abbe::identify::heldout::FoldKind;
use abbe::identify::problem::Problem;
use abbe::identify::series::lengths;
use abbe::identify::series::sensitivities::{self, Sensitivity, TestSensitivities};
use abbe::identify::series::spectrum::Spectrum;
use abbe::model::effect::shape::Harmonic;
use abbe::model::effect::{Effect, Shape};
use maud::{Markup, html};

use super::decimate;
use super::document::Document;
use super::plot::bars::{Fill, bars};
use super::plot::lines::{ACROSS, Lines, Mark, Series, UP, span};
use super::plot::polar::{Round, Trace, drawing};
use super::plot::scale::{Scale, place, polyline, text};
use super::plot::{Plot, cut};
use super::plots::{Drawn, MAX_TESTS};
use super::readings::unit;

/// Strips of a plot over time.
const TIME_STRIPS: usize = 240;
/// Strips of a test at least.
const MIN_STRIPS: usize = 12;

/// How many readings have how long a residual.
pub fn histogram(drawn: &Drawn<'_>, words: [&str; 2]) -> Plot {
    const CLASSES: usize = 60;
    let all = |after: bool| -> Vec<f64> {
        drawn
            .views
            .tests
            .iter()
            .flat_map(|test| {
                let values = if after { &test.after_um } else { &test.before_um };
                lengths(values, drawn.views.coordinates)
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

/// Residuals of the whole session over time, or in the order of the readings where there is no time.
pub fn over_time(drawn: &Drawn<'_>) -> Plot {
    let timed = drawn
        .problem
        .tests
        .iter()
        .all(|test| test.readings.as_ref().is_some_and(|r| !r.time_s.is_empty()));
    // Time, before and after of each test, and the classes by which the page switches it off.
    let mut tests: Vec<[Vec<f64>; 3]> = Vec::new();
    let mut past = 0;
    for (test, view) in drawn.problem.tests.iter().zip(&drawn.views.tests) {
        let Some(readings) = &test.readings else { continue };
        let time = if timed {
            let minutes = |t: &f64| (t - drawn.problem.origin.time_s) / 60.0;
            readings.time_s.iter().map(minutes).collect()
        } else {
            (past..past + readings.rows())
                .map(|row| row as f64 + 1.0)
                .collect()
        };
        past += readings.rows();
        let of = |values: &[f64]| lengths(values, drawn.views.coordinates);
        tests.push([time, of(&view.before_um), of(&view.after_um)]);
    }
    let classes: Vec<[String; 2]> = (0..tests.len())
        .map(|test| ["before", "after"].map(|when| format!("{when} of-test-{test}")))
        .collect();
    let strips = (TIME_STRIPS / tests.len().max(1)).max(MIN_STRIPS);
    let of = |time: &[f64], values: &[f64]| -> Vec<(f64, f64)> {
        let strips = decimate::strips(time, values, strips);
        strips
            .into_iter()
            .flat_map(|(at, low, high)| [(at, low), (at, high)])
            .collect()
    };
    let all = |column: usize| tests.iter().flat_map(move |test| test[column].iter().copied());
    let [low, high] = span(all(0));
    let [least, most] = span(all(1).chain(all(2)));
    let (what, unit) = if timed {
        ("time", "min")
    } else {
        ("reading", "in the order of the files")
    };
    Lines {
        name: "residual-over-time".to_string(),
        title: format!("Residual against {what}"),
        caption:
            "All tests one after another: drift, and what comes and goes. Before (red) and after (blue). The switches of the traces take tests out here too."
                .to_string(),
        x: (Scale::over(low, high, ACROSS, 7), format!("{what}, {unit}")),
        y: (
            Scale::rounded(least.min(0.0), most.max(0.0), UP, 6),
            if drawn.views.coordinates == 3 {
                "length of the residual, µm".to_string()
            } else {
                "residual, µm".to_string()
            },
        ),
        series: [0, 1]
            .into_iter()
            .flat_map(|when| {
                let of = &of;
                tests.iter().zip(&classes).map(move |(test, class)| Series {
                    class: &class[when],
                    live: None,
                    mark: Mark::Bars,
                    points: of(&test[0], &test[1 + when]),
                })
            })
            .collect(),
        legend: vec![("before bars", "before".into()), ("after bars", "after".into())],
        over: html! {},
    }
    .plot()
}

/// A residual by order; `highest` is the greatest amplitude of all that are drawn beside it.
pub fn spectrum_plot(spectrum: &Spectrum, highest: f64, effects: &[Effect]) -> Plot {
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
            Shape::Harmonic(Harmonic { order }) => Some((order, effect.id())),
            _ => None,
        })
        .filter(|(order, _)| *order <= orders)
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let over = html! {
        @for (number, (order, id)) in found.iter().enumerate() {
            @let (at, down) = (x.at(*order), UP[1] + 12.0 + 12.0 * (number % 3) as f64);
            @let id_stem = spectrum.before_um.iter().zip(&spectrum.after_um).nth((order.round() as usize).saturating_sub(1));
            @let top = y.at(id_stem.map_or(0.0, |(before, after)| before.max(*after)));
            path class="found-line" d=(polyline([(at, (top - 3.0).max(down + 2.0)), (at, down + 2.0)])) {}
            path class="found" d=(format!("M{} {}l-4 8h8z", place(at), UP[0])) {}
            text class=(if at > 400.0 { "small right" } else { "small" }) x=(place(if at > 400.0 { at - 4.0 } else { at + 4.0 })) y=(place(down)) {
                title { (id) } (cut(id, 24))
            }
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

/// What one error at a time does to each test: 10 µm and 0.01° (Table 3.1 of the thesis), 5 µm per division (its Figs. 3.7, 3.8); coordinates of a vector
/// as curves, and among poses by how much.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn patterns(
    document: &mut Document,
    problem: &Problem<'_>,
    beta: &[f64],
) -> Result<Markup, IdentifyError> {
    const DIVISION_UM: f64 = 5.0;
    if problem.folds.kind == FoldKind::Poses {
        let plots = over_poses(&sensitivities::over_poses(problem, beta)?);
        return Ok(document.show(plots));
    }
    let mut plots = Vec::new();
    let found = sensitivities::sensitivities(problem, beta)?;
    for test in found.iter().take(MAX_TESTS * problem.coordinates()) {
        if test.columns.is_empty() {
            continue;
        }
        if test.way.is_angle && test.coordinate.is_none() {
            for chunk in test.columns.chunks(12) {
                plots.push(small_circles(test, chunk, DIVISION_UM));
            }
        }
        for chunk in test.columns.chunks(8) {
            plots.push(curves(test, chunk));
        }
    }
    Ok(document.show(plots))
}

/// How far each error moves the readings of poses, unit by unit, the greatest first.
fn over_poses(found: &[Sensitivity]) -> Vec<Plot> {
    const MAX: usize = 40;
    let mut units: Vec<&str> = found.iter().map(|error| error.unit.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    units
        .into_iter()
        .map(|name| {
            let own = found.iter().filter(|error| error.unit == name);
            let mut rows: Vec<(String, f64, Fill)> =
                own.map(|error| (error.id.clone(), error.values[0], Fill::Named)).collect();
            rows.sort_by(|a, b| b.1.total_cmp(&a.1));
            let left = rows.len().saturating_sub(MAX);
            rows.truncate(MAX);
            let caption = match left {
                0 => "Root mean square over all poses of the length by which a unit moves a reading.".to_string(),
                left => format!("Root mean square over all poses of the length by which a unit moves a reading; {left} that move it less are left out."),
            };
            bars(
                format!("sensitivity-{}", name.replace('/', "-per-")),
                format!("Sensitivity to errors in {}", unit(name)),
                caption,
                &format!("µm for one {}", unit(name)),
                &rows,
                &[],
            )
        })
        .collect()
}

/// By how much an error of this unit is drawn, and in words.
fn amount(unit_name: &str) -> Option<(f64, &'static str)> {
    match unit_name {
        "um" => Some((10.0, "10 µm")),
        "arcsec" => Some((36.0, "0.01°")),
        _ => None,
    }
}

fn small_circles(test: &TestSensitivities, columns: &[Sensitivity], um: f64) -> Plot {
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
            "{} µm per division; first order. What no reading of the test changes with is left out.",
            text(um, um)
        ),
        [round.side * across as f64, high * rows as f64 + 6.0],
        inner,
    )
}

fn curves(test: &TestSensitivities, columns: &[Sensitivity]) -> Plot {
    const CLASSES: [&str; 8] = ["c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7"];
    let ways = span(test.way.values.iter().copied());
    let values = span(columns.iter().flat_map(|c| c.values.iter().copied()));
    let x = Scale::over(ways[0], ways[1], ACROSS, 9);
    let x = if test.way.is_angle { x.in_degrees() } else { x };
    let points = |column: &Sensitivity| {
        test.way
            .values
            .iter()
            .copied()
            .zip(column.values.iter().copied())
            .collect()
    };
    let (name, what) = match test.coordinate {
        Some(coordinate) => (
            format!("{}-{coordinate}", test.test),
            format!("{}: sensitivity of {coordinate}", test.test),
        ),
        None => (test.test.clone(), format!("{}: sensitivity", test.test)),
    };
    Lines {
        name: format!("sensitivity-{name}"),
        title: what,
        caption: "µm of reading per unit of each error, along the first run.".to_string(),
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
            "µm per unit".to_string(),
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
