//! The first screen of `abbe plan`: identifiability, predicted uncertainties, what is confounded, what to do next, the
//! verdict.

use abbe::identify::plan::results::{EffectsAnalysis, PlanAnalysis};
use abbe::model::words::counted;

use crate::cli::screen::{self, Step, command};
use crate::cli::{SessionArguments, output};
use crate::report::confounded::{BY_PRIOR, by_prior};
use crate::report::fit::noise;
use crate::report::number::with_symbols;
use crate::report::plan::verdict::verdict;
use crate::report::plan::{self as present, effects};

/// Prints the analysis of a plan. With `all`, no list is folded and the tables of [`details()`] are printed.
pub fn print(analysis: &PlanAnalysis, session: &SessionArguments, improvable: bool, all: bool) {
    header(analysis);
    output::print(&present::uncertainties(&analysis.errors));
    unidentifiable(analysis, all);
    if !analysis.clearances.is_empty() {
        output::print(&present::clearances(&analysis.clearances));
    }
    if all {
        details(analysis);
    } else if let Some(found) = &analysis.effects {
        effects_in_short(found);
    }
    screen::print_next(&next(analysis, session, improvable, all));
    say!("\nVerdict: {}", verdict(analysis).join("\n  "));
}

fn header(analysis: &PlanAnalysis) {
    let identifiable = analysis.errors.iter().filter(|error| error.u.is_some()).count();
    say!(
        "{identifiable} of {} identifiable; numerical rank {} of {} with set-up parameters",
        counted(analysis.errors.len(), "error"),
        analysis.rank,
        analysis.parameter_count
    );
    let moving = analysis.moving_min.map_or(String::new(), |min| format!(", {min:.1} min of movement"));
    say!(
        "{} in {}, {}{moving}, {}",
        counted(analysis.readings, "reading"),
        counted(analysis.tests.len(), "test"),
        counted(analysis.setup_count, "set-up"),
        noise(analysis.noise_um, analysis.noise_source)
    );
}

fn unidentifiable(analysis: &PlanAnalysis, all: bool) {
    let list = |title: &str, lines: Vec<String>| {
        if !lines.is_empty() {
            say!("\n{title}");
            screen::list(&lines, "  ", all);
        }
    };
    let null_space = analysis.unidentifiable.iter();
    list(
        "Confounded: null-space directions, which leave every reading unchanged:",
        null_space.map(|item| with_symbols(&item.why)).collect(),
    );
    list(BY_PRIOR, by_prior(&analysis.determined_by_prior));
    let near = analysis.nearly_collinear.iter();
    list("Nearly collinear:", near.map(|item| with_symbols(&item.why)).collect());
}

/// The tables that the first screen folds.
fn details(analysis: &PlanAnalysis) {
    output::print(&present::sensitivity(&analysis.errors));
    output::print(&present::budgets(&analysis.errors));
    let plots = present::small_plots(analysis);
    if !plots.is_empty() {
        say!("\nSensitivity along the first run of each test, each row to its own scale, zero at half height:");
        plots.iter().for_each(output::print);
    }
    match present::correlation(analysis) {
        Some(table) => output::print(&table),
        None => say!("\nThe correlation matrix of {} errors is in the JSON.", analysis.correlation.ids.len()),
    }
    output::print(&present::indices(&analysis.indices));
    if !analysis.leave_one_out.is_empty() {
        say!("\nContribution of each test:");
        analysis.leave_one_out.iter().for_each(|item| say!("  {}", item.why));
    }
    if let Some(found) = &analysis.effects {
        let counts = effects::counts(found);
        say!(
            "\nUndeclared effects: of {} screened, {} are detectable, {} are confounded and {} change no reading of these tests.",
            found.effects.len(),
            counts.detectable,
            counts.confounded,
            counts.without_signal
        );
        output::print(&effects::detectable(found));
        output::print(&effects::confounded(found));
        output::print(&effects::by_error(found));
    }
}

/// How many undeclared effects the tests detect.
fn effects_in_short(found: &EffectsAnalysis) {
    let counts = effects::counts(found);
    say!(
        "\nUndeclared effects: of {} screened, {} are detectable and {} are confounded with the errors; --all lists them",
        found.effects.len(),
        counts.detectable,
        counts.confounded
    );
}

/// What to do next.
fn next(analysis: &PlanAnalysis, session: &SessionArguments, improvable: bool, all: bool) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    if improvable {
        let purpose = if analysis.unidentifiable.is_empty() {
            "propose the test that most lowers the largest uncertainty"
        } else {
            "propose the test that makes the errors identifiable"
        };
        steps.push((command("plan", session, "--improve"), purpose.into()));
    }
    if !all {
        let purpose = "list sensitivities, budgets, correlations, indices, tests, effects";
        steps.push((command("plan", session, "--all"), purpose.into()));
    }
    steps.push((command("simulate", session, "--out run1"), "simulate readings of these tests".into()));
    steps
}
