//! A fit.

use std::sync::Arc;

use abbe::document::{Call, Document, StatedFit};
use abbe::identify::fit::Fit as Estimated;
use abbe::identify::model_file::IdentifiedModel;
use abbe::identify::plausibility;
use abbe::identify::problem::Problem;
use abbe::report::block::Report;
use abbe::report::commands::Commands;
use abbe::report::parameters::{self, Estimates};
use abbe::report::{self, readings};
use abbe::trace::SessionFit;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;

use crate::failed::Failed;
use crate::model::Model;
use crate::session::{Session, State, no_test};
use crate::show::{self, Figure, Table};
use crate::work;

/// A fitted session.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Fit {
    state: Arc<State>,
    seed: u64,
    fit: Arc<SessionFit>,
}

#[pymethods]
impl Fit {
    #[staticmethod]
    fn of(py: Python<'_>, session: &Session, seed: u64, allow_implausible: bool) -> PyResult<Fit> {
        let state = session.state();
        let own = Arc::clone(&state);
        let fit = work::run(py, None, move |_| {
            let fit = SessionFit::of(&own.session, seed)?;
            if !allow_implausible {
                plausibility::accepted(&fit.result.plausibility)?;
            }
            Ok(fit)
        })?;
        Ok(Fit { state, seed, fit: Arc::new(fit) })
    }

    fn json(&self) -> Result<String, Failed> {
        let origin = self.state.origin.clone();
        let stated = StatedFit::of_fit(&self.fit.problem, &self.fit.result);
        Ok(Document::new(call("fit"), origin, Some(self.seed), &stated).text()?)
    }

    /// Estimates of all parameters of the session in their order, in display units.
    fn estimates<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        estimates(&self.fit.problem, &self.fit.fit).into_pyarray(py)
    }

    fn residuals_um<'py>(&self, py: Python<'py>, test: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        residuals_um(py, &self.state, &self.fit.problem, &self.fit.fit, test)
    }

    fn is_outlier<'py>(&self, py: Python<'py>, test: &str) -> PyResult<Bound<'py, PyArray1<bool>>> {
        is_outlier(py, &self.state, &self.fit.problem, test)
    }

    fn tables(&self) -> Vec<Table> {
        estimate_tables(&self.fit.problem, &self.fit.fit, &self.fit.result.model.parameters)
    }

    fn residual_table(&self, py: Python<'_>) -> PyResult<Table> {
        work::at_once(py, || Ok(Table(readings::residuals(&self.fit.problem, &self.fit.fit))))
    }

    /// What `print` and a notebook show.
    fn shown(&self, py: Python<'_>) -> PyResult<(String, String)> {
        work::at_once(py, || Ok(show::shown(&self.report(false)?)))
    }

    fn figures(&self, py: Python<'_>) -> PyResult<Vec<Figure>> {
        work::at_once(py, || Ok(show::figures(&self.report(true)?)))
    }

    fn page(&self, py: Python<'_>) -> PyResult<String> {
        let read = (&self.state.session, &self.state.sources);
        work::at_once(py, || show::page(&self.report(true)?, read, "abbe.Session.fit", self.seed))
    }

    fn model(&self, py: Python<'_>) -> PyResult<Model> {
        work::at_once(py, || model_of(&self.state, &self.fit.problem, &self.fit.fit, call("fit"), self.seed))
    }
}

impl Fit {
    fn report(&self, figures: bool) -> Result<Report, Failed> {
        let SessionFit { problem, fit, result, .. } = &*self.fit;
        Ok(report::fit::report(problem, fit, &StatedFit::of_fit(problem, result), &Commands::default(), figures)?)
    }
}

/// A call without options.
pub fn call(command: &str) -> Call {
    Call { command: command.to_string(), ..Call::default() }
}

/// Estimates of all parameters in display units.
pub fn estimates(problem: &Problem, fit: &Estimated) -> Vec<f64> {
    let list = problem.parameters.list.iter().zip(&fit.beta);
    list.map(|(parameter, value)| (parameter.found + value) * parameter.unit.display_per_internal).collect()
}

/// The tables of estimates: errors and effects, then the set-up.
pub fn estimate_tables(
    problem: &Problem,
    fit: &Estimated,
    of: &[abbe::identify::results::ParameterResult],
) -> Vec<Table> {
    let estimates = Estimates::new(problem, fit, of);
    let mut tables = vec![Table(parameters::table(&estimates.errors, None))];
    if !estimates.setup.is_empty() {
        tables.push(Table(estimates.setup_table(None)));
    }
    tables
}

/// Residuals observed − model of a test, µm, all coordinates of a reading together.
pub fn residuals_um<'py>(
    py: Python<'py>,
    state: &State,
    problem: &Problem,
    fit: &Estimated,
    test: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let number = problem.tests.iter().position(|known| known.name == test).ok_or_else(|| no_test(state, test))?;
    Ok(fit.residuals[number].iter().map(|mm| mm * 1e3).collect::<Vec<f64>>().into_pyarray(py))
}

/// Whether each reading of a test is excluded as an outlier.
pub fn is_outlier<'py>(
    py: Python<'py>,
    state: &State,
    problem: &Problem,
    test: &str,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let number = problem.tests.iter().position(|known| known.name == test).ok_or_else(|| no_test(state, test))?;
    Ok(problem.rejected[number].clone().into_pyarray(py))
}

/// The model of a fit, with the text that `--save` writes.
pub fn model_of(state: &State, problem: &Problem, fit: &Estimated, call: Call, seed: u64) -> Result<Model, Failed> {
    Model::of(IdentifiedModel::of_fit(problem, fit, state.origin.provenance(call, seed))?)
}
