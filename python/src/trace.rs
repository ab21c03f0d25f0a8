//! A trace.

use std::sync::Arc;
use std::time::{Duration, Instant};

use abbe::document::{Call, Document, StatedTrace};
use abbe::identify::plausibility;
use abbe::plan::separating_tests::separate_aliases;
use abbe::plan::test_variations::TestVariations;
use abbe::report::block::Report;
use abbe::report::commands::Commands;
use abbe::report::{self, readings};
use abbe::trace::{self, Progress, TraceOptions, TraceOutcome};
use numpy::PyArray1;
use pyo3::prelude::*;
use serde_json::{Map, Value};

use crate::failed::Failed;
use crate::fit::{estimate_tables, is_outlier, model_of, residuals_um};
use crate::model::Model;
use crate::session::{Session, State};
use crate::show::{self, Figure, Table};
use crate::work::{self, Caller};

/// A traced session.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Trace {
    state: Arc<State>,
    seed: u64,
    options: Map<String, Value>,
    trace: Arc<TraceOutcome>,
}

/// Tells the caller about the progress, and returns whether to go on.
fn reported(caller: &Caller, progress: &Progress) -> bool {
    progress.words().map_or_else(|| caller.should_continue(), |words| caller.report(words))
}

/// The end of a computation with a limit in seconds. A limit beyond what a clock can hold is none.
fn deadline(limit_s: Option<f64>) -> Result<Option<Instant>, Failed> {
    match limit_s {
        Some(seconds) if !(seconds > 0.0 && seconds.is_finite()) => {
            Err(Failed::argument(format!("`time_limit` is {seconds}"), "a positive number of seconds is expected"))
        }
        Some(seconds) => {
            Ok(Duration::try_from_secs_f64(seconds).ok().and_then(|limit| Instant::now().checked_add(limit)))
        }
        None => Ok(None),
    }
}

#[pymethods]
impl Trace {
    #[staticmethod]
    fn of(
        py: Python<'_>,
        session: &Session,
        progress: Option<Py<PyAny>>,
        max_effects: Option<usize>,
        only: Vec<String>,
        exclude: Vec<String>,
        time_limit_s: Option<f64>,
        seed: u64,
        allow_implausible: bool,
    ) -> PyResult<Trace> {
        let deadline = deadline(time_limit_s)?;
        let state = session.state();
        let own = Arc::clone(&state);
        let stated = [
            ("max_effects", max_effects.map(Value::from)),
            ("only", Some(&only).filter(|texts| !texts.is_empty()).map(|texts| Value::from(texts.clone()))),
            ("time_limit", time_limit_s.map(Value::from)),
            ("exclude", Some(&exclude).filter(|texts| !texts.is_empty()).map(|texts| Value::from(texts.clone()))),
        ];
        let stated = stated.into_iter().filter_map(|(name, value)| Some((name.to_string(), value?)));
        let options = TraceOptions { seed, max_effects, only, exclude, ..TraceOptions::default() };
        let trace = work::run(py, progress, move |caller| {
            let should_continue = || deadline.is_none_or(|deadline| Instant::now() < deadline);
            let report = |progress: Progress| reported(caller, &progress) && should_continue();
            let mut trace = trace::trace(&own.session, &options, &report)?;
            if !allow_implausible {
                plausibility::accepted(&trace.result.plausibility)?;
            }
            if caller.report("comparing candidate tests".to_string()) && should_continue() {
                separate_aliases(&mut trace, &TestVariations::short(), &report)?;
            }
            if let Some(seconds) = time_limit_s {
                trace.result.mark_time_limit(seconds);
            }
            Ok(trace)
        })?;
        Ok(Trace { state, seed, options: stated.collect(), trace: Arc::new(trace) })
    }

    fn json(&self) -> Result<String, Failed> {
        let origin = self.state.origin.clone();
        Ok(Document::new(self.call(), origin, Some(self.seed), &StatedTrace::of_trace(&self.trace)).text()?)
    }

    fn residuals_um<'py>(&self, py: Python<'py>, test: &str, before: bool) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (problem, fit) = match before {
            true => (&self.trace.before, &self.trace.before_fit),
            false => (&self.trace.after, &self.trace.after_fit),
        };
        residuals_um(py, &self.state, problem, fit, test)
    }

    fn is_outlier<'py>(&self, py: Python<'py>, test: &str) -> PyResult<Bound<'py, PyArray1<bool>>> {
        is_outlier(py, &self.state, &self.trace.after, test)
    }

    fn tables(&self) -> Vec<Table> {
        let mut tables = vec![Table(report::trace::before_and_after(&self.trace.result))];
        tables.extend(estimate_tables(&self.trace.after, &self.trace.after_fit, &self.trace.result.after.parameters));
        tables
    }

    fn residual_table(&self, py: Python<'_>) -> PyResult<Table> {
        work::at_once(py, || Ok(Table(readings::residuals(&self.trace.after, &self.trace.after_fit))))
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
        work::at_once(py, || show::page(&self.report(true)?, read, "abbe.Session.trace", self.seed))
    }

    fn model(&self, py: Python<'_>) -> PyResult<Model> {
        work::at_once(py, || {
            if self.trace.result.interrupted {
                return Err(Failed::new(format!(
                    "no model: the trace was {}, and effects may be missing from it",
                    self.trace.result.interruption()
                )));
            }
            model_of(&self.state, &self.trace.after, &self.trace.after_fit, self.call(), self.seed)
        })
    }

    /// The session with the found effects declared.
    fn session(&self) -> Result<Session, Failed> {
        let state = &self.state;
        let mut session = state.session.clone();
        session.effects.extend(self.trace.effects.iter().cloned());
        let mut sources = state.sources.clone();
        sources.text.add_effects(&self.trace.effects, &session.machine)?;
        sources.files.clear();
        Ok(Session::of(State::new(session, sources, Default::default())))
    }
}

impl Trace {
    fn report(&self, figures: bool) -> Result<Report, Failed> {
        Ok(report::trace::report(&self.trace, &StatedTrace::of_trace(&self.trace), &Commands::default(), figures)?)
    }

    fn call(&self) -> Call {
        Call { command: "trace".to_string(), options: self.options.clone() }
    }
}
