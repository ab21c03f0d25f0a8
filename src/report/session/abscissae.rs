//! Abscissae of the plots of readings.

use abbe::identify::problem::Problem;
use abbe::identify::series::TestSeries;
use abbe::model::axis::AxisKind;

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
