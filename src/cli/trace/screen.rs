//! The first screen of `abbe trace`: verdict and uniqueness, the residual before and after, the effects with their
//! aliases, the next measurement.

use abbe::identify::results::{AliasResult, EffectResult, Statements, TraceResult};
use abbe::identify::trace::TraceOutcome;
use abbe::model::words::counted;

use crate::cli::screen::{self, Step, command};
use crate::cli::{SessionArguments, output};
use crate::report::effect::name;
use crate::report::number::{micrometres, p_value, quantity, shape_number, value_and_u};
use crate::report::parameters::Estimates;
use crate::report::{trace as present, uniqueness};

/// Prints the result of a trace of a session. With `all`, no list is folded.
pub fn print(trace: &TraceOutcome, session: &SessionArguments, all: bool) {
    let result = &trace.result;
    let statements = Statements::of_trace(&trace.after, result);
    verdict(result);
    screen::print_statements("Goodness of fit", &statements, result.after.degrees_of_freedom, session);
    readings(result);
    screen::print_conflicts(&result.plausibility);
    say!("Residual of the declared model: {}", result.residual_before);
    say!("");
    output::print(&present::before_and_after(result));
    for (number, effect) in result.effects.iter().enumerate() {
        print_effect(number + 1, effect, result.candidates_detectable, all);
    }
    remaining(result, all);
    let with_its_effect = |id: &str| {
        let mut parameters = result.effects.iter().flat_map(|effect| &effect.parameters);
        parameters.any(|p| p.id == id)
    };
    let mut estimates = Estimates::new(&trace.after, &trace.after_fit, &result.after.parameters);
    estimates.errors.retain(|parameter| !with_its_effect(&parameter.id));
    screen::print_estimates(&estimates, result.outcome.goodness, all);
    if result.after.parameters.iter().any(|parameter| !parameter.enlarged_by.is_empty()) {
        say!("  u covers the change of the parameter if an alias takes the place of an effect");
    }
    screen::print_corrections(&statements, all);
    changes(result, all);
    screen::print_conformity(result.conformity.as_ref());
    screen::print_missing(&result.unobservable, &result.outcome.determined_by_prior, &result.outliers, all);
    measure_next(result);
    screen::print_next(&next(result, session));
}

/// The verdict and the number of effects, then their uniqueness.
fn verdict(result: &TraceResult) {
    say!("Verdict: {}, {}", result.verdict, counted(result.effects.len(), "effect"));
    if let Some(headline) = uniqueness::headline(result) {
        say!("{headline}");
    }
}

/// Readings, noise and candidates.
fn readings(result: &TraceResult) {
    say!(
        "{}, {}; {} of {} detectable",
        counted(result.readings, "reading"),
        present::noise(result),
        result.candidates_detectable,
        counted(result.candidates, "candidate")
    );
}

fn print_effect(number: usize, effect: &EffectResult, screened: usize, all: bool) {
    say!("\n{number}. {}  ({})", name(&effect.name), effect.family);
    say!("   {}", effect.name.meaning);
    for number in &effect.shape_parameters {
        say!("   {}", shape_number(number));
    }
    for p in &effect.parameters {
        let (value, u) = value_and_u(p.value, p.u);
        say!("   {}  {}", p.id, quantity(&format!("{value} ± {u}"), &p.unit));
    }
    if let Some(prior) = &effect.prior {
        say!("   {}", present::prior(prior));
    }
    say!("   explains {} rms; {}", micrometres(effect.rms_gain_um), p_value(effect.p_value));
    say!("   {}", uniqueness::standing(effect, screened));
    let aliases = effect.aliases.iter();
    let line = |(place, alias): (usize, &AliasResult)| {
        let predicted = uniqueness::worse_prediction(effect, place);
        format!(
            "or {}  ({}); {}{}",
            alias.name.meaning,
            name(&alias.name),
            uniqueness::likelihood(alias),
            predicted.map_or(String::new(), |words| format!("; {words}"))
        )
    };
    let aliases: Vec<String> = aliases.enumerate().map(line).collect();
    screen::list(&aliases, "     ", all);
}

/// Rejected candidates and remaining structure.
fn remaining(result: &TraceResult, all: bool) {
    let rejected = present::rejected(result);
    if !rejected.is_empty() {
        say!("\nRejected, because the held-out error does not decrease significantly:");
        screen::list(&rejected, "  ", all);
    }
    if let Some(remainder) = present::remainder(result) {
        say!("\nRemaining structure {remainder}");
    }
}

/// Parameters that changed by more than their uncertainty when the effects were added.
fn changes(result: &TraceResult, all: bool) {
    let lines: Vec<String> = present::changes(result).into_iter().map(|(_, sentence)| sentence).collect();
    if lines.is_empty() {
        return;
    }
    say!("\nChanged by more than their standard uncertainty when the effects were added (bias of the declared model):");
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
    say!("\nTests that separate an effect from its aliases:");
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
