//! Comparisons of sessions and models.

use std::sync::Arc;

use abbe::apply::compare::results::Comparison as Compared;
use abbe::apply::compare::{CompareOptions, Input, compare_inputs};
use abbe::document::{Document, Origin, StatedComparison};
use abbe::identify::model_file::IdentifiedModel;
use abbe::report::block::Report;
use abbe::report::commands::Commands;
use abbe::report::compare::report;
use pyo3::prelude::*;

use crate::failed::Failed;
use crate::fit::call;
use crate::model::Model;
use crate::session::{Session, State};
use crate::show::{self, Figure, Table};
use crate::work;

/// What can be compared.
#[derive(FromPyObject)]
pub enum Given<'py> {
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

/// A comparison.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Comparison {
    machine: String,
    with_workspace: bool,
    origin: Origin,
    found: Compared,
}

#[pymethods]
impl Comparison {
    #[staticmethod]
    fn of(
        py: Python<'_>,
        inputs: Vec<(String, Given<'_>)>,
        significance: f64,
        shared: Option<Vec<String>>,
        places: usize,
        seed: u64,
    ) -> PyResult<Comparison> {
        let mut origin = Origin::default();
        let mut kept = Vec::with_capacity(inputs.len());
        for (name, given) in inputs {
            let own = match given {
                Given::Model(model) => {
                    origin.add(model.origin.clone());
                    Kept::Model(Arc::clone(&model.model))
                }
                Given::Session(session) => {
                    let state = session.state();
                    origin.add(state.origin.clone());
                    Kept::Session(state)
                }
            };
            kept.push((name, own));
        }
        let options = CompareOptions { significance, shared, places };
        let (machine, found) = work::run(py, None, move |_| {
            let (names, given): (Vec<String>, Vec<Input>) = kept
                .into_iter()
                .map(|(name, kept)| match kept {
                    Kept::Model(model) => (name, Input::Model(Box::new((*model).clone()))),
                    Kept::Session(state) => (name, Input::Session(Box::new(state.session.clone()))),
                })
                .unzip();
            let machine = given.first().map_or(String::new(), |input| input.machine().name.clone());
            Ok((machine, compare_inputs(names, given, &options, seed)?))
        })?;
        Ok(Comparison { machine, with_workspace: places > 0, origin, found })
    }

    fn json(&self, seed: u64) -> Result<String, Failed> {
        let stated = StatedComparison::of_comparison(&self.found);
        Ok(Document::new(call("compare"), self.origin.clone(), Some(seed), &stated).text()?)
    }

    fn tables(&self) -> Vec<Table> {
        self.report().tables().cloned().map(Table).collect()
    }

    /// What `print` and a notebook show.
    fn shown(&self) -> (String, String) {
        show::shown(&self.report())
    }

    fn figures(&self) -> Vec<Figure> {
        show::figures(&self.report())
    }

    fn page(&self) -> Result<String, Failed> {
        show::page_without_session(&self.report(), "abbe.compare")
    }
}

impl Comparison {
    fn report(&self) -> Report {
        report(&self.machine, &StatedComparison::of_comparison(&self.found), self.with_workspace, &Commands::default())
    }
}
