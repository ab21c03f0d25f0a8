//! Comparison of a geometric method with the full fit on the same readings: value, uncertainty, and bias.

use std::sync::Arc;

use abbe_identify::error;
use abbe_model::Diagnostic;
use abbe_model::instrument::InstrumentKind;
use abbe_model::session::Session;
use schemars::JsonSchema;
use serde::Serialize;

use super::{Estimate, Estimator, Method};
use abbe_identify::fit::{self, Fit};
use abbe_identify::noise::ReadingNoise;
use abbe_identify::problem::Problem;

/// The circle centre of one test.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CentreResult {
    /// The test.
    pub test: String,
    /// The axis that turns.
    pub axis: String,
    /// Offset of the circle's centre from the nominal axis in the two directions across it.
    pub offsets: Vec<CentreOffset>,
    /// Radius of the circle, mm.
    pub radius_mm: f64,
    /// Position of the circle's plane along the axis, mm from the axis' origin.
    pub plane_mm: f64,
    /// Height of the cone, mm; 0 if both balls lie in the plane.
    pub height_mm: f64,
}

/// Offset of a circle's centre in one direction.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CentreOffset {
    /// `X`, `Y` or `Z`.
    pub direction: String,
    /// The offset, µm.
    pub offset_um: f64,
    /// Its standard uncertainty, µm.
    pub u_um: f64,
    /// Sensitivity of the offset to each declared error.
    pub sensitivities: Vec<OffsetSensitivity>,
}

/// Sensitivity of an offset to an error.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct OffsetSensitivity {
    /// The error.
    pub id: String,
    /// Change of the offset per unit of the error, in `unit`.
    pub value: f64,
    /// `um/um`, `um/arcsec`.
    pub unit: String,
}

/// One error by the method and by the full fit, in its display unit.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ComparisonRow {
    /// The error.
    pub id: String,
    /// Unit of all values.
    pub unit: String,
    /// Estimate of the method; `None` if the method does not identify the error.
    pub value: Option<f64>,
    /// Its standard uncertainty from noise and set-ups, with the factor of the full fit.
    pub u: Option<f64>,
    /// Bias of the method: its estimate from noise-free readings simulated with the full fit's errors, minus those
    /// errors.
    pub bias: Option<f64>,
    /// Estimate of the full fit; `None` if the error is not identifiable.
    pub full_value: Option<f64>,
    /// Its standard uncertainty.
    pub full_u: Option<f64>,
    /// Bias of the full fit.
    pub full_bias: Option<f64>,
}

/// Comparison of a method with the full fit.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Comparison {
    /// `circle`, `cone`, `two-plane`.
    pub method: String,
    /// Number of readings in the session.
    pub readings: usize,
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
    /// Residual of the full fit, µm.
    pub rms_um: f64,
    /// Residual of the readings of the method with its estimates, set-ups nominal, µm.
    pub method_rms_um: f64,
    /// Residual of the same readings with the nominal machine, µm: before compensation.
    pub nominal_rms_um: f64,
    /// The centres.
    pub centres: Vec<CentreResult>,
    /// The errors.
    pub errors: Vec<ComparisonRow>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Estimates the errors of a session by a geometric method and by the full fit.
///
/// # Errors
/// See [`Estimator::new`] and [`fit::prepare`].
pub fn compare(session: &Session, method: Method, seed: u64) -> Result<Comparison, Diagnostic> {
    if let Some(other) = session.tests.iter().find(|test| test.station.bar().is_none()) {
        let (found, expected) = (other.station.kind(), InstrumentKind::BallBar);
        return Err(error::other_instrument("the methods of circles", found, expected));
    }
    let (problem, full) = fit::prepare(session, seed)?;
    let estimator = Estimator::new(&problem, method)?;
    let observed = observed(&problem);
    let estimate = estimator.estimate(&problem, &observed)?;
    let list = &problem.parameters.list;

    // The known errors are those of the full fit, without set-up quantities and effects.
    let mut known = vec![0.0; list.len()];
    for (p, parameter) in list.iter().enumerate() {
        if parameter.id.is_error() && full.rank.is_identifiable(p) {
            known[p] = full.beta[p];
        }
    }
    let simulated = readings(&problem, &known);
    let of_simulated: Vec<&[f64]> = simulated.iter().map(Vec::as_slice).collect();
    let again = estimator.estimate(&problem, &of_simulated)?;
    let full_again = refitted(&problem, &simulated, &full)?;

    let mut errors = Vec::new();
    for (p, parameter) in list.iter().enumerate() {
        if !parameter.id.is_error() {
            continue;
        }
        let display = parameter.unit.display_per_internal;
        let index = estimator.errors.iter().position(|error| *error == p);
        let identifiable = full.rank.is_identifiable(p).then_some(());
        errors.push(ComparisonRow {
            id: parameter.id.to_string(),
            unit: parameter.unit.name.clone(),
            value: index.map(|k| estimate.values[k] * display),
            u: index.map(|k| estimate.covariance[(k, k)].max(0.0).sqrt() * full.u_enlargement * display),
            bias: index.map(|k| (again.values[k] - known[p]) * display),
            full_value: identifiable.map(|()| full.beta[p] * display),
            full_u: identifiable.map(|()| full.covariance[(p, p)].max(0.0).sqrt() * full.u_enlargement * display),
            full_bias: identifiable.map(|()| (full_again[p] - known[p]) * display),
        });
    }
    let mut by_method = vec![0.0; list.len()];
    for (k, p) in estimator.errors.iter().enumerate() {
        by_method[*p] = estimate.values[k];
    }
    let rms_um = |beta: &[f64]| {
        let modelled = readings(&problem, beta);
        let (mut sum, mut count) = (0.0, 0);
        for test in &estimator.tests {
            for (row, (o, m)) in observed[*test].iter().zip(&modelled[*test]).enumerate() {
                if !problem.rejected[*test][row] {
                    sum += (o - m).powi(2);
                    count += 1;
                }
            }
        }
        (sum / f64::from(count.max(1))).sqrt() * 1e3
    };
    let mut warnings = session.warnings.clone();
    warnings.extend(fit::enlargement_warning(full.u_enlargement));
    if !problem.parameters.effects.is_empty() {
        warnings.push(format!(
            "the {} method does not model the declared effects: their contributions bias its estimates",
            method.word()
        ));
    }
    Ok(Comparison {
        method: method.word().into(),
        readings: problem.readings(),
        noise: problem.reading_noise(),
        rms_um: abbe_identify::heldout::rms_mm(&problem, &full.residuals) * 1e3,
        method_rms_um: rms_um(&by_method),
        nominal_rms_um: rms_um(&vec![0.0; list.len()]),
        centres: centres(&problem, &estimator, &estimate, full.u_enlargement),
        errors,
        warnings,
    })
}

fn observed<'p>(problem: &'p Problem) -> Vec<&'p [f64]> {
    let of = |test: &'p abbe_model::session::Test| {
        test.readings.as_ref().map_or(&[][..], |readings| readings.observed.as_slice())
    };
    problem.tests.iter().map(of).collect()
}

/// Noise-free readings at given parameters, test by test, mm.
fn readings(problem: &Problem, beta: &[f64]) -> Vec<Vec<f64>> {
    let values = problem.slot_values(beta);
    let models = problem.models.iter().zip(&values);
    models.map(|(model, values)| model.readings(values)).collect()
}

/// The parameters of the full fit to other readings of the same tests.
fn refitted(problem: &Problem, readings: &[Vec<f64>], full: &Fit) -> Result<Vec<f64>, Diagnostic> {
    let mut session = Session::clone(&problem.session);
    let mut remaining = readings.iter();
    for test in &mut session.tests {
        if let (Some(known), Some(drawn)) =
            (&mut test.readings, test_has(problem, &test.name).then(|| remaining.next()).flatten())
        {
            Arc::make_mut(known).observed.clone_from(drawn);
        }
    }
    let mut again = Problem::new(&session, problem.noise.clone(), 0)?;
    again.rejected.clone_from(&problem.rejected);
    Ok(fit::fit(&again, Some(&full.beta))?.beta)
}

fn test_has(problem: &Problem, name: &str) -> bool {
    problem.tests.iter().any(|test| test.name == name)
}

fn centres(problem: &Problem, estimator: &Estimator, estimate: &Estimate, u_enlargement: f64) -> Vec<CentreResult> {
    let list = &problem.parameters.list;
    let declared: Vec<usize> = (0..list.len()).filter(|p| list[*p].id.is_error()).collect();
    let letter = |k: usize| ["X", "Y", "Z"][k].to_string();
    let tests = estimator.tests.iter().zip(&estimator.geometries).zip(&estimate.centres);
    tests
        .enumerate()
        .map(|(test_index, ((test, geometry), centre))| {
            let u = |which: usize| {
                let row = 2 * test_index + which;
                estimate.centre_covariance[(row, row)].max(0.0).sqrt() * u_enlargement * 1e3
            };
            let sensitivity = |which: usize, p: usize| OffsetSensitivity {
                id: list[p].id.to_string(),
                value: estimator.sensitivities[(2 * test_index + which, p)] * 1e3 / list[p].unit.display_per_internal,
                unit: format!("um/{}", list[p].unit.name),
            };
            let offset = |which: usize| CentreOffset {
                direction: letter(geometry.across[which]),
                offset_um: centre.offset_mm[which] * 1e3,
                u_um: u(which),
                sensitivities: declared.iter().map(|p| sensitivity(which, *p)).collect(),
            };
            CentreResult {
                test: problem.tests[*test].name.clone(),
                axis: problem.session.machine.axes[geometry.axis].name.clone(),
                offsets: (0..2).map(offset).collect(),
                radius_mm: centre.radius_mm,
                plane_mm: geometry.plane_mm,
                height_mm: geometry.height_mm,
            }
        })
        .collect()
}
