//! Self-calibration of a rotary axis and two linear axes by probing an uncalibrated cylinder (Zimmermann & Ibaraki, Int. J. Adv. Manuf. Technol.
//! 107 (2020) 2107): four functions of an angle that the tests mix differently come apart.
//!
//! ```text
//! Δr = e(φ)·E_total(C) + W_radial(angle on the artefact) − E_radial(φ)
//! ```
//!
//! for a touch at the angle φ of the machine while the table stands at C. The coefficients are the chain's own derivatives, so that the sense in
//! which the table turns is that of the machine file and no sign is typed in. In test 3 the touch goes with the table: on a table that turns clockwise
//! `e(φ) = (cos C, −sin C)`, where the paper's Eq. (3) prints `+sin C`.

mod boundary;
mod equations;
mod position;
mod results;
mod solve;

use abbe_model::session::Session;
use faer::Mat;

pub use boundary::{Condition, Reduction, conditions, reduce};
pub use equations::{Equations, Function, Reference};
pub use results::{
    DistributionResult, FunctionPoint, FunctionResult, Histogram, MonteCarloResult, SelfCalibration,
};
pub use solve::{Solution, rank_before, solve};

use crate::error::IdentifyError;
use crate::monte_carlo;
pub use crate::monte_carlo::MonteCarlo;

/// A session's equations, solved.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The equations.
    pub equations: Equations,
    /// The boundary conditions.
    pub conditions: Vec<Condition>,
    /// Rank of the equations without them.
    pub rank_before: usize,
    /// The solution.
    pub solution: Solution,
    /// Standard uncertainty of a reading, mm.
    pub sigma_mm: f64,
    /// `√(χ²/ν)` where a stated uncertainty is significantly less than the readings scatter, else 1; the solution's uncertainties are enlarged by it.
    pub u_enlargement: f64,
    /// The columns of the equations that the conditions leave free.
    pub free: Vec<usize>,
    /// Whether the session states it; else it is the residual of the solution.
    pub sigma_stated: bool,
}

/// Guess of the noise from which the rank is decided where nothing is known, mm.
const FIRST_GUESS_MM: f64 = 1e-3;

/// Solves the equations of a session. The uncertainty of a reading is the session's `noise_um`, or the residual of the solution.
///
/// # Errors
/// See [`Equations::of`] and [`conditions`]; also if the session states no noise and the readings leave nothing over to tell it from.
pub fn calibrate(session: &Session) -> Result<Calibration, IdentifyError> {
    let equations = Equations::of(session)?;
    let conditions = conditions(&equations, &session.machine.axes[equations.axis].name)?;
    let reduction = reduce(equations.columns(), &conditions);
    let stated = session.noise_mm.filter(|sigma| *sigma > 0.0);
    // The residual tells of the noise only with the radius as an unknown: referred to one reading, all rows have that reading's noise.
    let free_radius = Equations {
        reference: Reference::Estimated,
        ..equations.clone()
    };
    let left = solve(&free_radius, &reduction, stated.unwrap_or(FIRST_GUESS_MM))?;
    let square = left.rms_mm.powi(2) * equations.rows.len() as f64;
    let freedom = left.freedom as f64;
    let (sigma_mm, u_enlargement) = match stated {
        Some(sigma) => (sigma, crate::fit::u_enlargement(square / sigma.powi(2), freedom)),
        None if left.freedom == 0 => {
            return Err(IdentifyError::Request(
                "self-calibration: the session states no `noise_um`, and there are no more readings than unknowns to tell it from; \
                 state it, or repeat the cycle"
                    .into(),
            ));
        }
        None => {
            let floor = session.resolution_mm.unwrap_or(0.0) / 12.0_f64.sqrt();
            ((square / freedom).sqrt().max(floor).max(1e-9), 1.0)
        }
    };
    let solution = solve(&equations, &reduction, sigma_mm * u_enlargement)?;
    Ok(Calibration {
        rank_before: rank_before(&equations)?,
        conditions,
        solution,
        sigma_mm,
        u_enlargement,
        sigma_stated: stated.is_some(),
        free: reduction.free,
        equations,
    })
}

impl Calibration {
    /// Values of a function at its angles, mm.
    pub fn values_mm(&self, function: Function) -> &[f64] {
        let offset = self.equations.offset(function);
        &self.solution.values_mm[offset..offset + self.equations.angles[function as usize].len()]
    }

    /// Whether the displacements of the table are seen at every position of the axis, so that it has a position.
    pub fn has_position(&self) -> bool {
        let count = 2 * self.equations.angles[0].len();
        self.solution.seen[..count].iter().all(|seen| *seen)
    }

    /// Sine and cosine of each position of the axis.
    fn turns(&self) -> Vec<[f64; 2]> {
        let turn = |angle: &f64| [angle.sin(), angle.cos()];
        self.equations.angles[0].iter().map(turn).collect()
    }

    /// The distribution of every value, then of the axis' position by circle (two) and by turn (two).
    pub fn monte_carlo(&self, draws: &MonteCarlo) -> Vec<monte_carlo::Distribution> {
        let zero = vec![0.0; self.solution.u_inputs_mm.len()];
        let outputs = self.solution.values_mm.len();
        let propagated = Propagated {
            calibration: self,
            // By column, so that an input's share is added to all values at once.
            columns: columns_of(&self.solution.estimator),
            turns: self.turns(),
            outputs,
        };
        monte_carlo::propagate(
            &propagated,
            &monte_carlo::Draws {
                mean: &zero,
                u: &self.solution.u_inputs_mm,
                runs: draws.runs,
                seed: draws.seed,
                coverage: draws.coverage,
            },
        )
    }
}

fn columns_of(matrix: &Mat<f64>) -> Vec<Vec<f64>> {
    (0..matrix.ncols())
        .map(|j| (0..matrix.nrows()).map(|i| matrix[(i, j)]).collect())
        .collect()
}

/// From deviations of the readings to values and position.
struct Propagated<'a> {
    calibration: &'a Calibration,
    columns: Vec<Vec<f64>>,
    turns: Vec<[f64; 2]>,
    outputs: usize,
}

impl monte_carlo::Function for Propagated<'_> {
    type Scratch = Vec<[f64; 2]>;

    fn inputs(&self) -> usize {
        self.columns.len()
    }

    fn outputs(&self) -> usize {
        self.outputs + 4
    }

    fn evaluate(&self, inputs: &[f64], outputs: &mut [f64], points: &mut Self::Scratch) {
        let (values, place) = outputs.split_at_mut(self.outputs);
        values.copy_from_slice(&self.calibration.solution.values_mm);
        for (input, column) in inputs.iter().zip(&self.columns) {
            for (value, share) in values.iter_mut().zip(column) {
                *value += input * share;
            }
        }
        let count = self.turns.len();
        let sense = self.calibration.equations.sense;
        let found = position::position(&self.turns, sense, points, |k| [values[k], values[count + k]]);
        place.copy_from_slice(&[found.circle[0], found.circle[1], found.turn[0], found.turn[1]]);
    }
}
