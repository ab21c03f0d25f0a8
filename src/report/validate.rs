//! A validated model: verdict, residuals of each machine, moved parameters, share of each effect.

use abbe::document::StatedValidation;
use abbe::model::words::counted;
use abbe::trace::validate::{JudgedResidual, RmsResult, Validation, ValidationResult, ValidationVerdict};

use super::block::{KeyFigure, Report, Text};
use super::commands::Commands;
use super::figure::bars::{ALIAS, NAMED, OTHER, bars};
use super::figure::lines::{Axis, Lines, Mark, Series};
use super::figure::scale::{Scale, span};
use super::figure::{Figure, Quantity};
use super::fit::Figures;
use super::number::{capitalised, integer, of_readings, probability, unit};
use super::statements;
use super::table::{Cell, Table, cells, numbers, words};

/// Rows of a list that a terminal shows without `--all`.
const MAX_ROWS: usize = 10;

/// Method of a validation.
const METHOD: &str = "The errors of the machine are those of the saved model. Only the set-up of this session is \
     estimated, with its priors, and again for each machine that is compared. The predicted variance of a residual is \
     that of the noise plus that of the model's covariance, after projection on the set-up. Consistent: the residual is \
     as large as predicted (ratio at most 1.05, or p at least 0.001), the 95 % intervals cover at least 90 % of the \
     readings, and no parameter has moved (generalised least squares, 0.5 % over all parameters, Bonferroni).";

/// The report of a validation.
pub fn report(machine: &str, validation: &Validation, stated: &StatedValidation<'_>, commands: &Commands) -> Report {
    let result = stated.result;
    let mut report = Report::new(format!("Validation of a model of {machine}"));
    report.warnings.clone_from(&result.warnings);
    report.method = METHOD.to_string();
    let sentence = format!("{}.", capitalised(&sentence(result)));
    let statements = statements::of_validation(&stated.statements, result, commands);
    let readings = format!("{}.", readings(result));
    let sentences = std::iter::once(sentence.into()).chain(statements).chain([readings.into()]);
    report.opening(result.verdict.to_string(), sentences);
    report.key(key_figures(result));
    report.section("Residuals");
    report.key(residuals(result));
    report.figures(of_machines(result));
    report.section("Moved parameters");
    match (&result.not_judged, result.moved.is_empty()) {
        (Some(_), _) => report.key("Not judged: the model itself lacks an effect."),
        (None, true) => report.key("No parameter of the machine has moved significantly."),
        (None, false) => report.key(moved(result).folded(MAX_ROWS)),
    }
    report.section("Effects");
    report.key(without(result).folded(MAX_ROWS));
    report.figures((!result.without.is_empty()).then(|| of_effects(result)).into_iter().flatten());
    report.section("Set-up");
    let estimated = counted(result.set_up.len(), "parameter");
    if !result.set_up.is_empty() {
        report.brief(Text::Note(format!("{estimated} of the set-up estimated")));
    }
    report.folded(estimated, set_up(result));
    report.section("Tests");
    report.figures(of_tests(validation));
    report.values = values(result);
    report
}

fn key_figures(result: &ValidationResult) -> Vec<KeyFigure> {
    let shown = |value: f64| of_readings(value, result.noise.unit);
    let model = &result.model;
    let predicted = format!("predicted {}", shown(model.residual.predicted_rms_um));
    let mut figures = vec![KeyFigure::new("Residual rms", shown(model.residual.rms.rms_um), predicted)];
    let length =
        model.residual.rms.rms_3d_um.map(|length| KeyFigure::new("Residual vector", shown(length), "rms length"));
    figures.extend(length);
    figures.extend([
        KeyFigure::new(
            "Location errors alone",
            shown(result.locations.rms_um),
            format!("nominal machine {}", shown(result.nominal.rms_um)),
        ),
        KeyFigure::new(
            "In 95 % intervals",
            format!("{:.1} %", 100.0 * model.residual.coverage_95),
            "of scalar readings",
        ),
        KeyFigure::new("Readings", integer(result.readings), format!("{} inside the range", result.readings_in_range)),
    ]);
    figures
}

/// The verdict in a sentence.
fn sentence(result: &ValidationResult) -> String {
    let cause = match result.moved.len() {
        0 if result.not_judged.is_some() => "the readings are not as the model predicts".to_string(),
        0 => "the residual is larger than predicted".to_string(),
        1 => "1 parameter has moved".to_string(),
        count => format!("{} have moved", counted(count, "parameter")),
    };
    let other = if result.without.is_empty() { "the nominal machine" } else { "the location errors alone" };
    match result.verdict {
        ValidationVerdict::Holds => "the model predicts the readings within noise and its uncertainty".to_string(),
        ValidationVerdict::HoldsInRange => {
            "the model predicts the readings inside the range of its data, not those outside it".to_string()
        }
        ValidationVerdict::Degraded => format!("{cause}; the model is still better than {other}"),
        ValidationVerdict::DoesNotHold => format!("{cause}, and the model is no better than {other}"),
    }
}

/// The readings, those inside the range, and the noise.
fn readings(result: &ValidationResult) -> String {
    let shown = |value: f64| of_readings(value, result.noise.unit);
    let outside = match result.outside.as_slice() {
        [] => String::new(),
        names => format!(" (outside: {})", names.join(", ")),
    };
    let outliers = match result.outliers {
        0 => String::new(),
        count => format!(", {} excluded", counted(count, "outlier")),
    };
    format!(
        "{}, {} inside the range of the model{outside}{outliers}; noise {} ({})",
        counted(result.readings, "reading"),
        result.readings_in_range,
        shown(result.noise.value),
        result.noise.source
    )
}

/// Rms of each machine, with what the model predicts and covers.
pub fn residuals(result: &ValidationResult) -> Table {
    let shown = |value: f64| of_readings(value, result.noise.unit);
    let length = |rms: &RmsResult| rms.rms_3d_um.map_or("–".to_string(), shown);
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let row = |name: &str, rms: &RmsResult| {
        cells![name, shown(rms.rms_um), length(rms), Cell::fixed(rms.noise_ratio, 3), "–", "–", "–"]
    };
    let model = &result.model;
    let predicted = |name: &str, residual: &JudgedResidual| {
        cells![
            name,
            shown(residual.rms.rms_um),
            length(&residual.rms),
            Cell::fixed(residual.rms.noise_ratio, 3),
            shown(residual.predicted_rms_um),
            Cell::fixed(residual.residual_ratio, 3),
            percent(residual.coverage_95)
        ]
    };
    let mut rows = vec![
        row("nominal machine", &result.nominal),
        row("location errors", &result.locations),
        predicted("model", &model.residual),
    ];
    rows.extend(model.in_range.as_ref().map(|inside| predicted("model, inside its range", inside)));
    let three = model.residual.rms.rms_3d_um.is_some();
    let mut table =
        Table::new(["machine", ">rms", ">3-vector", ">of noise", ">predicted rms", ">of predicted", ">in 95 %"], rows);
    table.notes.push(
        "of noise: √(χ²/ν) of the residual over the noise and of the set-up over its priors. of predicted: the same \
         with the uncertainty of the model."
            .into(),
    );
    if !three {
        table.columns.remove(2);
        table.rows.iter_mut().for_each(|row| drop(row.remove(2)));
    }
    table.titled("Residual with the set-up of this session estimated")
}

/// The moved parameters.
pub fn moved(result: &ValidationResult) -> Table {
    let rows = result.moved.iter().map(|moved| {
        let [value, u] = Cell::estimate(moved.change.value, moved.change.u);
        let alternatives = moved.alternatives.join(", ");
        cells![&moved.change.id, value, u, unit(&moved.change.unit), probability(moved.p_value), alternatives]
    });
    Table::new(["parameter", ">change", ">u", "unit", ">p", "or instead"], rows)
        .titled("Parameters that have moved since the model, with standard uncertainty u")
}

/// The model without each effect, the most important first.
pub fn without(result: &ValidationResult) -> Table {
    let shown = |value: f64| of_readings(value, result.noise.unit);
    let mut order: Vec<usize> = (0..result.without.len()).collect();
    order.sort_by(|a, b| result.without[*b].rms.rms_um.total_cmp(&result.without[*a].rms.rms_um));
    let rows = order.into_iter().map(|k| {
        let without = &result.without[k];
        let change = without.rms.rms_um - result.model.residual.rms.rms_um;
        cells![&without.effect, shown(without.rms.rms_um), format!("{change:+.3}")]
    });
    let change = format!("change, {}", unit(result.noise.unit.name()));
    Table::new([words("effect"), numbers("rms without it"), numbers(change)], rows)
        .titled("The model without each effect; an effect that lowers no residual does not hold here")
}

/// The estimated set-up.
fn set_up(result: &ValidationResult) -> Table {
    let rows = result.set_up.iter().map(|parameter| {
        let [value, u] = Cell::estimate(parameter.value, parameter.u);
        cells![&parameter.id, value, u, unit(&parameter.unit), &parameter.meaning]
    });
    Table::new(["parameter", ">value", ">u", "unit", "meaning"], rows)
        .titled("Set-up of this session, as deviations from its stated values")
}

/// Every figure with all its digits, one row per figure.
fn values(result: &ValidationResult) -> Table {
    let unit = result.noise.unit.name();
    let mut figures = Figures::default();
    figures.statement("verdict", result.verdict.word(), &sentence(result));
    let mut rms = |id: &str, rms: &RmsResult| {
        figures.figure("residual", id, "rms over scalar readings", rms.rms_um, unit);
        if let Some(length) = rms.rms_3d_um {
            figures.figure("residual", id, "rms length of the vector", length, unit);
        }
    };
    rms("nominal", &result.nominal);
    rms("locations", &result.locations);
    rms("model", &result.model.residual.rms);
    if let Some(inside) = &result.model.in_range {
        rms("model in range", &inside.rms);
    }
    for without in &result.without {
        rms(&format!("without {}", without.effect), &without.rms);
    }
    figures.figure("prediction", "predicted rms", "", result.model.residual.predicted_rms_um, unit);
    figures.figure("prediction", "coverage", "share inside the 95 % intervals", result.model.residual.coverage_95, "1");
    let mut table = figures.table();
    table.rows.extend(result.moved.iter().map(|moved| {
        cells![
            "moved",
            &moved.change.id,
            "change since the model",
            Cell::exact(moved.change.value),
            Cell::exact(moved.change.u),
            &moved.change.unit
        ]
    }));
    table
}

/// Maximum number of tests with figures of their own.
const MAX_TESTS: usize = 12;
/// Maximum number of bars.
const MAX_BARS: usize = 30;
/// Maximum number of drawn readings of a test.
const MAX_POINTS: usize = 1500;
/// Standard deviations of a 95 % interval.
const INTERVAL: f64 = 1.96;

/// Rms of the nominal machine, of the location errors and of the model.
fn of_machines(result: &ValidationResult) -> Vec<Figure> {
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
fn of_effects(result: &ValidationResult) -> Vec<Figure> {
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
fn of_tests(validation: &Validation) -> Vec<Figure> {
    let mut figures = vec![coverage(validation)];
    figures.extend((0..validation.tests.len().min(MAX_TESTS)).map(|test| of_test(validation, test)));
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
fn of_test(validation: &Validation, test: usize) -> Figure {
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
