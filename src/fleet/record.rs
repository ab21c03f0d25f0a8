//! The result of one session, as JSON has it: what the tables of a data set and the history of a machine need.

use std::collections::BTreeMap;

use abbe_identify::error::NOT_APPLICABLE;
use abbe_identify::fit::Fit;
use abbe_identify::fit::base::{Gauge, base_parameters};
use abbe_identify::model_file::InputFile;
use abbe_identify::numerics::solve::Svd;
use abbe_identify::problem::Problem;
use abbe_identify::results::{Estimate, ModelResult, TraceVerdict};
use abbe_identify::tolerance::Conformity;
use abbe_model::Diagnostic;
use abbe_trace::result::EffectName;
use abbe_trace::validate::ValidationVerdict;
use faer::Mat;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::options::Options;

/// Version of the schema of records and of the tables that are made from them.
pub const SCHEMA_VERSION: u32 = 3;

/// The result of one session. It depends on the contents of the input files, the options and the build of the program
/// alone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Record {
    /// Version of this schema.
    pub schema_version: u32,
    /// SHA-256 of all inputs, all options and the build of the program, in hexadecimal.
    pub key: String,
    /// Build of the program: its version and a checksum of its sources, such as `0.1.0+3fa2b1c9d4e5`.
    pub tool_version: String,
    /// The options of the analysis.
    pub options: Options,
    /// Seed of all random numbers; it follows from what `key` follows from, except the build.
    pub seed: u64,
    /// Identifier of the session: `session_id` of `[about]`; `null` without one.
    pub session_id: Option<String>,
    /// Identifier of the machine: `serial_number` of `[about]`, else the name of the machine.
    pub machine_id: String,
    /// The machine; `null` if the session cannot be read.
    pub machine: Option<MachineRecord>,
    /// Date of the measurement: `date` of `[about]`; `null` without one.
    pub date: Option<String>,
    /// All notes of `[about]`.
    pub about: BTreeMap<String, String>,
    /// The input files: name relative to the folder of the session file, and SHA-256.
    pub inputs: Vec<InputFile>,
    /// Why there is no result; `null` if there is one.
    pub error: Option<ErrorRecord>,
    /// Instrument: `ballbar`, `r-test`, …
    pub instrument: Option<String>,
    /// The final model, with the found effects; `null` if there is none. Its keys end in `um` where
    /// `reading_unit` is `arcsec` too; the values are then in arcsec.
    pub model: Option<ModelResult>,
    /// Verdict of the trace; `null` without a trace.
    pub verdict: Option<TraceVerdict>,
    /// Rms of the residual of the declared model, µm.
    pub rms_before_um: Option<f64>,
    /// Number of set-up conflicts.
    pub conflicts: Option<usize>,
    /// The base parameters of the machine, if the readings do not separate all of its parameters; `null` otherwise.
    #[serde(default)]
    pub base: Option<BaseRecord>,
    /// The effects that the trace found.
    pub effects: Vec<EffectRecord>,
    /// The decisions by the limits of the session; `null` without limits.
    pub conformity: Option<Conformity>,
    /// The validation of the machine's model; `null` without a model.
    pub validation: Option<ValidationRecord>,
    /// Warnings in words.
    pub warnings: Vec<String>,
}

/// The machine of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MachineRecord {
    /// Its name.
    pub name: String,
    /// Its structural code.
    pub code: String,
    /// SHA-256 of its axes with their geometry, in hexadecimal. Parameters of machines with different axes are not
    /// comparable.
    pub sha256: String,
}

/// Why a session has no result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorRecord {
    /// Where it failed: `read`, `fit`, `trace` or `validate`.
    pub stage: String,
    /// What was found and what was expected.
    pub message: String,
}

/// Base parameters of the machine: all that the readings determine of it, with other parameters held at nominal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseRecord {
    /// The parameters that are held at nominal, without those of combinations that the readings hardly determine.
    pub held: Vec<String>,
    /// The base parameters.
    pub parameters: Vec<Estimate>,
    /// Their covariance, row by row.
    pub covariance: Vec<Vec<f64>>,
}

impl BaseRecord {
    /// Of a fit; `None` if it separates all parameters, or its null space has no stable parametrisation.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(problem: &Problem, fit: &Fit) -> Result<Option<BaseRecord>, Diagnostic> {
        if fit.rank.null_space.ncols() == 0 {
            return Ok(None);
        }
        let base = match base_parameters(problem, fit, Gauge::OwnDirection) {
            Ok(base) => base,
            Err(error) if error.code == NOT_APPLICABLE => return Ok(None),
            Err(error) => return Err(error),
        };
        let list = &problem.parameters.list;
        let display = |j: usize| list[j].unit.display_per_internal;
        let of_machine = |j: &usize| !list[*j].id.is_setup();
        let covariance = |i: usize, j: usize| base.covariance[(i, j)] * display(i) * display(j);
        // A parameter without uncertainty is held at nominal in a combination that the readings hardly determine.
        let is_kept = |j: &usize| !base.held.contains(j) && of_machine(j) && covariance(*j, *j) > 0.0;
        let kept: Vec<usize> = (0..list.len()).filter(is_kept).collect();
        Ok(Some(BaseRecord {
            held: base.held.iter().filter(|j| of_machine(j)).map(|j| list[*j].id.to_string()).collect(),
            parameters: kept.iter().map(|j| base.estimate(problem, *j)).collect(),
            covariance: kept.iter().map(|i| kept.iter().map(|j| covariance(*i, *j)).collect()).collect(),
        }))
    }

    /// Number of directions of the base parameters that the readings determine: the rank of their covariance. Along the others
    /// they are held at nominal.
    pub fn determined(&self) -> usize {
        let count = self.covariance.len();
        let u = |own: usize| self.covariance[own][own].sqrt();
        let correlation = Mat::from_fn(count, count, |a, b| self.covariance[a][b] / (u(a) * u(b)));
        Svd::of(correlation.as_ref()).map_or(count, |svd| svd.rank(HELD))
    }
}

/// Eigenvalue of a correlation, as a share of the largest, below which it is a rounding error.
const HELD: f64 = 1e-11;

/// A found effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectRecord {
    /// Identifier: `EZC~C:h2`.
    pub id: String,
    /// Component, driver, shape, order.
    #[serde(flatten)]
    pub name: EffectName,
    /// Family of the effect in the library.
    pub family: String,
    /// Probability that the whole search finds as much in readings without structure.
    pub p_value: f64,
    /// Rms of what the effect explains in addition to the rest of the model, µm.
    pub rms_gain_um: f64,
    /// Whether no other effect of the library explains the readings equally well.
    pub unique: bool,
    /// Identifiers of the effects that explain the readings equally well, nearest first.
    pub aliases: Vec<String>,
}

/// The validation of the machine's model on the session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ValidationRecord {
    /// SHA-256 of the model file, in hexadecimal.
    pub model_sha256: String,
    /// `holds`, `holds-in-range`, `degraded` or `does-not-hold`.
    pub verdict: ValidationVerdict,
    /// Rms of the residual of the model, µm.
    pub rms_um: f64,
    /// The parameters that have moved, the most significant first; empty if the model itself lacks an effect.
    pub moved: Vec<String>,
}

impl Record {
    /// The parameters that a history follows, and their covariance: the base parameters, or those of the final model.
    pub fn followed(&self, by_base: bool) -> (&[Estimate], &[Vec<f64>]) {
        match (&self.base, &self.model) {
            (Some(base), _) if by_base => (&base.parameters, &base.covariance),
            (_, Some(model)) => (&model.parameters, &model.covariance.matrix),
            _ => (&[], &[]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two parameters of which the readings determine the sum, and one that they determine: two directions.
    #[test]
    fn directions_held_at_nominal_are_not_determined() {
        let covariance = vec![vec![1.0, 1.0, 0.0], vec![1.0, 1.0, 0.0], vec![0.0, 0.0, 0.25]];
        assert_eq!(BaseRecord { covariance, ..BaseRecord::default() }.determined(), 2);
    }
}
