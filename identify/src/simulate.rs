//! Simulated readings: the states of a plan, errors and effects with given values, noise, and the resolution of the
//! sensor.
//!
//! `reading = round((L(state; errors, set-up, effects) + σ·ν) / r) · r`, with ν standard normal, `r` the resolution,
//! and `L` the chain in `f64`. The identifiers are those of the results, so that the estimates of a fit can be
//! simulated again.

use std::path::Path;
use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::parameter_id::{ParameterId, Part};
use abbe_model::sensitivity::TestModel;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Session, planned};
use abbe_model::unit::ARCSEC_PER_RAD;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Serialize;

use crate::error;
use crate::parameters::Parameters;
use crate::quantity::Given;

/// The values and options of a simulation.
#[derive(Clone, Debug, Default)]
pub struct Simulation {
    /// Values of errors, set-up quantities and coefficients of declared effects; everything else is zero.
    pub given: Vec<Given>,
    /// Standard deviation of a length, mm; `None` for that of the session, or zero if it states none.
    pub noise_mm: Option<f64>,
    /// The same of an angle, rad.
    pub noise_rad: Option<f64>,
    /// Whether set-up quantities without a given value are drawn from their priors.
    pub draw_setups: bool,
    /// Seed of the noise and the set-ups.
    pub seed: u64,
}

/// The result of a simulation.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// The readings of each test, in the order of the session.
    pub readings: Vec<Readings>,
    /// Every value that is not zero.
    pub truth: Vec<Given>,
    /// Standard deviation of the noise of a length, mm.
    pub noise_mm: f64,
    /// Standard deviation of the noise of an angle, rad.
    pub noise_rad: f64,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// The simulated session and the true values of its parameters.
#[derive(Serialize, JsonSchema)]
pub struct SimulationResult {
    /// The session file that was written.
    pub written_session: String,
    /// Number of simulated readings.
    pub readings: usize,
    /// Standard deviation of the simulated noise of lengths, µm.
    pub noise_um: f64,
    /// Standard deviation of the simulated noise of angles, arcsec; absent without angles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_arcsec: Option<f64>,
    /// Resolution of the readings, µm; `null` for none.
    pub resolution_um: Option<f64>,
    /// The parameters that are not zero.
    pub truth: Vec<Given>,
    /// Warnings in words.
    pub warnings: Vec<String>,
}

impl SimulationResult {
    /// Of a simulation that was written to this session file.
    pub fn of(session: &Session, simulated: &Simulated, file: &Path) -> SimulationResult {
        SimulationResult {
            written_session: file.display().to_string(),
            readings: simulated.readings.iter().map(|readings| readings.rows()).sum(),
            noise_um: simulated.noise_mm * 1e3,
            noise_arcsec: session.units().angles.then_some(simulated.noise_rad * ARCSEC_PER_RAD),
            resolution_um: session.resolution_mm.map(|step| step * 1e3),
            truth: simulated.truth.clone(),
            warnings: simulated.warnings.clone(),
        }
    }
}

/// Stream of the generator for the set-ups; test `k` has stream `k + 1`.
const SETUP_STREAM: u128 = 0;

/// Simulates the readings of every test of a session.
///
/// A fit recovers the values of a simulation without noise:
///
/// ```
/// use std::path::Path;
///
/// use abbe_identify::fit;
/// use abbe_identify::quantity::Given;
/// use abbe_identify::simulate::{Simulation, simulate};
/// use abbe_files::ReadOptions;
///
/// let plan = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/chapter5.toml");
/// let mut session = abbe_files::session(&plan, &ReadOptions::default())?;
/// session.resolution_mm = None;
/// let given = vec![Given::parse("EY0A=35.3um")?, Given::parse("EB0A=-1.29arcsec")?];
/// let drawn = simulate(&session, &Simulation { given, noise_mm: Some(0.0), ..Simulation::default() })?;
/// let session = session.with_readings(drawn.readings);
/// let (problem, found) = fit::prepare(&session, 1)?;
/// let parameters = fit::parameters(&problem, &found);
/// let value = |id: &str| parameters.iter().find(|parameter| parameter.id == id).map(|parameter| parameter.value);
/// assert!((value("EY0A").unwrap() - 35.3).abs() < 1e-3);
/// assert!((value("EB0A").unwrap() + 1.29).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
/// # Errors
/// If the plan cannot be carried out, a name or a unit does not fit the session, or the model yields a number that is
/// not finite.
pub fn simulate(session: &Session, simulation: &Simulation) -> Result<Simulated, Diagnostic> {
    if session.instruments().iter().any(|kind| !kind.entry().has_readings) {
        let found = "a session of contacts has no readings to draw";
        return Err(error::not_applicable("simulation", found, "its poses are its data"));
    }
    let planned = planned::planned_session(session)?;
    let mut given = Vec::with_capacity(simulation.given.len());
    let mut open = with_free_setups(session, planned);
    for value in &simulation.given {
        let id = parameter_id(&open, &value.id)?;
        let is_same =
            |(known, other): &(Option<ParameterId>, &Given)| *known == id && (id.is_some() || other.id == value.id);
        if given.iter().any(is_same) {
            return Err(error::repeated_unknown(&value.id));
        }
        if let Some(name) = id.as_ref().and_then(ParameterId::error)
            && !open.unknowns.contains(name)
        {
            open.unknowns.push(name.clone());
        }
        given.push((id, value));
    }

    let tests = &open.tests;
    let models: Vec<TestModel> = tests
        .iter()
        .filter_map(|test| {
            let states = test.readings.as_ref()?;
            Some(TestModel::new(Arc::clone(&open.machine), test.station.clone(), states))
        })
        .collect();
    let mut parameters = Parameters::declared(&open, tests, &models)?;
    let reference = open.reference();
    for effect in &session.effects {
        parameters.add_effect(&open, tests, &models, &reference, effect)?;
    }

    let mut beta = vec![0.0; parameters.list.len()];
    if simulation.draw_setups {
        let stated = Parameters::declared(session, &session.tests, &models)?;
        let mut random = Pcg64::new(u128::from(simulation.seed), SETUP_STREAM);
        for parameter in &stated.list {
            let Prior::Gaussian(u) = parameter.prior else { continue };
            if !parameter.id.is_setup() {
                continue;
            }
            let normal: f64 = StandardNormal.sample(&mut random);
            if let Some(place) = parameters.list.iter().position(|other| other.id == parameter.id) {
                beta[place] = u * normal;
            }
        }
    }
    assign(&parameters, &given, &mut beta)?;

    let warnings = warnings(&parameters, &beta);
    let noise_mm = simulation.noise_mm.or(session.noise_mm).unwrap_or(0.0);
    let noise_rad = simulation.noise_rad.or(session.noise_rad).unwrap_or(0.0);
    let values = parameters.slot_values(&models, &beta);
    let mut readings = Vec::with_capacity(tests.len());
    for (index, (model, values)) in models.iter().zip(&values).enumerate() {
        let mut observed = model.readings(values);
        if let Some(bad) = observed.iter().position(|value| !value.is_finite()) {
            return Err(error::not_finite(&tests[index].name, bad / model.channels().len() + 1, observed[bad]));
        }
        let mut random = Pcg64::new(u128::from(simulation.seed), index as u128 + 1);
        for values in observed.chunks_exact_mut(model.channels().len()) {
            for (value, channel) in values.iter_mut().zip(model.channels()) {
                let normal: f64 = StandardNormal.sample(&mut random);
                *value += normal * if channel.is_angle() { noise_rad } else { noise_mm };
            }
        }
        let states = tests[index].readings.as_deref().cloned().unwrap_or_default();
        let mut of_test = Readings { observed, ..states };
        of_test.channels_to_columns(&open.machine, model.station());
        for values in of_test.observed.chunks_exact_mut(model.channels().len()) {
            for (value, channel) in values.iter_mut().zip(model.channels()) {
                let resolution = if channel.is_angle() { session.resolution_rad } else { session.resolution_mm };
                if let Some(step) = resolution {
                    *value = rounded(*value, step);
                }
            }
        }
        readings.push(of_test);
    }
    let truth = parameters
        .list
        .iter()
        .zip(&beta)
        .filter(|(_, value)| **value != 0.0)
        .map(|(parameter, value)| {
            let unit = &parameter.unit;
            Given { id: parameter.id.to_string(), value: value * unit.display_per_internal, unit: unit.name.clone() }
        })
        .collect();
    Ok(Simulated { readings, truth, noise_mm, noise_rad, warnings })
}

/// Rounds to a multiple of a step. Dividing by the whole reciprocal of the step keeps decimals exact.
fn rounded(value: f64, step: f64) -> f64 {
    let per_unit = 1.0 / step;
    let whole = per_unit.round();
    if (per_unit - whole).abs() < 1e-9 * whole {
        (value * whole).round() / whole
    } else {
        (value / step).round() * step
    }
}

/// The session with its planned states as readings and every set-up quantity free, so that each has an identifier and a
/// slot.
fn with_free_setups(session: &Session, planned: Vec<Readings>) -> Session {
    let mut open = session.clone();
    for (test, states) in open.tests.iter_mut().zip(planned) {
        test.readings = Some(Arc::new(states));
        for prior in &mut test.priors {
            if *prior == Prior::Known {
                *prior = Prior::Free;
            }
        }
    }
    open
}

/// The parameter of this name, an error with the name of its axis as the machine writes it; `None` if the text names none.
fn parameter_id(session: &Session, id: &str) -> Result<Option<ParameterId>, Diagnostic> {
    let mut name = match id.parse::<ParameterId>() {
        Ok(ParameterId::Error(name)) => name,
        other => return Ok(other.ok()),
    };
    let machine = &session.machine;
    let lower = name.axis.to_lowercase();
    let axis = machine
        .axis_index(&name.axis)
        .or_else(|| machine.axes.iter().position(|axis| axis.name.to_lowercase() == lower));
    let Some(axis) = axis else {
        return Err(error::no_axis(machine, format!("`{id}`: "), &name.axis));
    };
    name.axis.clone_from(&machine.axes[axis].name);
    Ok(Some(ParameterId::Error(name)))
}

/// Writes the given values to the parameters. Amplitude and phase of a harmonic become cosine and sine,
/// `A·cos(nq + φ) = A cos φ · cos nq − A sin φ · sin nq`.
fn assign(
    parameters: &Parameters,
    given: &[(Option<ParameterId>, &Given)],
    beta: &mut [f64],
) -> Result<(), Diagnostic> {
    let find = |id: &ParameterId| parameters.list.iter().position(|parameter| parameter.id == *id);
    let mut used = vec![false; given.len()];
    for (effect, id) in parameters.effects.iter().zip(&parameters.effect_ids) {
        if !effect.shape.is_wave() {
            continue;
        }
        let own = |part: Part| ParameterId::Effect(Arc::clone(id), part);
        let [cos, sin] = ["cos", "sin"].map(|name| own(Part::Coefficient(name.to_string())));
        let place = |id: &ParameterId| given.iter().position(|(known, _)| known.as_ref() == Some(id));
        let (amplitude, phase) = (place(&own(Part::Amplitude)), place(&own(Part::Phase)));
        let Some(amplitude) = amplitude else {
            if phase.is_some() {
                return Err(error::missing(
                    format!("`{id}`"),
                    "amplitude beside its phase",
                    format!("give `{id}.amplitude`"),
                ));
            }
            continue;
        };
        if place(&cos).is_some() || place(&sin).is_some() {
            return Err(error::contradictory(
                format!("`{id}.amplitude`"),
                format!("`{id}.cos` or `{id}.sin`"),
                "give one or the other",
            ));
        }
        let Some(cosine) = find(&cos) else {
            continue;
        };
        used[amplitude] = true;
        let size = given[amplitude].1.inside(&parameters.list[cosine].unit)?;
        let angle = match phase {
            Some(phase) => {
                used[phase] = true;
                given[phase].1.in_unit("rad")?
            }
            None => 0.0,
        };
        beta[cosine] = size * angle.cos();
        beta[cosine + 1] = -size * angle.sin();
    }
    for ((id, value), used) in given.iter().zip(used) {
        if used {
            continue;
        }
        let Some(index) = id.as_ref().and_then(find) else {
            return Err(unknown_identifier(parameters, &value.id));
        };
        beta[index] = value.inside(&parameters.list[index].unit)?;
    }
    Ok(())
}

/// The error for an identifier that the session lacks, with those that it has.
fn unknown_identifier(parameters: &Parameters, id: &str) -> Diagnostic {
    let of_role = |coefficients: bool| {
        let ids = parameters.list.iter().map(|parameter| &parameter.id);
        let chosen = ids.filter(|id| if coefficients { id.is_coefficient() } else { id.is_setup() });
        chosen.map(ToString::to_string).collect::<Vec<_>>()
    };
    let of_effect = id.contains('~');
    let these = match of_effect {
        true => "coefficients of its effects are",
        false => "errors are named as in EY0A; set-up quantities are",
    };
    error::unknown("the session", "parameter", id, these, of_role(of_effect))
}

/// Warnings about values without an effect on the readings, and declared effects without a value.
fn warnings(parameters: &Parameters, beta: &[f64]) -> Vec<String> {
    let mut warnings = Vec::new();
    for (index, (parameter, value)) in parameters.list.iter().zip(beta).enumerate() {
        let moves = parameters.contributions.iter().flatten().any(|contribution| contribution.parameter == index);
        if *value != 0.0 && !moves {
            warnings.push(format!("`{}` affects no reading of these tests", parameter.id));
        }
    }
    for (number, effect) in parameters.effects.iter().enumerate() {
        let own = parameters.list.iter().zip(beta).filter(|(parameter, _)| parameter.coefficient_of() == Some(number));
        if own.into_iter().all(|(_, value)| *value == 0.0) {
            warnings.push(format!(
                "the declared effect `{}` has no given value: it is zero in these readings",
                effect.id()
            ));
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::rounded;

    /// Readings are written to files: a rounded reading has no more decimals than its step.
    #[test]
    fn rounding_keeps_the_decimals_of_the_step() {
        assert_eq!(rounded(100.012_349, 1e-4), 100.0123);
        assert_eq!(rounded(-0.000_05, 1e-4), -0.0001);
        // 1/1e-5 is not a whole number in `f64`, and 3 · 1e-5 is not 3e-5.
        assert_eq!(rounded(3.2e-5, 1e-5), 3e-5);
        assert_eq!(rounded(1.0, 0.3), 0.3 * 3.0);
        assert_eq!(rounded(7.0, 3.0), 6.0);
    }
}
