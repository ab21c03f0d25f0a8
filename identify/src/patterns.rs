//! The pattern of each single error in the readings of each test, for visual diagnosis on plots (Jiang 2014, Figs. 3.7
//! and 3.8).
//!
//! `ΔL_e = L(state; e) − L(state; 0)` by the exact chain, for one error of a stated size at a time, all others zero.
//!
//! Jiang (2014): X. Jiang, *Characterising Geometric Errors in Rotary Axes of 5-axis Machine Tools*, PhD thesis,
//! University of Birmingham.

use abbe_model::Diagnostic;
use abbe_model::session::Session;
use abbe_model::session::readings::Readings;
use schemars::JsonSchema;
use serde::Serialize;

use crate::error;
use crate::quantity::Given;
use crate::simulate::{Simulation, simulate};

/// Size of a position error (Jiang 2014, Table 3.1).
const POSITION: (f64, &str) = (10.0, "um");
/// Size of an orientation error.
const ORIENTATION: (f64, &str) = (0.01, "deg");

/// Change of the readings of one test by one error.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Pattern {
    /// The test.
    pub test: String,
    /// The error, by its name on input.
    pub error: String,
    /// Its size, in `unit`.
    pub size: f64,
    /// `um`, `deg`, …
    pub unit: String,
    /// Largest absolute deviation along the path, µm.
    pub largest_um: f64,
    /// Mean deviation, µm: the part that the radius of a circle absorbs.
    pub mean_um: f64,
    /// Standard deviation about the mean, µm.
    pub standard_deviation_um: f64,
    /// Reading by reading, µm; the coordinates of a reading are consecutive.
    #[serde(skip)]
    pub deviations_um: Vec<f64>,
}

/// The patterns of a session.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Patterns {
    /// Names and states of the tests.
    #[serde(skip)]
    pub tests: Vec<(String, Readings)>,
    /// Test by test, error by error.
    pub patterns: Vec<Pattern>,
}

/// The session's errors to be estimated, positions of 10 µm and orientations of 0.01°.
pub fn usual_sizes(session: &Session) -> Vec<Given> {
    let given = |name: &abbe_model::component::ErrorName| {
        let (value, unit) = if name.freedom.is_angle() { ORIENTATION } else { POSITION };
        Given { id: name.to_string(), value, unit: unit.to_string() }
    };
    session.unknowns.iter().map(given).collect()
}

/// The pattern of each single error, along the measured or planned path of each test.
///
/// # Errors
/// If a movement is impossible, a name or unit does not fit the session, or the model yields a number that is not
/// finite.
pub fn patterns(session: &Session, errors: &[Given]) -> Result<Patterns, Diagnostic> {
    if errors.is_empty() {
        return Err(error::not_applicable(
            "no error to show",
            "`[unknowns] errors` is empty",
            "give at least one error with its size, as in EY0A=10um",
        ));
    }
    if session.units().angles {
        return Err(error::not_applicable(
            "patterns show lengths",
            "a test of this session reads angles",
            "`plan` and the sensitivities of a report show both",
        ));
    }
    let mut exact = session.clone();
    exact.resolution_mm = None;
    let drawn = |given: Vec<Given>| {
        let simulation = Simulation { given, noise_mm: Some(0.0), ..Simulation::default() };
        Ok::<_, Diagnostic>(simulate(&exact, &simulation)?.readings)
    };
    let without = drawn(Vec::new())?;
    let mut by_error = Vec::with_capacity(errors.len());
    for error in errors {
        by_error.push(drawn(vec![error.clone()])?);
    }
    let mut patterns = Vec::new();
    for (place, test) in session.tests.iter().enumerate() {
        for (error, with) in errors.iter().zip(&by_error) {
            let pairs = with[place].observed.iter().zip(&without[place].observed);
            let deviations_um: Vec<f64> = pairs.map(|(with, without)| (with - without) * 1e3).collect();
            let count = deviations_um.len().max(1) as f64;
            let mean_um = deviations_um.iter().sum::<f64>() / count;
            let square: f64 = deviations_um.iter().map(|d| (d - mean_um).powi(2)).sum();
            patterns.push(Pattern {
                test: test.name.clone(),
                error: error.id.clone(),
                size: error.value,
                unit: error.unit.clone(),
                largest_um: deviations_um.iter().fold(0.0, |most, d| d.abs().max(most)),
                mean_um,
                standard_deviation_um: (square / count).sqrt(),
                deviations_um,
            });
        }
    }
    let names = session.tests.iter().map(|test| test.name.clone());
    Ok(Patterns { tests: names.zip(without).collect(), patterns })
}
