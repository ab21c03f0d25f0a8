//! Plots of derived quantities: histogram and time series of the residual, spectra, and sensitivities to single errors.

use abbe::identify::IdentifyError;
use abbe::identify::problem::Problem;
use abbe::identify::series::lengths;
use abbe::identify::series::sensitivities::{self as sensitivity, Sensitivity, TestSensitivities};
use abbe::identify::series::spectrum::Spectrum;
use abbe::model::effect::shape::Harmonic;
use abbe::model::effect::{Effect, Shape};
use abbe::model::words::counted;
use maud::{Markup, html};

use super::decimate;
use super::document::Document;
use super::plots::{MAX_TESTS, SessionPlots};
use crate::present::figure::bars::{Fill, bars};
use crate::present::figure::lines::{ACROSS, Lines, Mark, Series, UP, span};
use crate::present::figure::polar::{PolarSize, Traversal, drawing};
use crate::present::figure::scale::{Scale, coordinate, polyline, text};
use crate::present::figure::{Plot, shortened};
use crate::present::number::{unit, units};

/// Intervals of a plot over time.
const TIME_INTERVALS: usize = 240;
/// Minimum number of intervals of a test.
const MIN_INTERVALS: usize = 12;
/// Labels to the right of this coordinate are aligned to the right.
const LABEL_LIMIT: f64 = ACROSS[1] - 144.0;

/// Histogram of the absolute residual before and after.
pub fn histogram(session: &SessionPlots<'_>, models: [&str; 2]) -> Plot {
    const CLASSES: usize = 60;
    let all = |after: bool| -> Vec<f64> {
        session
            .series
            .tests
            .iter()
            .flat_map(|test| {
                let values = if after { &test.after_um } else { &test.before_um };
                lengths(values, session.series.coordinates)
            })
            .map(f64::abs)
            .collect()
    };
    let [before, after] = [all(false), all(true)];
    let maximum = before.iter().chain(&after).copied().fold(0.0, f64::max);
    let counted = |values: &[f64]| -> Vec<(f64, f64)> {
        let mut counts = vec![0.0; CLASSES];
        for value in values {
            counts[((value / maximum * CLASSES as f64) as usize).min(CLASSES - 1)] += 1.0;
        }
        let width = maximum / CLASSES as f64;
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
        title: "Distribution of the residual".to_string(),
        caption: "Absolute residual of all tests.".to_string(),
        x: (Scale::over(0.0, maximum, ACROSS, 7), "residual, µm".to_string()),
        y: (Scale::rounded(0.0, highest, UP, 5), "readings".to_string()),
        series: vec![
            Series { class: "before", source: None, mark: Mark::Line, points: before },
            Series { class: "after", source: None, mark: Mark::Line, points: after },
        ],
        legend: vec![("before", models[0].to_string()), ("after", models[1].to_string())],
        over: html! {},
    }
    .plot()
}

/// Residuals of the session over time. Without time: in the order of the readings.
pub fn over_time(session: &SessionPlots<'_>) -> Plot {
    let has_time =
        session.problem.tests.iter().all(|test| test.readings.as_ref().is_some_and(|r| !r.time_s.is_empty()));
    // Time, residual before and residual after of each test. The script of the page hides a test by its class.
    let mut tests: Vec<[Vec<f64>; 3]> = Vec::new();
    let mut preceding = 0;
    for (test, view) in session.problem.tests.iter().zip(&session.series.tests) {
        let Some(readings) = &test.readings else { continue };
        let time = if has_time {
            let minutes = |t: &f64| (t - session.problem.reference.time_s) / 60.0;
            readings.time_s.iter().map(minutes).collect()
        } else {
            (preceding..preceding + readings.rows()).map(|row| row as f64 + 1.0).collect()
        };
        preceding += readings.rows();
        let of = |values: &[f64]| lengths(values, session.series.coordinates);
        tests.push([time, of(&view.before_um), of(&view.after_um)]);
    }
    let classes: Vec<[String; 2]> =
        (0..tests.len()).map(|test| ["before", "after"].map(|when| format!("{when} of-test-{test}"))).collect();
    let intervals = (TIME_INTERVALS / tests.len().max(1)).max(MIN_INTERVALS);
    let of = |time: &[f64], values: &[f64]| -> Vec<(f64, f64)> {
        let extremes = decimate::interval_extremes(time, values, intervals);
        extremes.into_iter().flat_map(|(centre, minimum, maximum)| [(centre, minimum), (centre, maximum)]).collect()
    };
    let all = |column: usize| tests.iter().flat_map(move |test| test[column].iter().copied());
    let [low, high] = span(all(0));
    let [minimum, maximum] = span(all(1).chain(all(2)));
    let (abscissa, unit) = if has_time { ("time", "min") } else { ("reading", "in the order of the files") };
    Lines {
        name: "residual-over-time".to_string(),
        title: format!("Residual against {abscissa}"),
        caption:
            "All tests, minimum to maximum of each interval. Before: red. After: blue. The test switches of the traces apply here too."
                .to_string(),
        x: (Scale::over(low, high, ACROSS, 7), format!("{abscissa}, {unit}")),
        y: (
            Scale::rounded(minimum.min(0.0), maximum.max(0.0), UP, 6),
            if session.series.coordinates == 3 {
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
                    source: None,
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

/// Amplitude spectrum of the residual of a test. `maximum` is the largest amplitude of all spectra, so that they share
/// one scale.
pub fn spectrum_plot(spectrum: &Spectrum, maximum: f64, effects: &[Effect]) -> Plot {
    let orders = spectrum.before_um.len() as f64;
    let x = Scale { step: 5.0, ..Scale::over(0.0, orders + 1.0, ACROSS, 8) };
    // The upper fifth is left free for the names of found effects.
    let y = Scale::over(0.0, (maximum * 1.25).max(1e-6), UP, 5);
    let stems = |values: &[f64], shift: f64| -> Vec<(f64, f64)> {
        values.iter().enumerate().map(|(k, v)| (k as f64 + 1.0 + shift, *v)).collect()
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
            @let (at, baseline) = (x.at(*order), UP[1] + 12.0 + 12.0 * (number % 3) as f64);
            @let stem = spectrum.before_um.iter().zip(&spectrum.after_um).nth((order.round() as usize).saturating_sub(1));
            @let top = y.at(stem.map_or(0.0, |(before, after)| before.max(*after)));
            path class="found-line" d=(polyline([(at, (top - 3.0).max(baseline + 2.0)), (at, baseline + 2.0)])) {}
            path class="found" d=(format!("M{} {}l-4 8h8z", coordinate(at), UP[0])) {}
            text class=(if at > LABEL_LIMIT { "small right" } else { "small" }) x=(coordinate(if at > LABEL_LIMIT { at - 4.0 } else { at + 4.0 })) y=(coordinate(baseline)) {
                title { (id) } (shortened(id, 24))
            }
        }
    };
    let mut legend = vec![("before", "before".to_string()), ("after", "after".to_string())];
    if !found.is_empty() {
        legend.push(("found-line", "found order".to_string()));
    }
    Lines {
        name: format!("spectrum-{}-{}", spectrum.of, spectrum.over),
        title: format!("{}: spectrum of the residual over {}", spectrum.of, spectrum.over),
        caption: "Amplitude of a sine and cosine of each order, fitted separately.".to_string(),
        x: (x, format!("order, cycles per turn of {}", spectrum.over)),
        y: (y, "amplitude, µm".to_string()),
        series: vec![
            Series { class: "before", source: None, mark: Mark::Stems, points: stems(&spectrum.before_um, -0.16) },
            Series { class: "after", source: None, mark: Mark::Stems, points: stems(&spectrum.after_um, 0.16) },
        ],
        legend,
        over,
    }
    .plot()
}

/// Effect of single errors on each test: 10 µm and 0.01° (Table 3.1 of Jiang (2014)) at 5 µm per division (Figs. 3.7
/// and 3.8 there). Instruments with three coordinates have curves of each coordinate. Separate poses have one RMS
/// sensitivity per error.
///
/// Jiang (2014): Xiaogeng Jiang, *Characterising Geometric Errors in Rotary Axes of 5-axis Machine Tools*, PhD thesis,
/// University of Birmingham, 2014.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn sensitivities(document: &mut Document, problem: &Problem, beta: &[f64]) -> Result<Markup, IdentifyError> {
    const DIVISION_UM: f64 = 5.0;
    if problem.folds.kind.is_poses() {
        let plots = pose_sensitivities(&sensitivity::over_poses(problem, beta)?);
        return Ok(document.show(plots));
    }
    let mut plots = Vec::new();
    let found = sensitivity::sensitivities(problem, beta)?;
    for test in found.iter().take(MAX_TESTS * problem.coordinates()) {
        if test.columns.is_empty() {
            continue;
        }
        if test.way.is_angle && test.coordinate.is_none() {
            for chunk in test.columns.chunks(12) {
                plots.push(polar_sensitivities(test, chunk, DIVISION_UM));
            }
        }
        for chunk in test.columns.chunks(8) {
            plots.push(curves(test, chunk));
        }
    }
    Ok(document.show(plots))
}

/// RMS sensitivity of the readings of separate poses to each error, by unit, in descending order.
fn pose_sensitivities(found: &[Sensitivity]) -> Vec<Plot> {
    const MAX: usize = 40;
    units(found.iter().map(|error| error.unit.as_str()))
        .into_iter()
        .map(|name| {
            let own = found.iter().filter(|error| error.unit == name);
            let mut rows: Vec<(String, f64, Fill)> =
                own.map(|error| (error.id.clone(), error.values[0], Fill::Named)).collect();
            rows.sort_by(|a, b| b.1.total_cmp(&a.1));
            let omitted = rows.len().saturating_sub(MAX);
            rows.truncate(MAX);
            let caption = match omitted {
                0 => "RMS over all poses of the displacement of a reading per unit of the error.".to_string(),
                omitted => format!(
                    "RMS over all poses of the displacement of a reading per unit of the error. {} with smaller sensitivity omitted.",
                    counted(omitted, "error")
                ),
            };
            bars(
                format!("sensitivity-{}", name.replace('/', "-per-")),
                format!("Sensitivity to errors in {}", unit(name)),
                caption,
                &format!("µm per {}", unit(name)),
                &rows,
                &[],
            )
        })
        .collect()
}

/// Size of an error in a plot, in this unit and as text.
fn amount(unit_name: &str) -> Option<(f64, &'static str)> {
    match unit_name {
        "um" => Some((10.0, "10 µm")),
        "arcsec" => Some((36.0, "0.01°")),
        _ => None,
    }
}

fn polar_sensitivities(test: &TestSensitivities, columns: &[Sensitivity], um: f64) -> Plot {
    let size = PolarSize::SMALL;
    let per_row = 3;
    let drawn: Vec<_> = columns.iter().filter_map(|c| Some((c, amount(&c.unit)?))).collect();
    let rows = drawn.len().div_ceil(per_row).max(1);
    let row_height = size.side + 22.0;
    let inner = html! {
        @for (number, (column, (amount, label))) in drawn.iter().enumerate() {
            @let x = (number % per_row) as f64 * size.side;
            @let y = (number / per_row) as f64 * row_height;
            g transform=(format!("translate({x} {y})")) {
                @let points = test.way.values.iter().zip(&column.values).map(|(angle, value)| (*angle, value * amount)).collect();
                (drawing(size, um, &[Traversal { class: "forward", index: None, points }]))
                text class="middle" x=(size.side / 2.0) y=(size.side + 8.0) { (shortened(&column.id, 18)) " = " (label) }
            }
        }
    };
    Plot::new(
        format!("patterns-{}", test.test),
        format!("{}: deviation caused by single errors", test.test),
        format!("{} µm per division, first order. Errors without influence on the test are omitted.", text(um, um)),
        [crate::present::figure::WIDTH, row_height * rows as f64 + 6.0],
        inner,
    )
}

fn curves(test: &TestSensitivities, columns: &[Sensitivity]) -> Plot {
    const CLASSES: [&str; 8] = ["c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7"];
    let range = span(test.way.values.iter().copied());
    let values = span(columns.iter().flat_map(|c| c.values.iter().copied()));
    let x = Scale::over(range[0], range[1], ACROSS, 9);
    let x = if test.way.is_angle { x.in_degrees() } else { x };
    let points = |column: &Sensitivity| test.way.values.iter().copied().zip(column.values.iter().copied()).collect();
    let (name, title) = match test.coordinate {
        Some(coordinate) => {
            (format!("{}-{coordinate}", test.test), format!("{}: sensitivity of {coordinate}", test.test))
        }
        None => (test.test.clone(), format!("{}: sensitivity", test.test)),
    };
    Lines {
        name: format!("sensitivity-{name}"),
        title,
        caption: "Change of the reading per unit of each error, along the first run.".to_string(),
        x: (x, format!("{}, {}", test.way.name, if test.way.is_angle { "°" } else { "mm" })),
        y: (Scale::rounded(values[0].min(0.0), values[1].max(0.0), UP, 6), "µm per unit".to_string()),
        series: columns
            .iter()
            .zip(CLASSES)
            .map(|(column, class)| Series { class, source: None, mark: Mark::Line, points: points(column) })
            .collect(),
        legend: columns
            .iter()
            .zip(CLASSES)
            .map(|(c, class)| (class, format!("{}, per {}", shortened(&c.id, 20), unit(&c.unit))))
            .collect(),
        over: html! {},
    }
    .plot()
}
