//! The first screen of `abbe plan`: identifiability, predicted uncertainties, what is confounded, what to do next, the
//! verdict.

use abbe::identify::plan::results::{EffectsAnalysis, ErrorAnalysis, PlanAnalysis};
use abbe::model::words::counted;

use super::details;
use super::digits::three_digits;
use super::verdict::verdict;
use crate::cli::screen::{self, Step, command};
use crate::cli::{SessionArguments, table};

/// Prints the analysis of a plan. With `all`, no list is folded and the tables of [`details`] are printed.
pub fn print(analysis: &PlanAnalysis, session: &SessionArguments, improvable: bool, all: bool) {
    header(analysis);
    errors(&analysis.errors);
    unidentifiable(analysis, all);
    if all {
        details::print(analysis);
    } else if let Some(found) = &analysis.effects {
        effects(found);
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
        "{} in {}, {}{moving}, noise {}",
        counted(analysis.readings, "reading"),
        counted(analysis.tests.len(), "test"),
        counted(analysis.setup_count, "set-up"),
        table::micrometres(analysis.noise_um)
    );
}

fn errors(errors: &[ErrorAnalysis]) {
    say!(
        "\nPredicted standard uncertainty u and expanded uncertainty U = 2u; parts of u from noise and from the set-up;"
    );
    say!("conditional u (all other errors known); the largest contribution to the variance:");
    let optional = |u: Option<f64>| u.map_or("–".to_string(), three_digits);
    let rows: Vec<Vec<String>> = errors
        .iter()
        .map(|error| {
            let part = |noise: bool| {
                let parts = error.budget.iter().filter(|part| (part.source == "noise") == noise);
                let part = parts.map(|part| part.u.powi(2)).sum::<f64>().sqrt();
                error.u.map(|_| part)
            };
            let largest = error.budget.first().filter(|_| error.u.is_some());
            vec![
                error.id.clone(),
                error.u.map_or("not identifiable".to_string(), three_digits),
                optional(error.u.map(|u| 2.0 * u)),
                table::unit(&error.unit),
                optional(part(true)),
                optional(part(false)),
                optional(error.conditional_u),
                largest.map_or(String::new(), |part| format!("{} {:.0} %", part.source, part.share * 100.0)),
            ]
        })
        .collect();
    let header = ["error", "u", "U", "unit", "noise", "set-up", "conditional", "largest contribution"];
    table::print_aligned(&header, &rows, &[0, 3, 7]);
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
        null_space.map(|item| table::with_symbols(&item.why)).collect(),
    );
    let by_setup = analysis.determined_by_prior.iter();
    list(
        "Determined by the set-up priors only, because the readings alone do not separate them:",
        by_setup.map(|item| table::with_symbols(&item.why)).collect(),
    );
    let near = analysis.nearly_collinear.iter();
    list("Nearly collinear:", near.map(|item| table::with_symbols(&item.why)).collect());
}

/// How many undeclared effects the tests detect.
fn effects(found: &EffectsAnalysis) {
    let count = |verdict: fn(&str) -> bool| found.effects.iter().filter(|effect| verdict(&effect.verdict)).count();
    say!(
        "\nUndeclared effects: of {} screened, {} are detectable and {} are confounded with the errors; --all lists them",
        found.effects.len(),
        count(|verdict| verdict == "detectable"),
        count(|verdict| verdict.starts_with("confounded"))
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
