//! Figures of a validation: rms of each machine, residuals and coverage of each test, share of each effect.

use abbe::trace::validate::{Validation, ValidationResult};

use crate::report::figure::bars::{ALIAS, NAMED, OTHER, bars};
use crate::report::figure::lines::{Axis, Lines, Mark, Series};
use crate::report::figure::scale::{Scale, span};
use crate::report::figure::{Figure, Quantity};

/// Maximum number of tests with figures of their own.
const MAX_TESTS: usize = 12;
/// Maximum number of bars.
const MAX_BARS: usize = 30;
/// Maximum number of drawn readings of a test.
const MAX_POINTS: usize = 1500;
/// Standard deviations of a 95 % interval.
const INTERVAL: f64 = 1.96;

/// Rms of the nominal machine, of the location errors and of the model.
pub fn of_machines(result: &ValidationResult) -> Vec<Figure> {
    let model = &result.model;
    let mut rows = vec![
        ("nominal machine".to_string(), result.nominal.rms_um, OTHER),
        ("location errors".to_string(), result.locations.rms_um, ALIAS),
        ("model".to_string(), model.residual.rms.rms_um, NAMED),
        ("predicted".to_string(), model.residual.predicted_rms_um, OTHER),
    ];
    rows.extend(
        model.in_range.as_ref().map(|inside| ("model, inside its range".to_string(), inside.rms.rms_um, NAMED)),
    );
    let caption = "With the set-up of this session estimated for each.";
    vec![Figure::new("rms", "Residual of each machine", caption, bars(&Quantity::new("rms", "um"), &rows, &[]))]
}

/// Rms without each effect, less that of the whole model.
pub fn of_effects(result: &ValidationResult) -> Vec<Figure> {
    let mut rows: Vec<(String, f64, &str)> = result
        .without
        .iter()
        .map(|without| {
            let change = without.rms.rms_um - result.model.residual.rms.rms_um;
            (without.effect.clone(), change, if change > 0.0 { NAMED } else { OTHER })
        })
        .collect();
    rows.sort_by(|a, b| b.1.total_cmp(&a.1));
    rows.truncate(MAX_BARS);
    let caption = "Increase of the rms without the effect. A negative bar: the effect does not hold here.";
    let chart = bars(&Quantity::new("increase of the rms", "um"), &rows, &[]);
    vec![Figure::new("effects", "Share of each effect", caption, chart)]
}

/// Coverage of all tests, and residuals of each with the 95 % intervals of the model.
pub fn of_tests(validation: &Validation) -> Vec<Figure> {
    let mut figures = vec![coverage(validation)];
    figures.extend((0..validation.tests.len().min(MAX_TESTS)).map(|test| residuals(validation, test)));
    figures
}

/// Share of readings of each test inside their intervals.
fn coverage(validation: &Validation) -> Figure {
    let share = |test: usize| {
        let rows = validation.residuals[test].iter().zip(&validation.predicted_mm[test]).enumerate();
        let kept: Vec<bool> = rows
            .filter(|(i, _)| !validation.rejected[test][i / validation.channels[test]])
            .map(|(_, (residual, deviation))| residual.abs() <= INTERVAL * deviation)
            .collect();
        100.0 * kept.iter().filter(|inside| **inside).count() as f64 / kept.len().max(1) as f64
    };
    let tests = validation.tests.iter().enumerate().take(MAX_BARS);
    let rows: Vec<_> = tests.map(|(test, name)| (name.clone(), share(test), NAMED)).collect();
    let caption = "Share of the scalar readings of each test.";
    Figure::new("coverage", "Coverage of the 95 % intervals", caption, bars(&Quantity::new("inside", "%"), &rows, &[]))
}

/// Residuals of a test: the nominal machine, the model, and the ends of the model's intervals.
fn residuals(validation: &Validation, test: usize) -> Figure {
    let count = validation.residuals[test].len();
    let step = count.div_ceil(MAX_POINTS).max(1);
    let points = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        (0..count).step_by(step).map(|i| ((i / validation.channels[test] + 1) as f64, value(i))).collect()
    };
    // The interval of the first coordinate of a reading, so that its line is smooth.
    let end = |i: usize| INTERVAL * validation.predicted_mm[test][i - i % validation.channels[test]] * 1e3;
    let nominal = points(&|i| validation.residuals_nominal[test][i] * 1e3);
    let series = vec![
        Series::new("nominal machine", "before", Mark::Dots, nominal),
        Series::new("model", "after", Mark::Dots, points(&|i| validation.residuals[test][i] * 1e3)),
        Series::new("95 % interval, upper end", "after", Mark::Line, points(&end)),
        Series::new("95 % interval, lower end", "after", Mark::Line, points(&|i| -end(i))),
    ];
    let [low, high] = span(series.iter().flat_map(|series| series.points.iter().map(|point| point.1)));
    let last = (count / validation.channels[test]).max(2) as f64;
    let name = &validation.tests[test];
    let x = Axis::new("reading", "", Scale::rounded([1.0, last], 6));
    let y = Axis::new("residual", "um", Scale::rounded([low.min(0.0), high.max(0.0)], 6));
    Figure::new(
        format!("residual-{name}"),
        format!("{name}: residuals"),
        "Nominal machine and model, each with its estimated set-up.",
        Lines::new(x, y, series),
    )
}
