//! What a plan's analysis looks like on a screen.

use abbe::identify::plan::effects::confounded_by_error;
use abbe::identify::plan::results::{EffectDetectability, EffectsAnalysis, ErrorAnalysis, PlanAnalysis};
use abbe::model::words::counted;

use super::digits::three_digits;
use crate::cli::table;

/// Tests side by side in the table of small plots.
const PLOTS_ABREAST: usize = 4;
/// Width of a small plot.
const PLOT_WIDTH: usize = 18;
/// Contributions listed on the screen; JSON has them all.
const CONTRIBUTIONS: usize = 3;
/// Effects listed on the screen in each table.
const EFFECTS: usize = 16;
/// Hidden effects named beside each error.
const LIMITING_PARAMETERS: usize = 3;

/// Prints everything.
pub fn print(analysis: &PlanAnalysis) {
    header(analysis);
    errors(&analysis.errors);
    budget(&analysis.errors);
    plots(analysis);
    print_unidentifiable(analysis);
    correlation(analysis);
    indices(analysis);
    tests(analysis);
    if let Some(found) = &analysis.effects {
        effects(found);
    }
}

fn header(analysis: &PlanAnalysis) {
    let moving = analysis
        .moving_min
        .map_or(String::new(), |min| format!(", {min:.1} min of movement"));
    say!(
        "{} in {}, {}{moving}, noise {}",
        counted(analysis.readings, "reading"),
        counted(analysis.tests.len(), "test"),
        counted(analysis.setup_count, "set-up"),
        table::micrometres(analysis.noise_um)
    );
    say!(
        "{} of {} parameters identifiable (rank)",
        analysis.rank,
        analysis.parameter_count
    );
}

fn optional(value: Option<f64>) -> String {
    value.map_or("—".to_string(), three_digits)
}

fn errors(errors: &[ErrorAnalysis]) {
    say!(
        "\nPredicted standard uncertainty, what noise and set-up contribute, and what it would be if all other errors were known;\n\
         sensitivity of a reading, µm per unit of the error (largest, rms, the test in which it is largest):"
    );
    let rows: Vec<Vec<String>> = errors
        .iter()
        .map(|error| {
            let part = |noise: bool| {
                let parts = error
                    .budget
                    .iter()
                    .filter(|part| (part.source == "noise") == noise);
                error
                    .u
                    .map(|_| parts.map(|part| part.u.powi(2)).sum::<f64>().sqrt())
            };
            vec![
                error.id.clone(),
                error.u.map_or("not seen".to_string(), three_digits),
                error.unit.clone(),
                optional(part(true)),
                optional(part(false)),
                optional(error.conditional_u),
                three_digits(error.sensitivity.largest),
                three_digits(error.sensitivity.rms),
                if error.sensitivity.largest == 0.0 {
                    "—".into()
                } else {
                    error.sensitivity.largest_in_test.clone()
                },
            ]
        })
        .collect();
    let header = [
        "error",
        "u (k=1)",
        "unit",
        "of noise",
        "of set-up",
        "others known",
        "largest",
        "rms",
        "largest in",
    ];
    table::print(&header, &rows);
}

fn budget(errors: &[ErrorAnalysis]) {
    say!("\nWhere the uncertainty comes from (share of the variance), and with what it is correlated:");
    let width = errors
        .iter()
        .map(|error| error.id.chars().count())
        .max()
        .unwrap_or(0);
    for error in errors.iter().filter(|error| error.u.is_some()) {
        let parts: Vec<String> = error
            .budget
            .iter()
            .take(CONTRIBUTIONS)
            .map(|part| format!("{} {:.0} %", part.source, part.share * 100.0))
            .collect();
        let shared: Vec<String> = error
            .correlated_with
            .iter()
            .take(2)
            .map(|other| format!("{} {:+.2}", other.id, other.correlation))
            .collect();
        let with = if shared.is_empty() {
            String::new()
        } else {
            format!("; with {}", shared.join(", "))
        };
        say!("  {:width$}  {}{with}", error.id, parts.join(", "));
    }
}

fn plots(analysis: &PlanAnalysis) {
    let names: Vec<&str> = analysis.tests.iter().map(|test| test.name.as_str()).collect();
    if analysis.errors.iter().all(|error| error.curves.is_empty()) {
        return;
    }
    say!("\nSensitivity along the first run of each test, each row to its own scale, zero in the middle:");
    for abreast in names.chunks(PLOTS_ABREAST) {
        let mut header = vec!["error"];
        header.extend(abreast);
        let rows: Vec<Vec<String>> = analysis
            .errors
            .iter()
            .map(|error| {
                let values = error.curves.iter().flat_map(|curve| &curve.values);
                let most = values.fold(0.0_f64, |most, value| most.max(value.abs()));
                let mut row = vec![error.id.clone()];
                for name in abreast {
                    let curve = error.curves.iter().find(|curve| curve.test == *name);
                    row.push(curve.map_or("·".into(), |curve| small_plot(&curve.values, most)));
                }
                row
            })
            .collect();
        table::print(&header, &rows);
    }
}

/// A row of eight-step bars, from `−most` to `most`.
pub fn small_plot(values: &[f64], most: f64) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let width = PLOT_WIDTH.min(values.len());
    (0..width)
        .map(|k| {
            let value = values[k * (values.len() - 1) / (width - 1).max(1)];
            let level = if most > 0.0 {
                (value / most + 1.0) / 2.0
            } else {
                0.5
            };
            BARS[((level * 7.0).round() as usize).min(7)]
        })
        .collect()
}

fn print_unidentifiable(analysis: &PlanAnalysis) {
    let list = |title: &str, lines: Vec<&String>| {
        if !lines.is_empty() {
            say!("\n{title}");
            lines.into_iter().for_each(|line| say!("  {line}"));
        }
    };
    list(
        "Blind spots:",
        analysis.unidentifiable.iter().map(|item| &item.why).collect(),
    );
    list(
        "Held by what is known of the set-up, not by readings:",
        analysis
            .determined_by_prior
            .iter()
            .map(|item| &item.why)
            .collect(),
    );
    list(
        "Nearly blind:",
        analysis.nearly_collinear.iter().map(|item| &item.why).collect(),
    );
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
            cells.extend(
                row.iter()
                    .take(i + 1)
                    .map(|value| value.map_or("—".into(), |rho| format!("{rho:+.2}"))),
            );
            cells.resize(ids.len() + 1, String::new());
            cells
        })
        .collect();
    table::print(&header, &rows);
}

fn indices(analysis: &PlanAnalysis) {
    let indices = &analysis.indices;
    say!(
        "\nInformation on {} of {}, set-ups unknown within what is known of them:",
        indices.identifiable_count,
        counted(indices.error_count, "error")
    );
    say!(
        "  condition number {}; O1 {}  O2 {}  O3 {}  O4 {}  O5 {}",
        three_digits(indices.condition_number),
        three_digits(indices.o1),
        three_digits(indices.o2),
        three_digits(indices.o3),
        three_digits(indices.o4),
        three_digits(indices.o5)
    );
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
    say!("\nWhat each test contributes:");
    analysis
        .leave_one_out
        .iter()
        .for_each(|item| say!("  {}", item.why));
}

fn effects(found: &EffectsAnalysis) {
    let by_verdict = |verdict: fn(&str) -> bool| -> Vec<&EffectDetectability> {
        found
            .effects
            .iter()
            .filter(|effect| verdict(&effect.verdict))
            .collect()
    };
    let confounded = by_verdict(|verdict| verdict.starts_with("confounded"));
    let seen = by_verdict(|verdict| verdict == "detectable");
    let none = by_verdict(|verdict| verdict == "no signal").len();
    say!(
        "\nUndeclared effects: of {} looked at, {} would be seen, {} would hide and {none} move no reading of these tests.",
        found.effects.len(),
        seen.len(),
        confounded.len()
    );
    say!(
        "\nSeen: smallest amplitude found with {:.0} % power at {:.0} % significance, of one look and of a search of the whole library of {}\n\
         (Šidák, which is on the safe side); share of the signal that remains in the residual; what it adds to the errors until it is found;\n\
         how many alike, of the same component and driver, are not listed. A power has its amplitude at 100 mm, or at 180°:",
        found.power * 100.0,
        found.significance_level * 100.0,
        found.effects_screened
    );
    effect_table(&seen);
    say!(
        "\nHidden: under 1 % of the signal fraction_left the fit. A clean residual does not exclude these, and they bias:"
    );
    effect_table(&confounded);
    say!("\nWhat may hide in each error, the strongest first:");
    let by_error = confounded_by_error(found);
    let width = by_error.keys().map(|id| id.chars().count()).max().unwrap_or(0);
    for (error, limiting) in &by_error {
        let words: Vec<String> = limiting
            .iter()
            .take(LIMITING_PARAMETERS)
            .map(|(id, per_unit, unit)| format!("{id} {} {unit}", three_digits(*per_unit)))
            .collect();
        let more = match limiting.len().saturating_sub(LIMITING_PARAMETERS) {
            0 => String::new(),
            more => format!(", {more} more"),
        };
        say!("  {error:width$}  {}{more}", words.join(", "));
    }
}

/// What an effect acts on and what it follows: `EZC~C` of `EZC~C:h2`.
fn id_stem(id: &str) -> &str {
    id.split_once(':').map_or(id, |(id_stem, _)| id_stem)
}

/// A table of effects: of those with the same component and driver the one that biases most, the others counted.
fn effect_table(effects: &[&EffectDetectability]) {
    let strongest =
        |effect: &EffectDetectability| effect.biases.first().map_or(0.0, |bias| bias.per_unit.abs());
    let mut sorted: Vec<&EffectDetectability> = effects.to_vec();
    // Equal ones by name: rounding, which differs between processors, has no say.
    let size =
        |effect: &EffectDetectability| three_digits(strongest(effect)).parse().unwrap_or(f64::INFINITY);
    sorted.sort_by(|a, b| f64::total_cmp(&size(b), &size(a)).then_with(|| a.id.cmp(&b.id)));
    let mut chosen: Vec<(&EffectDetectability, usize)> = Vec::new();
    for effect in sorted {
        match chosen
            .iter_mut()
            .find(|(first, _)| id_stem(&first.id) == id_stem(&effect.id))
        {
            Some((_, alike)) => *alike += 1,
            None => chosen.push((effect, 0)),
        }
    }
    let rows: Vec<Vec<String>> = chosen
        .iter()
        .take(EFFECTS)
        .map(|(effect, alike)| {
            let biases: Vec<String> = effect
                .biases
                .iter()
                .take(2)
                .map(|bias| format!("{} {} {}", bias.id, three_digits(bias.per_unit), bias.unit))
                .collect();
            vec![
                effect.id.clone(),
                optional(effect.detectable_amplitude),
                optional(effect.detectable_amplitude_screened),
                effect.unit.clone(),
                fraction_left(effect.residual_share),
                if biases.is_empty() {
                    "none".into()
                } else {
                    biases.join(", ")
                },
                alike.to_string(),
            ]
        })
        .collect();
    table::print(
        &[
            "effect", "one look", "search", "unit", "survives", "biases", "alike",
        ],
        &rows,
    );
    if chosen.len() > EFFECTS {
        say!("  … {} more in the JSON", chosen.len() - EFFECTS);
    }
}

/// A share in per cent.
fn fraction_left(share: f64) -> String {
    if share < 1e-4 {
        "< 0.01 %".to_string()
    } else {
        format!("{} %", three_digits(share * 100.0))
    }
}
