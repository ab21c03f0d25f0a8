//! A session reading by reading: the columns for plots.
//!
//! Let `L` be the reading and `β` the fitted parameters. The deviation of a reading from the nominal machine is, to
//! first order, a sum of *shares*:
//!
//! ```text
//! d = observed − L(0) = Σ_k J_k β_k + residual + O(β²)
//! ```
//!
//! The deviation without one error is thus `d` minus the share of that error. [`SessionSeries::second_order_um`] bounds
//! the last term.

pub mod abscissa;
pub mod paths;
pub mod places;
pub mod sensitivities;
pub mod spectrum;

use abbe_model::Diagnostic;
use abbe_model::instrument::channel::Channel;
use abbe_model::parameter_id::ParameterId;
use abbe_model::sensitivity::TestModel;
use abbe_model::unit::Unit;

use crate::fit::Fit;
use crate::heldout::rms_mm;
use crate::problem::Problem;
use abscissa::{Abscissa, PathSegment};

/// The source of a share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// An identified error of the machine.
    Error,
    /// An effect, declared or found.
    Effect,
    /// All set-up quantities together: balls, bar, pose of a tracker.
    Setup,
    /// All confounded parameters together.
    Unseen,
}

/// A contribution to the deviation of the readings.
#[derive(Clone, Debug)]
pub struct Share {
    /// `EY0A`, `EZC~C:h2`, `set-up`, `confounded`.
    pub id: String,
    /// The source.
    pub cause: Cause,
    /// The indices of its parameters.
    pub unknowns: Vec<usize>,
}

/// One test, row by row, µm; the coordinates of a reading are consecutive.
#[derive(Clone, Debug)]
pub struct TestSeries {
    /// Its name.
    pub name: String,
    /// Number of channels of a reading.
    pub channels: usize,
    /// Its abscissa.
    pub way: Abscissa,
    /// Segments of one run in one direction.
    pub stretches: Vec<PathSegment>,
    /// Observed minus nominal. For instruments with three coordinates without the set-up's share, which includes the
    /// frame of reference.
    pub deviation_um: Vec<f64>,
    /// Residual of the model before.
    pub before_um: Vec<f64>,
    /// Residual of the model after.
    pub after_um: Vec<f64>,
    /// Contribution of each share to the deviation.
    pub shares_um: Vec<Vec<f64>>,
}

/// A fitted session, reading by reading.
#[derive(Clone, Debug)]
pub struct SessionSeries {
    /// The shares of the deviation.
    pub shares: Vec<Share>,
    /// The tests.
    pub tests: Vec<TestSeries>,
    /// The unit of all values. An angle beside lengths is the length that
    /// has the same noise, µm.
    pub unit: Unit,
    /// Whether every reading is a vector.
    pub vectors: bool,
    /// The largest difference between the sum of shares and the model over all readings, µm.
    pub second_order_um: f64,
}

impl SessionSeries {
    /// Root mean square of the residual of the model before over the scalar readings that are not excluded, µm.
    pub fn rms_before_um(&self, problem: &Problem) -> f64 {
        let before: Vec<Vec<f64>> = self.tests.iter().map(|test| test.before_um.clone()).collect();
        rms_mm(problem, &before)
    }

    /// The size of a share: its sum of squares, µm².
    pub fn weight_of(&self, share: usize) -> f64 {
        let of = |test: &TestSeries| test.shares_um[share].iter().map(|v| v * v).sum::<f64>();
        self.tests.iter().map(of).sum()
    }
}

/// The shares of a fit: each identified error, each effect, the set-up, and the confounded parameters.
fn shares(problem: &Problem, fit: &Fit) -> Vec<Share> {
    let mut shares: Vec<Share> = Vec::new();
    let mut add = |id: &str, cause: Cause, unknown: usize| match shares.iter_mut().find(|share| share.id == id) {
        Some(share) => share.unknowns.push(unknown),
        None => shares.push(Share { id: id.to_string(), cause, unknowns: vec![unknown] }),
    };
    for (j, parameter) in problem.parameters.list.iter().enumerate() {
        match &parameter.id {
            ParameterId::Setup { .. } => add("set-up", Cause::Setup, j),
            _ if !fit.rank.is_identifiable(j) => add("confounded", Cause::Unseen, j),
            ParameterId::Error(name) => add(&name.to_string(), Cause::Error, j),
            ParameterId::Effect(effect, _) => add(&effect.to_string(), Cause::Effect, j),
        }
    }
    shares
}

/// The series of a fit, with the residuals (mm) of another model of the same session as `before`. The default for
/// `before` is the nominal machine.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn views(problem: &Problem, fit: &Fit, before_mm: Option<&[Vec<f64>]>) -> Result<SessionSeries, Diagnostic> {
    let shares = shares(problem, fit);
    let vectors = problem.are_vectors();
    let nominal_mm = problem.residuals(&vec![0.0; fit.beta.len()]);
    let mut of_tests = shares_of_readings(problem, fit, &shares)?;
    let mut second_order_um = 0.0_f64;
    let mut tests = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let shares_um = std::mem::take(&mut of_tests[number]);
        let after_um: Vec<f64> = fit.residuals[number].iter().map(|mm| mm * 1e3).collect();
        let mut deviation_um: Vec<f64> = nominal_mm[number].iter().map(|mm| mm * 1e3).collect();
        for (i, deviation) in deviation_um.iter_mut().enumerate() {
            let sum: f64 = shares_um.iter().map(|share| share[i]).sum();
            second_order_um = second_order_um.max((*deviation - sum - after_um[i]).abs());
            if vectors {
                let of_setup = shares.iter().position(|share| share.cause == Cause::Setup);
                *deviation -= of_setup.map_or(0.0, |k| shares_um[k][i]);
            }
        }
        let before_um = match before_mm {
            Some(before) => before[number].iter().map(|mm| mm * 1e3).collect(),
            None => deviation_um.clone(),
        };
        let way = Abscissa::of(&problem.session.machine, readings);
        let poses = problem.folds.kind.is_poses();
        tests.push(TestSeries {
            name: test.name.clone(),
            channels: problem.channels(number),
            stretches: way.stretches(readings, poses),
            way,
            deviation_um,
            before_um,
            after_um,
            shares_um,
        });
    }
    Ok(SessionSeries { shares, tests, unit: problem.unit(), vectors, second_order_um })
}

/// `J_k β_k` of every share, µm, by test.
fn shares_of_readings(problem: &Problem, fit: &Fit, shares: &[Share]) -> Result<Vec<Vec<Vec<f64>>>, Diagnostic> {
    let values = problem.slot_values(&fit.beta);
    let zero = |model: &TestModel| vec![vec![0.0; model.rows() * model.channels().len()]; shares.len()];
    let mut of_tests: Vec<Vec<Vec<f64>>> = problem.models.iter().map(zero).collect();
    for block in problem.blocks() {
        let rows = problem.rows(&values, &block)?;
        for (k, share) in shares.iter().enumerate() {
            let column = &mut of_tests[block.test][k];
            for i in 0..rows.nrows() {
                let sum: f64 = share.unknowns.iter().map(|j| rows[(i, *j)] * fit.beta[*j]).sum();
                column[block.rows.start * problem.channels(block.test) + i] = sum * 1e3;
            }
        }
    }
    Ok(of_tests)
}

/// Lengths of vector readings; readings of one channel unchanged.
pub fn lengths(values: &[f64], channels: usize) -> Vec<f64> {
    if channels == 1 {
        return values.to_vec();
    }
    let length = |reading: &[f64]| reading.iter().map(|v| v * v).sum::<f64>().sqrt();
    values.chunks(channels).map(length).collect()
}

/// Correlation matrix of the identified errors and effects' coefficients, with identifiers, row by row. Set-up
/// parameters and confounded parameters are excluded.
pub fn correlation(problem: &Problem, fit: &Fit) -> (Vec<String>, Vec<Vec<f64>>) {
    let list = &problem.parameters.list;
    let chosen: Vec<usize> = (0..list.len())
        .filter(|j| !list[*j].id.is_setup() && fit.rank.is_identifiable(*j) && fit.covariance[(*j, *j)] > 0.0)
        .collect();
    let of = |j: usize, k: usize| fit.covariance[(j, k)] / (fit.covariance[(j, j)] * fit.covariance[(k, k)]).sqrt();
    let matrix = chosen.iter().map(|j| chosen.iter().map(|k| of(*j, *k)).collect()).collect();
    let ids = chosen.iter().map(|j| list[*j].id.to_string()).collect();
    (ids, matrix)
}

/// Whether an instrument measures one length about a nominal one, for polar plots.
pub fn is_round(channels: &[Channel]) -> bool {
    matches!(channels, [one] if !one.is_angle())
}
