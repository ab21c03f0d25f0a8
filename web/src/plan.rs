//! A plan that changes while it is looked at: the change of its readings by errors, its analysis, its equation.

use std::cell::OnceCell;

use abbe::analysis::problem_of;
use abbe::codegen::print::{LATEX, Numbering, Style};
use abbe::codegen::{Equation, Options, Order, SessionTest, Symbols, check};
use abbe::document::{Stated, json as document};
use abbe::equation::EquationParameters;
use abbe::files::template;
use abbe::identify::problem::Problem;
use abbe::identify::series::paths;
use abbe::model::axis::AxisKind;
use abbe::model::chain::{AxisPosition, BodyErrors, Frame, Machine};
use abbe::model::document::schema;
use abbe::model::frames::Point;
use abbe::model::session::Test;
use abbe::plan::design::Goal;
use abbe::plan::improve::{ImproveOptions, improve};
use abbe::plan::variations::TestVariations;
use abbe::plan::{self, PlanOptions};
use serde_json::{Value, json};
use wasm_bindgen::prelude::*;

use crate::failed::Failed;
use crate::folder::{Folder, Read};

/// A plan with its states.
#[wasm_bindgen]
pub struct Plan {
    read: Read,
    problem: Problem,
    /// The readings without errors, mm, by test; computed once.
    nominal: OnceCell<Vec<Vec<f64>>>,
}

/// Without the library of undeclared effects, which takes seconds.
fn options() -> PlanOptions {
    PlanOptions { effects: false, ..PlanOptions::default() }
}

/// The texts of `machine.toml` and `plan.toml` of a structural code, as JSON.
///
/// # Errors
/// If the code is not valid.
#[wasm_bindgen(js_name = filesOfCode)]
pub fn files_of_code(code: &str) -> Result<String, Failed> {
    let [machine, plan] = template::of_code(code, template::Sizes::default())?;
    Ok(json!({ "machine.toml": machine, "plan.toml": plan }).to_string())
}

#[wasm_bindgen]
impl Plan {
    /// Reads the plan of a session, without its data.
    ///
    /// # Errors
    /// If the session cannot be used, or the machine cannot carry out a test.
    pub fn of(folder: &Folder, session: &str) -> Result<Plan, Failed> {
        let read = folder.read(session, false)?;
        let problem = problem_of(&read.session, &options())?;
        Ok(Plan { read, problem, nominal: OnceCell::new() })
    }

    /// Machine, tests, parameters and paths, as JSON.
    pub fn description(&self) -> String {
        let session = &self.problem.session;
        let machine = &session.machine;
        let axes = machine.axes.iter().map(|axis| {
            json!({ "name": axis.name, "unit": axis.kind.unit(), "direction": axis.direction, "origin_mm": axis.origin_mm })
        });
        let paths = paths::set_ups(&self.problem);
        let tests = self.problem.tests.iter().zip(&paths).map(|(test, path)| {
            let bar_mm = test.station.bar().map(|bar| bar.bar);
            let moved = moved_axes(machine, test);
            let readings = test.readings.as_ref().map_or(0, |readings| readings.rows());
            let channels: Vec<&str> = test.station.channels().iter().map(|channel| channel.name).collect();
            let moves: Vec<&str> = moved.iter().map(|axis| machine.axes[*axis].name.as_str()).collect();
            json!({
                "name": test.name,
                "instrument": test.station.kind().word(),
                "bar_mm": bar_mm,
                "table_point_mm": test.station.table_point().map(|point| point.mm),
                "tool_point_mm": test.station.tool_point().mm,
                "moves": moves,
                "coordinates": channels,
                "readings": readings,
                "table_path_mm": path.workpiece_mm,
                "tool_path_mm": path.tool_mm,
                "stops": stops(machine, test, &path.rows),
                "axis_lines": path.axes.iter().map(|(name, point, direction)| json!({
                    "name": name, "point_mm": point, "direction": direction,
                })).collect::<Vec<_>>(),
            })
        });
        let parameters = self.problem.parameters.list.iter().map(
            |parameter| json!({ "id": parameter.id, "unit": parameter.unit.name, "setup": parameter.id.is_setup() }),
        );
        json!({
            "machine": machine.name,
            "chain": machine.code(),
            "axes": axes.collect::<Vec<Value>>(),
            "tests": tests.collect::<Vec<Value>>(),
            "parameters": parameters.collect::<Vec<Value>>(),
            "warnings": self.read.session.warnings,
            "test_keys": schema::keys_of_test(session.instrument),
            "motion_keys": schema::keys_of_motions(),
        })
        .to_string()
    }

    /// The positions of the axis that moves most in a test, deg or mm, reading by reading.
    pub fn abscissae(&self, test: usize) -> Vec<f64> {
        let Some((test, readings)) = self.problem.tests.get(test).and_then(|t| Some((t, t.readings.as_ref()?))) else {
            return Vec::new();
        };
        let machine = &self.problem.session.machine;
        let axis = moved_axes(machine, test).first().copied().unwrap_or(0);
        let kind = machine.axes[axis].kind;
        readings.positions.get(axis).into_iter().flatten().map(|position| kind.to_display(*position)).collect()
    }

    /// The change of every reading by the parameters at these values (in their units): test by test first by all
    /// together, then by each parameter of `alone` by itself. µm.
    pub fn patterns(&self, values: &[f64], alone: &[usize]) -> Vec<f64> {
        let all = self.readings(values);
        let single = |parameter: &usize| {
            let only: Vec<f64> =
                values.iter().enumerate().map(|(j, value)| if j == *parameter { *value } else { 0.0 }).collect();
            self.readings(&only)
        };
        let each: Vec<Vec<Vec<f64>>> = std::iter::once(all).chain(alone.iter().map(single)).collect();
        let nominal = self.nominal.get_or_init(|| self.readings(&[]));
        let mut changes = Vec::new();
        for (test, nominal) in nominal.iter().enumerate() {
            for readings in &each {
                changes.extend(readings[test].iter().zip(nominal).map(|(with, without)| (with - without) * 1e3));
            }
        }
        changes
    }

    /// The derivatives of every reading by some parameters, at these values: test by test, parameter by parameter. µm
    /// per unit of the parameter.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn sensitivities(&self, values: &[f64], of: &[usize]) -> Result<Vec<f64>, Failed> {
        let values = self.problem.slot_values(&self.internal(values));
        let list = &self.problem.parameters.list;
        let mut by_test: Vec<Vec<Vec<f64>>> = vec![vec![Vec::new(); of.len()]; self.problem.tests.len()];
        for block in self.problem.blocks() {
            let rows = self.problem.rows(&values, &block)?;
            for (column, parameter) in by_test[block.test].iter_mut().zip(of) {
                let Some(known) = list.get(*parameter) else { continue };
                let scale = 1e3 / known.unit.display_per_internal;
                column.extend((0..rows.nrows()).map(|row| rows[(row, *parameter)] * scale));
            }
        }
        Ok(by_test.concat().concat())
    }

    /// The analysis of the plan: the result of `abbe plan --no-effects`, as JSON.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn analysis(&self) -> Result<String, Failed> {
        let analysis = plan::analyse(&self.read.session, &options())?;
        let stated = Stated { statements: analysis.statements(&self.problem), result: &analysis };
        Ok(document(&stated).map_err(|fault| fault.to_string())?.to_string())
    }

    /// The proposal of `abbe plan --improve`, as JSON.
    ///
    /// # Errors
    /// If there is no candidate test.
    pub fn improve(&self) -> Result<String, Failed> {
        let goal = Goal::WorstUncertainty;
        let variations = TestVariations::default();
        let found = improve(&self.problem, &variations, &ImproveOptions { goal, tests: 1, by_minute: false })?;
        Ok(document(&found).map_err(|fault| fault.to_string())?.to_string())
    }

    /// The equation of the readings of a test to first order, in LaTeX.
    ///
    /// # Errors
    /// If the equation has no readable form.
    pub fn equation(&self, test: usize) -> Result<String, Failed> {
        let session = &self.read.session;
        let test = session.tests.get(test).ok_or_else(|| "there is no such test".to_string())?;
        let parameters = EquationParameters::of_test(session, test, &[])?;
        let options = Options {
            order: Order::First,
            symbols: Symbols::Literature,
            unknowns: parameters.instrument,
            effects: parameters.effects,
            ..Options::default()
        };
        let source = SessionTest::new(session, test)?;
        let equation = Equation::of(&session.machine, &source, &parameters.errors, &options)?;
        let style = Style { numbering: Numbering::None, nomenclature: false, ..Style::default() };
        Ok(LATEX.print(&check(&equation, &source)?, &style)?)
    }
}

/// Where the axes are at some readings, deg or mm, and how the frames of table and tool lie in R: the images of the
/// unit vectors.
fn stops(machine: &Machine, test: &Test, rows: &[usize]) -> Vec<Value> {
    let Some(readings) = &test.readings else { return Vec::new() };
    let mut state = Vec::new();
    let stop = |row: &usize| {
        readings.state(machine, *row, &mut state);
        let positions = machine.axes.iter().zip(&readings.positions);
        let at: Vec<f64> = positions.map(|(axis, column)| axis.kind.to_display(column[*row])).collect();
        json!({ "at": at, "table": turned(machine, &state, Frame::Table), "tool": turned(machine, &state, Frame::Tool) })
    };
    rows.iter().map(stop).collect()
}

/// The images of the unit vectors of a frame in R.
fn turned(machine: &Machine, state: &[AxisPosition<f64>], frame: Frame) -> [[f64; 3]; 3] {
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let image = |point: [f64; 3]| machine.in_r(frame, state, &none, Point(point)).0;
    let origin = image([0.0; 3]);
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|unit| {
        let end = image(unit);
        std::array::from_fn(|k| end[k] - origin[k])
    })
}

/// The axes that move in a test, rotary axes first.
fn moved_axes(machine: &Machine, test: &Test) -> Vec<usize> {
    let positions = test.readings.iter().flat_map(|readings| readings.positions.iter().enumerate());
    let moves = |positions: &Vec<f64>| positions.iter().any(|position| *position != positions[0]);
    let mut moved: Vec<usize> = positions.filter(|(_, positions)| moves(positions)).map(|(axis, _)| axis).collect();
    moved.sort_by_key(|axis| machine.axes[*axis].kind == AxisKind::Linear);
    moved
}

impl Plan {
    /// Parameters in internal units; those without a value are zero.
    fn internal(&self, values: &[f64]) -> Vec<f64> {
        let list = &self.problem.parameters.list;
        let value = |j: usize| values.get(j).copied().unwrap_or(0.0);
        list.iter().enumerate().map(|(j, parameter)| value(j) / parameter.unit.display_per_internal).collect()
    }

    /// The readings at these parameters, mm, by test.
    fn readings(&self, values: &[f64]) -> Vec<Vec<f64>> {
        let values = self.problem.slot_values(&self.internal(values));
        self.problem.models.iter().zip(&values).map(|(model, values)| model.readings(values)).collect()
    }
}
