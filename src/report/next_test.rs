//! Report of `abbe plan --improve`, `--separate` and `--range`.

use abbe::identify::plan::improve::{Improvement, ProposedTest};
use abbe::identify::plan::range::Shrinkage;
use abbe::identify::problem::Problem;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::{Document, capitalised, list, table};
use super::format::{typeset, unit};
use super::plot::bars::{Fill, bars};
use super::readings;
use crate::cli::plan::improve::{RANGES, range_rows};

/// Method of the proposal.
pub fn method() -> Markup {
    html! {
        p {
            "Each candidate test is rated by the information that it adds to the plan, linearised at the nominal machine. Tests are selected one by one, \
             then improved by exchange: V. V. Fedorov, Theory of Optimal Experiments, Academic Press, 1972; A. C. Atkinson, A. N. Donev and R. D. Tobias, \
             Optimum Experimental Designs, with SAS, Oxford University Press, 2007, ch. 12."
        }
    }
}

/// The report.
pub fn document(problem: &Problem, improvement: Option<&Improvement>, ranges: &[Shrinkage]) -> Document {
    let mut document = Document {
        title: format!("Next test for {}", problem.session.machine.name),
        verdict: match improvement {
            Some(found) => verdict(found),
            None => format!("Minimum sweep range of {}.", counted(ranges.len(), "test")),
        },
        ..Document::default()
    };
    if let Some(found) = improvement {
        let section = proposed(&mut document, found);
        document.section("Proposed tests", section);
        document.section("Uncertainty of each error", uncertainties(found));
    }
    if !ranges.is_empty() {
        document.section("Minimum sweep ranges", shrinkages(ranges));
    }
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    document
}

fn verdict(found: &Improvement) -> String {
    match found.steps.as_slice() {
        [] => format!(
            "None of {} reduces the {}, {}.",
            counted(found.candidate_tests, "candidate test"),
            name_of(&found.criterion),
            digits(found.before)
        ),
        [.., last] => format!(
            "{} the {} from {} to {}.",
            match found.steps.len() {
                1 => format!("1 of {} candidate tests reduces", found.candidate_tests),
                many => format!("{many} of {} candidate tests reduce", found.candidate_tests),
            },
            name_of(&found.criterion),
            digits(found.before),
            digits(last.after)
        ),
    }
}

/// The figure of merit without its units: they differ between the errors.
fn name_of(figure: &str) -> &str {
    figure.split(',').next().unwrap_or(figure)
}

fn proposed(document: &mut Document, found: &Improvement) -> Markup {
    let mut bar_rows = vec![("as planned".to_string(), found.before, Fill::Other)];
    bar_rows.extend(found.steps.iter().enumerate().map(|(k, step)| {
        let name = format!("with {}", k + 1);
        (name, step.after, Fill::Named)
    }));
    // An error that is not identifiable has no uncertainty.
    bar_rows.retain(|row| row.1.is_finite());
    let shown = document.show([bars(
        "next-test".to_string(),
        "Plan with each proposed test".to_string(),
        format!("{}. The tests are added one after another.", capitalised(&unit(&found.criterion))),
        &unit(&found.criterion),
        &bar_rows,
        &[],
    )]);
    let rows: Vec<Vec<String>> = found.steps.iter().enumerate().map(row).collect();
    let others: Vec<Vec<String>> = found
        .alternatives
        .iter()
        .map(|other| vec![other.test.clone(), digits(other.after), format!("{:.1}", other.duration_min)])
        .collect();
    html! {
        @if !rows.is_empty() {
            (table(
                &["number", "figure of merit", "duration, min", "workpiece ball, mm", "spindle ball, mm", "bar, mm", "makes identifiable", "test"],
                &rows,
            ))
        }
        (shown)
        @if !others.is_empty() {
            h3 { "Best single tests" }
            (table(&["test", "figure of merit", "duration, min"], &others))
        }
        @if !found.exchanged.is_empty() {
            h3 { "Exchanges" }
            (list(found.exchanged.iter().cloned()))
        }
    }
}

fn row((number, step): (usize, &ProposedTest)) -> Vec<String> {
    let point = |mm: [f64; 3]| mm.map(|x| format!("{x:.1}").replace('-', "\u{2212}")).join(", ");
    vec![
        (number + 1).to_string(),
        digits(step.after),
        format!("{:.1}{}", step.duration_min, if step.new_setup { " with set-up" } else { "" }),
        point(step.workpiece_ball_mm),
        point(step.spindle_ball_mm),
        step.bar_mm.to_string(),
        step.makes_identifiable.join(", "),
        step.test.clone(),
    ]
}

fn uncertainties(found: &Improvement) -> Markup {
    let mut header = vec!["error".to_string(), "as planned".to_string()];
    header.extend((1..=found.steps.len()).map(|number| format!("with {number}")));
    let rows: Vec<Vec<String>> = found
        .uncertainties_before
        .iter()
        .enumerate()
        .map(|(k, before)| {
            let with = found.steps.iter().map(|step| digits(step.uncertainties[k].u));
            [before.id.clone(), digits(before.u)].into_iter().chain(with).collect()
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    html! {
        p { "Predicted standard uncertainty (k = 1), µm or ″." }
        (table(&header, &rows))
    }
}

fn shrinkages(ranges: &[Shrinkage]) -> Markup {
    html! {
        p { "The smallest range about the centre of each sweep at which no standard uncertainty doubles." }
        (table(&RANGES, &typeset(range_rows(ranges)).into_iter().map(|row| row.iter().map(|cell| unit(cell)).collect()).collect::<Vec<_>>()))
    }
}

/// Three significant digits. An infinite uncertainty means that the error is not identifiable.
fn digits(value: f64) -> String {
    if !value.is_finite() {
        return "not identifiable".to_string();
    }
    let decimals = (2 - value.abs().max(1e-6).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}
