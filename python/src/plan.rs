//! The analysis of a plan.

use std::sync::Arc;

use abbe::document::{Call, Document, StatedPlan};
use abbe::identify::problem::Problem;
use abbe::model::session::limits::{LARGEST, MIN_UM};
use abbe::plan::results::PlanAnalysis;
use abbe::plan::{self, PlanOptions};
use abbe::report::block::Report;
use abbe::report::commands::Commands;
use abbe::report::plan as present;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use serde_json::{Map, Value};

use crate::failed::Failed;
use crate::session::{Session, State, no_test};
use crate::show::{self, Figure, Table};
use crate::work;

/// An analysed plan.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Plan {
    state: Arc<State>,
    options: Map<String, Value>,
    problem: Arc<Problem>,
    analysis: Arc<PlanAnalysis>,
}

#[pymethods]
impl Plan {
    #[staticmethod]
    fn of(py: Python<'_>, session: &Session, noise_um: Option<f64>, planned: bool, effects: bool) -> PyResult<Plan> {
        let state = session.state();
        let own = Arc::clone(&state);
        if let Some(um) = noise_um.filter(|um| !(MIN_UM..=LARGEST).contains(um)) {
            let message = format!("`noise_um` is {um}; a number of µm from {MIN_UM:e} to {LARGEST:e} is expected");
            return Err(Failed::argument(message, "the standard deviation of a reading").into());
        }
        let stated = [
            ("noise_um", noise_um.map(Value::from)),
            ("planned", planned.then_some(Value::Bool(true))),
            ("no_effects", (!effects).then_some(Value::Bool(true))),
        ];
        let stated = stated.into_iter().filter_map(|(name, value)| Some((name.to_string(), value?)));
        let noise_mm = noise_um.map(|um| um * 1e-3);
        let options = PlanOptions { noise_mm, planned_only: planned, effects, ..PlanOptions::default() };
        let (problem, analysis) = work::run(py, None, move |_| {
            let mut analysis = plan::analyse(&own.session, &options)?;
            analysis.warnings.extend(plan::collision::unchecked(&own.session, options.planned_only));
            let (complete, noise) = plan::prepared(&own.session, &options)?;
            Ok((plan::states::problem_by_test(&complete, noise)?, analysis))
        })?;
        Ok(Plan { state, options: stated.collect(), problem: Arc::new(problem), analysis: Arc::new(analysis) })
    }

    fn json(&self, seed: u64) -> Result<String, Failed> {
        let call = Call { command: "plan".to_string(), options: self.options.clone() };
        let stated = StatedPlan::of_plan(&self.problem, &self.analysis);
        Ok(Document::new(call, self.state.origin.clone(), Some(seed), &stated).text()?)
    }

    /// The change of each reading of a test by each error of the analysis, in µm per unit of the error.
    fn sensitivity<'py>(&self, py: Python<'py>, test: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let problem = &self.problem;
        let number = problem.tests.iter().position(|known| known.name == test);
        let number = number.ok_or_else(|| no_test(&self.state, test))?;
        let list = &problem.parameters.list;
        let of = |id: &str| list.iter().position(|parameter| parameter.id == id);
        let columns: Vec<Option<usize>> = self.analysis.errors.iter().map(|error| of(&error.id)).collect();
        let matrix = work::at_once(py, || {
            let values = problem.slot_values(&vec![0.0; list.len()]);
            let mut matrix: Vec<f64> = Vec::new();
            for block in problem.blocks().iter().filter(|block| block.test == number) {
                let rows = problem.rows(&values, block)?;
                for row in 0..rows.nrows() {
                    let entry = |column: &Option<usize>| {
                        column.map_or(0.0, |j| 1e3 * rows[(row, j)] / list[j].unit.display_per_internal)
                    };
                    matrix.extend(columns.iter().map(entry));
                }
            }
            Ok(matrix)
        })?;
        let rows = matrix.len().checked_div(columns.len()).unwrap_or(0);
        matrix.into_pyarray(py).reshape([rows, columns.len()])
    }

    fn tables(&self) -> Vec<Table> {
        let errors = &self.analysis.errors;
        [present::uncertainties(errors), present::sensitivity(errors), present::budgets(errors)].map(Table).into()
    }

    /// What `print` and a notebook show.
    fn shown(&self, py: Python<'_>) -> PyResult<(String, String)> {
        work::at_once(py, || Ok(show::shown(&self.report(false)?)))
    }

    fn figures(&self, py: Python<'_>) -> PyResult<Vec<Figure>> {
        work::at_once(py, || Ok(show::figures(&self.report(true)?)))
    }

    fn page(&self, py: Python<'_>, seed: u64) -> PyResult<String> {
        let read = (&self.state.session, &self.state.sources);
        work::at_once(py, || show::page(&self.report(true)?, read, "abbe.Session.plan", seed))
    }
}

impl Plan {
    fn report(&self, figures: bool) -> Result<Report, Failed> {
        let stated = StatedPlan::of_plan(&self.problem, &self.analysis);
        Ok(present::analysis::report(&self.problem, &stated, &Commands::default(), figures)?)
    }
}
