//! The first screen of `abbe fit`: whether the result is good, what was found, what is missing or confounded, what to
//! do next.

use abbe::identify::fit::Fit;
use abbe::identify::plan::candidate_tests;
use abbe::identify::problem::Problem;
use abbe::identify::results::{FitMonteCarlo, FitResult, GoodnessVerdict, Statements};
use abbe::model::words::counted;

use crate::cli::screen::{self, Step, command};
use crate::cli::{SessionArguments, output};
use crate::report::base::{base_parameters, base_statement};
use crate::report::cross_validation;
use crate::report::fit as present;
use crate::report::number::micrometres;
use crate::report::parameters::Estimates;

/// Prints the result of a fit of a session. With `all`, no list is folded.
pub fn print(problem: &Problem, fit: &Fit, result: &FitResult, session: &SessionArguments, all: bool) {
    let statements = Statements::of_fit(problem, result);
    screen::print_conflicts(&result.plausibility);
    screen::print_statements("Goodness of fit", &statements, result.degrees_of_freedom, session);
    quality(result);
    let estimates = Estimates::new(problem, fit, &result.parameters);
    match &result.monte_carlo {
        Some(drawn) => print_drawn(drawn, &estimates, all),
        None => screen::print_estimates(&estimates, result.outcome.goodness, all),
    }
    if let Some(base) = &result.base {
        output::print(&base_parameters(base));
        say!("{}", base_statement(base));
    }
    screen::print_corrections(&statements, all);
    screen::print_circular(&result.circular, all);
    screen::print_conformity(result.conformity.as_ref());
    screen::print_missing(&result.unobservable, &result.outcome.determined_by_prior, &result.outliers, all);
    screen::print_next(&next(problem, result, session));
}

/// Goodness of fit, held-out error and rank.
fn quality(result: &FitResult) {
    say!(
        "{}, {}; residual {} rms, held out {} rms (leaving out {})",
        counted(result.readings, "reading"),
        present::noise(result.noise_um, result.noise_source),
        micrometres(result.rms_um),
        micrometres(result.heldout_rms_um),
        result.heldout_by
    );
    if let (Some(rms), Some(held)) = (result.rms_3d_um, result.heldout_rms_3d_um) {
        say!("length of the 3-vector: residual {} rms, held out {} rms", micrometres(rms), micrometres(held));
    }
    for sentence in cross_validation::sentences(&result.cross_validation, None) {
        say!("{sentence}");
    }
    say!("{}", present::rank(result.identifiable.len(), result.parameter_count, result.rank));
}

/// Both propagations side by side, with the quoted interval.
fn print_drawn(drawn: &FitMonteCarlo, estimates: &Estimates<'_>, all: bool) {
    output::print(&present::propagations(drawn, |id| all || !estimates.is_setup(id)));
    if !all {
        screen::print_folded_setup(estimates);
    }
    say!("{}", present::agreement_of_propagations(drawn));
}

/// What to do next.
fn next(problem: &Problem, result: &FitResult, session: &SessionArguments) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    if !result.plausibility.conflicts.is_empty() {
        steps.push(("correct the session".into(), "the readings contradict it".into()));
    }
    let goodness = result.outcome.goodness.verdict;
    if goodness.forbids_decisions().is_some() {
        let purpose = "find the unmodelled effect behind the residual";
        steps.push((command("trace", session, ""), purpose.into()));
    }
    if goodness == GoodnessVerdict::NotJudged {
        let step = "state `noise_um` or repeat a run";
        steps.push((step.into(), "χ² then judges the model".into()));
    }
    if candidate_tests::has_candidates(problem) {
        let purpose = if result.unobservable.is_empty() {
            "propose the test that most lowers the largest uncertainty"
        } else {
            "propose the test that makes the confounded parameters identifiable"
        };
        steps.push((command("plan", session, "--improve"), purpose.into()));
    }
    let purpose = "write residuals, plots and sliders as a page";
    steps.push((command("fit", session, "--report fit.html"), purpose.into()));
    steps
}
