//! Plots of derived quantities: histogram and time series of the residual, spectra, and sensitivities to single errors.

use abbe::identify::problem::Problem;
use abbe::identify::series::lengths;
use abbe::identify::series::sensitivities::{self as sensitivity, Sensitivity, TestSensitivities};
use abbe::identify::series::spectrum::Spectrum;
use abbe::model::Diagnostic;
use abbe::model::effect::shape::Harmonic;
use abbe::model::effect::{Effect, Shape};
use abbe::model::words::{counted, cut};

use super::plots::{MAX_TESTS, SessionPlots, interval_extremes};
use crate::report::figure::bars::{NAMED, bars};
use crate::report::figure::lines::{Axis, Lines, Mark, Name, Series};
use crate::report::figure::polar::panels;
use crate::report::figure::scale::{Scale, span, text};
use crate::report::figure::{Figure, Quantity};
use crate::report::number::{unit, units};

/// Intervals of a plot over time.
const TIME_INTERVALS: usize = 240;
/// Minimum number of intervals of a test.
const MIN_INTERVALS: usize = 12;

/// Histogram of the absolute residual before and after.
pub fn histogram(session: &SessionPlots<'_>, models: [&str; 2]) -> Figure {
    const CLASSES: usize = 60;
    let all = |after: bool| -> Vec<f64> {
        session
            .series
            .tests
            .iter()
            .flat_map(|test| {
                let values = if after { &test.after_um } else { &test.before_um };
                lengths(values, test.channels)
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
    let lines = Lines::new(
        Axis::new("residual", session.series.unit.name(), Scale::over([0.0, maximum], 7)),
        Axis::new("readings", "", Scale::rounded([0.0, highest], 5)),
        vec![Series::new(models[0], "before", Mark::Line, before), Series::new(models[1], "after", Mark::Line, after)],
    );
    let caption = "Absolute residual of all tests.";
    Figure::new("residual-lengths", "Distribution of the residual", caption, lines)
}

/// Residuals of the session over time. Without time: in the order of the readings.
pub fn over_time(session: &SessionPlots<'_>) -> Figure {
    let has_time =
        session.problem.tests.iter().all(|test| test.readings.as_ref().is_some_and(|r| !r.time_s.is_empty()));
    // Name of each test; its time, residual before and residual after.
    let mut tests: Vec<(String, [Vec<f64>; 3])> = Vec::new();
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
        let of = |values: &[f64]| lengths(values, view.channels);
        tests.push((view.name.clone(), [time, of(&view.before_um), of(&view.after_um)]));
    }
    let intervals = (TIME_INTERVALS / tests.len().max(1)).max(MIN_INTERVALS);
    let of = |time: &[f64], values: &[f64]| -> Vec<(f64, f64)> {
        let extremes = interval_extremes(time, values, intervals);
        extremes.into_iter().flat_map(|(centre, minimum, maximum)| [(centre, minimum), (centre, maximum)]).collect()
    };
    let all = |column: usize| tests.iter().flat_map(move |(_, test)| test[column].iter().copied());
    let series = ["before", "after"].into_iter().enumerate().flat_map(|(when, class)| {
        let of = &of;
        tests.iter().enumerate().map(move |(number, (name, test))| Series {
            test: Some((number, name.clone())),
            ..Series::new(class, class, Mark::Bars, of(&test[0], &test[1 + when]))
        })
    });
    let (abscissa, name, unit) =
        if has_time { ("time", "time", "min") } else { ("reading", "reading, in the order of the files", "") };
    let residual = if session.series.vectors { "length of the residual" } else { "residual" };
    let lines = Lines::new(
        Axis::new(name, unit, Scale::over(span(all(0)), 7)),
        Axis::new(residual, session.series.unit.name(), Scale::with_zero(span(all(1).chain(all(2))), 6)),
        series.collect(),
    );
    Figure::new(
        "residual-over-time",
        format!("Residual against {abscissa}"),
        "All tests, minimum to maximum of each interval. Before: red. After: blue. The test switches of the traces \
         apply here too.",
        lines,
    )
}

/// Amplitude spectrum of the residual of a test. `maximum` is the largest amplitude of all spectra, so that they share
/// one scale.
pub fn spectrum_plot(spectrum: &Spectrum, maximum: f64, effects: &[Effect]) -> Figure {
    let orders = spectrum.before_um.len() as f64;
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
    let stems = |label: &'static str, values: &[f64], beside: f64| {
        let points = values.iter().enumerate().map(|(k, v)| (k as f64 + 1.0, *v)).collect();
        Series::new(label, label, Mark::Stems(beside), points)
    };
    let highest = |order: f64| {
        let k = (order.round() as usize).saturating_sub(1);
        let amplitudes = spectrum.before_um.iter().zip(&spectrum.after_um).nth(k);
        amplitudes.map_or(0.0, |(before, after)| before.max(*after))
    };
    let flags = Series {
        names: found.iter().map(|(_, id)| Name { text: id.clone(), note: String::new(), shown: true }).collect(),
        ..Series::new(
            "found order",
            "found-line",
            Mark::Flags,
            found.iter().map(|(order, _)| (*order, highest(*order))).collect(),
        )
    };
    let mut series = vec![stems("before", &spectrum.before_um, -0.16), stems("after", &spectrum.after_um, 0.16)];
    series.extend((!found.is_empty()).then_some(flags));
    // The upper fifth is left free for the names of found effects.
    let lines = Lines::new(
        Axis::new(
            format!("order, cycles per turn of {}", spectrum.over),
            "",
            Scale { step: 5.0, ..Scale::over([0.0, orders + 1.0], 8) },
        ),
        Axis::new("amplitude", "um", Scale::over([0.0, (maximum * 1.25).max(1e-6)], 5)),
        series,
    );
    Figure::new(
        format!("spectrum-{}-{}", spectrum.of, spectrum.over),
        format!("{}: spectrum of the residual over {}", spectrum.of, spectrum.over),
        "Amplitude of a sine and cosine of each order. Over a part of a turn they are fitted together.",
        lines,
    )
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
pub fn sensitivities(problem: &Problem, beta: &[f64]) -> Result<Vec<Figure>, Diagnostic> {
    const DIVISION_UM: f64 = 5.0;
    if problem.folds.kind.is_poses() {
        return Ok(pose_sensitivities(&sensitivity::over_poses(problem, beta)?));
    }
    let mut plots = Vec::new();
    let found = sensitivity::sensitivities(problem, beta)?;
    let most: usize = problem.models.iter().take(MAX_TESTS).map(|model| model.channels().len()).sum();
    for test in found.iter().take(most) {
        if test.columns.is_empty() {
            continue;
        }
        if test.way.is_angle && test.channel.is_none() {
            for chunk in test.columns.chunks(12) {
                plots.push(polar_sensitivities(test, chunk, DIVISION_UM));
            }
        }
        for chunk in test.columns.chunks(8) {
            plots.push(curves(test, chunk));
        }
    }
    Ok(plots)
}

/// RMS sensitivity of the readings of separate poses to each error, by unit, in descending order.
fn pose_sensitivities(found: &[Sensitivity]) -> Vec<Figure> {
    const MAX: usize = 40;
    units(found.iter().map(|error| error.unit.as_str()))
        .into_iter()
        .map(|name| {
            let own = found.iter().filter(|error| error.unit == name);
            let mut rows: Vec<(String, f64, &str)> =
                own.map(|error| (error.id.clone(), error.values[0], NAMED)).collect();
            rows.sort_by(|a, b| b.1.total_cmp(&a.1));
            let omitted = rows.len().saturating_sub(MAX);
            rows.truncate(MAX);
            let mut caption = "RMS over all poses of the displacement of a reading per unit of the error.".to_string();
            if omitted > 0 {
                caption.push_str(&format!(" {} with smaller sensitivity omitted.", counted(omitted, "error")));
            }
            let quantity = Quantity::new("", format!("um per {name}"));
            Figure::new(
                format!("sensitivity-{}", name.replace('/', "-per-")),
                format!("Sensitivity to errors in {}", unit(name)),
                caption,
                bars(&quantity, &rows, &[]),
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

/// Share of the largest value by which two curves differ at most if they are drawn as one.
const SAME_SHARE: f64 = 1e-3;

fn polar_sensitivities(test: &TestSensitivities, columns: &[Sensitivity], um: f64) -> Figure {
    let panel = |column: &Sensitivity| {
        let (amount, label) = amount(&column.unit)?;
        let points = test.way.values.iter().zip(&column.values).map(|(angle, value)| (*angle, value * amount));
        Some(Series::new(format!("{} = {label}", column.id), "forward", Mark::Line, points.collect()))
    };
    let [angle, deviation] =
        [(test.way.name.as_str(), "deg"), ("deviation", "um")].map(|(of, unit)| Quantity::new(of, unit));
    let series: Vec<Series> = columns.iter().filter_map(panel).collect();
    Figure::new(
        format!("patterns-{}", test.test),
        format!("{}: deviation caused by single errors", test.test),
        format!("{} µm per division, first order. Errors without influence on the test are omitted.", text(um, um)),
        panels([&angle, &deviation], um, &series),
    )
}

fn curves(test: &TestSensitivities, columns: &[Sensitivity]) -> Figure {
    const CLASSES: [&str; 8] = ["c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7"];
    let (name, title) = match test.channel {
        Some(channel) => (format!("{}-{channel}", test.test), format!("{}: sensitivity of {channel}", test.test)),
        None => (test.test.clone(), format!("{}: sensitivity", test.test)),
    };
    let way = &test.way;
    // All curves have the unit of the reading, and equal curves are one.
    let mut found: Vec<(String, &str, Vec<f64>)> = Vec::new();
    for column in columns {
        let (amount, size) = amount(&column.unit).unwrap_or((1.0, "1"));
        let values: Vec<f64> = column.values.iter().map(|value| value * amount).collect();
        let most = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let is_same = |other: &[f64]| other.iter().zip(&values).all(|(a, b)| (a - b).abs() <= SAME_SHARE * most);
        let name = cut(&column.id, 20).into_owned();
        match found.iter_mut().find(|(_, other, curve)| *other == size && is_same(curve)) {
            Some((names, ..)) => *names = format!("{names}, {name}"),
            None => found.push((name, size, values)),
        }
    }
    let y = Scale::with_zero(span(found.iter().flat_map(|(.., values)| values.iter().copied())), 6);
    let series = found.into_iter().zip(CLASSES).map(|((names, size, values), class)| {
        Series::new(format!("{names} = {size}"), class, Mark::Line, way.values.iter().copied().zip(values).collect())
    });
    let x = Scale::of_axis(span(way.values.iter().copied()), way.is_angle);
    let lines = Lines::new(
        Axis::new(&way.name, if way.is_angle { "deg" } else { "mm" }, x),
        Axis::new("change of the reading", "um", y),
        series.collect(),
    );
    let caption = "Change of the reading by each error alone, of this size, along the first run.";
    Figure::new(format!("sensitivity-{name}"), title, caption, lines)
}
