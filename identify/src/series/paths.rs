//! The set-up of each test in R: the nominal paths of the instrument's points, and the lines of the rotary axes.
//!
//! `P_w` is the point that the table frame carries, `P_s` the point that the tool frame carries, both by the nominal
//! chain at the states of the first run.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::instrument::Station;
use abbe_model::session::placing;
use abbe_model::session::readings::Readings;

use crate::problem::Problem;

/// Maximum number of points of a path.
const MAX_POINTS: usize = 121;

/// The set-up of one test, in R, mm.
#[derive(Clone, Debug)]
pub struct SetUpPath {
    /// The test.
    pub test: String,
    /// The point that the table frame carries, state by state; empty if the instrument has none.
    pub workpiece_mm: Vec<[f64; 3]>,
    /// The point that the tool frame carries, state by state.
    pub tool_mm: Vec<[f64; 3]>,
    /// The readings at these states.
    pub rows: Vec<usize>,
    /// The rotary axes at the first state: name, a point, direction.
    pub axes: Vec<(String, [f64; 3], [f64; 3])>,
    /// Whether the states follow one another on a path; else they are separate poses.
    pub is_path: bool,
}

/// The set-ups of all tests that have states.
pub fn set_ups(problem: &Problem) -> Vec<SetUpPath> {
    let machine = &problem.session.machine;
    let tests = problem.tests.iter().zip(&problem.models).filter_map(|(test, model)| {
        let readings = test.readings.as_ref()?;
        set_up(machine, &test.name, model.station(), readings)
    });
    tests.collect()
}

/// The set-up of a test at these states; `None` without states.
pub fn set_up(machine: &Machine, test: &str, station: &Station<f64>, readings: &Readings) -> Option<SetUpPath> {
    let run = readings.runs().first().cloned()?;
    let (mut workpiece_mm, mut tool_mm, mut state) = (Vec::new(), Vec::new(), Vec::new());
    let first: Vec<f64> = readings.positions.iter().map(|positions| positions[run.start]).collect();
    let is_path = !readings.run.is_empty();
    let rows: Vec<usize> = run.clone().step_by(run.len().div_ceil(MAX_POINTS)).chain([run.end - 1]).collect();
    for row in &rows {
        readings.state(machine, *row, &mut state);
        workpiece_mm.extend(station.table_point().map(|point| point.nominal_mm(machine, &state)));
        tool_mm.push(station.tool_point().nominal_mm(machine, &state));
    }
    let rotary = (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary);
    let line = |axis: usize| {
        let (point, direction) = placing::axis_line(machine, &first, axis);
        (machine.axes[axis].name.clone(), point, direction)
    };
    Some(SetUpPath { test: test.to_string(), workpiece_mm, tool_mm, rows, axes: rotary.map(line).collect(), is_path })
}
