//! The first screen of `abbe fit`: whether the result is good, what was found, what is missing or confounded, what to
//! do next.

use abbe::identify::fit::Fit;
use abbe::identify::plan::candidate_tests;
use abbe::identify::problem::Problem;
use abbe::identify::results::{FitMonteCarlo, FitResult, Verdict};
use abbe::model::words::counted;

use crate::cli::screen::{self, Estimates, Step, command};
use crate::cli::{SessionArguments, circular, plausibility, table};

/// χ²/ν below which the noise is said to be overstated.
const MIN_RATIO: f64 = 0.5;

/// Prints the result of a fit of a session. With `all`, no list is folded.
pub fn print(problem: &Problem, fit: &Fit, result: &FitResult, session: &SessionArguments, all: bool) {
    plausibility::print(&result.plausibility);
    quality(result);
    let estimates = Estimates::new(problem, fit, &result.parameters, |_| false);
    match &result.monte_carlo {
        Some(drawn) => print_drawn(drawn, &estimates, all),
        None => estimates.print(all),
    }
    circular::print(&result.circular, all);
    screen::print_missing(&result.unobservable, &result.outliers, all);
    screen::print_next(&next(problem, result, session));
}

/// Goodness of fit, held-out error and rank.
fn quality(result: &FitResult) {
    let ratio = result.chi_square / result.degrees_of_freedom.max(1) as f64;
    let figures = format!("χ²/ν = {ratio:.2}, ν = {}", result.degrees_of_freedom);
    let verdict = if result.noise_source == "residual" {
        "no statement: no noise is stated and no reading repeats, so the residual is taken for noise".to_string()
    } else if result.u_enlargement > 1.0 {
        format!("the residual exceeds the noise ({figures}): the model lacks an effect")
    } else if ratio < MIN_RATIO {
        format!("the residual is smaller than the noise ({figures}): the noise is overstated")
    } else {
        format!("the residual agrees with the noise ({figures})")
    };
    say!("Goodness of fit: {verdict}");
    say!(
        "{}, {}; residual {} rms, held out {} rms (leaving out {})",
        counted(result.readings, "reading"),
        screen::noise(result.noise_um, &result.noise_source),
        table::micrometres(result.rms_um),
        table::micrometres(result.heldout_rms_um),
        result.heldout_by
    );
    if let (Some(rms), Some(held)) = (result.rms_3d_um, result.heldout_rms_3d_um) {
        say!(
            "length of the 3-vector: residual {} rms, held out {} rms",
            table::micrometres(rms),
            table::micrometres(held)
        );
    }
    say!("{}", screen::rank(result.identifiable.len(), result.parameter_count, result.rank));
}

/// Both propagations side by side, with the quoted interval.
fn print_drawn(drawn: &FitMonteCarlo, estimates: &Estimates<'_>, all: bool) {
    let shown = drawn.parameters.iter().filter(|p| all || !estimates.is_setup(&p.id));
    let rows: Vec<Vec<String>> = shown
        .map(|parameter| {
            let (value, gum_u) = table::value_and_u(parameter.value, parameter.gum_u);
            let (_, u) = table::value_and_u(parameter.value, parameter.u);
            let (quoted, source) = match parameter.verdict {
                Verdict::Agree => (&parameter.gum_interval, "GUM"),
                Verdict::Differ => (&parameter.symmetric_interval, "Monte Carlo"),
                Verdict::Undecided => (&parameter.symmetric_interval, "Monte Carlo (too few runs to compare)"),
            };
            let [low, high] = [quoted.low, quoted.high].map(|end| table::value_and_u(end, parameter.u).0);
            vec![
                parameter.id.clone(),
                value,
                gum_u,
                u,
                format!("{low} to {high}"),
                table::unit(&parameter.unit),
                source.to_string(),
            ]
        })
        .collect();
    let interval = format!("{} %", drawn.coverage_probability * 100.0);
    say!("\nEstimates with standard uncertainty u by GUM and by Monte Carlo, and the quoted coverage interval:");
    table::print(&["parameter", "value", "u GUM", "u MC", &interval, "unit", "quoted"], &rows);
    if !all {
        estimates.print_folded_setup();
    }
    let count = |verdict: Verdict| drawn.parameters.iter().filter(|p| p.verdict == verdict).count();
    say!(
        "Monte Carlo, {}, seed {}: {} of {} agree with the GUM within the tolerance of JCGM 101, 8.1; {} differ",
        counted(drawn.runs, "run"),
        drawn.seed,
        count(Verdict::Agree),
        counted(drawn.parameters.len(), "parameter"),
        count(Verdict::Differ)
    );
}

/// What to do next.
fn next(problem: &Problem, result: &FitResult, session: &SessionArguments) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    if !result.plausibility.conflicts.is_empty() {
        steps.push(("correct the session".into(), "the readings contradict it".into()));
    }
    if result.u_enlargement > 1.0 || result.noise_source == "residual" {
        let purpose = "find the unmodelled effect behind the residual";
        steps.push((command("trace", session, ""), purpose.into()));
    }
    if result.noise_source == "residual" {
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
