//! Plots of the readings of a session: deviations and residuals of each test against their abscissae, decimated for drawing so
//! that the extremes of every interval are kept.

use abbe::identify::problem::Problem;
use abbe::identify::series::{SessionSeries, TestSeries, is_round, lengths};
use abbe::model::axis::AxisKind;

use crate::report::figure::lines::{Axis, Lines, Live, Mark, Series, Size};
use crate::report::figure::polar::{DIVISIONS, division_um, polar};
use crate::report::figure::scale::{Scale, round_up, span};
use crate::report::figure::{Figure, Quantity};

/// Intervals of a traversal in which the minimum and the maximum are kept.
const TRAVERSAL_INTERVALS: usize = 360;
/// Intervals of an axis for readings at separate poses.
const POSE_INTERVALS: usize = 150;
/// Number of evenly spaced poses that are drawn in addition to the extremes, so that the plot shows the whole
/// distribution.
const POSE_SAMPLE: usize = 500;
/// Maximum number of tests with plots of their own. The data of the page contain all tests.
pub const MAX_TESTS: usize = 12;

/// A test is affected if the RMS change of its residual is at least this multiple of the noise standard deviation.
const MIN_CHANGE: f64 = 0.25;

/// A quantity of each reading.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// Observed minus nominal reading.
    Deviation,
    /// Residual of the first model.
    Before,
    /// Residual of the second model.
    After,
}

impl Column {
    /// Name in the data of the page.
    pub fn name(self) -> &'static str {
        match self {
            Column::Deviation => "deviation",
            Column::Before => "before",
            Column::After => "after",
        }
    }

    /// CSS class of its residual in a traversal.
    fn class(self, backward: bool) -> &'static str {
        match (self, backward) {
            (Column::Before, true) => "before back",
            (Column::After, true) => "after back",
            _ => self.name(),
        }
    }

    /// Its scalar values in a test, µm.
    pub fn of(self, test: &TestSeries) -> &[f64] {
        match self {
            Column::Deviation => &test.deviation_um,
            Column::Before => &test.before_um,
            Column::After => &test.after_um,
        }
    }
}

/// A session prepared for plotting.
pub struct SessionPlots<'d> {
    /// The estimation problem.
    pub problem: &'d Problem,
    /// Deviations, residuals and shares of all readings.
    pub series: &'d SessionSeries,
    /// Drawn rows of each traversal of each test.
    pub rows: Vec<Vec<Vec<usize>>>,
}

impl<'d> SessionPlots<'d> {
    /// Decimates the readings of a session.
    pub fn new(problem: &'d Problem, series: &'d SessionSeries) -> SessionPlots<'d> {
        let rows = series
            .tests
            .iter()
            .enumerate()
            .map(|(number, test)| {
                let columns = [Column::Deviation, Column::Before, Column::After]
                    .map(|column| lengths(column.of(test), test.channels));
                test.stretches
                    .iter()
                    .map(|stretch| {
                        let part = |values: &[f64]| values[stretch.rows.clone()].to_vec();
                        let columns = columns.each_ref().map(|c| part(c));
                        let columns = columns.each_ref().map(|c| c.as_slice());
                        let mut kept: Vec<usize> = if stretch.forward.is_some() {
                            decimated_rows(&part(&test.way.values), &columns, TRAVERSAL_INTERVALS)
                        } else {
                            axes_of(problem, test, number)
                                .iter()
                                .flat_map(|(_, values)| decimated_rows(&part(values), &columns, POSE_INTERVALS))
                                .chain((0..stretch.rows.len()).step_by(stretch.rows.len().div_ceil(POSE_SAMPLE).max(1)))
                                .collect()
                        };
                        kept.sort_unstable();
                        kept.dedup();
                        kept.into_iter().map(|row| row + stretch.rows.start).collect()
                    })
                    .collect()
            })
            .collect();
        SessionPlots { problem, series, rows }
    }

    /// Whether the readings are lengths, which a polar plot shows about a nominal circle.
    pub fn is_polar(&self) -> bool {
        self.problem.models.iter().all(|model| is_round(model.channels()))
    }

    /// RMS of the change of the residual from the first to the second model, µm.
    fn change_um(test: &TestSeries) -> f64 {
        let squares = test.before_um.iter().zip(&test.after_um).map(|(before, after)| (before - after).powi(2));
        (squares.sum::<f64>() / test.after_um.len().max(1) as f64).sqrt()
    }

    /// Whether the second model changes the residual of a test by at least [`MIN_CHANGE`] of the noise. If no test
    /// changes, all count as affected.
    pub fn is_affected(&self, number: usize) -> bool {
        let min_um = MIN_CHANGE * self.problem.noise.sigma_mm * 1e3;
        let changes = |test: &TestSeries| Self::change_um(test) >= min_um;
        changes(&self.series.tests[number]) || !self.series.tests.iter().any(changes)
    }

    /// RMS residual of a test, µm, outliers excluded: before, after.
    pub fn rms_um(&self, number: usize) -> [f64; 2] {
        let test = &self.series.tests[number];
        [&test.before_um, &test.after_um].map(|values| {
            let counted = || values.iter().enumerate().filter(|(i, _)| self.problem.counts(number, *i));
            (counted().map(|(_, v)| v * v).sum::<f64>() / counted().count().max(1) as f64).sqrt()
        })
    }

    /// Tests with plots of their own, with their indices.
    pub fn tests(&self) -> impl Iterator<Item = (usize, &TestSeries)> {
        self.series.tests.iter().enumerate().take(MAX_TESTS)
    }

    /// Drawn points of a traversal: abscissa and value.
    fn points(&self, test: usize, traversal: usize, abscissa: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
        let rows = &self.rows[test][traversal];
        rows.iter().map(|row| (abscissa[*row], values[*row])).collect()
    }

    /// Polar plot of a test. `um` is the scale per division; by default all points lie within the circles.
    fn polar(&self, number: usize, column: Column, name: &str, title: String, um: Option<f64>) -> Figure {
        let test = &self.series.tests[number];
        let values = column.of(test);
        let series = test.stretches.iter().enumerate().map(|(k, stretch)| {
            let class = class_of(stretch.forward);
            let label = if stretch.forward.is_some() { class } else { "readings" };
            let points = self.points(number, k, &test.way.values, values);
            Series { source: Some((k, column.name())), ..Series::new(label, class, Mark::Line, points) }
        });
        let series: Vec<Series> = series.collect();
        let drawn_um = series.iter().flat_map(|series| &series.points).map(|(_, um)| *um);
        let quantity = if column == Column::Deviation { "deviation" } else { "residual" };
        let (angle, read) = (Quantity::new(&test.way.name, "deg"), Quantity::new(quantity, self.series.unit.name()));
        let um = um.unwrap_or_else(|| division_um(drawn_um));
        let chart = polar([&angle, &read], um, &series, (number, column.name()));
        Figure::new(format!("{name}-{}", test.name), title, "Magnified about the nominal circle.", chart)
    }

    /// Polar plot of the deviation of a test, if its abscissa is an angle.
    pub fn polar_deviation(&self, number: usize) -> Option<Figure> {
        let test = &self.series.tests[number];
        let title = format!("{}: deviation from nominal", test.name);
        (self.is_polar() && test.way.is_angle).then(|| self.polar(number, Column::Deviation, "trace", title, None))
    }

    /// Whether the second model changes any residual. Otherwise the plots show one residual.
    pub fn has_change(&self) -> bool {
        self.series.tests.iter().any(|test| Self::change_um(test) > 0.0)
    }

    /// The residuals that the plots show.
    fn residual_columns(&self) -> &'static [Column] {
        if self.has_change() { &[Column::Before, Column::After] } else { &[Column::After] }
    }

    /// Polar plots of the residuals of a test, at one magnification.
    pub fn polar_residuals(&self, number: usize, models: [&str; 2]) -> Option<Vec<Figure>> {
        let test = &self.series.tests[number];
        if !self.is_polar() || !test.way.is_angle {
            return None;
        }
        let um = division_um(test.before_um.iter().chain(&test.after_um).copied());
        let plot = |column: &Column| {
            let model = models[usize::from(*column == Column::After)];
            let name = format!("residual-{}", column.name());
            self.polar(number, *column, &name, format!("{}: residual, {model}", test.name), Some(um))
        };
        Some(self.residual_columns().iter().map(plot).collect())
    }

    /// Deviation of a test against its abscissa. For separate poses: against each axis.
    pub fn deviations(&self, number: usize) -> Vec<Figure> {
        self.against(number, &[Column::Deviation])
    }

    /// Residuals of a test before and after, against the same abscissae.
    pub fn residuals(&self, number: usize) -> Vec<Figure> {
        self.against(number, self.residual_columns())
    }

    fn against(&self, number: usize, columns: &[Column]) -> Vec<Figure> {
        let test = &self.series.tests[number];
        let values: Vec<Vec<f64>> = columns.iter().map(|c| lengths(c.of(test), test.channels)).collect();
        axes_of(self.problem, test, number)
            .into_iter()
            .map(|(axis, abscissa)| self.against_axis(number, columns, &values, &axis, &abscissa))
            .collect()
    }

    fn against_axis(
        &self,
        number: usize,
        columns: &[Column],
        values: &[Vec<f64>],
        axis: &PlotAxis,
        abscissa: &[f64],
    ) -> Figure {
        let test = &self.series.tests[number];
        let several = test.channels > 1;
        let range = span(values.iter().flatten().copied());
        let is_deviation = columns == [Column::Deviation];
        let y = if several {
            Scale::rounded([0.0, range[1]], 5)
        } else if is_deviation {
            let um = round_up(range[0].abs().max(range[1].abs()) / DIVISIONS);
            Scale { values: [-DIVISIONS * um, DIVISIONS * um], step: um, words: None }
        } else {
            Scale::with_zero(range, 6)
        };
        let is_pose = test.stretches.iter().any(|stretch| stretch.forward.is_none());
        let mark = if is_pose { Mark::Dots } else { Mark::Line };
        let directions = [Some(true), Some(false)];
        let both_ways = directions.iter().all(|way| test.stretches.iter().any(|stretch| stretch.forward == *way));
        let series = columns.iter().zip(values).flat_map(|(column, values)| {
            test.stretches.iter().enumerate().map(move |(k, stretch)| {
                let backward = both_ways && stretch.forward == Some(false);
                let class = if is_deviation { class_of(stretch.forward) } else { column.class(backward) };
                let label = match (is_deviation, columns) {
                    (true, _) if is_pose => "pose".to_string(),
                    (true, _) => class.to_string(),
                    (false, [_]) if backward => "backward".to_string(),
                    (false, [_]) => String::new(),
                    (false, _) if backward => format!("{}, backward", column.name()),
                    (false, _) => column.name().to_string(),
                };
                let points = self.points(number, k, abscissa, values);
                Series { source: Some((k, column.name())), ..Series::new(label, class, mark, points) }
            })
        });
        let quantity = match (is_deviation, several) {
            (true, true) => "length of the deviation",
            (true, false) => "deviation",
            (false, true) => "length of the residual",
            (false, false) => "residual",
        };
        let lines = Lines {
            x: Axis::new(&axis.name, axis.unit, Scale::of_axis(span(abscissa.iter().copied()), axis.is_angle)),
            y: Axis::new(quantity, self.series.unit.name(), y),
            series: series.collect(),
            size: Size::WIDE,
            live: Some(Live {
                test: number,
                column: columns[0].name(),
                abscissa: if is_pose { axis.name.clone() } else { "x".to_string() },
                scaled: is_deviation && !several,
            }),
        };
        let caption = match (is_deviation, columns) {
            (true, _) => "Observed minus nominal reading.",
            (false, [_]) => "",
            (false, _) => "Before: orange, dashed or large. After: blue.",
        };
        Figure::new(
            format!("{}-{}-over-{}", if is_deviation { "deviation" } else { "residual" }, test.name, axis.name),
            format!("{}: {quantity} against {}", test.name, axis.name),
            caption,
            lines,
        )
    }
}

/// CSS class of a traversal.
pub fn class_of(forward: Option<bool>) -> &'static str {
    match forward {
        Some(true) => "forward",
        Some(false) => "backward",
        None => "plain",
    }
}

/// Abscissa of a plot of readings.
pub struct PlotAxis {
    /// Name.
    pub name: String,
    /// Unit: `deg`, `mm` or `number`.
    pub unit: &'static str,
    /// Whether it is an angle.
    pub is_angle: bool,
}

/// Abscissae of a test with their values: the angle or position of its traversal, or for separate poses each axis that
/// moves.
pub fn axes_of(problem: &Problem, test: &TestSeries, number: usize) -> Vec<(PlotAxis, Vec<f64>)> {
    let is_traversal = test.stretches.iter().all(|stretch| stretch.forward.is_some());
    let readings = problem.tests[number].readings.as_ref();
    let (Some(readings), false) = (readings, is_traversal || test.way.moving.is_empty()) else {
        let unit = if test.way.is_angle {
            "deg"
        } else if test.way.axis.is_some() {
            "mm"
        } else {
            "number"
        };
        let axis = PlotAxis { name: test.way.name.clone(), unit, is_angle: test.way.is_angle };
        return vec![(axis, test.way.values.clone())];
    };
    let of = |axis: &usize| {
        let is_angle = problem.session.machine.axes[*axis].kind == AxisKind::Rotary;
        let display = if is_angle { 1.0_f64.to_degrees() } else { 1.0 };
        let values = readings.positions[*axis].iter().map(|q| q * display).collect();
        let axis = PlotAxis {
            name: problem.session.machine.axes[*axis].name.clone(),
            unit: problem.session.machine.axes[*axis].kind.unit().name(),
            is_angle,
        };
        (axis, values)
    };
    test.way.moving.iter().map(of).collect()
}

/// Returns the rows to draw, in ascending order.
///
/// The range of the abscissa is divided into `intervals` equal intervals. In each interval, the rows with the minimum
/// and the maximum of every series are kept. The first and the last row are kept too.
pub fn decimated_rows(abscissa: &[f64], series: &[&[f64]], intervals: usize) -> Vec<usize> {
    let rows = abscissa.len();
    if rows <= 2 * intervals {
        return (0..rows).collect();
    }
    let low = abscissa.iter().copied().fold(f64::INFINITY, f64::min);
    let high = abscissa.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = ((high - low) / intervals as f64).max(f64::MIN_POSITIVE);
    let mut kept = vec![false; rows];
    for values in series {
        let mut extremes: Vec<Option<(usize, usize)>> = vec![None; intervals];
        for row in 0..rows {
            let interval = (((abscissa[row] - low) / width) as usize).min(intervals - 1);
            let (minimum, maximum) = extremes[interval].unwrap_or((row, row));
            extremes[interval] = Some((
                if values[row] < values[minimum] { row } else { minimum },
                if values[row] > values[maximum] { row } else { maximum },
            ));
        }
        for (minimum, maximum) in extremes.into_iter().flatten() {
            kept[minimum] = true;
            kept[maximum] = true;
        }
    }
    kept[0] = true;
    kept[rows - 1] = true;
    (0..rows).filter(|row| kept[*row]).collect()
}

/// Returns centre, minimum and maximum of each of `intervals` equal intervals of the abscissa. Empty intervals are
/// omitted.
pub fn interval_extremes(abscissa: &[f64], values: &[f64], intervals: usize) -> Vec<(f64, f64, f64)> {
    let low = abscissa.iter().copied().fold(f64::INFINITY, f64::min);
    let high = abscissa.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = ((high - low) / intervals as f64).max(f64::MIN_POSITIVE);
    let mut extremes: Vec<Option<(f64, f64)>> = vec![None; intervals];
    for (position, value) in abscissa.iter().zip(values) {
        let extreme = &mut extremes[(((position - low) / width) as usize).min(intervals - 1)];
        let (minimum, maximum) = extreme.unwrap_or((*value, *value));
        *extreme = Some((minimum.min(*value), maximum.max(*value)));
    }
    let centre = |k: usize| low + (k as f64 + 0.5) * width;
    let interval =
        |(k, pair): (usize, Option<(f64, f64)>)| pair.map(|(minimum, maximum)| (centre(k), minimum, maximum));
    extremes.into_iter().enumerate().filter_map(interval).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_peak_among_many_readings_is_kept() {
        let abscissa: Vec<f64> = (0..10_000).map(f64::from).collect();
        let mut values = vec![0.0; 10_000];
        values[4321] = 7.0;
        values[4322] = -9.0;
        let kept = decimated_rows(&abscissa, &[&values], 300);
        assert!(kept.len() <= 602);
        assert!(kept.contains(&4321) && kept.contains(&4322));
        assert!(kept.is_sorted() && kept.first() == Some(&0) && kept.last() == Some(&9_999));
    }

    #[test]
    fn few_readings_are_all_kept() {
        assert_eq!(decimated_rows(&[1.0, 2.0, 3.0], &[&[0.0; 3]], 300), [0, 1, 2]);
    }
}
