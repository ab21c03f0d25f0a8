//! Tables of `abbe plan --all`: sensitivity, budgets, correlation, indices, tests, undeclared effects.

use abbe::identify::plan::effects::confounded_by_error;
use abbe::identify::plan::results::{EffectDetectability, EffectsAnalysis, ErrorAnalysis, PlanAnalysis};
use abbe::model::words::counted;

use super::digits::three_digits;
use crate::cli::table;

/// Tests in one row of the table of small plots.
const PLOTS_PER_ROW: usize = 4;
/// Width of a small plot.
const PLOT_WIDTH: usize = 18;
/// Contributions to a variance that are listed; the JSON lists all.
const MAX_CONTRIBUTIONS: usize = 3;
/// Effects in one table; the JSON lists all.
const MAX_EFFECTS: usize = 16;
/// Confounded effects named with each error.
const MAX_CONFOUNDED: usize = 3;

/// Prints the tables that the first screen folds.
pub fn print(analysis: &PlanAnalysis) {
    sensitivity(&analysis.errors);
    budget(&analysis.errors);
    plots(analysis);
    correlation(analysis);
    indices(analysis);
    tests(analysis);
    if let Some(found) = &analysis.effects {
        effects(found);
    }
}

fn sensitivity(errors: &[ErrorAnalysis]) {
    say!("\nSensitivity of a reading, µm per unit of the error (largest, rms, the test in which it is largest):");
    let rows: Vec<Vec<String>> = errors
        .iter()
        .map(|error| {
            let test = if error.sensitivity.largest == 0.0 {
                "–".to_string()
            } else {
                error.sensitivity.largest_in_test.clone()
            };
            vec![
                error.id.clone(),
                table::unit(&error.unit),
                three_digits(error.sensitivity.largest),
                three_digits(error.sensitivity.rms),
                test,
            ]
        })
        .collect();
    table::print_aligned(&["error", "unit", "largest", "rms", "largest in"], &rows, &[0, 1, 4]);
}

fn optional(value: Option<f64>) -> String {
    value.map_or("–".to_string(), three_digits)
}

fn budget(errors: &[ErrorAnalysis]) {
    say!("\nLargest contributions to the variance of each error, and its largest correlations:");
    let width = errors.iter().map(|error| error.id.chars().count()).max().unwrap_or(0);
    for error in errors.iter().filter(|error| error.u.is_some()) {
        let parts: Vec<String> = error
            .budget
            .iter()
            .take(MAX_CONTRIBUTIONS)
            .map(|part| format!("{} {:.0} %", part.source, part.share * 100.0))
            .collect();
        let shared: Vec<String> = error
            .correlated_with
            .iter()
            .take(2)
            .map(|other| format!("{} {:+.2}", other.id, other.correlation))
            .collect();
        let with = if shared.is_empty() { String::new() } else { format!("; with {}", shared.join(", ")) };
        say!("  {:width$}  {}{with}", error.id, parts.join(", "));
    }
}

fn plots(analysis: &PlanAnalysis) {
    let names: Vec<&str> = analysis.tests.iter().map(|test| test.name.as_str()).collect();
    if analysis.errors.iter().all(|error| error.curves.is_empty()) {
        return;
    }
    say!("\nSensitivity along the first run of each test, each row to its own scale, zero at half height:");
    for group in names.chunks(PLOTS_PER_ROW) {
        let mut header = vec!["error"];
        header.extend(group);
        let rows: Vec<Vec<String>> = analysis
            .errors
            .iter()
            .map(|error| {
                let values = error.curves.iter().flat_map(|curve| &curve.values);
                let most = values.fold(0.0_f64, |most, value| most.max(value.abs()));
                let mut row = vec![error.id.clone()];
                for name in group {
                    let curve = error.curves.iter().find(|curve| curve.test == *name);
                    row.push(curve.map_or("·".into(), |curve| small_plot(&curve.values, most)));
                }
                row
            })
            .collect();
        table::print(&header, &rows);
    }
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

fn correlation(analysis: &PlanAnalysis) {
    let ids = &analysis.correlation.ids;
    if ids.len() > 16 {
        say!("\nThe correlation matrix of {} errors is in the JSON.", ids.len());
        return;
    }
    say!("\nCorrelation:");
    let mut header = vec![""];
    header.extend(ids.iter().map(String::as_str));
    let rows: Vec<Vec<String>> = ids
        .iter()
        .zip(&analysis.correlation.matrix)
        .enumerate()
        .map(|(i, (id, row))| {
            let mut cells = vec![id.clone()];
            cells.extend(row.iter().take(i + 1).map(|value| value.map_or("–".into(), |rho| format!("{rho:+.2}"))));
            cells.resize(ids.len() + 1, String::new());
            cells
        })
        .collect();
    table::print(&header, &rows);
}

fn indices(analysis: &PlanAnalysis) {
    let indices = &analysis.indices;
    say!(
        "\nObservability indices of {} of {}, set-up parameters within their priors:",
        indices.identifiable_count,
        counted(indices.error_count, "error")
    );
    let row = |name: &str, value: f64, meaning: &str| vec![name.to_string(), three_digits(value), meaning.to_string()];
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
    table::print_aligned(&["index", "value", "meaning"], &rows, &[0, 2]);
    say!(
        "  efficiency D {}  A {}  E {}  G {}",
        three_digits(indices.d_efficiency),
        three_digits(indices.a_efficiency),
        three_digits(indices.e_efficiency),
        three_digits(indices.g_efficiency)
    );
}

fn tests(analysis: &PlanAnalysis) {
    if analysis.leave_one_out.is_empty() {
        return;
    }
    say!("\nContribution of each test:");
    analysis.leave_one_out.iter().for_each(|item| say!("  {}", item.why));
}

fn effects(found: &EffectsAnalysis) {
    let by_verdict = |verdict: fn(&str) -> bool| -> Vec<&EffectDetectability> {
        found.effects.iter().filter(|effect| verdict(&effect.verdict)).collect()
    };
    let confounded = by_verdict(|verdict| verdict.starts_with("confounded"));
    let detectable = by_verdict(|verdict| verdict == "detectable");
    let none = by_verdict(|verdict| verdict == "no signal").len();
    say!(
        "\nUndeclared effects: of {} screened, {} are detectable, {} are confounded and {none} change no reading of these tests.",
        found.effects.len(),
        detectable.len(),
        confounded.len()
    );
    say!(
        "\nDetectable: smallest amplitude that is found with {:.0} % power at {:.0} % significance by a single test of that effect and by a search of\n\
         the library of {} effects (Šidák, conservative); share of the signal that remains in the residual; bias of the errors while it is\n\
         undeclared; number of further effects of the same component and driver. A power has its amplitude at 100 mm, or at 180°:",
        found.power * 100.0,
        found.significance_level * 100.0,
        found.effects_screened
    );
    effect_table(&detectable);
    say!(
        "\nConfounded: less than 1 % of the signal remains in the residual. A clean residual does not exclude these effects, and they bias:"
    );
    effect_table(&confounded);
    say!("\nEffects confounded with each error, the largest bias first:");
    let by_error = confounded_by_error(found);
    let width = by_error.keys().map(|id| id.chars().count()).max().unwrap_or(0);
    for (error, effects) in &by_error {
        let words: Vec<String> = effects
            .iter()
            .take(MAX_CONFOUNDED)
            .map(|(id, per_unit, unit)| format!("{id} {} {}", three_digits(*per_unit), table::unit(unit)))
            .collect();
        let more = match effects.len().saturating_sub(MAX_CONFOUNDED) {
            0 => String::new(),
            more => format!(", {more} more"),
        };
        say!("  {error:width$}  {}{more}", words.join(", "));
    }
}

/// Component and driver of an effect: `EZC~C` of `EZC~C:h2`.
fn component_and_driver(id: &str) -> &str {
    id.split_once(':').map_or(id, |(before, _)| before)
}

/// A table of effects. Of those with the same component and driver it lists the one with the largest bias and counts
/// the others.
fn effect_table(effects: &[&EffectDetectability]) {
    let strongest = |effect: &EffectDetectability| effect.biases.first().map_or(0.0, |bias| bias.per_unit.abs());
    let mut sorted: Vec<&EffectDetectability> = effects.to_vec();
    // Equal rounded values are ordered by name: rounding differs between processors.
    let size = |effect: &EffectDetectability| three_digits(strongest(effect)).parse().unwrap_or(f64::INFINITY);
    sorted.sort_by(|a, b| f64::total_cmp(&size(b), &size(a)).then_with(|| a.id.cmp(&b.id)));
    let mut chosen: Vec<(&EffectDetectability, usize)> = Vec::new();
    for effect in sorted {
        match chosen.iter_mut().find(|(first, _)| component_and_driver(&first.id) == component_and_driver(&effect.id)) {
            Some((_, alike)) => *alike += 1,
            None => chosen.push((effect, 0)),
        }
    }
    let rows: Vec<Vec<String>> = chosen
        .iter()
        .take(MAX_EFFECTS)
        .map(|(effect, alike)| {
            let biases: Vec<String> = effect
                .biases
                .iter()
                .take(2)
                .map(|bias| format!("{} {} {}", bias.id, three_digits(bias.per_unit), table::unit(&bias.unit)))
                .collect();
            vec![
                effect.id.clone(),
                optional(effect.detectable_amplitude),
                optional(effect.detectable_amplitude_screened),
                table::unit(&effect.unit),
                per_cent(effect.residual_share),
                if biases.is_empty() { "none".into() } else { biases.join(", ") },
                alike.to_string(),
            ]
        })
        .collect();
    table::print(&["effect", "single", "search", "unit", "remains", "bias", "further"], &rows);
    if chosen.len() > MAX_EFFECTS {
        say!("  … {} more in the JSON", chosen.len() - MAX_EFFECTS);
    }
}

/// A share of a signal in per cent.
fn per_cent(share: f64) -> String {
    if share < 1e-4 { "< 0.01 %".to_string() } else { format!("{} %", three_digits(share * 100.0)) }
}
