//! Report of `abbe plan --improve`, `--separate` and `--range`.

use abbe::identify::plan::improve::Improvement;
use abbe::identify::plan::range::Shrinkage;
use abbe::identify::problem::Problem;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::Document;
use super::readings;
use crate::printers::html::{capitalised, list, table};
use crate::report::figure::bars::{Bars, Fill};
use crate::report::figure::{Chart, Figure, Quantity};
use crate::report::next_test as present;
use crate::report::number::{three_digits, unit};

/// Method of the proposal.
const METHOD: &str = "Each candidate test is rated by the information that it adds to the plan, linearised at the \
    nominal machine. Tests are selected one by one, then improved by exchange: V. V. Fedorov, Theory of Optimal \
    Experiments, Academic Press, 1972; A. C. Atkinson, A. N. Donev and R. D. Tobias, Optimum Experimental Designs, with \
    SAS, Oxford University Press, 2007, ch. 12.";

/// The report.
pub fn document(problem: &Problem, improvement: Option<&Improvement>, ranges: &[Shrinkage]) -> Document {
    let mut document = Document {
        title: format!("Next test for {}", problem.session.machine.name),
        verdict: match improvement {
            Some(found) => verdict(found),
            None => format!("Minimum sweep range of {}.", counted(ranges.len(), "test")),
        },
        method: METHOD.to_string(),
        ..Document::default()
    };
    if let Some(found) = improvement {
        let section = proposed(&mut document, found);
        document.section("Proposed tests", section);
        document.section("Uncertainty of each error", table(&present::uncertainties(found)));
    }
    if !ranges.is_empty() {
        document.section("Minimum sweep ranges", table(&present::ranges(ranges)));
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
            three_digits(found.before)
        ),
        [.., last] => format!(
            "{} the {} from {} to {}.",
            match found.steps.len() {
                1 => format!("1 of {} candidate tests reduces", found.candidate_tests),
                many => format!("{many} of {} candidate tests reduce", found.candidate_tests),
            },
            name_of(&found.criterion),
            three_digits(found.before),
            three_digits(last.after)
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
    let criterion = unit(&found.criterion);
    let shown = document.show([Figure::new(
        "next-test",
        "Plan with each proposed test",
        format!("{}. The tests are added one after another.", capitalised(&criterion)),
        Chart::Bars(Bars { quantity: Quantity::new(criterion, ""), rows: bar_rows, labels: Vec::new() }),
    )]);
    html! {
        @if !found.steps.is_empty() { (table(&present::proposed(found))) }
        (shown)
        @if !found.alternatives.is_empty() { (table(&present::alternatives(found))) }
        @if !found.exchanged.is_empty() {
            h3 { "Exchanges" }
            (list(found.exchanged.iter().cloned()))
        }
    }
}
