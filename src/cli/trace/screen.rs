//! The first screen of `abbe trace`: verdict and uniqueness, the residual before and after, the effects with their
//! aliases, the next measurement.

use abbe::identify::results::{EffectResult, ModelResult, TraceResult};
use abbe::identify::trace::TraceOutcome;
use abbe::model::words::counted;

use crate::cli::screen::{self, Estimates, Step, command};
use crate::cli::{SessionArguments, plausibility, table, uniqueness};
use crate::present::effect::name;

/// Prints the result of a trace of a session. With `all`, no list is folded.
pub fn print(trace: &TraceOutcome, session: &SessionArguments, all: bool) {
    let result = &trace.result;
    verdict(result);
    plausibility::print(&result.plausibility);
    before_and_after(result);
    for (number, effect) in result.effects.iter().enumerate() {
        print_effect(number + 1, effect, result.candidates_detectable, all);
    }
    remaining(result, all);
    let with_its_effect = |id: &str| {
        let mut parameters = result.effects.iter().flat_map(|effect| &effect.parameters);
        parameters.any(|p| p.id == id)
    };
    Estimates::new(&trace.after, &trace.after_fit, &result.after.parameters, with_its_effect).print(all);
    if result.effects.iter().any(|effect| !effect.unique) {
        say!("  u covers the change of the parameter if an alias takes the place of an effect");
    }
    changes(result, all);
    screen::print_missing(&result.unobservable, &result.outliers, all);
    measure_next(result);
    screen::print_next(&next(result, session));
}

/// The verdict and the number of effects, then the uniqueness of the effects, then readings, noise and candidates.
fn verdict(result: &TraceResult) {
    say!("Verdict: {}, {}", result.verdict, counted(result.effects.len(), "effect"));
    if let Some(headline) = uniqueness::headline(result) {
        say!("{headline}");
    }
    say!(
        "{}, {}; {} of {} detectable",
        counted(result.readings, "reading"),
        noise(result),
        result.candidates_detectable,
        counted(result.candidates, "candidate")
    );
}

/// The noise and its source in words. A residual is not called noise.
fn noise(result: &TraceResult) -> String {
    if result.noise_source != "residual" || result.effects.is_empty() {
        return screen::noise(result.noise_um, &result.noise_source);
    }
    format!(
        "residual of the declared model {}, with the effects {} (no noise stated, no repeats)",
        table::micrometres(result.before.noise_um),
        table::micrometres(result.after.noise_um)
    )
}

fn before_and_after(result: &TraceResult) {
    say!("Residual of the declared model: {}", result.residual_before);
    say!("");
    // The residual itself is no measure of the noise.
    let judges = result.noise_source != "residual";
    let row = |name: &str, model: &ModelResult| {
        let mut cells = vec![name.to_string(), format!("{:.3}", model.rms_um), format!("{:.3}", model.heldout_rms_um)];
        if let (Some(rms), Some(held)) = (model.rms_3d_um, model.heldout_rms_3d_um) {
            cells.extend([format!("{rms:.1}"), format!("{held:.1}")]);
        }
        if judges {
            let ratio = model.chi_square / model.degrees_of_freedom.max(1) as f64;
            cells.push(format!("{ratio:.2}"));
        }
        cells.push(screen::rank(model.identifiable.len(), model.parameter_count, model.rank));
        cells
    };
    let mut header = vec!["residual, µm", "rms", "held out"];
    if result.before.rms_3d_um.is_some() {
        header.extend(["3-vector", "held out"]);
    }
    if judges {
        header.push("χ²/ν");
    }
    let last = header.len();
    header.push("");
    let rows = [row("before", &result.before), row("after", &result.after)];
    table::print_aligned(&header, &rows, &[0, last]);
    say!("  held out: leaving out {}", result.heldout_by);
}

fn print_effect(number: usize, effect: &EffectResult, screened: usize, all: bool) {
    say!("\n{number}. {}  ({})", name(&effect.name), effect.family);
    say!("   {}", effect.name.meaning);
    for number in &effect.shape_parameters {
        say!("   {}", table::shape_number(number));
    }
    for p in &effect.parameters {
        let (value, u) = table::value_and_u(p.value, p.u);
        say!("   {}  {}", p.id, table::quantity(&format!("{value} ± {u}"), &p.unit));
    }
    say!("   explains {} rms; p ≤ {:.3}", table::micrometres(effect.rms_gain_um), effect.p_value);
    say!("   {}", uniqueness::standing(effect, screened));
    let aliases = effect.aliases.iter();
    let aliases: Vec<String> = aliases.map(|alias| format!("or {}  ({})", alias.meaning, name(alias))).collect();
    screen::list(&aliases, "     ", all);
}

/// Rejected candidates and remaining structure.
fn remaining(result: &TraceResult, all: bool) {
    let rejected = result.rejected_candidates.iter();
    let lines: Vec<String> = rejected
        .map(|candidate| {
            format!(
                "{} (p ≤ {:.3}): the held-out rms decreases by {:.4} µm, with a standard error of {:.4} µm",
                name(&candidate.name),
                candidate.p_value,
                candidate.heldout_decrease_um,
                candidate.u_heldout_decrease_um
            )
        })
        .collect();
    if !lines.is_empty() {
        say!("\nRejected, because the held-out error does not decrease significantly:");
        screen::list(&lines, "  ", all);
    }
    if result.remainder.structured {
        say!(
            "\nRemaining structure (p ≤ {:.3}): {}",
            result.remainder.p_value,
            result.remainder.place.as_deref().unwrap_or("")
        );
    }
}

/// Parameters that changed by more than their uncertainty when the effects were added.
fn changes(result: &TraceResult, all: bool) {
    if result.changed_parameters.is_empty() {
        return;
    }
    say!("\nChanged by more than their standard uncertainty when the effects were added (bias of the declared model):");
    let changed = result.changed_parameters.iter();
    let lines: Vec<String> = changed
        .map(|changed| {
            let (change, u) = table::value_and_u(changed.change, changed.u);
            format!("{}  {} (u {u})", changed.id, table::quantity(&change, &changed.unit))
        })
        .collect();
    screen::list(&lines, "  ", all);
}

/// The tests that separate effects from their aliases.
fn measure_next(result: &TraceResult) {
    let effects = result.effects.iter().enumerate();
    let sentences: Vec<String> = effects
        .flat_map(|(k, effect)| {
            let about = if result.effects.len() > 1 { format!("Effect {}: ", k + 1) } else { String::new() };
            let tests = uniqueness::tests(effect, name).into_iter();
            tests.map(move |sentence| format!("{about}{sentence}"))
        })
        .collect();
    if sentences.is_empty() {
        return;
    }
    say!("\nWhat to measure next:");
    for sentence in sentences {
        say!("  {sentence}");
    }
}

/// What to do next.
fn next(result: &TraceResult, session: &SessionArguments) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    if !result.plausibility.conflicts.is_empty() {
        steps.push(("correct the session".into(), "the readings contradict it".into()));
    }
    if result.interrupted {
        steps.push((command("trace", session, ""), "search to the end".into()));
    } else if !result.effects.is_empty() {
        let purpose = "declare the effects in a session, which `abbe fit next.toml` fits";
        steps.push((command("trace", session, "--write next.toml"), purpose.into()));
    }
    let purpose = "write residuals, plots and alternatives as a page";
    steps.push((command("trace", session, "--report trace.html"), purpose.into()));
    steps
}
