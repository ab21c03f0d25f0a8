//! Result of a self-calibration, as JSON has it.

use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::session::Session;
use schemars::JsonSchema;
use serde::Serialize;

use super::position::{self, Position};
use super::{Calibration, Function, MonteCarlo, Reference};
use crate::monte_carlo::Distribution;
use crate::noise::ReadingNoise;
use crate::parameter_description::error_meaning;
use crate::results::{Estimate, Finding, Interval, Unobservable};

/// Bins of a histogram in a report.
const REPORTED_BINS: usize = 100;
/// Radius of a circle, in standard uncertainties of its points, below which linear propagation does not describe the
/// uncertainty of its centre.
const NARROW: f64 = 3.0;

/// Value of a function at one angle.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FunctionPoint {
    /// Angle, degrees.
    pub at_deg: f64,
    /// Value, µm; `null` where it is not identifiable.
    pub value_um: Option<f64>,
    /// Standard uncertainty of the value; 0 where a boundary condition fixes it.
    pub u_um: Option<f64>,
}

/// A function of an angle.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FunctionResult {
    /// Name of the function.
    pub id: String,
    /// Values of the function.
    pub points: Vec<FunctionPoint>,
}

/// Number of Monte Carlo runs by value.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Histogram {
    /// Lower end of the first bin, µm.
    pub from_um: f64,
    /// Upper end of the last bin, µm.
    pub to_um: f64,
    /// Number of runs in each bin. All bins have the same width.
    pub counts: Vec<u64>,
    /// Number of runs below the first bin.
    pub below: u64,
    /// Number of runs above the last bin.
    pub above: u64,
}

/// Distribution of a quantity over the Monte Carlo runs.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DistributionResult {
    /// The quantity.
    pub id: String,
    /// Mean over the runs, µm.
    pub mean_um: f64,
    /// Standard deviation over the runs, µm.
    pub u_um: f64,
    /// Shortest coverage interval, µm.
    pub shortest_interval_um: Interval,
    /// Probabilistically symmetric coverage interval, µm.
    pub symmetric_interval_um: Interval,
    /// Histogram of the runs.
    pub histogram: Histogram,
}

/// Monte Carlo of a self-calibration.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MonteCarloResult {
    /// Runs, seed and coverage probability.
    #[serde(flatten)]
    pub draws: MonteCarlo,
    /// Distribution of every quantity.
    pub quantities: Vec<DistributionResult>,
}

/// Rotary axis, linear axes and artefact, separated from readings of one artefact.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SelfCalibration {
    /// `self-calibration`.
    pub method: String,
    /// The rotary axis.
    pub axis: String,
    /// Number of readings.
    pub readings: usize,
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
    /// Root mean square of the residual of the solution, µm.
    pub rms_um: f64,
    /// Number of values of all functions.
    pub value_count: usize,
    /// Numerical rank without boundary conditions.
    pub rank_without_conditions: usize,
    /// The boundary conditions.
    pub conditions: Vec<String>,
    /// Number of parameters under the conditions, the radius included where it is estimated.
    pub parameter_count: usize,
    /// Numerical rank under the conditions.
    pub rank: usize,
    /// The functions.
    pub functions: Vec<FunctionResult>,
    /// Deviation of the radius at 0° from the stated one; absent where it is not estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<Estimate>,
    /// Position errors of the axis from the centre of the least-squares circle.
    pub parameters: Vec<Estimate>,
    /// Position errors of the axis from the angles of rotation.
    pub parameters_by_turn: Vec<Estimate>,
    /// Radius of the least-squares circle, µm; `null` where the axis gets no position.
    pub circle_radius_um: Option<f64>,
    /// Error motions: the displacements less the rotation about that centre.
    pub error_motions: Vec<FunctionResult>,
    /// The null-space directions in words.
    pub unobservable: Vec<Unobservable>,
    /// The Monte Carlo runs; absent where they were not requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<MonteCarloResult>,
    /// Warnings in words.
    pub warnings: Vec<String>,
}

impl Calibration {
    /// The result of the calibration.
    pub fn report(&self, session: &Session, draws: Option<&MonteCarlo>) -> SelfCalibration {
        let axis = session.machine.axes[self.equations.axis].name.clone();
        let mut warnings = session.warnings.clone();
        warnings.extend(crate::fit::enlargement_warning(self.enlargement));
        if !session.effects.is_empty() {
            warnings.push("self-calibration does not model the declared effects: its functions include them".into());
        }
        if self.equations.reference == Reference::FirstReading {
            warnings.push(
                "the readings are referred to the first one, as in the paper, and its noise is not propagated; `radius_u_um = inf` in the \
                 tests takes the radius from all readings"
                    .into(),
            );
        }
        let position = self.has_position().then(|| self.position());
        match &position {
            None => warnings.push(
                "the displacements of the table are not identifiable at every position of the axis: the position of the axis is not estimated"
                    .into(),
            ),
            Some(position) if position.narrow => warnings.push(format!(
                "the circle of the displacements (radius {:.2} µm) is close to their uncertainty: the distribution of its centre is \
                 not Gaussian; use the estimate from the angles of rotation, or a Monte Carlo propagation",
                position.radius_mm * 1e3
            )),
            Some(_) => {}
        }
        let parameters = |which: usize| {
            position.as_ref().map_or(Vec::new(), |position| {
                (0..2)
                    .map(|k| {
                        let name = self.location(k, &axis);
                        let meaning = error_meaning(&session.machine, &name);
                        let (value, u) = (position.centres_mm[which][k], position.u_mm[which][k]);
                        Estimate::new(name.to_string(), value * 1e3, u * 1e3, "um").with_meaning(meaning)
                    })
                    .collect()
            })
        };
        let columns = self.equations.columns();
        SelfCalibration {
            method: "self-calibration".into(),
            readings: self.equations.rows.len(),
            noise: ReadingNoise { value: self.sigma_mm * 1e3, source: self.noise_source, ..ReadingNoise::default() },
            rms_um: self.solution.rms_mm * 1e3,
            value_count: columns,
            rank_without_conditions: self.rank_before,
            conditions: self.conditions.iter().map(|condition| condition.words.clone()).collect(),
            parameter_count: self.solution.parameters,
            rank: self.solution.rank.identifiable_basis.ncols(),
            functions: Function::ALL.map(|function| self.function(function, &axis)).to_vec(),
            radius: (self.solution.values_mm.len() > columns && self.solution.identifiable[columns]).then(|| {
                let value = self.solution.values_mm[columns] * 1e3;
                Estimate::new("radius", value, self.u_mm(columns) * 1e3, "um")
                    .with_meaning("artefact: deviation of the radius from the stated one")
            }),
            parameters: parameters(0),
            parameters_by_turn: parameters(1),
            circle_radius_um: position.as_ref().map(|position| position.radius_mm * 1e3),
            error_motions: position.as_ref().map_or(Vec::new(), |position| self.error_motions(position, &axis)),
            unobservable: self.unobservable(&axis),
            monte_carlo: draws.map(|draws| self.drawn(draws, &axis, position.is_some())),
            warnings,
            axis,
        }
    }

    fn u_mm(&self, column: usize) -> f64 {
        self.solution.covariance[(column, column)].max(0.0).sqrt()
    }

    /// `EX0C` for the first direction across axis C where that is X.
    fn location(&self, which: usize, axis: &str) -> ErrorName {
        ErrorName { kind: ErrorKind::Location, freedom: Freedom::ALL[self.equations.across[which]], axis: axis.into() }
    }

    fn function(&self, function: Function, axis: &str) -> FunctionResult {
        let offset = self.equations.offset(function);
        let angles = &self.equations.angles[function as usize];
        let points = angles.iter().enumerate().map(|(k, angle)| {
            let identifiable = self.solution.identifiable[offset + k];
            FunctionPoint {
                at_deg: degrees(*angle),
                value_um: identifiable.then(|| self.solution.values_mm[offset + k] * 1e3),
                u_um: identifiable.then(|| self.u_mm(offset + k) * 1e3),
            }
        });
        FunctionResult { id: self.equations.name(function, axis), points: points.collect() }
    }

    fn position(&self) -> AxisPositionEstimate {
        let turns = self.turns();
        let (first, second) = (self.values_mm(Function::First), self.values_mm(Function::Second));
        let sense = self.equations.sense;
        let found: Position<f64> = position::position(&turns, sense, &mut Vec::new(), |k| [first[k], second[k]]);
        let jacobian = position::jacobian(&turns, sense, first, second);
        let covariance = &self.solution.covariance;
        let u = jacobian.map(|row| {
            let terms = row
                .iter()
                .enumerate()
                .flat_map(|(i, a)| row.iter().enumerate().map(move |(j, b)| a * b * covariance[(i, j)]));
            terms.sum::<f64>().max(0.0).sqrt()
        });
        let count = 2 * turns.len();
        let mean_square = (0..count).map(|k| covariance[(k, k)]).sum::<f64>() / count as f64;
        AxisPositionEstimate {
            centres_mm: [found.circle, found.turn],
            u_mm: [[u[0], u[1]], [u[2], u[3]]],
            radius_mm: found.radius,
            narrow: found.radius.is_nan() || found.radius < NARROW * mean_square.sqrt(),
        }
    }

    fn error_motions(&self, position: &AxisPositionEstimate, axis: &str) -> Vec<FunctionResult> {
        let [a, b] = position.centres_mm[0];
        let sense = self.equations.sense;
        let turns = self.turns();
        (0..2)
            .map(|which| {
                let function = [Function::First, Function::Second][which];
                let offset = self.equations.offset(function);
                let points = turns.iter().enumerate().map(|(k, [sin, cos])| {
                    let turned = match which {
                        0 => a * (1.0 - cos) + sense * b * sin,
                        _ => b * (1.0 - cos) - sense * a * sin,
                    };
                    FunctionPoint {
                        at_deg: degrees(self.equations.angles[0][k]),
                        value_um: Some((self.solution.values_mm[offset + k] - turned) * 1e3),
                        u_um: Some(self.u_mm(offset + k) * 1e3),
                    }
                });
                FunctionResult {
                    id: ErrorName {
                        kind: ErrorKind::Motion,
                        freedom: Freedom::ALL[self.equations.across[which]],
                        axis: axis.into(),
                    }
                    .to_string(),
                    points: points.collect(),
                }
            })
            .collect()
    }

    /// What a value is called: `EXC,total(45°)`, `radius`.
    fn id(&self, column: usize, axis: &str) -> String {
        if column >= self.equations.columns() {
            return "radius".into();
        }
        let (function, angle) = self.equations.node(column);
        format!("{}({}°)", self.equations.name(function, axis), degrees(angle))
    }

    fn unobservable(&self, axis: &str) -> Vec<Unobservable> {
        let name = |free: usize| {
            let column = self.free.get(free).copied().unwrap_or(self.equations.columns());
            self.id(column, axis)
        };
        self.solution
            .rank
            .null_combinations
            .iter()
            .map(|row| {
                let terms = row.iter().enumerate().filter(|(_, value)| **value != 0.0);
                Unobservable {
                    finding: Finding::Structural,
                    combination: terms.map(|(k, value)| (name(k), *value)).collect(),
                    why: "no reading of these tests changes when these values change together; touch at a second direction that \
                          shares no divisor with the number of angles, or at more angles"
                        .into(),
                }
            })
            .collect()
    }

    fn drawn(&self, draws: &MonteCarlo, axis: &str, with_position: bool) -> MonteCarloResult {
        let distributions = self.monte_carlo(draws);
        let values = self.solution.values_mm.len();
        let mut quantities = Vec::new();
        for (k, distribution) in distributions.iter().enumerate() {
            let id = match k.checked_sub(values) {
                None if !self.solution.identifiable[k] || self.u_mm(k) <= 1e-9 * self.sigma_mm => continue,
                None => self.id(k, axis),
                Some(_) if !with_position => continue,
                Some(place @ 0..2) => self.location(place, axis).to_string(),
                Some(place) => format!("{} by turn", self.location(place - 2, axis)),
            };
            quantities.push(reported(id, distribution));
        }
        MonteCarloResult { draws: *draws, quantities }
    }
}

/// The axis' position by circle and by turn.
struct AxisPositionEstimate {
    centres_mm: [[f64; 2]; 2],
    u_mm: [[f64; 2]; 2],
    radius_mm: f64,
    narrow: bool,
}

fn reported(id: String, distribution: &Distribution) -> DistributionResult {
    let merged = distribution.counts.len() / REPORTED_BINS;
    let um = |interval: [f64; 2]| Interval::from(interval.map(|end| end * 1e3));
    DistributionResult {
        id,
        mean_um: distribution.mean * 1e3,
        u_um: distribution.u * 1e3,
        shortest_interval_um: um(distribution.shortest),
        symmetric_interval_um: um(distribution.symmetric),
        histogram: Histogram {
            from_um: distribution.from * 1e3,
            to_um: distribution.to * 1e3,
            counts: distribution.counts.chunks(merged.max(1)).map(|bins| bins.iter().sum()).collect(),
            below: distribution.outside[0],
            above: distribution.outside[1],
        },
    }
}

/// An angle in degrees without the rounding of its radians.
fn degrees(angle: f64) -> f64 {
    (angle.to_degrees() * 1e4).round() / 1e4 + 0.0
}
