//! The results of analyses: one handle for all of them.

use std::any::Any;
use std::sync::Arc;

use abbe::analysis::{self, Analysed, Given, Plan, Progress};
use abbe::document::Origin;
use abbe::identify::model_file::IdentifiedModel;
use abbe::report::block::Report;
use abbe::report::commands::Commands;
use abbe::report::readings;
use abbe::trace::TraceOutcome;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::failed::Failed;
use crate::model::Model;
use crate::session::{Session, State, no_test};
use crate::show::{self, Figure, Table};
use crate::work;

/// What can be analysed.
#[derive(FromPyObject)]
pub enum Input<'py> {
    /// A model.
    Model(PyRef<'py, Model>),
    /// A session.
    Session(PyRef<'py, Session>),
}

/// The same, for the thread of the computation.
enum Kept {
    Model(Arc<IdentifiedModel>),
    Session(Arc<State>),
}

/// The result of an analysis.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Analysis {
    sessions: Vec<Arc<State>>,
    origin: Origin,
    analysed: Analysed,
}

#[pymethods]
impl Analysis {
    /// Runs the analysis of a name; `options` is a JSON object. `progress` is called with words.
    #[staticmethod]
    fn run(
        py: Python<'_>,
        name: String,
        inputs: Vec<Input<'_>>,
        options: String,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Analysis> {
        let (mut sessions, mut origin) = (Vec::new(), Origin::default());
        let mut keep = |input| match input {
            Input::Model(model) => {
                origin.add(model.origin.clone());
                Kept::Model(Arc::clone(&model.model))
            }
            Input::Session(session) => {
                let state = session.state();
                origin.add(state.origin.clone());
                sessions.push(Arc::clone(&state));
                Kept::Session(state)
            }
        };
        let kept: Vec<Kept> = inputs.into_iter().map(&mut keep).collect();
        let analysed = work::run(py, progress, move |caller| {
            let given = kept.iter().map(|kept| match kept {
                Kept::Model(model) => Given::Model(model),
                Kept::Session(state) => Given::Session(&state.session),
            });
            let given: Vec<Given<'_>> = given.collect();
            let listener =
                |step: Progress| step.words().map_or_else(|| caller.should_continue(), |words| caller.report(words));
            Ok(analysis::run(&name, &given, &options, seed, &listener)?)
        })?;
        Ok(Analysis { sessions, origin, analysed })
    }

    /// The document of the command.
    fn json(&self) -> Result<String, Failed> {
        Ok(self.analysed.document(self.origin.clone())?)
    }

    /// Estimates of all parameters of the session in their order, in display units.
    fn estimates<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let fits = self.analysed.found.fits();
        let estimates = fits.last().map_or_else(Vec::new, |(problem, fit)| {
            let list = problem.parameters.list.iter().zip(&fit.beta);
            list.map(|(parameter, value)| (parameter.found + value) * parameter.unit.display_per_internal).collect()
        });
        estimates.into_pyarray(py)
    }

    /// Residuals observed − model of a test, µm, all coordinates of a reading together.
    #[pyo3(signature = (test, before=false))]
    fn residuals_um<'py>(&self, py: Python<'py>, test: &str, before: bool) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let residuals = self.analysed.found.residuals_mm(before);
        let (_, mm) = residuals.iter().find(|(name, _)| *name == test).ok_or_else(|| self.no_test(test))?;
        Ok(mm.iter().map(|mm| mm * 1e3).collect::<Vec<f64>>().into_pyarray(py))
    }

    /// Whether each reading of a test is excluded as an outlier.
    fn is_outlier<'py>(&self, py: Python<'py>, test: &str) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let fits = self.analysed.found.fits();
        let rejected = fits.last().and_then(|(problem, _)| {
            let number = problem.tests.iter().position(|known| known.name == test)?;
            Some(problem.rejected[number].clone())
        });
        Ok(rejected.ok_or_else(|| self.no_test(test))?.into_pyarray(py))
    }

    /// The change of each reading of a test by each error of a plan, in µm per unit of the error.
    fn sensitivity<'py>(&self, py: Python<'py>, test: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let plan = self.found::<Plan>()?;
        let matrix = work::at_once(py, || plan.sensitivity(test)?.ok_or_else(|| self.no_test(test)))?;
        let columns = plan.analysis.errors.len();
        let rows = matrix.len().checked_div(columns).unwrap_or(0);
        matrix.into_pyarray(py).reshape([rows, columns])
    }

    fn tables(&self) -> Vec<Table> {
        self.analysed.found.tables().into_iter().map(Table).collect()
    }

    /// The table of `--residuals`.
    fn residual_table(&self, py: Python<'_>) -> PyResult<Table> {
        let fits = self.analysed.found.fits();
        let (problem, fit) = *fits.last().ok_or_else(|| Failed::new("the result has no residuals of its own"))?;
        work::at_once(py, || Ok(Table(readings::residuals(problem, fit))))
    }

    /// What `print` and a notebook show.
    fn shown(&self, py: Python<'_>) -> PyResult<(String, String)> {
        work::at_once(py, || Ok(show::shown(&self.report(false)?)))
    }

    fn figures(&self, py: Python<'_>) -> PyResult<Vec<Figure>> {
        work::at_once(py, || Ok(show::figures(&self.report(true)?)))
    }

    /// The page of `--report`; `called` is what was called in Python.
    fn page(&self, py: Python<'_>, called: &str) -> PyResult<String> {
        let sessions = self.sessions.iter().map(|state| (&state.session, &state.sources));
        work::at_once(py, || show::page(&self.report(true)?, sessions, called, self.analysed.seed))
    }

    fn model(&self, py: Python<'_>) -> PyResult<Model> {
        work::at_once(py, || Model::of(self.analysed.model(&self.origin)?))
    }

    /// The session of a trace with the found effects declared.
    fn session(&self) -> Result<Session, Failed> {
        let (trace, state) = (self.found::<TraceOutcome>()?, &self.sessions[0]);
        let mut session = state.session.clone();
        session.effects.extend(trace.effects.iter().cloned());
        let mut sources = state.sources.clone();
        sources.text.add_effects(&trace.effects, &session.machine)?;
        sources.files.clear();
        Ok(Session::of(State::new(session, sources, Origin::default())))
    }
}

impl Analysis {
    fn report(&self, figures: bool) -> Result<Report, Failed> {
        Ok(self.analysed.found.report(&Commands::default(), figures)?)
    }

    /// The result as that of one analysis.
    fn found<F: Any>(&self) -> Result<&F, Failed> {
        let found: &dyn Any = &*self.analysed.found;
        found.downcast_ref().ok_or_else(|| Failed::new(format!("no result of `{}`", self.analysed.call.command)))
    }

    /// The error for an unknown test.
    fn no_test(&self, test: &str) -> Failed {
        self.sessions.last().map_or_else(|| Failed::new(format!("no test `{test}`")), |state| no_test(state, test))
    }
}
