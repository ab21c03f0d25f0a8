//! Plots of a validation: rms of each machine, residuals and coverage of each test, share of each effect.

use abbe::identify::validate::{Validation, ValidationResult};

use crate::present::figure::Plot;
use crate::present::figure::bars::{Fill, bars};
use crate::present::figure::lines::{ACROSS, Lines, Mark, Series, UP, span};
use crate::present::figure::scale::Scale;

/// Maximum number of tests with plots of their own.
const MAX_TESTS: usize = 12;
/// Maximum number of effects in a plot.
const MAX_EFFECTS: usize = 30;
/// Maximum number of drawn readings of a test.
const MAX_POINTS: usize = 1500;
/// Standard deviations of a 95 % interval.
const INTERVAL: f64 = 1.96;

/// Rms of the nominal machine, of the location errors and of the model.
pub fn of_machines(result: &ValidationResult) -> Vec<Plot> {
    let model = &result.model;
    let mut rows = vec![
        ("nominal machine".to_string(), result.nominal.rms_um, Fill::Other),
        ("location errors".to_string(), result.locations.rms_um, Fill::Alias),
        ("model".to_string(), model.rms.rms_um, Fill::Named),
        ("predicted".to_string(), model.predicted_rms_um, Fill::Other),
    ];
    rows.extend(
        model.in_range.as_ref().map(|inside| ("model, inside its range".to_string(), inside.rms.rms_um, Fill::Named)),
    );
    vec![bars(
        "rms".into(),
        "Residual of each machine".into(),
        "With the set-up of this session estimated for each.".into(),
        "rms, µm",
        &rows,
        &[],
    )]
}

/// Rms without each effect, less that of the whole model.
pub fn of_effects(result: &ValidationResult) -> Vec<Plot> {
    let change = |rms_um: f64| rms_um - result.model.rms.rms_um;
    let mut rows: Vec<(String, f64, Fill)> = result
        .without
        .iter()
        .map(|without| {
            let change = change(without.rms.rms_um);
            (without.effect.clone(), change, if change > 0.0 { Fill::Named } else { Fill::Other })
        })
        .collect();
    rows.sort_by(|a, b| b.1.total_cmp(&a.1));
    rows.truncate(MAX_EFFECTS);
    vec![bars(
        "effects".into(),
        "Share of each effect".into(),
        "Increase of the rms without the effect. A negative bar: the effect does not hold here.".into(),
        "increase of the rms, µm",
        &rows,
        &[],
    )]
}

/// Residuals of each test before and after, with the 95 % intervals of the model.
pub fn of_tests(validation: &Validation) -> Vec<Plot> {
    let mut plots = vec![coverage(validation)];
    plots.extend((0..validation.tests.len().min(MAX_TESTS)).map(|test| residuals(validation, test)));
    plots
}

/// Share of readings of each test inside their intervals.
fn coverage(validation: &Validation) -> Plot {
    let share = |test: usize| {
        let rows = validation.residuals[test].iter().zip(&validation.predicted_mm[test]).enumerate();
        let kept: Vec<bool> = rows
            .filter(|(i, _)| !validation.rejected[test][i / validation.coordinates])
            .map(|(_, (residual, deviation))| residual.abs() <= INTERVAL * deviation)
            .collect();
        100.0 * kept.iter().filter(|inside| **inside).count() as f64 / kept.len().max(1) as f64
    };
    let rows: Vec<(String, f64, Fill)> = validation
        .tests
        .iter()
        .enumerate()
        .take(MAX_EFFECTS)
        .map(|(test, name)| (name.clone(), share(test), Fill::Named))
        .collect();
    bars(
        "coverage".into(),
        "Coverage of the 95 % intervals".into(),
        "Share of the scalar readings of each test.".into(),
        "inside, %",
        &rows,
        &[],
    )
}

/// Residuals of a test: the nominal machine, the model, and the ends of the model's intervals.
fn residuals(validation: &Validation, test: usize) -> Plot {
    let count = validation.residuals[test].len();
    let step = count.div_ceil(MAX_POINTS).max(1);
    let points = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        (0..count).step_by(step).map(|i| ((i / validation.coordinates + 1) as f64, value(i))).collect()
    };
    // The interval of the first coordinate of a reading, so that its line is smooth.
    let of_row = |i: usize| validation.predicted_mm[test][i - i % validation.coordinates] * 1e3;
    let series = [
        ("before", "nominal machine", points(&|i| validation.residuals_nominal[test][i] * 1e3)),
        ("after", "model", points(&|i| validation.residuals[test][i] * 1e3)),
        ("after", "95 % interval", points(&|i| INTERVAL * of_row(i))),
        ("after", "", points(&|i| -INTERVAL * of_row(i))),
    ];
    let [low, high] = span(series.iter().flat_map(|(_, _, points)| points.iter().map(|point| point.1)));
    let last = (count / validation.coordinates).max(2) as f64;
    let name = &validation.tests[test];
    Lines {
        name: format!("residual-{name}"),
        title: format!("{name}: residuals"),
        caption: "Nominal machine and model, each with its estimated set-up.".into(),
        x: (Scale::rounded(1.0, last, ACROSS, 6), "reading".into()),
        y: (Scale::rounded(low.min(0.0), high.max(0.0), UP, 6), "residual, µm".into()),
        legend: series
            .iter()
            .filter(|(_, label, _)| !label.is_empty())
            .enumerate()
            .map(|(k, (class, label, _))| {
                let class = match (k, *class) {
                    (2.., class) => class,
                    (_, "before") => "run before dots sparse",
                    _ => "run after dots sparse",
                };
                (class, label.to_string())
            })
            .collect(),
        series: series
            .into_iter()
            .enumerate()
            .map(|(k, (class, _, points))| {
                let mark = if k < 2 { Mark::Dots } else { Mark::Line };
                Series { class, source: None, mark, points }
            })
            .collect(),
        over: maud::html! {},
    }
    .plot()
}
