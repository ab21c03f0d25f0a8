//! A session: a machine, tests and readings. It grows by whole new states, so that a computation keeps the state with
//! which it began.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use abbe::document::Origin;
use abbe::files::read::{add_node, plan_of_node};
use abbe::files::table::memory::MemoryColumn;
use abbe::files::{self, Changes, ReadOptions, SourceMap};
use abbe::identify::noise::{Noise, NoiseSource};
use abbe::identify::problem::{Problem, RowBlock};
use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::document::edit::SessionText;
use abbe::model::document::node::Node;
use abbe::model::document::{of_domain, print};
use abbe::model::driver::column;
use abbe::model::effect::Component;
use abbe::model::instrument::channel::labels;
use abbe::model::parameter_id::ParameterId;
use abbe::model::sensitivity::TestModel;
use abbe::model::session::{self as domain, Prior};
use abbe::model::unit::{ARCSEC_PER_RAD, Unit};
use abbe::plan::states;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::failed::Failed;
use crate::keywords::{Keywords, node_of};
use crate::machine::Machine;
use crate::work;

/// What a session is at one time.
pub struct State {
    /// The session.
    pub session: domain::Session,
    /// Its text and its files; no files for a session in memory.
    pub sources: SourceMap,
    /// Its files with their checksums.
    pub origin: Origin,
    /// The least-squares problem at its states, once it is needed.
    problem: Mutex<Option<Arc<Problem>>>,
}

impl State {
    /// A state.
    pub fn new(session: domain::Session, sources: SourceMap, origin: Origin) -> State {
        State { session, sources, origin, problem: Mutex::new(None) }
    }

    /// A state of a session with this document and no files.
    pub fn in_memory(session: domain::Session, document: &Node) -> Result<State, Failed> {
        let file = PathBuf::from("session.toml");
        let text = SessionText::of_document(document, &file)?;
        let sources = SourceMap { file, text, machine_text: None, bodies: Vec::new(), files: Vec::new() };
        Ok(State::new(session, sources, Origin::default()))
    }

    /// The problem at the readings, and at the planned states of tests without readings.
    fn problem(&self) -> Result<Arc<Problem>, Failed> {
        let mut known = self.problem.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(problem) = known.as_ref() {
            return Ok(Arc::clone(problem));
        }
        // No result of this problem depends on its noise.
        let noise = Noise::white(1e-3, NoiseSource::Stated);
        let problem = Arc::new(Problem::new(&states::complete(&self.session, false)?, noise, 1)?);
        *known = Some(Arc::clone(&problem));
        Ok(problem)
    }
}

/// A session.
#[pyclass(frozen, module = "abbe._abbe")]
pub struct Session(RwLock<Arc<State>>);

impl Session {
    /// A session in this state.
    pub fn of(state: State) -> Session {
        Session(RwLock::new(Arc::new(state)))
    }

    /// The present state.
    pub fn state(&self) -> Arc<State> {
        Arc::clone(&self.0.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// The next state, with an entry of a list added.
    fn extend(&self, list: &str, entry: Node, columns: &[MemoryColumn<'_>]) -> PyResult<()> {
        let state = self.state();
        let mut session = state.session.clone();
        add_node(&mut session, list, entry.clone(), columns).map_err(Failed::from)?;
        let mut sources = state.sources.clone();
        sources.text.add(list, &entry).map_err(Failed::from)?;
        let next = State::new(session, sources, state.origin.clone());
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(next);
        Ok(())
    }
}

#[pymethods]
impl Session {
    #[staticmethod]
    #[pyo3(signature = (path, data=None, allow_outside=false))]
    fn read(py: Python<'_>, path: PathBuf, data: Option<PathBuf>, allow_outside: bool) -> PyResult<Session> {
        let state = work::run(py, None, move |_| {
            let options = ReadOptions { data_directory: data, allow_outside, ..ReadOptions::default() };
            let (session, sources) = files::session_with_sources(&path, &options)?;
            let origin = Origin::of_session(&sources);
            Ok(State::new(session, sources, origin))
        })?;
        Ok(Session::of(state))
    }

    /// A session without tests: `head` has the tables of a session file without its machine.
    #[staticmethod]
    fn new(machine: &Machine, head: &Bound<'_, PyDict>) -> PyResult<Session> {
        let mut document = node_of("session", head.as_any())?;
        let tables = print::json_of(&of_domain::machine(&machine.machine)).map_err(Failed::from)?;
        document.set("machine", tables);
        let session = plan_of_node(document.clone()).map_err(Failed::from)?;
        Ok(Session::of(State::in_memory(session, &document)?))
    }

    fn add_test(&self, name: &str, keywords: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut sorted = Keywords::of_test(&self.state().session, keywords)?;
        let mut entry = vec![("name".to_string(), Node::from(name))];
        if sorted.has_columns() {
            entry.push(("data".to_string(), Node::from(format!("{name}.csv").as_str())));
        }
        entry.extend(std::mem::take(&mut sorted.table));
        self.extend("test", Node::table(entry), &sorted.columns()?)
    }

    /// Adds an entry of `[[effect]]` or `[[socket_distance]]`.
    fn add(&self, list: &str, keywords: &Bound<'_, PyDict>) -> PyResult<()> {
        self.extend(list, node_of(list, keywords.as_any())?, &[])
    }

    #[getter]
    fn machine(&self) -> Machine {
        Machine { machine: Arc::clone(&self.state().session.machine) }
    }

    #[getter]
    fn instrument(&self) -> &'static str {
        self.state().session.instrument.word()
    }

    #[getter]
    fn noise_um(&self) -> Option<f64> {
        self.state().session.noise_mm.map(|mm| mm * 1e3)
    }

    #[getter]
    fn errors(&self) -> Vec<String> {
        self.state().session.unknowns.iter().map(ToString::to_string).collect()
    }

    #[getter]
    fn effects(&self) -> Vec<String> {
        self.state().session.effects.iter().map(abbe::model::effect::Effect::id).collect()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.state().session.warnings.clone()
    }

    #[getter]
    fn text(&self) -> String {
        self.state().sources.text.to_string()
    }

    /// Name, number of readings (0 for a plan) and number of channels of each test.
    fn tests(&self) -> Vec<(String, usize, usize)> {
        let state = self.state();
        let rows = |test: &domain::Test| test.readings.as_ref().map_or(0, |readings| readings.rows());
        state.session.tests.iter().map(|test| (test.name.clone(), rows(test), test.station.channels().len())).collect()
    }

    /// The columns of a test by their names in a data file.
    fn columns<'py>(&self, py: Python<'py>, test: &str) -> PyResult<Bound<'py, PyDict>> {
        let state = self.state();
        let found = state.session.tests.iter().find(|known| known.name == test).ok_or_else(|| no_test(&state, test))?;
        let columns = PyDict::new(py);
        let Some(readings) = &found.readings else {
            return Ok(columns);
        };
        if !readings.run.is_empty() {
            columns.set_item("run", PyArray1::from_slice(py, &readings.run))?;
        }
        if !readings.time_s.is_empty() {
            columns.set_item("time_s", PyArray1::from_slice(py, &readings.time_s))?;
        }
        for (name, values) in &readings.drivers {
            columns.set_item(column::in_files(name), PyArray1::from_slice(py, values))?;
        }
        for (axis, positions) in state.session.machine.axes.iter().zip(&readings.positions) {
            let display = positions.iter().map(|position| axis.kind.to_display(*position));
            columns.set_item(axis.column(""), PyArray1::from_vec(py, display.collect()))?;
        }
        let channels = found.station.channels();
        let mut readings = readings.as_ref().clone();
        readings.columns_to_channels(&state.session.machine, &found.station);
        for (first, (channel, label)) in channels.iter().zip(labels(channels)).enumerate() {
            let unit = if channel.is_angle() { Unit::Arcsecond } else { Unit::Millimetre };
            let name = match label {
                "" => format!("reading_{unit}"),
                label => format!("{label}_reading_{unit}"),
            };
            let observed = readings.observed.iter().skip(first).step_by(channels.len());
            columns.set_item(name, PyArray1::from_vec(py, observed.map(|value| unit.to_display(*value)).collect()))?;
        }
        Ok(columns)
    }

    /// Identifier, unit and prior standard uncertainty of each parameter: `None` without a prior.
    fn parameters(&self, py: Python<'_>) -> PyResult<Vec<(String, String, Option<f64>)>> {
        let state = self.state();
        let problem = work::at_once(py, || state.problem())?;
        let row = |parameter: &abbe::identify::parameters::Parameter| {
            let unit = &parameter.unit;
            let prior = match parameter.prior {
                Prior::Gaussian(u) => Some(u * unit.display_per_internal),
                Prior::Known | Prior::Free => None,
            };
            (parameter.id.to_string(), unit.name.clone(), prior)
        };
        Ok(problem.parameters.list.iter().map(row).collect())
    }

    /// The readings, mm or rad, test by test and row by row.
    fn observed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let state = self.state();
        let observed = work::at_once(py, || {
            let problem = state.problem()?;
            let readings = problem.tests.iter().zip(&problem.models).filter_map(|(test, model)| {
                let observed = test.readings.as_ref()?.observed.clone();
                Some(unweighted(model, observed))
            });
            Ok(readings.flatten().collect::<Vec<f64>>())
        })?;
        Ok(observed.into_pyarray(py))
    }

    /// The readings of the model, mm or rad, at parameters in display units.
    fn predict<'py>(&self, py: Python<'py>, parameters: Vec<f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let state = self.state();
        let readings = work::at_once(py, || {
            let problem = state.problem()?;
            let values = problem.slot_values(&internal(&problem, &parameters)?);
            let models = problem.models.par_iter().zip(&values);
            let readings: Vec<Vec<f64>> =
                models.map(|(model, values)| unweighted(model, model.readings(values))).collect();
            // Of one test, nothing is copied.
            Ok(match <[Vec<f64>; 1]>::try_from(readings) {
                Ok([one]) => one,
                Err(several) => several.concat(),
            })
        })?;
        Ok(readings.into_pyarray(py))
    }

    /// The derivatives of [`Session::predict`] by the parameters: one row for each reading.
    fn jacobian<'py>(&self, py: Python<'py>, parameters: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let state = self.state();
        let (matrix, width) = work::at_once(py, || {
            let problem = state.problem()?;
            let beta = internal(&problem, &parameters)?;
            Ok((jacobian(&problem, &beta)?, beta.len()))
        })?;
        let rows = matrix.len().checked_div(width).unwrap_or(0);
        matrix.into_pyarray(py).reshape([rows, width])
    }

    /// A session with simulated readings, the values that are not zero, and warnings. Values without a unit are in that
    /// of the parameter.
    fn simulate(
        &self,
        py: Python<'_>,
        given: Vec<(String, f64, Option<String>)>,
        seed: u64,
        noise_um: Option<f64>,
        noise_arcsec: Option<f64>,
        draw_setups: bool,
        hide_effects: bool,
    ) -> PyResult<(Session, Vec<(String, f64, String)>, Vec<String>)> {
        let state = self.state();
        let (next, truth, warnings) = work::run(py, None, move |_| {
            let given = given.into_iter().map(|(id, value, unit)| {
                let unit = unit.map_or_else(|| unit_of(&state, &id), Ok)?;
                Ok(Given { id, value, unit })
            });
            let given = given.collect::<Result<Vec<_>, Failed>>()?;
            let noise_mm = noise_um.map(|um| um * 1e-3);
            let noise_rad = noise_arcsec.map(|arcsec| arcsec / ARCSEC_PER_RAD);
            let simulation = Simulation { given, noise_mm, noise_rad, draw_setups, seed };
            let simulated = simulate(&state.session, &simulation)?;
            let mut session = state.session.clone().with_readings(simulated.readings);
            let mut sources = SourceMap { files: Vec::new(), ..state.sources.clone() };
            if let Some(noise_um) = noise_um {
                session.noise_mm = noise_mm;
                sources.text.set_of_instrument("noise_um", noise_um);
            }
            if let Some(noise_arcsec) = noise_arcsec {
                session.noise_rad = noise_rad;
                sources.text.set_of_instrument("noise_arcsec", noise_arcsec);
            }
            if hide_effects {
                session.effects.clear();
                sources.text.remove(&["effect"]);
            }
            let truth = simulated.truth.into_iter().map(|own| (own.id, own.value, own.unit));
            Ok((State::new(session, sources, Origin::default()), truth.collect(), simulated.warnings))
        })?;
        Ok((Session::of(next), truth, warnings))
    }

    /// The files of a folder that can be read as this session: names and contents.
    fn files(&self, py: Python<'_>) -> PyResult<Vec<(String, Vec<u8>)>> {
        let state = self.state();
        work::at_once(py, || {
            let readings = state.session.tests.iter().map(|test| test.readings.as_deref().cloned());
            let Some(readings) = readings.collect::<Option<Vec<_>>>() else {
                return Err(Failed::new("a test has no readings: simulate them, or write the text of the plan"));
            };
            Ok(files::with_readings((&state.session, &state.sources), &readings, Changes::default())?)
        })
    }
}

/// The error for an unknown test.
pub fn no_test(state: &State, name: &str) -> Failed {
    let names: Vec<&str> = state.session.tests.iter().map(|test| test.name.as_str()).collect();
    Failed::argument(format!("no test `{name}`"), format!("the session has {}", names.join(", ")))
}

/// Parameters in internal units.
fn internal(problem: &Problem, display: &[f64]) -> Result<Vec<f64>, Failed> {
    let list = &problem.parameters.list;
    if display.len() != list.len() {
        let message = format!("{} parameters where the session has {}", display.len(), list.len());
        return Err(Failed::argument(message, "`Session.parameters` lists them in order"));
    }
    if let Some(place) = display.iter().position(|value| !value.is_finite()) {
        let message = format!("parameter {} is {}; a finite number is expected", list[place].id, display[place]);
        return Err(Failed::argument(message, "in the unit of the parameter"));
    }
    Ok(list.iter().zip(display).map(|(parameter, value)| value / parameter.unit.display_per_internal).collect())
}

/// The readings of a test, mm or rad, from those in which all channels have the same noise.
fn unweighted(model: &TestModel, mut readings: Vec<f64>) -> Vec<f64> {
    let weights = model.weights();
    if weights.iter().any(|weight| *weight != 1.0) {
        for of_row in readings.chunks_exact_mut(weights.len()) {
            of_row.iter_mut().zip(weights).for_each(|(value, weight)| *value /= weight);
        }
    }
    readings
}

/// The derivatives of all readings in mm or rad by all parameters in display units, row by row.
fn jacobian(problem: &Problem, beta: &[f64]) -> Result<Vec<f64>, Failed> {
    let width = beta.len();
    let scale: Vec<f64> =
        problem.parameters.list.iter().map(|parameter| 1.0 / parameter.unit.display_per_internal).collect();
    let values = problem.slot_values(beta);
    let blocks = problem.blocks();
    let scalars_of = |block: &RowBlock| block.rows.len() * problem.channels(block.test);
    let scalars: usize = blocks.iter().map(scalars_of).sum();
    let mut matrix = vec![0.0; scalars * width];
    let mut rest = matrix.as_mut_slice();
    let mut parts = Vec::with_capacity(blocks.len());
    for block in &blocks {
        let (part, after) = rest.split_at_mut(scalars_of(block) * width);
        parts.push((block, part));
        rest = after;
    }
    parts.into_par_iter().try_for_each(|(block, part)| {
        let rows = problem.own_rows(&values[block.test], block)?;
        let own = problem.own_parameters(block.test);
        let weights = problem.models[block.test].weights();
        for (row, to) in part.chunks_exact_mut(width).enumerate() {
            for (place, parameter) in own.iter().enumerate() {
                to[*parameter] = rows[(row, place)] * scale[*parameter] / weights[row % weights.len()];
            }
        }
        Ok::<(), Failed>(())
    })?;
    Ok(matrix)
}

/// The display unit of a parameter: one of the session, or any error of an axis.
fn unit_of(state: &State, id: &str) -> Result<String, Failed> {
    let problem = state.problem()?;
    let known = id.parse::<ParameterId>().ok();
    // Results state harmonics by amplitude and phase.
    if known.as_ref().is_some_and(ParameterId::is_phase) {
        return Ok("deg".to_string());
    }
    let estimated = known.as_ref().map(ParameterId::cosine);
    if let Some(parameter) = problem.parameters.list.iter().find(|parameter| Some(&parameter.id) == estimated.as_ref())
    {
        return Ok(parameter.unit.name.clone());
    }
    let component = known.as_ref().and_then(ParameterId::error).cloned().map(Component::Axis);
    let unit = component.and_then(|component| component.unit(state.session.instrument.unknowns()));
    unit.map(|unit| unit.displayed().name().to_string()).ok_or_else(|| {
        Failed::argument(
            format!("`{id}` has no unit that follows from its name"),
            "write number and unit as a text, such as \"1.5um\"",
        )
    })
}
