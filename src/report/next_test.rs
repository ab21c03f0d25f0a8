//! The report of `abbe plan --improve`, `--separate` and `--range`.

use abbe::identify::plan::improve::{Improvement, ProposedTest};
use abbe::identify::plan::range::Shrinkage;
use abbe::identify::problem::Problem;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::{Document, list, table};
use super::plot::bars::{Fill, bars};
use super::readings::{self, typeset};
use crate::cli::plan::improve::{RANGES, range_rows};

/// How tests are proposed.
pub fn method() -> Markup {
    html! {
        p {
            "Tests of a menu are judged by what they add to the information of the plan, linearised at the nominal machine: \
             greedily, then by exchange (Fedorov; Atkinson, \
             Donev & Tobias 2007, ch. 12). Nothing is refitted."
        }
    }
}

/// The report.
pub fn document(problem: &Problem<'_>, improvement: Option<&Improvement>, ranges: &[Shrinkage]) -> Document {
    let mut document = Document {
        title: format!("Next test for {}", problem.session.machine.name),
        verdict: match improvement {
            Some(found) => verdict(found),
            None => format!(
                "How far the sweeps of {} can shrink.",
                counted(ranges.len(), "test")
            ),
        },
        ..Document::default()
    };
    if let Some(found) = improvement {
        let section = proposed(&mut document, found);
        document.section("What to measure next", section);
        document.section("What it does to the errors", uncertainties(found));
    }
    if !ranges.is_empty() {
        document.section("How far each sweep can shrink", shrinkages(ranges));
    }
    let section = readings::machine(&mut document, problem);
    document.section("Machine", section);
    document
}

fn verdict(found: &Improvement) -> String {
    match found.steps.as_slice() {
        [] => format!(
            "None of {} candidate tests improves the {}, {}.",
            counted(found.candidate_tests, "test"),
            found.criterion,
            digits(found.before)
        ),
        [.., last] => format!(
            "{} the {} from {} to {}.",
            match found.steps.len() {
                1 => format!("One test of {} candidate tests takes", found.candidate_tests),
                many => format!("{many} tests of {} candidate tests take", found.candidate_tests),
            },
            found.criterion,
            digits(found.before),
            digits(last.after)
        ),
    }
}

fn proposed(document: &mut Document, found: &Improvement) -> Markup {
    let mut bar_rows = vec![("as planned".to_string(), found.before, Fill::Other)];
    bar_rows.extend(found.steps.iter().enumerate().map(|(k, step)| {
        let name = format!("with {}", k + 1);
        (name, step.after, Fill::Named)
    }));
    // A blind spot has no uncertainty to draw.
    bar_rows.retain(|row| row.1.is_finite());
    let shown = document.show([bars(
        "next-test".to_string(),
        "The plan with each proposed test".to_string(),
        format!(
            "{}; tests are added one after another.",
            sentence(&found.criterion)
        ),
        &found.criterion,
        &bar_rows,
        &[],
    )]);
    let rows: Vec<Vec<String>> = found.steps.iter().enumerate().map(row).collect();
    let others: Vec<Vec<String>> = found
        .alternatives
        .iter()
        .map(|other| {
            vec![
                other.test.clone(),
                digits(other.after),
                format!("{:.1}", other.duration_min),
            ]
        })
        .collect();
    html! {
        (shown)
        @if !rows.is_empty() {
            (table(
                &["", "figure with it", "min", "workpiece ball, mm", "spindle ball, mm", "bar, mm", "opens", "test"],
                &rows,
            ))
        }
        @if !others.is_empty() {
            h3 { "Best by themselves" }
            (table(&["test", "figure", "min"], &others))
        }
        @if !found.exchanged.is_empty() {
            h3 { "Exchanged" }
            (list(found.exchanged.iter().cloned()))
        }
    }
}

fn row((number, step): (usize, &ProposedTest)) -> Vec<String> {
    let point = |mm: [f64; 3]| mm.map(|x| format!("{x:.1}").replace('-', "\u{2212}")).join(", ");
    vec![
        (number + 1).to_string(),
        digits(step.after),
        format!(
            "{:.1}{}",
            step.duration_min,
            if step.new_setup { " with the set-up" } else { "" }
        ),
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
            [before.id.clone(), digits(before.u)]
                .into_iter()
                .chain(with)
                .collect()
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    html! {
        p { "Standard uncertainty (k = 1), µm or arcsec." }
        (table(&header, &rows))
    }
}

fn shrinkages(ranges: &[Shrinkage]) -> Markup {
    html! {
        p { "About its middle, before an uncertainty doubles." }
        (table(&RANGES, &typeset(range_rows(ranges))))
    }
}

/// Three digits, or that there is no number.
fn digits(value: f64) -> String {
    if !value.is_finite() {
        return "not seen".to_string();
    }
    let decimals = (2 - value.abs().max(1e-6).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}

/// With a capital letter.
fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
