//! Figures of straightness of ISO 230-1.

use abbe::identify::figure::STRAIGHTNESS;
use abbe::identify::straightness::{StraightnessPosition, StraightnessTest};

use super::block::{Report, Text};
use super::figure::Figure;
use super::figure::lines::{Axis, Lines, Mark, Series};
use super::figure::scale::{Scale, span};
use super::table::{Cell, Table, cells, numbers, words};

/// The section of the figures of every test, if there is one.
pub fn section(report: &mut Report, tests: &[StraightnessTest]) {
    if tests.is_empty() {
        return;
    }
    report.section("Straightness figures");
    let row = |test: &StraightnessTest| {
        let mut cells = cells![&test.test, &test.axis, &test.channel];
        cells.extend(test.figures.iter().map(|figure| Cell::fixed(figure.value, 2)));
        cells
    };
    let figures = STRAIGHTNESS.iter().map(|definition| numbers(format!("{}, µm", definition.name)));
    let columns = ["test", "axis", "direction"].map(words).into_iter().chain(figures);
    report.key(Table::new(columns, tests.iter().map(row)).titled("Straightness error (ISO 230-1)"));
    report.figures(tests.iter().map(plot));
    report.page(Text::Note(
        "The straightness error is the range of the mean deviations about a line: that of least squares, or that through the \
         first and the last position. The figures describe the readings without any correction by the fit."
            .to_string(),
    ));
}

/// The deviations from both lines over the positions.
fn plot(test: &StraightnessTest) -> Figure {
    let points = |of: fn(&StraightnessPosition) -> f64| -> Vec<(f64, f64)> {
        test.positions.iter().map(|position| (position.at_mm, of(position))).collect()
    };
    let series = vec![
        Series::new("least squares", "forward", Mark::Line, points(|position| position.least_squares_um)),
        Series::new("end points", "backward", Mark::Line, points(|position| position.end_points_um)),
    ];
    let x = Scale::of_axis(span(test.positions.iter().map(|position| position.at_mm)), false);
    let y = Scale::with_zero(span(series.iter().flat_map(|series| series.points.iter().map(|point| point.1))), 6);
    let lines = Lines::new(Axis::new(&test.axis, "mm", x), Axis::new("deviation", "um", y), series);
    Figure::new(
        format!("straightness-{}-{}", test.test, test.channel),
        format!("{}: {} straightness of {}", test.test, test.channel, test.axis),
        "Means of the readings less the line of least squares, and less the line through the end points.",
        lines,
    )
}
