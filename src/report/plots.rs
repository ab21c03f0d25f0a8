//! What of a session is drawn: the rows that stay when points are thinned, and the plots of its readings.

use abbe::identify::problem::Problem;
use abbe::identify::series::{SessionSeries, TestSeries, is_round, lengths};
use abbe::model::axis::AxisKind;
use maud::html;
use serde_json::json;

use super::decimate;
use super::plot::lines::{ACROSS, Lines, Mark, Series, UP, span};
use super::plot::polar::{DIVISIONS, Round, Trace, division_um};
use super::plot::scale::Scale;
use super::plot::{Plot, polar};

/// Strips of a trace in which the least and the greatest reading are kept.
const TRACE_STRIPS: usize = 360;
/// Strips of an axis of poses.
const POSE_STRIPS: usize = 150;
/// Poses that are drawn however ordinary they are, so that the bulk is seen beside the extremes.
const POSE_SAMPLE: usize = 500;
/// Tests that are drawn one by one; what a session has beyond is in its data.
pub const MAX_TESTS: usize = 12;

/// A column of the readings.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// Observed less nominal.
    Deviation,
    /// What the model before leaves.
    Before,
    /// What the model after leaves.
    After,
}

impl Column {
    /// Its name in the page's data.
    pub fn word(self) -> &'static str {
        match self {
            Column::Deviation => "deviation",
            Column::Before => "before",
            Column::After => "after",
        }
    }

    /// Its scalars.
    pub fn of(self, test: &TestSeries) -> &[f64] {
        match self {
            Column::Deviation => &test.deviation_um,
            Column::Before => &test.before_um,
            Column::After => &test.after_um,
        }
    }
}

/// A session as it is drawn.
pub struct Drawn<'d> {
    /// The problem.
    pub problem: &'d Problem<'d>,
    /// Its readings.
    pub views: &'d SessionSeries,
    /// Rows that are drawn, by test and stretch.
    pub rows: Vec<Vec<Vec<usize>>>,
}

impl<'d> Drawn<'d> {
    /// Thins the readings of a session.
    pub fn new(problem: &'d Problem<'d>, views: &'d SessionSeries) -> Drawn<'d> {
        let rows = views
            .tests
            .iter()
            .enumerate()
            .map(|(number, test)| {
                let columns = [Column::Deviation, Column::Before, Column::After]
                    .map(|column| lengths(column.of(test), views.coordinates));
                test.stretches
                    .iter()
                    .map(|stretch| {
                        let part = |values: &[f64]| values[stretch.rows.clone()].to_vec();
                        let columns = columns.each_ref().map(|c| part(c));
                        let columns = columns.each_ref().map(|c| c.as_slice());
                        let mut kept: Vec<usize> = if stretch.forward.is_some() {
                            decimate::kept(&part(&test.way.values), &columns, TRACE_STRIPS)
                        } else {
                            axes_of(problem, test, number)
                                .iter()
                                .flat_map(|(_, values)| decimate::kept(&part(values), &columns, POSE_STRIPS))
                                .chain(
                                    (0..stretch.rows.len())
                                        .step_by(stretch.rows.len().div_ceil(POSE_SAMPLE).max(1)),
                                )
                                .collect()
                        };
                        kept.sort_unstable();
                        kept.dedup();
                        kept.into_iter().map(|row| row + stretch.rows.start).collect()
                    })
                    .collect()
            })
            .collect();
        Drawn { problem, views, rows }
    }

    /// Whether the readings are lengths about a circle.
    pub fn is_round(&self) -> bool {
        is_round(self.problem.session.instrument)
    }

    /// The tests that are drawn one by one.
    pub fn tests(&self) -> impl Iterator<Item = (usize, &TestSeries)> {
        self.views.tests.iter().enumerate().take(MAX_TESTS)
    }

    /// Points of a stretch: abscissa and value.
    fn points(&self, test: usize, stretch: usize, abscissa: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
        let rows = &self.rows[test][stretch];
        rows.iter().map(|row| (abscissa[*row], values[*row])).collect()
    }

    /// The trace of a test about the nominal circle, with this round number of µm per division.
    fn circle(&self, number: usize, column: Column, name: &str, title: String, um: Option<f64>) -> Plot {
        let test = &self.views.tests[number];
        let values = column.of(test);
        let traces: Vec<Trace<'_>> = test
            .stretches
            .iter()
            .enumerate()
            .map(|(k, stretch)| Trace {
                class: class_of(stretch.forward),
                number: Some(k),
                points: self.points(number, k, &test.way.values, values),
            })
            .collect();
        let um = um.unwrap_or_else(|| division_um(traces.iter().flat_map(|trace| &trace.points)));
        let caption = "Magnified; the heavy circle is zero.".to_string();
        let mut plot = polar::plot(
            format!("{name}-{}", test.name),
            title,
            caption,
            &test.way.name,
            &traces,
            um,
        );
        let round = Round::FULL;
        plot.live = json!({
            "kind": "polar", "test": number, "column": column.word(), "x0": round.side / 2.0, "y0": round.side / 2.0,
            "r": round.nominal(), "px": round.division(), "um": um, "along": "x",
        })
        .to_string();
        plot
    }

    /// The trace of a test, if it goes along an angle.
    pub fn trace(&self, number: usize) -> Option<Plot> {
        let test = &self.views.tests[number];
        let title = format!("{}: deviation from nominal about the circle", test.name);
        (self.is_round() && test.way.is_angle)
            .then(|| self.circle(number, Column::Deviation, "trace", title, None))
    }

    /// What is left of a test before and after, at one magnification.
    pub fn residual_circles(&self, number: usize, words: [&str; 2]) -> Option<[Plot; 2]> {
        let test = &self.views.tests[number];
        if !self.is_round() || !test.way.is_angle {
            return None;
        }
        let most = |values: &[f64]| values.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let um = super::plot::scale::round_up(most(&test.before_um).max(most(&test.after_um)) / DIVISIONS);
        Some([Column::Before, Column::After].map(|column| {
            let words = words[usize::from(column == Column::After)];
            let name = format!("residual-{}", column.word());
            self.circle(number, column, &name, format!("{}: {words}", test.name), Some(um))
        }))
    }

    /// The deviation of a test against what it goes along; of poses against each axis.
    pub fn deviations(&self, number: usize) -> Vec<Plot> {
        self.against(number, &[Column::Deviation])
    }

    /// Residuals of a test before and after, likewise.
    pub fn residuals(&self, number: usize) -> Vec<Plot> {
        self.against(number, &[Column::Before, Column::After])
    }

    fn against(&self, number: usize, columns: &[Column]) -> Vec<Plot> {
        let test = &self.views.tests[number];
        let values: Vec<Vec<f64>> = columns
            .iter()
            .map(|c| lengths(c.of(test), self.views.coordinates))
            .collect();
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
        axis: &Axis,
        abscissa: &[f64],
    ) -> Plot {
        let test = &self.views.tests[number];
        let three = self.views.coordinates == 3;
        let [low, high] = span(abscissa.iter().copied());
        let x = Scale::over(low, high, ACROSS, if axis.is_angle { 9 } else { 7 });
        let x = if axis.is_angle { x.in_degrees() } else { x };
        let [least, most] = span(values.iter().flatten().copied());
        let is_deviation = columns == [Column::Deviation];
        let y = if three {
            Scale::rounded(0.0, most, UP, 5)
        } else if is_deviation {
            let um = super::plot::scale::round_up(least.abs().max(most.abs()) / DIVISIONS);
            Scale {
                values: [-DIVISIONS * um, DIVISIONS * um],
                places: UP,
                step: um,
            }
        } else {
            Scale::rounded(least.min(0.0), most.max(0.0), UP, 6)
        };
        let is_pose = test.stretches.iter().any(|stretch| stretch.forward.is_none());
        let mark = if is_pose { Mark::Dots } else { Mark::Line };
        let series = columns
            .iter()
            .zip(values)
            .flat_map(|(column, values)| {
                test.stretches
                    .iter()
                    .enumerate()
                    .map(move |(k, stretch)| (*column, values, k, stretch))
            })
            .map(|(column, values, k, stretch)| Series {
                class: if is_deviation {
                    class_of(stretch.forward)
                } else {
                    column.word()
                },
                live: Some((k, column.word())),
                mark,
                points: self.points(number, k, abscissa, values),
            })
            .collect();
        let forward = test.stretches.iter().any(|s| s.forward == Some(true));
        let backward = test.stretches.iter().any(|s| s.forward == Some(false));
        let legend: Vec<(&str, String)> = match (is_deviation, is_pose) {
            (true, true) => vec![("plain dots", "a pose".to_string())],
            (true, false) => [("forward", forward), ("backward", backward)]
                .into_iter()
                .filter(|(_, there)| *there)
                .map(|(class, _)| (class, class.to_string()))
                .collect(),
            (false, true) => vec![("before dots", "before".into()), ("after dots", "after".into())],
            (false, false) => vec![("before", "before".into()), ("after", "after".into())],
        };
        let what = match (is_deviation, three) {
            (true, true) => "length of the deviation",
            (true, false) => "deviation",
            (false, true) => "length of the residual",
            (false, false) => "residual",
        };
        let key = if is_pose {
            axis.name.clone()
        } else {
            "x".to_string()
        };
        let mut plot = Lines {
            name: format!(
                "{}-{}-over-{}",
                if is_deviation { "deviation" } else { "residual" },
                test.name,
                axis.name
            ),
            title: format!("{}: {what} against {}", test.name, axis.name),
            caption: if is_deviation {
                "Observed less what the nominal machine would read.".to_string()
            } else {
                "Before (red; broken or large) and after (blue).".to_string()
            },
            x: (x, format!("{}, {}", axis.name, axis.unit)),
            y: (y, format!("{what}, µm")),
            series,
            legend,
            over: html! {},
        }
        .plot();
        let (um, px) = if is_deviation && !three {
            (y.step, y.per_unit().abs() * y.step)
        } else {
            (1.0, y.per_unit().abs())
        };
        plot.live = json!({
            "kind": "line", "test": number, "column": columns[0].word(), "along": key, "x0": x.at(0.0), "kx": x.per_unit(),
            "y0": y.at(0.0), "px": px, "um": um, "scaled": is_deviation && !three,
        })
        .to_string();
        plot
    }
}

/// The class of a stretch.
pub fn class_of(forward: Option<bool>) -> &'static str {
    match forward {
        Some(true) => "forward",
        Some(false) => "backward",
        None => "plain",
    }
}

/// What readings are drawn against.
pub struct Axis {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Whether it is an angle.
    pub is_angle: bool,
}

/// What a test's readings are drawn against, with the values: what it goes along, or for poses each axis that moves.
pub fn axes_of(problem: &Problem<'_>, test: &TestSeries, number: usize) -> Vec<(Axis, Vec<f64>)> {
    let along = test.stretches.iter().all(|stretch| stretch.forward.is_some());
    let readings = problem.tests[number].readings.as_ref();
    let (Some(readings), false) = (readings, along || test.way.moving.is_empty()) else {
        let unit = if test.way.is_angle {
            "°"
        } else if test.way.axis.is_some() {
            "mm"
        } else {
            "number"
        };
        let axis = Axis {
            name: test.way.name.clone(),
            unit,
            is_angle: test.way.is_angle,
        };
        return vec![(axis, test.way.values.clone())];
    };
    let of = |axis: &usize| {
        let is_angle = problem.session.machine.axes[*axis].kind == AxisKind::Rotary;
        let outside = if is_angle { 1.0_f64.to_degrees() } else { 1.0 };
        let values = readings.positions[*axis].iter().map(|q| q * outside).collect();
        let axis = Axis {
            name: problem.session.machine.axes[*axis].name.clone(),
            unit: if is_angle { "°" } else { "mm" },
            is_angle,
        };
        (axis, values)
    };
    test.way.moving.iter().map(of).collect()
}
