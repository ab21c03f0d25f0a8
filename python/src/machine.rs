//! A machine, with the text of its file.

use std::path::PathBuf;
use std::sync::Arc;

use abbe::files;
use abbe::model;
use abbe::model::document::{of_domain, print};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::failed::Failed;
use crate::keywords::node_of;

/// A kinematic chain.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Machine {
    /// The chain.
    pub machine: Arc<model::chain::Machine>,
}

#[pymethods]
impl Machine {
    #[staticmethod]
    fn read(path: PathBuf) -> Result<Machine, Failed> {
        Ok(Machine { machine: Arc::new(files::machine(&path)?) })
    }

    #[staticmethod]
    fn from_code(code: &str) -> Result<Machine, Failed> {
        Ok(Machine { machine: Arc::new(model::chain::Machine::from_code(code)?) })
    }

    #[staticmethod]
    fn from_toml(text: &str) -> Result<Machine, Failed> {
        Ok(Machine { machine: Arc::new(files::read::machine_of(&files::Source::new("machine.toml".as_ref(), text))?) })
    }

    /// The machine of the tables of a machine file.
    #[staticmethod]
    fn from_tables(tables: &Bound<'_, PyDict>) -> PyResult<Machine> {
        let machine = files::read::machine_of_node(node_of("machine", tables.as_any())?).map_err(Failed::from)?;
        Ok(Machine { machine: Arc::new(machine) })
    }

    fn to_toml(&self) -> Result<String, Failed> {
        Ok(print::text_of(&of_domain::machine(&self.machine))?)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.machine.name
    }

    #[getter]
    fn code(&self) -> String {
        self.machine.code()
    }

    #[getter]
    fn axes(&self) -> Vec<String> {
        self.machine.axes.iter().map(|axis| axis.name.clone()).collect()
    }

    /// The names of all errors of the axes.
    fn errors(&self) -> Vec<String> {
        model::pattern::errors(&self.machine).iter().map(ToString::to_string).collect()
    }

    fn __eq__(&self, other: &Machine) -> bool {
        self.machine == other.machine
    }
}
