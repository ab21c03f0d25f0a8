//! Proposed tests, and the smallest ranges of sweeps.

use abbe::identify::problem::Problem;
use abbe::identify::results::Interval;
use abbe::model::words::{counted, listed};
use abbe::plan::improve::Improvement;
use abbe::plan::improve::NextTest;
use abbe::plan::range::Shrinkage;

use super::block::{Level, Report, Text};
use super::figure::bars::{NAMED, OTHER, bars};
use super::figure::{Figure, Quantity};
use super::number::{capitalised, quantity, three_digits, unit};
use super::quality::{efficiency, noise};
use super::session;
use super::table::{Cell, Column, Table, cells, numbers};

/// Method of the proposal.
const METHOD: &str = "Each candidate test is rated by the information that it adds to the plan, linearised at the \
    nominal machine. Tests are selected one by one, then improved by exchange: V. V. Fedorov, Theory of Optimal \
    Experiments, Academic Press, 1972; A. C. Atkinson, A. N. Donev and R. D. Tobias, Optimum Experimental Designs, with \
    SAS, Oxford University Press, 2007, ch. 12.";

/// The report of proposed tests and of ranges.
pub fn report(problem: &Problem, found: &NextTest) -> Report {
    let NextTest { improvement, ranges, .. } = found;
    let mut report = Report::new(format!("Next test for {}", problem.session.machine.name));
    report.method = METHOD.to_string();
    let verdict = match improvement {
        Some(found) => verdict(found),
        None => format!("Minimum sweep range of {}.", counted(ranges.len(), "test")),
    };
    let noise = noise(found.noise);
    let bound = improvement.as_ref().and_then(|found| {
        let last = found.steps.last()?;
        Some(efficiency(last.after, found.bound?, "as many of these tests"))
    });
    report.opening("", std::iter::once(verdict).chain(bound).chain([format!("{}.", capitalised(&noise))]));
    if let Some(found) = improvement {
        proposed(&mut report, found);
    }
    report.section("Minimum sweep ranges");
    report.key(self::ranges(ranges));
    session::machine(&mut report, problem);
    report
}

fn verdict(found: &Improvement) -> String {
    let criterion = unit(&found.criterion);
    match found.steps.as_slice() {
        [] => {
            let of = counted(found.candidate_tests, "candidate test");
            let open = found.uncertainties_before.iter().filter(|error| error.u.is_infinite());
            let open: Vec<&str> = open.map(|error| error.id.as_str()).collect();
            match open.as_slice() {
                [] => format!("None of {of} improves the {criterion} {}.", three_digits(found.before)),
                open => format!("None of {of} makes {} identifiable.", listed(open, "or")),
            }
        }
        [.., last] => format!(
            "With {} of {}: {criterion}: {} in place of {}.",
            found.steps.len(),
            counted(found.candidate_tests, "candidate test"),
            three_digits(last.after),
            three_digits(found.before)
        ),
    }
}

/// The proposed tests, one after another, and the plan with each.
fn proposed(report: &mut Report, found: &Improvement) {
    let criterion = unit(&found.criterion);
    report.section("Proposed tests");
    for (number, step) in found.steps.iter().enumerate() {
        let point = |mm: [f64; 3]| format!("({}) mm", mm.map(|x| format!("{x:.1}")).join(", "));
        let set_up = if step.new_setup { " including the set-up" } else { "" };
        let mut rows = vec![
            cells![&criterion, three_digits(step.after)],
            cells!["duration", format!("{:.1} min{set_up}", step.duration_min)],
        ];
        let balls = [("workpiece ball", step.workpiece_ball_mm), ("spindle ball", step.spindle_ball_mm)];
        rows.extend(balls.into_iter().filter_map(|(name, mm)| Some(cells![name, point(mm?)])));
        rows.extend(step.bar_mm.map(|mm| cells!["bar", format!("{mm} mm")]));
        if !step.makes_identifiable.is_empty() {
            rows.push(cells!["makes identifiable", step.makes_identifiable.join(", ")]);
        }
        report.headed(Level::Key, format!("{}. {}", number + 1, step.test), Table::new(["", ""], rows));
    }
    report.page(Text::Heading("Plan with each proposed test".to_string()));
    report.figures([figure(found, &criterion)]);
    report.section("Uncertainty of each error");
    report.key(uncertainties(found));
    let exchanged = found.exchanged.iter().map(|exchange| format!("replaced by a further search: {exchange}"));
    report.key(Text::List(exchanged.collect()));
    report.section("Alternatives");
    report.key(alternatives(found));
}

/// The figure of merit of the plan, and with each proposed test.
fn figure(found: &Improvement, criterion: &str) -> Figure {
    let mut rows = vec![("as planned".to_string(), found.before, OTHER)];
    rows.extend(found.steps.iter().enumerate().map(|(k, step)| (format!("with {}", k + 1), step.after, NAMED)));
    // An error that is not identifiable has no uncertainty.
    rows.retain(|row| row.1.is_finite());
    Figure::new(
        "next-test",
        "Plan with each proposed test",
        format!("{}. The tests are added one after another.", capitalised(criterion)),
        bars(&Quantity::new(criterion, ""), &rows, &[]),
    )
}

/// The predicted standard uncertainty of each error with the plan and with each proposed test.
fn uncertainties(found: &Improvement) -> Table {
    let rows = found.uncertainties_before.iter().enumerate().map(|(k, before)| {
        let with = found.steps.iter().map(|step| Cell::from(three_digits(step.uncertainties[k].u)));
        cells![&before.id, three_digits(before.u)].into_iter().chain(with).collect()
    });
    let with = (1..=found.steps.len()).map(|number| numbers(format!("with test {number}")));
    let columns = ["error", ">plan"].map(Column::from).into_iter().chain(with);
    Table::new(columns, rows).titled("Predicted standard uncertainty u, µm or ″ (∞: not identifiable)")
}

/// The best single tests.
fn alternatives(found: &Improvement) -> Table {
    let rows = found
        .alternatives
        .iter()
        .map(|other| cells![three_digits(other.after), Cell::fixed(other.duration_min, 1), &other.test]);
    let columns = [">figure of merit", ">duration, min", "test"];
    Table::new(columns, rows).titled("Best single tests")
}

/// The smallest range of each sweep.
fn ranges(ranges: &[Shrinkage]) -> Table {
    let rows = ranges.iter().map(|range| {
        let span = |Interval { low, high }: Interval| quantity(&format!("{low:.0} to {high:.0}"), &range.unit);
        cells![
            &range.test,
            &range.axis,
            span(range.range),
            range.minimum_range.map_or("can be omitted".into(), span),
            range.first_to_double.clone().unwrap_or("–".into()),
        ]
    });
    let columns = ["test", "axis", ">planned", ">smallest", "doubles first"];
    Table::new(columns, rows).titled("Smallest range of each sweep about its middle before an uncertainty doubles")
}
