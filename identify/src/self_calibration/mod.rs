//! Self-calibration of a rotary axis and two linear axes by probing an uncalibrated cylinder (Zimmermann & Ibaraki,
//! Int. J. Adv. Manuf. Technol. 107 (2020) 2107). The tests combine four functions of an angle differently, which makes
//! the functions separable.
//!
//! ```text
//! Δr = e(φ)·E_total(C) + W_radial(angle on the artefact) − E_radial(φ)
//! ```
//!
//! φ is the angle of the probed point in the machine while the table is at C. The coefficients are the derivatives of
//! the chain, so all signs follow from the machine file. In test 3 the probed point turns with the table. For a table
//! that turns clockwise `e(φ) = (cos C, −sin C)`; Eq. (3) of the reference prints `+sin C`.
//!
//! Rank, null space, covariance and Monte Carlo are those of every fit. The parameters are not: the angles of the probed
//! point, in the machine and on the artefact, are no drivers of effects.

mod boundary;
mod equations;
mod position;
mod results;
mod solve;

use abbe_model::Diagnostic;
use abbe_model::session::{Session, Test};

pub use boundary::{Condition, Reduction, conditions, reduce};
pub use equations::{Equations, Function, Reference};
pub use results::{DistributionResult, FunctionPoint, FunctionResult, Histogram, MonteCarloResult, SelfCalibration};
pub use solve::{CalibrationSolution, rank_before, solve};

use crate::monte_carlo;
pub use crate::monte_carlo::MonteCarlo;
use crate::noise::{NoiseSource, PureError};

/// The solved equations of a session.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The equations.
    pub equations: Equations,
    /// The boundary conditions.
    pub conditions: Vec<Condition>,
    /// Rank of the equations without the boundary conditions.
    pub rank_before: usize,
    /// The solution.
    pub solution: CalibrationSolution,
    /// Standard uncertainty of a reading, mm.
    pub sigma_mm: f64,
    /// Factor on the uncertainties of the solution: `√(χ²/ν)` if the readings scatter significantly more than stated,
    /// else 1.
    pub enlargement: f64,
    /// The free columns of the equations under the boundary conditions.
    pub free: Vec<usize>,
    /// Source of `sigma_mm`: stated by the session, repeated readings, or the residual of the solution.
    pub noise_source: NoiseSource,
}

/// Least noise, mm.
const LEAST_NOISE_MM: f64 = 1e-9;
/// Noise standard deviation for the decision on the rank if the session states none, mm.
const START_NOISE_MM: f64 = 1e-3;

/// Solves the equations of a session. The noise is the session's `noise_um`, or that of repeats, or the residual of the
/// solution.
///
/// # Errors
/// See [`Equations::of`] and [`conditions`]; also if the session states no noise and the residual has no degrees of
/// freedom.
pub fn calibrate(session: &Session) -> Result<Calibration, Diagnostic> {
    let equations = Equations::of(session)?;
    let conditions = conditions(&equations, &session.machine.axes[equations.axis].name)?;
    let reduction = reduce(equations.columns(), &conditions)?;
    let stated = session.stated_noise_mm();
    // The residual estimates the noise only if the radius is a parameter: relative to one reading, all rows share that
    // reading's noise.
    let free_radius = Equations { reference: Reference::Estimated, ..equations.clone() };
    let unreferenced = solve(&free_radius, &reduction, stated.unwrap_or(START_NOISE_MM))?;
    let square = unreferenced.rms_mm.powi(2) * equations.rows.len() as f64;
    let freedom = unreferenced.freedom as f64;
    let floor = session.resolution_mm.unwrap_or(0.0) / 12.0_f64.sqrt();
    let enlarged =
        |sigma: f64, of_noise: Option<usize>| crate::fit::u_enlargement(square / sigma.powi(2), freedom, of_noise);
    let (sigma_mm, enlargement, noise_source) = match (stated, of_repeats(session)) {
        (Some(sigma), _) => (sigma, enlarged(sigma, None), NoiseSource::Stated),
        (None, Some((sigma, of_noise))) => {
            let sigma = sigma.max(floor).max(LEAST_NOISE_MM);
            (sigma, enlarged(sigma, Some(of_noise)), NoiseSource::Repeats)
        }
        (None, None) if unreferenced.freedom == 0 => {
            return Err(equations::refused(
                "the session states no `noise_um`, and there are no more readings than parameters to estimate it from",
                "state it, or repeat the cycle",
            ));
        }
        (None, None) => ((square / freedom).sqrt().max(floor).max(LEAST_NOISE_MM), 1.0, NoiseSource::Residual),
    };
    let solution = solve(&equations, &reduction, sigma_mm * enlargement)?;
    Ok(Calibration {
        rank_before: rank_before(&equations)?,
        conditions,
        solution,
        sigma_mm,
        enlargement,
        noise_source,
        free: reduction.free,
        equations,
    })
}

/// The standard deviation of repeated readings, mm, and its degrees of freedom; `None` without enough repeats.
fn of_repeats(session: &Session) -> Option<(f64, usize)> {
    let observed = |test: &Test| test.readings.as_ref().map_or_else(Vec::new, |readings| readings.observed.clone());
    let observed: Vec<Vec<f64>> = session.tests.iter().map(observed).collect();
    // A model changes all repeats of a reading by the same.
    let pure = PureError::of(&session.tests, &observed, |_, _| true);
    Some((pure.sigma_mm()?, pure.freedom))
}

impl Calibration {
    /// Values of a function at its angles, mm.
    pub fn values_mm(&self, function: Function) -> &[f64] {
        let offset = self.equations.offset(function);
        &self.solution.values_mm[offset..offset + self.equations.angles[function as usize].len()]
    }

    /// Whether readings determine the displacements of the table at every position of the axis, so that the axis
    /// position can be estimated.
    pub fn has_position(&self) -> bool {
        let count = 2 * self.equations.angles[0].len();
        self.solution.identifiable[..count].iter().all(|seen| *seen)
    }

    /// Sine and cosine of each position of the axis.
    fn turns(&self) -> Vec<[f64; 2]> {
        let turn = |angle: &f64| [angle.sin(), angle.cos()];
        self.equations.angles[0].iter().map(turn).collect()
    }

    /// The distribution of every value, then of the axis position by circle (two) and by rotation (two).
    pub fn monte_carlo(&self, draws: &MonteCarlo) -> Vec<monte_carlo::Distribution> {
        let inputs = self.solution.estimator.ncols();
        monte_carlo::propagate(
            &Propagated { calibration: self, turns: self.turns() },
            &monte_carlo::Draws {
                mean: &vec![0.0; inputs],
                u: &vec![self.sigma_mm * self.enlargement; inputs],
                runs: draws.runs,
                seed: draws.seed,
                coverage: draws.coverage,
            },
        )
    }
}

/// The function from deviations of the readings to values and axis position.
struct Propagated<'a> {
    calibration: &'a Calibration,
    turns: Vec<[f64; 2]>,
}

impl monte_carlo::Function for Propagated<'_> {
    type Scratch = Vec<[f64; 2]>;

    fn inputs(&self) -> usize {
        self.calibration.solution.estimator.ncols()
    }

    fn outputs(&self) -> usize {
        self.calibration.solution.values_mm.len() + 4
    }

    fn evaluate(&self, inputs: &[f64], outputs: &mut [f64], points: &mut Self::Scratch) {
        let solution = &self.calibration.solution;
        let (values, place) = outputs.split_at_mut(solution.values_mm.len());
        values.copy_from_slice(&solution.values_mm);
        // By column, so that an input contributes to all values at once.
        for (j, input) in inputs.iter().enumerate() {
            let shares = solution.estimator.col_as_slice(j);
            values.iter_mut().zip(shares).for_each(|(value, share)| *value += input * share);
        }
        let count = self.turns.len();
        let sense = self.calibration.equations.sense;
        let found = position::position(&self.turns, sense, points, |k| [values[k], values[count + k]]);
        place.copy_from_slice(&[found.circle[0], found.circle[1], found.turn[0], found.turn[1]]);
    }
}
