//! A session reading by reading: the columns that plots draw.
//!
//! With `L` the reading and `β` the fitted unknowns, the deviation of a reading from the nominal machine is, to first order, a sum of *shares*:
//!
//! ```text
//! d = observed − L(0) = Σ_k J_k β_k + residual + O(β²)
//! ```
//!
//! so that what a trace would look like without an error is `d` less that error's share. [`SessionSeries::second_order_um`] says how large the last term is.

pub mod abscissa;
pub mod sensitivities;
pub mod spectrum;

use abbe_model::instrument::InstrumentKind;

use crate::error::IdentifyError;
use crate::fit::Fit;
use crate::heldout::{FoldKind, rms_mm};
use crate::parameters::Role;
use crate::problem::Problem;
use abscissa::{Abscissa, Stretch};

/// What a share belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// An identified error of the machine.
    Error,
    /// An effect, declared or found.
    Effect,
    /// Everything of the set-up together: balls, bar, pose of a tracker.
    Setup,
    /// Unknowns that the readings cannot tell apart, together.
    Unseen,
}

/// What takes a part in the deviation of readings.
#[derive(Clone, Debug)]
pub struct Share {
    /// `EY0A`, `EZC~C:h2`, `set-up`, `confounded`.
    pub id: String,
    /// What it belongs to.
    pub cause: Cause,
    /// Places of its unknowns.
    pub unknowns: Vec<usize>,
}

/// One test, row by row; scalars of a reading together, µm.
#[derive(Clone, Debug)]
pub struct TestSeries {
    /// Its name.
    pub name: String,
    /// What it goes along.
    pub way: Abscissa,
    /// Stretches in one direction of one run.
    pub stretches: Vec<Stretch>,
    /// Observed less nominal; for instruments with three coordinates less the set-up's share too, for there a frame of reference comes with it.
    pub deviation_um: Vec<f64>,
    /// What the model before leaves.
    pub before_um: Vec<f64>,
    /// What the model after leaves.
    pub after_um: Vec<f64>,
    /// What each share adds to the deviation.
    pub shares_um: Vec<Vec<f64>>,
}

/// A fitted session, reading by reading.
#[derive(Clone, Debug)]
pub struct SessionSeries {
    /// The shares of the deviation.
    pub shares: Vec<Share>,
    /// The tests.
    pub tests: Vec<TestSeries>,
    /// Scalar coordinates of a reading.
    pub coordinates: usize,
    /// The greatest that the sum of shares misses any reading of the model by, µm.
    pub second_order_um: f64,
}

impl SessionSeries {
    /// Root mean square of the residual of the model before over the scalar readings that count, µm.
    pub fn rms_before_um(&self, problem: &Problem<'_>) -> f64 {
        let before: Vec<Vec<f64>> = self.tests.iter().map(|test| test.before_um.clone()).collect();
        rms_mm(problem, &before)
    }

    /// How much a share takes part in: the sum of its squares, µm².
    pub fn weight_of(&self, share: usize) -> f64 {
        let of = |test: &TestSeries| test.shares_um[share].iter().map(|v| v * v).sum::<f64>();
        self.tests.iter().map(of).sum()
    }
}

/// The shares of a fit: each identified error, each effect, the set-up, and what is confounded.
fn shares(problem: &Problem<'_>, fit: &Fit) -> Vec<Share> {
    let mut shares: Vec<Share> = Vec::new();
    let mut add =
        |id: &str, cause: Cause, unknown: usize| match shares.iter_mut().find(|share| share.id == id) {
            Some(share) => share.unknowns.push(unknown),
            None => shares.push(Share {
                id: id.to_string(),
                cause,
                unknowns: vec![unknown],
            }),
        };
    for (j, parameter) in problem.parameters.list.iter().enumerate() {
        match parameter.role {
            Role::Setup => add("set-up", Cause::Setup, j),
            _ if !fit.rank.is_identifiable(j) => add("confounded", Cause::Unseen, j),
            Role::Error => add(&parameter.id, Cause::Error, j),
            Role::Coefficient { effect, .. } => {
                add(&problem.parameters.effect_ids[effect], Cause::Effect, j);
            }
        }
    }
    shares
}

/// The views of a fit, beside the residuals (mm) that another model of the same session leaves; without one, the nominal machine stands before.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn views(
    problem: &Problem<'_>,
    fit: &Fit,
    before_mm: Option<&[Vec<f64>]>,
) -> Result<SessionSeries, IdentifyError> {
    let shares = shares(problem, fit);
    let three = problem.coordinates() == 3;
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
            if three {
                let of_setup = shares.iter().position(|share| share.cause == Cause::Setup);
                *deviation -= of_setup.map_or(0.0, |k| shares_um[k][i]);
            }
        }
        let before_um = match before_mm {
            Some(before) => before[number].iter().map(|mm| mm * 1e3).collect(),
            None => deviation_um.clone(),
        };
        let way = Abscissa::of(&problem.session.machine, readings);
        let poses = problem.folds.kind == FoldKind::Poses;
        tests.push(TestSeries {
            name: test.name.clone(),
            stretches: way.stretches(readings, poses),
            way,
            deviation_um,
            before_um,
            after_um,
            shares_um,
        });
    }
    Ok(SessionSeries {
        shares,
        tests,
        coordinates: problem.coordinates(),
        second_order_um,
    })
}

/// `J_k β_k` of every share, µm, by test.
fn shares_of_readings(
    problem: &Problem<'_>,
    fit: &Fit,
    shares: &[Share],
) -> Result<Vec<Vec<Vec<f64>>>, IdentifyError> {
    let coordinates = problem.coordinates();
    let values = problem.slot_values(&fit.beta);
    let mut of_tests: Vec<Vec<Vec<f64>>> = problem
        .models
        .iter()
        .map(|model| vec![vec![0.0; model.rows() * coordinates]; shares.len()])
        .collect();
    for block in problem.blocks() {
        let rows = problem.rows(&values, &block)?;
        for (k, share) in shares.iter().enumerate() {
            let column = &mut of_tests[block.test][k];
            for i in 0..rows.nrows() {
                let sum: f64 = share.unknowns.iter().map(|j| rows[(i, *j)] * fit.beta[*j]).sum();
                column[block.rows.start * coordinates + i] = sum * 1e3;
            }
        }
    }
    Ok(of_tests)
}

/// Lengths of readings' vectors; readings of one scalar as they are.
pub fn lengths(values: &[f64], coordinates: usize) -> Vec<f64> {
    if coordinates == 1 {
        return values.to_vec();
    }
    let length = |reading: &[f64]| reading.iter().map(|v| v * v).sum::<f64>().sqrt();
    values.chunks(coordinates).map(length).collect()
}

/// Correlation of the identified errors and effects' coefficients, by identifier: row by row. Unknowns of the set-up and what is confounded are
/// left out.
pub fn correlation(problem: &Problem<'_>, fit: &Fit) -> (Vec<String>, Vec<Vec<f64>>) {
    let list = &problem.parameters.list;
    let chosen: Vec<usize> = (0..list.len())
        .filter(|j| {
            list[*j].role != Role::Setup && fit.rank.is_identifiable(*j) && fit.covariance[(*j, *j)] > 0.0
        })
        .collect();
    let of = |j: usize, k: usize| {
        fit.covariance[(j, k)] / (fit.covariance[(j, j)] * fit.covariance[(k, k)]).sqrt()
    };
    let matrix = chosen
        .iter()
        .map(|j| chosen.iter().map(|k| of(*j, *k)).collect())
        .collect();
    let ids = chosen.iter().map(|j| list[*j].id.clone()).collect();
    (ids, matrix)
}

/// Whether readings of this instrument are lengths about a nominal one, which a circle can show.
pub fn is_round(instrument: InstrumentKind) -> bool {
    instrument.coordinates() == 1
}
