//! Keywords of Python as the keys of a session file, and as columns of readings.
//!
//! A keyword whose value is an array is a column, unless it is a key of the set-up such as `workpiece_ball_mm`. A
//! number for the position of an axis is where the test holds the axis. Everything else is a key of `[[test]]`. `None`
//! states nothing.

use abbe::files::table::memory::{MemoryColumn, Values};
use abbe::model::document::node::{Entry, Node, Value};
use abbe::model::document::schema;
use abbe::model::session::Session;
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};

use crate::failed::Failed;

/// Keys of `[[test]]` about files, which a test in memory does not have.
const OF_FILES: [&str; 3] = ["data", "format", "columns"];

/// The keywords of a test.
pub struct Keywords<'py> {
    /// The keys of `[[test]]`.
    pub table: Vec<(String, Node)>,
    columns: Vec<Column<'py>>,
}

/// A column of readings.
struct Column<'py> {
    name: String,
    values: Held<'py>,
    /// Which values are missing; empty if none is.
    missing: Vec<bool>,
}

/// The values of a column, for as long as they are read.
enum Held<'py> {
    /// An array of the caller, as it is.
    Array(PyReadonlyArray1<'py, f64>),
    /// Numbers of another kind or layout.
    Numbers(Vec<f64>),
    Words(Vec<String>),
}

impl<'py> Keywords<'py> {
    /// Sorts the keywords of a test.
    pub fn of_test(session: &Session, keywords: &Bound<'py, PyDict>) -> PyResult<Keywords<'py>> {
        let kind = match keywords.get_item("kind")? {
            Some(word) => word.extract::<String>()?.parse().unwrap_or(session.instrument),
            None => session.instrument,
        };
        let keys = schema::keys_of_test(kind).into_iter().map(|(key, _)| key);
        let keys: Vec<String> = keys.filter(|key| !OF_FILES.contains(&key.as_str())).collect();
        let is_key = |name: &String| keys.contains(name);
        let mut sorted = Keywords { table: Vec::new(), columns: Vec::new() };
        let mut at: Vec<(String, Node)> = Vec::new();
        for (name, value) in keywords.iter() {
            let name: String = name.extract()?;
            if value.is_none() {
                continue;
            } else if is_key(&name) {
                sorted.table.push((name.clone(), node_of(&name, &value)?));
            } else if is_sequence(&value) {
                sorted.columns.push(column(name, &value)?);
            } else if is_position(session, &name) {
                at.push((name.clone(), node_of(&name, &value)?));
            } else {
                return Err(Failed::argument(
                    format!("`{name}` is neither the position of an axis nor a key of a test"),
                    format!("columns are arrays; keys of a test are {}", keys.join(", ")),
                )
                .into());
            }
        }
        if !at.is_empty() {
            match sorted.table.iter_mut().find(|(name, _)| name == "at") {
                Some((_, stated)) => at.into_iter().for_each(|(name, position)| stated.set(&name, position)),
                None => sorted.table.push(("at".to_string(), Node::table(at))),
            }
        }
        Ok(sorted)
    }

    /// The columns of readings.
    pub fn columns(&self) -> PyResult<Vec<MemoryColumn<'_>>> {
        self.columns
            .iter()
            .map(|Column { name, values, missing }| {
                let values = match values {
                    Held::Array(array) => Values::Numbers(array.as_slice()?),
                    Held::Numbers(numbers) => Values::Numbers(numbers),
                    Held::Words(words) => Values::Words(words),
                };
                Ok(MemoryColumn { name, values, missing })
            })
            .collect()
    }

    /// Whether there are readings.
    pub fn has_columns(&self) -> bool {
        !self.columns.is_empty()
    }
}

/// Whether a name could be the position of an axis: the reader decides on the unit.
fn is_position(session: &Session, name: &str) -> bool {
    let axes = &session.machine.axes;
    name.rsplit_once('_').is_some_and(|(axis, _)| axes.iter().any(|known| known.name.eq_ignore_ascii_case(axis)))
}

fn is_sequence(value: &Bound<'_, PyAny>) -> bool {
    let array = value.cast::<PyUntypedArray>().is_ok_and(|array| array.ndim() > 0);
    let number = value.is_instance_of::<PyFloat>() || value.is_instance_of::<PyInt>();
    let text = value.is_instance_of::<PyString>() || value.is_instance_of::<PyDict>();
    array || (!number && !text && value.len().is_ok())
}

/// A column, and which of its values are marked as missing (`abbe/_missing.py`).
fn column<'py>(name: String, value: &Bound<'py, PyAny>) -> PyResult<Column<'py>> {
    let separated = value.py().import("abbe._missing")?.call_method1("separated", (value,))?;
    let (value, missing): (Bound<'py, PyAny>, Option<Vec<bool>>) = separated.extract()?;
    Ok(Column { values: held(&name, &value)?, missing: missing.unwrap_or_default(), name })
}

/// The values of a column: an array of float64 without gaps as it is, anything else as numbers or words.
fn held<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Held<'py>> {
    let py = value.py();
    if let Ok(array) = value.extract::<PyReadonlyArray1<'py, f64>>()
        && array.as_slice().is_ok()
    {
        return Ok(Held::Array(array));
    }
    let array = py.import("numpy")?.call_method1("asarray", (value,))?;
    let array = array.cast::<PyUntypedArray>()?;
    if array.ndim() != 1 {
        let message = format!("`{name}` has {} dimensions; an array of one is expected", array.ndim());
        return Err(Failed::argument(message, "one value for each reading").into());
    }
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    match kind.as_str() {
        "f" | "i" | "u" | "b" => {
            let numbers = array.call_method1("astype", ("float64",))?;
            Ok(Held::Numbers(numbers.cast::<PyArrayDyn<f64>>()?.to_vec()?))
        }
        "U" => Ok(Held::Words(array.call_method0("tolist")?.extract()?)),
        _ => {
            let found: String = array.getattr("dtype")?.str()?.extract()?;
            let message = format!("`{name}` has the dtype {found}; numbers are expected");
            Err(Failed::argument(message, "convert it with `.astype(float)`").into())
        }
    }
}

/// Largest depth of lists and dicts in one another; the files nest to 80.
const MAX_DEPTH: usize = 80;

/// A value of Python as a value of a document.
pub fn node_of(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Node> {
    nested(name, value, MAX_DEPTH)
}

/// A value in which lists and dicts may be nested `depth` deep.
fn nested(name: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Node> {
    let Some(depth) = depth.checked_sub(1) else {
        let message = format!("`{name}` has more than {MAX_DEPTH} lists and dicts in one another");
        return Err(Failed::argument(message, "a list or a dict must not contain itself").into());
    };
    if let Ok(table) = value.cast::<PyDict>() {
        let entry = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            let key: String = key.extract()?;
            let node = nested(&key, &value, depth)?;
            Ok::<_, PyErr>(Entry { key, key_span: 0..0, node })
        };
        // `None` is what a caller has who states nothing.
        let stated = table.iter().filter(|(_, value)| !value.is_none());
        return Ok(Value::Table(stated.map(entry).collect::<PyResult<_>>()?).into());
    }
    if value.is_instance_of::<PyBool>() {
        return Ok(value.extract::<bool>()?.into());
    }
    if value.is_instance_of::<PyInt>() {
        let number: f64 = value.extract().unwrap_or(f64::INFINITY);
        return Ok(Value::Number(number, value.str()?.extract()?).into());
    }
    if let Ok(number) = value.cast::<PyFloat>() {
        return Ok(number.extract::<f64>()?.into());
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Value::Text(text.extract()?).into());
    }
    // Numbers and arrays of NumPy become those of Python.
    if let Ok(plain) = value.call_method0("tolist") {
        return nested(name, &plain, depth);
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value.try_iter()?.map(|item| nested(name, &item?, depth));
        return Ok(Value::List(items.collect::<PyResult<_>>()?).into());
    }
    let found: String = value.get_type().name()?.extract()?;
    let message = format!("`{name}` is a {found}; a number, a text, a list or a dict is expected");
    Err(Failed::argument(message, "see the keys of session files").into())
}
