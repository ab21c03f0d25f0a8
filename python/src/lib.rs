//! The native part of the Python module `abbe`: handles on the library's types, NumPy arrays in and out, results as the
//! JSON documents of the command. The package in `src/abbe` gives them their Python form.
//!
//! - [`machine`], [`session`], [`equation`], [`model`]: one file per handle; [`analysis`]: one for all results;
//! - [`keywords`]: keywords as the keys of a session file; [`pickle`]: the state of a session;
//! - [`work`]: computations without the GIL, with Ctrl-C, progress and a bound on the threads;
//! - [`import`]: foreign files of readings; [`fleet`]: units of work of many sessions;
//! - [`show`]: tables, figures and reports; [`failed`]: errors as exceptions.

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

mod analysis;
mod equation;
mod failed;
mod fleet;
mod import;
mod keywords;
mod machine;
mod model;
mod pickle;
mod session;
mod show;
mod work;

use pyo3::prelude::*;

/// The native part of `abbe`.
#[pymodule]
fn _abbe(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<machine::Machine>()?;
    module.add_class::<session::Session>()?;
    module.add_class::<analysis::Analysis>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<show::Table>()?;
    module.add_class::<show::Figure>()?;
    module.add_function(wrap_pyfunction!(equation::equation, module)?)?;
    module.add_function(wrap_pyfunction!(import::import_readings, module)?)?;
    module.add_function(wrap_pyfunction!(pickle::pickled, module)?)?;
    module.add_function(wrap_pyfunction!(pickle::unpickled, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::run_session, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::analyse_session, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::session_files, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::forget_missing_sessions, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::fleet_records, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::fleet_history, module)?)?;
    module.add_function(wrap_pyfunction!(work::set_threads, module)?)?;
    module.add_function(wrap_pyfunction!(work::threads, module)?)?;
    Ok(())
}
