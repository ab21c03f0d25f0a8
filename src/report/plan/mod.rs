//! The analysis of a plan: predicted uncertainties, sensitivities, budgets, correlation, observability indices.

pub mod analysis;
pub mod effects;
pub mod global;

use abbe::model::words::counted;
use abbe::plan::collision::TestClearance;
use abbe::plan::results::{EffectDetectability, ErrorAnalysis, Indices, PlanAnalysis};

use super::number::{three_digits, unit};
use super::table::{Cell, Table, cells, numbers, words};

/// Contributions to a variance that are listed; the JSON lists all.
const MAX_CONTRIBUTIONS: usize = 3;
/// Errors of a correlation matrix in numbers.
const MAX_CORRELATED: usize = 16;
/// Tests in one row of the table of small plots.
const PLOTS_PER_ROW: usize = 4;
/// Width of a small plot, characters.
const PLOT_WIDTH: usize = 18;

fn optional(value: Option<f64>) -> String {
    value.map_or("–".to_string(), three_digits)
}

/// The predicted uncertainty of each error, and what contributes to it.
pub fn uncertainties(errors: &[ErrorAnalysis]) -> Table {
    let rows = errors.iter().map(|error| {
        let part = |noise: bool| {
            let parts = error.budget.iter().filter(|part| part.is_noise() == noise);
            let part = parts.map(|part| part.u.powi(2)).sum::<f64>().sqrt();
            error.u.map(|_| part)
        };
        let largest = error.budget.first().filter(|_| error.u.is_some());
        cells![
            &error.id,
            error.u.map_or("not identifiable".to_string(), three_digits),
            optional(error.u.map(|u| 2.0 * u)),
            unit(&error.unit),
            optional(part(true)),
            optional(part(false)),
            optional(error.conditional_u),
            largest.map_or(String::new(), |part| format!("{} {:.0} %", part.source, part.share * 100.0)),
        ]
    });
    let columns = ["error", ">u", ">U", "unit", ">noise", ">set-up", ">conditional", "largest contribution"];
    Table::new(columns, rows).titled(
        "Predicted standard uncertainty u and expanded uncertainty U = 2u; parts of u from noise and from the set-up;\n\
         conditional u (all other errors known); the largest contribution to the variance",
    )
}

/// The least clearance of every test, and where it is.
pub fn clearances(found: &[TestClearance]) -> Table {
    let rows = found.iter().map(|found| {
        let at: Vec<String> = found.at.iter().map(|(name, q)| format!("{name} {q:.1}")).collect();
        cells![&found.test, Cell::fixed(found.clearance_mm, 1), found.between.join(", "), at.join(", ")]
    });
    Table::new(["test", ">clearance, mm", "between", "at"], rows).titled("Least clearance (0 or less: collision)")
}

/// How far each error moves the readings.
pub fn sensitivity(errors: &[ErrorAnalysis]) -> Table {
    let rows = errors.iter().map(|error| {
        let of = &error.sensitivity;
        let test = if of.largest == 0.0 { "–" } else { of.largest_in_test.as_str() };
        cells![&error.id, unit(&error.unit), three_digits(of.largest), three_digits(of.rms), test]
    });
    let columns = ["error", "unit", ">largest", ">rms", "largest in"];
    Table::new(columns, rows)
        .titled("Sensitivity of a reading, µm per unit of the error (largest, rms, the test in which it is largest)")
}

/// The largest contributions to the variance of each error, and its largest correlations.
pub fn budgets(errors: &[ErrorAnalysis]) -> Table {
    let identifiable = errors.iter().filter(|error| error.u.is_some());
    let rows = identifiable.map(|error| {
        let parts: Vec<String> = error
            .budget
            .iter()
            .take(MAX_CONTRIBUTIONS)
            .map(|part| format!("{} {:.0} %", part.source, part.share * 100.0))
            .collect();
        let shared = error.correlated_with.iter().take(2);
        let shared: Vec<String> = shared.map(|other| format!("{} {:+.2}", other.id, other.correlation)).collect();
        cells![&error.id, parts.join(", "), shared.join(", ")]
    });
    Table::new(["error", "contributions", "correlated with"], rows)
        .titled("Largest contributions to the variance of each error, and its largest correlations")
}

/// Sensitivities along the first run of each test as plots of characters.
pub fn small_plots(analysis: &PlanAnalysis) -> Vec<Table> {
    if analysis.errors.iter().all(|error| error.curves.is_empty()) {
        return Vec::new();
    }
    let tables = analysis.tests.chunks(PLOTS_PER_ROW).map(|group| {
        let columns = [words("error")].into_iter().chain(group.iter().map(|test| numbers(&test.name)));
        let rows = analysis.errors.iter().map(|error| {
            let values = error.curves.iter().flat_map(|curve| &curve.values);
            let most = values.fold(0.0_f64, |most, value| most.max(value.abs()));
            let plots = group.iter().map(|test| {
                let curve = error.curves.iter().find(|curve| curve.test == test.name);
                Cell::from(curve.map_or("·".into(), |curve| small_plot(&curve.values, most)))
            });
            [Cell::from(&error.id)].into_iter().chain(plots).collect()
        });
        Table::new(columns, rows)
    });
    tables.collect()
}

/// A plot of bars in one line, of eight heights from `−most` to `most`.
pub fn small_plot(values: &[f64], most: f64) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let width = PLOT_WIDTH.min(values.len());
    (0..width)
        .map(|k| {
            let value = values[k * (values.len() - 1) / (width - 1).max(1)];
            let level = if most > 0.0 { (value / most + 1.0) / 2.0 } else { 0.5 };
            BARS[((level * 7.0).round() as usize).min(7)]
        })
        .collect()
}

/// The lower triangle of the correlation matrix; `None` if there are too many errors for numbers.
pub fn correlation(analysis: &PlanAnalysis) -> Option<Table> {
    let ids = &analysis.correlation.ids;
    if ids.len() > MAX_CORRELATED {
        return None;
    }
    let rows = ids.iter().zip(&analysis.correlation.matrix).enumerate().map(|(i, (id, row))| {
        let mut cells = cells![id];
        cells.extend(row.iter().take(i + 1).map(|value| value.map_or("–".into(), |rho| format!("{rho:+.2}").into())));
        cells.resize(ids.len() + 1, "".into());
        cells
    });
    let columns = [words("")].into_iter().chain(ids.iter().map(numbers));
    Some(Table::new(columns, rows).titled("Correlation"))
}

/// Observability indices O1 to O5, condition number and efficiencies.
pub fn indices(indices: &Indices) -> Table {
    let row = |name: &str, value: f64, meaning: &str| cells![name, three_digits(value), meaning];
    let rows = [
        row("condition number", indices.condition_number, "largest over smallest singular value"),
        row(
            "O1",
            indices.o1,
            "geometric mean of the singular values, per root of the readings: volume of the confidence region",
        ),
        row("O2", indices.o2, "smallest over largest singular value: evenness"),
        row("O3", indices.o3, "smallest singular value: worst determined direction"),
        row("O4", indices.o4, "square of the smallest over the largest singular value: noise amplification"),
        row("O5", indices.o5, "reciprocal of the sum of reciprocal singular values: mean uncertainty"),
    ];
    let mut table = Table::new(["index", ">value", "meaning"], rows).titled(format!(
        "Observability indices of {} of {}, set-up parameters within their priors",
        indices.identifiable_count,
        counted(indices.error_count, "error")
    ));
    let [d, a, e, g] =
        [indices.d_efficiency, indices.a_efficiency, indices.e_efficiency, indices.g_efficiency].map(three_digits);
    table.notes.push(format!("efficiency D {d}  A {a}  E {e}  G {g}"));
    table
}

/// The table of `--csv`.
pub fn values(analysis: &PlanAnalysis) -> Table {
    let mut rows = Rows(Vec::new());
    rows.add("plan", "noise", "", analysis.noise.value, analysis.noise.unit.name());
    rows.add("plan", "readings", "", analysis.readings as f64, "");
    rows.some("plan", "movement", "", analysis.moving_min, "min");
    for test in &analysis.tests {
        rows.add("test", &test.name, "readings", test.readings as f64, "");
        rows.some("test", &test.name, "movement", test.moving_min, "min");
    }
    analysis.errors.iter().for_each(|error| rows.error(error));
    let correlation = &analysis.correlation;
    for (row, id) in correlation.matrix.iter().zip(&correlation.ids) {
        let pairs = row.iter().zip(&correlation.ids).take_while(|(_, other)| *other != id);
        pairs.for_each(|(value, other)| rows.some("correlation", id, other, *value, ""));
    }
    for without in &analysis.leave_one_out {
        let inflated = without.variance_inflation.iter();
        inflated.for_each(|own| rows.some("variance without a test", &own.id, &without.test, own.factor, "1"));
    }
    let indices = &analysis.indices;
    for (name, value) in [
        ("condition number", indices.condition_number),
        ("O1", indices.o1),
        ("O2", indices.o2),
        ("O3", indices.o3),
        ("O4", indices.o4),
        ("O5", indices.o5),
        ("D-efficiency", indices.d_efficiency),
        ("A-efficiency", indices.a_efficiency),
        ("E-efficiency", indices.e_efficiency),
        ("G-efficiency", indices.g_efficiency),
    ] {
        rows.add("index", name, "", value, "");
    }
    analysis.clearances.iter().for_each(|own| rows.add("clearance", &own.test, "", own.clearance_mm, "mm"));
    analysis.effects.iter().flat_map(|effects| &effects.effects).for_each(|effect| rows.effect(effect));
    let columns = ["section", "id", "of"].map(words).into_iter().chain([numbers("value"), words("unit")]);
    Table::new(columns, rows.0)
}

struct Rows(Vec<Vec<Cell>>);

impl Rows {
    fn add(&mut self, section: &str, id: &str, of: &str, value: f64, unit: &str) {
        self.0.push(cells![section, id, of, Cell::exact(value), unit]);
    }

    fn some(&mut self, section: &str, id: &str, of: &str, value: Option<f64>, unit: &str) {
        value.into_iter().for_each(|value| self.add(section, id, of, value, unit));
    }

    fn error(&mut self, error: &ErrorAnalysis) {
        let (id, unit, sensitivity) = (&error.id, &error.unit, &error.sensitivity);
        self.some("uncertainty", id, "", error.u, unit);
        self.some("conditional uncertainty", id, "", error.conditional_u, unit);
        self.add("largest sensitivity", id, &sensitivity.largest_in_test, sensitivity.largest, &sensitivity.unit);
        self.add("rms sensitivity", id, "", sensitivity.rms, &sensitivity.unit);
        error.budget.iter().for_each(|part| self.add("budget", id, &part.source, part.u, unit));
    }

    fn effect(&mut self, effect: &EffectDetectability) {
        let (id, unit) = (&effect.id, &effect.unit);
        self.some("detectable amplitude", id, "", effect.detectable_amplitude, unit);
        self.some("detectable amplitude of all", id, "", effect.detectable_amplitude_screened, unit);
        self.add("share in the residual", id, "", effect.residual_share, "1");
        effect.biases.iter().for_each(|bias| self.add("bias", id, &bias.id, bias.per_unit, &bias.unit));
    }
}
