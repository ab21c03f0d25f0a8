//! An identified model, and what follows from it: exports and corrected commands.

use std::path::PathBuf;
use std::sync::Arc;

use abbe::apply::correction::Correction;
use abbe::apply::export::travel::Travel;
use abbe::document::Origin;
use abbe::exports::{self, Contents, ExportOptions};
use abbe::files;
use abbe::files::robot::dh::Convention;
use abbe::identify::model_file::errors::EstimatedErrors;
use abbe::identify::model_file::{self, IdentifiedModel};
use abbe::model::pose::Aim;
use abbe::model::session::readings::Readings;
use abbe::model::unit::{ARCSEC_PER_RAD, UM_PER_MM};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::failed::Failed;
use crate::machine::Machine;
use crate::work;

/// An identified model.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Model {
    pub model: Arc<IdentifiedModel>,
    /// Its file. Numbers of a model that is read are rounded by their units.
    text: String,
    pub origin: Origin,
}

impl Model {
    /// A new model.
    pub fn of(model: IdentifiedModel) -> Result<Model, Failed> {
        Ok(Model { text: model.to_text()?, model: Arc::new(model), origin: Origin::default() })
    }
}

/// Corrected positions in mm and degrees, what became of each, the remaining error in µm and arcsec.
type Corrected<'py> =
    (Bound<'py, PyArray2<f64>>, Vec<&'static str>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

#[pymethods]
impl Model {
    #[staticmethod]
    fn read(path: PathBuf) -> Result<Model, Failed> {
        let source = files::text(&path, "the model file")?;
        let model = Arc::new(model_file::of_source(&source)?);
        Ok(Model { model, origin: Origin::of_files(&source.stamp), text: source.text })
    }

    #[staticmethod]
    fn from_text(text: &str) -> Result<Model, Failed> {
        let model = Arc::new(model_file::of_source(&files::Source::new("model.json".as_ref(), text))?);
        Ok(Model { model, text: text.to_string(), origin: Origin::default() })
    }

    fn text(&self) -> &str {
        &self.text
    }

    #[getter]
    fn machine(&self) -> Machine {
        Machine { machine: Arc::new(self.model.machine.clone()) }
    }

    /// The names of the positions of the axes in a data file.
    fn columns(&self) -> Vec<String> {
        self.model.machine.axes.iter().map(|axis| axis.column("")).collect()
    }

    /// Identifier, value, standard uncertainty, unit and whether it is held at nominal, of each parameter.
    fn parameters(&self) -> Vec<(String, f64, f64, String, bool)> {
        let parameters = self.model.parameters.iter().enumerate();
        let row = |(j, parameter): (usize, &model_file::ModelParameter)| {
            let scale = parameter.display_per_internal;
            let name = parameter.unit.clone();
            (parameter.id.to_string(), parameter.value * scale, self.model.u(j) * scale, name, parameter.held)
        };
        parameters.map(row).collect()
    }

    /// The file of `abbe export`, without a name, or its files; `travel` has axes with their ranges, mm or degrees.
    #[pyo3(signature = (format, tool_mm, entries, travel, patch=None, tip=None, convention="modified", dh=None, places=None, references=Vec::new()))]
    fn export(
        &self,
        format: &str,
        tool_mm: Option<[f64; 3]>,
        entries: &str,
        travel: Vec<(String, [f64; 2])>,
        patch: Option<PathBuf>,
        tip: Option<String>,
        convention: &str,
        dh: Option<PathBuf>,
        places: Option<usize>,
        references: Vec<(String, f64)>,
    ) -> Result<Vec<(Option<String>, Vec<u8>)>, Failed> {
        let format = exports::format(format)?;
        let measured = Travel::measured(&self.model);
        let options = ExportOptions {
            tool_mm: tool_mm.unwrap_or(self.model.tool_mm),
            entries: exports::entries(entries)?,
            convention: Convention::of_word(convention).ok_or_else(|| {
                Failed::argument(format!("there is no convention `{convention}`"), "standard or modified")
            })?,
            dh: dh.map(|file| files::foreign_text(&file, "the table")).transpose()?,
            patch: patch
                .map(|file| files::foreign_text(&file, "the URDF file").map(|source| (source, tip)))
                .transpose()?,
            places,
            references,
            travel: travel.iter().try_fold(measured, |all, (axis, range)| all.with(&self.model, axis, *range))?,
        };
        if let Some((option, owners)) = format.ignored(&options) {
            let owners: Vec<String> = owners.iter().map(|word| format!("\"{word}\"")).collect();
            return Err(Failed::argument(format!("`{option}` belongs to {}", owners.join(" and ")), ""));
        }
        Ok(match format.export(&self.model, &options)?.contents {
            Contents::File(text) => vec![(None, text)],
            Contents::Folder(files) => files.into_iter().map(|(name, text)| (Some(name), text)).collect(),
        })
    }

    /// Corrected commands; `positions` has one column for each axis, mm or degrees.
    fn correct<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'py, f64>,
        tool_mm: Option<[f64; 3]>,
        time_s: Option<PyReadonlyArray1<'py, f64>>,
        temperature_c: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Corrected<'py>> {
        let commands = self.commands(&positions, time_s, temperature_c)?;
        let corrected =
            work::at_once(py, || Ok(self.correction(tool_mm, |correction| correction.correct(&commands))?))?;
        let machine = &self.model.machine;
        let display = corrected.iter().flat_map(|row| {
            machine.axes.iter().zip(&row.positions).map(|(axis, position)| axis.kind.to_display(*position))
        });
        let display: Vec<f64> = display.collect();
        let states = corrected.iter().map(|row| row.state.word()).collect();
        let um: Vec<f64> = corrected.iter().map(|row| row.remaining_mm * UM_PER_MM).collect();
        let arcsec: Vec<f64> = corrected.iter().map(|row| row.remaining_rad * ARCSEC_PER_RAD).collect();
        let positions = display.into_pyarray(py).reshape([corrected.len(), machine.axes.len()])?;
        Ok((positions, states, um.into_pyarray(py), arcsec.into_pyarray(py)))
    }

    /// The errors of the tool's pose at commands: µm and arcsec, six for each row.
    fn pose_errors<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'py, f64>,
        tool_mm: Option<[f64; 3]>,
        time_s: Option<PyReadonlyArray1<'py, f64>>,
        temperature_c: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let commands = self.commands(&positions, time_s, temperature_c)?;
        let errors =
            work::at_once(py, || Ok(self.correction(tool_mm, |correction| correction.pose_errors(&commands))?))?;
        let display = errors
            .iter()
            .flatten()
            .zip([[UM_PER_MM; 3], [ARCSEC_PER_RAD; 3]].into_iter().flatten().cycle())
            .map(|(error, display)| error * display);
        display.collect::<Vec<f64>>().into_pyarray(py).reshape([errors.len(), 6])
    }
}

impl Model {
    /// Commands as readings without observed values.
    fn commands(
        &self,
        positions: &PyReadonlyArray2<'_, f64>,
        time_s: Option<PyReadonlyArray1<'_, f64>>,
        temperature_c: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Readings> {
        let axes = &self.model.machine.axes;
        let array = positions.as_array();
        let (rows, columns) = array.dim();
        if columns != axes.len() {
            let names: Vec<String> = axes.iter().map(|axis| axis.column("")).collect();
            let message = format!("`positions` has {columns} columns; {} are expected", axes.len());
            return Err(Failed::argument(message, format!("in this order: {}", names.join(", "))).into());
        }
        let column = |(place, axis): (usize, &abbe::model::axis::Axis)| {
            array.column(place).iter().map(|position| axis.kind.to_internal(*position)).collect::<Vec<f64>>()
        };
        let of_rows = |name: &str, values: Option<PyReadonlyArray1<'_, f64>>| {
            let values = values.map_or(Ok(Vec::new()), |values| {
                values.as_array().iter().copied().map(Ok).collect::<PyResult<Vec<f64>>>()
            })?;
            if values.is_empty() || values.len() == rows {
                return Ok(values);
            }
            let message = format!("`{name}` has {} values, `positions` has {rows} rows", values.len());
            Err::<_, PyErr>(Failed::argument(message, "one value for each row").into())
        };
        let temperature_c = temperature_c.map(|values| of_rows("temperature_c", Some(values))).transpose()?;
        let temperature_c = temperature_c.map(|values| ("temperature_c".to_string(), values));
        Ok(Readings {
            positions: axes.iter().enumerate().map(column).collect(),
            time_s: of_rows("time_s", time_s)?,
            drivers: temperature_c.into_iter().collect(),
            ..Readings::default()
        })
    }

    fn correction<T>(&self, tool_mm: Option<[f64; 3]>, with: impl FnOnce(&Correction<'_>) -> T) -> T {
        let machine = &self.model.machine;
        let tool_mm = tool_mm.unwrap_or(self.model.tool_mm);
        let errors = EstimatedErrors::of_model(&self.model, tool_mm, self.model.table_mm);
        with(&Correction { machine, errors: &errors, tool_mm, aim: Aim::of(machine) })
    }
}
