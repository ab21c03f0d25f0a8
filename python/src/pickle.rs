//! The state of a session as plain values and arrays: its text with the machine in it, and its readings in internal
//! units, so that a copy equals the original to the last bit.

use std::path::PathBuf;
use std::sync::Arc;

use abbe::document::Origin;
use abbe::files::read::plan_of;
use abbe::files::{Source, SourceMap};
use abbe::model::document::edit::SessionText;
use abbe::model::session::Test;
use abbe::model::session::readings::{Origin as Lines, Readings};
use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::failed::Failed;
use crate::session::{Session, State};

/// The state: text, file, checksums, warnings, and name, socket and readings of each test.
#[pyfunction]
pub fn pickled<'py>(py: Python<'py>, session: &Session) -> PyResult<Bound<'py, PyDict>> {
    let state = session.state();
    let tests: Vec<_> = state.session.tests.iter().map(|test| pickled_test(py, test)).collect::<PyResult<_>>()?;
    let pickled = PyDict::new(py);
    pickled.set_item("text", whole(&state.sources)?.to_string())?;
    pickled.set_item("file", &state.sources.file)?;
    let origin = serde_json::to_string(&state.origin).map_err(|cause| Failed::new(cause.to_string()))?;
    pickled.set_item("origin", origin)?;
    pickled.set_item("warnings", &state.session.warnings)?;
    pickled.set_item("tests", tests)?;
    Ok(pickled)
}

/// The session of a pickled state.
#[pyfunction]
pub fn unpickled(pickled: &Bound<'_, PyDict>) -> PyResult<Session> {
    let item = |name: &str| {
        let missing = || Failed::new(format!("this is no pickled session: it has no `{name}`"));
        Ok::<_, PyErr>(pickled.get_item(name)?.ok_or_else(missing)?)
    };
    let text: String = item("text")?.extract()?;
    let source = Source::new("session.toml".as_ref(), &text);
    let mut session = plan_of(&source).map_err(Failed::from)?;
    let declared = std::mem::take(&mut session.tests);
    for test in item("tests")?.try_iter()? {
        session.tests.push(unpickled_test(&declared, test?.cast::<PyDict>()?, session.machine.axes.len())?);
    }
    session.warnings = item("warnings")?.extract()?;
    let origin: String = item("origin")?.extract()?;
    let origin: Origin = serde_json::from_str(&origin).map_err(|cause| Failed::new(cause.to_string()))?;
    let file: PathBuf = item("file")?.extract()?;
    let text = SessionText::new(&text, &file).map_err(Failed::from)?;
    let sources = SourceMap { file, text, machine_text: None, bodies: Vec::new(), files: Vec::new() };
    Ok(Session::of(State::new(session, sources, origin)))
}

/// A session with its machine in it.
fn whole(sources: &SourceMap) -> Result<SessionText, Failed> {
    let mut text = sources.text.clone();
    if let Some(machine) = &sources.machine_text {
        text.set_machine(machine)?;
    }
    Ok(text)
}

fn pickled_test<'py>(py: Python<'py>, test: &Test) -> PyResult<Bound<'py, PyDict>> {
    let pickled = PyDict::new(py);
    pickled.set_item("name", &test.name)?;
    pickled.set_item("socket", &test.socket)?;
    let Some(readings) = &test.readings else {
        return Ok(pickled);
    };
    pickled.set_item("run", PyArray1::from_slice(py, &readings.run))?;
    pickled.set_item("time_s", PyArray1::from_slice(py, &readings.time_s))?;
    let drivers = PyDict::new(py);
    for (name, values) in &readings.drivers {
        drivers.set_item(name, PyArray1::from_slice(py, values))?;
    }
    pickled.set_item("drivers", drivers)?;
    pickled.set_item("observed", PyArray1::from_slice(py, &readings.observed))?;
    let positions: Vec<_> = readings.positions.iter().map(|column| PyArray1::from_slice(py, column)).collect();
    pickled.set_item("positions", positions)?;
    if let Some(lines) = &readings.origin {
        let line: Vec<u64> = lines.line.iter().map(|line| *line as u64).collect();
        pickled.set_item("lines", (&lines.file, line.into_pyarray(py)))?;
    }
    Ok(pickled)
}

fn unpickled_test(declared: &[Test], pickled: &Bound<'_, PyDict>, axes: usize) -> PyResult<Test> {
    let damaged = || Failed::new("this is no pickled session: its tests do not fit its text");
    let item = |name: &str| Ok::<_, PyErr>(pickled.get_item(name)?.ok_or_else(damaged)?);
    let name: String = item("name")?.extract()?;
    let socket: Option<String> = item("socket")?.extract()?;
    // The text declares the tests of all sockets together.
    let group = socket.as_ref().and_then(|socket| name.strip_suffix(&format!("/{socket}")));
    let test = declared.iter().find(|test| test.name == name || Some(test.name.as_str()) == group);
    let test = test.ok_or_else(damaged)?.clone();
    let Some(run) = pickled.get_item("run")? else {
        return Ok(Test { name, socket, ..test });
    };
    let origin = match pickled.get_item("lines")? {
        Some(lines) => {
            let (file, line): (PathBuf, Bound<'_, PyArray1<u64>>) = lines.extract()?;
            let line = line.to_vec()?.into_iter().map(|line| line as usize).collect();
            Some(Lines { file, line })
        }
        None => None,
    };
    let positions = item("positions")?.try_iter()?.map(|column| numbers(&column?)).collect::<PyResult<Vec<_>>>()?;
    let drivers = item("drivers")?.cast_into::<PyDict>().map_err(|_| damaged())?;
    let drivers = drivers.iter().map(|(name, values)| Ok::<_, PyErr>((name.extract::<String>()?, numbers(&values)?)));
    let readings = Readings {
        origin,
        run: numbers(&run)?,
        time_s: numbers(&item("time_s")?)?,
        drivers: drivers.collect::<PyResult<_>>()?,
        positions,
        channels: test.station.channels().len(),
        observed: numbers(&item("observed")?)?,
        // Whole tests: nothing comes before or after them.
        ..Readings::default()
    };
    let rows = readings.rows();
    let fits = |length: usize| length == 0 || length == rows;
    let whole = readings.positions.len() == axes
        && readings.positions.iter().all(|column| column.len() == rows)
        && readings.observed.len() == rows * readings.channels
        && [readings.run.len(), readings.time_s.len()].into_iter().all(fits)
        && readings.drivers.values().all(|values| values.len() == rows);
    if !whole {
        return Err(damaged().into());
    }
    Ok(Test { name, socket, readings: Some(Arc::new(readings)), ..test })
}

fn numbers<T: Element>(array: &Bound<'_, PyAny>) -> PyResult<Vec<T>> {
    Ok(array.cast::<PyArray1<T>>()?.to_vec()?)
}
