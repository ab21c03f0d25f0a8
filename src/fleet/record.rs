//! The result of one session, as JSON has it: what the tables of a data set and the history of a machine need.

use std::collections::BTreeMap;

use abbe_identify::IdentifyError;
use abbe_identify::fit::Fit;
use abbe_identify::fit::base::{Gauge, base_parameters};
use abbe_identify::noise::NoiseSource;
use abbe_identify::numerics::solve::Svd;
use abbe_identify::parameter_description::parameter_meaning;
use abbe_identify::parameters::Role;
use abbe_identify::problem::Problem;
use abbe_identify::results::validation::ValidationVerdict;
use abbe_identify::results::{
    Covariance, DeterminedBy, EffectName, GoodnessVerdict, ParameterResult, TraceVerdict, Unobservable,
};
use abbe_identify::tolerance::Conformity;
use faer::Mat;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::options::Options;

/// Version of the schema of records and of the tables that are made from them.
pub const SCHEMA_VERSION: u32 = 2;

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
    pub inputs: Vec<InputRecord>,
    /// Why there is no result; `null` if there is one.
    pub error: Option<ErrorRecord>,
    /// Instrument: `ballbar`, `r-test`, …
    pub instrument: Option<String>,
    /// Number of readings without outliers.
    pub readings: Option<usize>,
    /// Number of readings excluded as outliers.
    pub outliers: Option<usize>,
    /// Standard deviation of one scalar reading, µm.
    pub noise_um: Option<f64>,
    /// Source of `noise_um`: `stated`, `repeats` or `residual`.
    pub noise_source: Option<NoiseSource>,
    /// Verdict of the trace; `null` without a trace.
    pub verdict: Option<TraceVerdict>,
    /// Whether the residual of the final model agrees with the noise.
    pub goodness: Option<GoodnessVerdict>,
    /// Rms of the residual of the declared model, µm.
    pub rms_before_um: Option<f64>,
    /// Rms of the residual of the final model, µm: with the found effects if there was a trace.
    pub rms_um: Option<f64>,
    /// Rms of the residual over held-out readings of the final model, µm.
    pub heldout_rms_um: Option<f64>,
    /// Numerical rank of the final model.
    pub rank: Option<usize>,
    /// Number of parameters of the final model, set-up parameters included.
    pub parameter_count: Option<usize>,
    /// Number of set-up conflicts.
    pub conflicts: Option<usize>,
    /// The parameters of the final model: the identifiable ones in the order of `covariance`, then the others.
    pub parameters: Vec<ParameterRecord>,
    /// Covariance of the identifiable parameters: the lower triangle, row by row.
    pub covariance: Vec<f64>,
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

/// An input file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InputRecord {
    /// Its name relative to the folder of the session file.
    pub file: String,
    /// SHA-256 of its contents, in hexadecimal; `null` if it cannot be read.
    pub sha256: Option<String>,
}

/// Why a session has no result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorRecord {
    /// Where it failed: `read`, `fit`, `trace` or `validate`.
    pub stage: String,
    /// What was found and what was expected.
    pub message: String,
}

/// A parameter of the final model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterRecord {
    /// Identifier: `EX0C`, `bar[A100]`, `EZC~C:h2.amplitude`.
    pub id: String,
    /// Estimate, in `unit`; `null` if it is not identifiable.
    pub value: Option<f64>,
    /// Standard uncertainty, in `unit`; `null` if the parameter is not identifiable.
    pub u: Option<f64>,
    /// Unit of `value` and `u`: `um`, `arcsec`, …
    pub unit: Option<String>,
    /// What the parameter is, in words.
    pub meaning: Option<String>,
    /// Whether the readings identify it.
    pub identifiable: bool,
    /// What determines the estimate.
    pub determined_by: DeterminedBy,
    /// Whether the estimate exceeds its expanded uncertainty and is quotable.
    pub significant: bool,
    /// Whether the estimate may be quoted with `u`: the readings determine it, and the model lacks no effect.
    pub quotable: bool,
}

/// Base parameters of the machine: all that the readings determine of it, with other parameters held at nominal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseRecord {
    /// The parameters that are held at nominal.
    pub held: Vec<String>,
    /// The base parameters.
    pub parameters: Vec<BaseParameterRecord>,
    /// Their covariance: the lower triangle, row by row.
    pub covariance: Vec<f64>,
}

/// A base parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseParameterRecord {
    /// Identifier.
    pub id: String,
    /// Estimate, in `unit`.
    pub value: f64,
    /// Standard uncertainty, in `unit`.
    pub u: f64,
    /// Unit of `value` and `u`.
    pub unit: String,
    /// What the parameter is, in words.
    pub meaning: String,
}

impl BaseRecord {
    /// Of a fit; `None` if it separates all parameters, or its null space has no stable parametrisation.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(problem: &Problem, fit: &Fit) -> Result<Option<BaseRecord>, IdentifyError> {
        if fit.rank.null_space.ncols() == 0 {
            return Ok(None);
        }
        let base = match base_parameters(problem, fit, Gauge::OwnDirection) {
            Ok(base) => base,
            Err(IdentifyError::NotApplicable { .. }) => return Ok(None),
            Err(error) => return Err(error),
        };
        let list = &problem.parameters.list;
        let display = |j: usize| list[j].unit.display_per_internal;
        let of_machine = |j: &usize| list[*j].role != Role::Setup;
        let kept: Vec<usize> = (0..list.len()).filter(|j| !base.held.contains(j)).filter(of_machine).collect();
        let covariance = |i: usize, j: usize| base.covariance[(i, j)] * display(i) * display(j);
        let parameters = kept.iter().map(|j| BaseParameterRecord {
            id: list[*j].id.clone(),
            value: problem.parameters.value(*j, &base.beta) * display(*j),
            u: covariance(*j, *j).max(0.0).sqrt(),
            unit: list[*j].unit.name.clone(),
            meaning: parameter_meaning(problem, *j, None),
        });
        let rows = kept.iter().enumerate();
        Ok(Some(BaseRecord {
            held: base.held.iter().filter(|j| of_machine(j)).map(|j| list[*j].id.clone()).collect(),
            parameters: parameters.collect(),
            covariance: rows.flat_map(|(row, i)| kept[..=row].iter().map(|j| covariance(*i, *j))).collect(),
        }))
    }

    /// Number of directions of the base parameters that the readings determine: the rank of their covariance. Along the others
    /// they are held at nominal.
    pub fn determined(&self) -> usize {
        let known: Vec<usize> = (0..self.parameters.len()).filter(|own| self.parameters[*own].u > 0.0).collect();
        let u = |own: usize| self.parameters[known[own]].u;
        let correlation = Mat::from_fn(known.len(), known.len(), |a, b| {
            self.covariance.get(in_triangle(known[a], known[b])).copied().unwrap_or(0.0) / (u(a) * u(b))
        });
        Svd::of(correlation.as_ref()).map_or(known.len(), |svd| svd.rank(HELD))
    }
}

/// Eigenvalue of a correlation, as a share of the largest, below which it is a rounding error.
const HELD: f64 = 1e-11;

/// Position of an entry in a lower triangle that is stored row by row.
fn in_triangle(a: usize, b: usize) -> usize {
    let (low, high) = (a.min(b), a.max(b));
    high * (high + 1) / 2 + low
}

/// A found effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectRecord {
    /// Identifier: `EZC~C:h2`.
    pub id: String,
    /// What moves.
    pub component: String,
    /// The quantity that the effect follows.
    pub driver: String,
    /// Shape of the dependence.
    pub shape: String,
    /// Order of a harmonic, degree of a polynomial.
    pub order: Option<f64>,
    /// The tests to which the effect is confined; empty for all tests.
    pub tests: Vec<String>,
    /// What the effect is, in words.
    pub meaning: String,
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

/// The parameters of a session that a history follows.
pub struct Followed<'r> {
    /// Identifier, unit, meaning, value and standard uncertainty.
    pub values: Vec<(&'r str, &'r str, &'r str, f64, f64)>,
    /// The place of each in the covariance.
    places: Vec<usize>,
    covariance: &'r [f64],
}

impl Followed<'_> {
    /// Covariance of two of them by their positions in `values`.
    pub fn covariance_of(&self, a: usize, b: usize) -> f64 {
        self.covariance.get(in_triangle(self.places[a], self.places[b])).copied().unwrap_or(0.0)
    }
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
    /// The parameters that have moved, the most significant first.
    pub moved: Vec<String>,
}

impl EffectRecord {
    /// An effect with its aliases, by their identifiers.
    pub fn new(id: String, result: &abbe_identify::results::EffectResult, aliases: Vec<String>) -> EffectRecord {
        let EffectName { component, driver, shape, order, tests, meaning } = result.name.clone();
        EffectRecord {
            id,
            component,
            driver,
            shape,
            order,
            tests,
            meaning,
            family: result.family.clone(),
            p_value: result.p_value,
            rms_gain_um: result.rms_gain_um,
            unique: result.unique,
            aliases,
        }
    }
}

impl Record {
    /// Sets the parameters with their covariance. Parameters of a null-space direction that are not among the
    /// identifiable ones have no value.
    pub fn set_parameters(
        &mut self,
        parameters: &[ParameterResult],
        covariance: &Covariance,
        unobservable: &[Unobservable],
    ) {
        self.parameters = parameters
            .iter()
            .map(|parameter| ParameterRecord {
                id: parameter.id.clone(),
                value: Some(parameter.value),
                u: Some(parameter.u),
                unit: Some(parameter.unit.clone()),
                meaning: Some(parameter.meaning.clone()),
                identifiable: true,
                determined_by: parameter.determined_by,
                significant: parameter.significant,
                quotable: parameter.quotable,
            })
            .collect();
        let combinations = unobservable.iter().map(|direction| &direction.combination);
        for (id, count) in combinations.flat_map(|combination| combination.keys().map(|id| (id, combination.len()))) {
            if !self.parameters.iter().any(|known| known.id == *id) {
                self.parameters.push(ParameterRecord {
                    id: id.clone(),
                    value: None,
                    u: None,
                    unit: None,
                    meaning: None,
                    identifiable: false,
                    determined_by: if count == 1 { DeterminedBy::Nothing } else { DeterminedBy::BaseCombination },
                    significant: false,
                    quotable: false,
                });
            }
        }
        let lower = covariance.matrix.iter().enumerate().flat_map(|(row, entries)| entries.iter().take(row + 1));
        self.covariance = lower.copied().collect();
    }

    /// The parameters of the machine with their values, and those held at nominal: the base parameters if the readings do
    /// not separate all, else the identifiable ones.
    pub fn followed(&self, by_base: bool) -> Followed<'_> {
        match self.base.as_ref().filter(|_| by_base) {
            Some(base) => {
                // A parameter without uncertainty is held at nominal in a combination that the readings hardly determine.
                let known = base.parameters.iter().enumerate().filter(|(_, own)| own.u > 0.0);
                let (places, values) =
                    known.map(|(place, own)| (place, (&*own.id, &*own.unit, &*own.meaning, own.value, own.u))).unzip();
                Followed { values, places, covariance: &base.covariance }
            }
            None => {
                let known = self.parameters.iter().enumerate().filter(|(_, own)| own.identifiable);
                let known: Vec<(usize, &ParameterRecord)> = known.filter(|(_, own)| own.value.is_some()).collect();
                let value = |own: &ParameterRecord| own.value.zip(own.u).unwrap_or_default();
                Followed {
                    values: (known.iter())
                        .map(|(_, own)| {
                            (
                                &*own.id,
                                own.unit.as_deref().unwrap_or_default(),
                                own.meaning.as_deref().unwrap_or_default(),
                                value(own).0,
                                value(own).1,
                            )
                        })
                        .collect(),
                    places: known.iter().map(|(place, _)| *place).collect(),
                    covariance: &self.covariance,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two parameters of which the readings determine the sum, one that they determine, and one that they do not: two directions.
    #[test]
    fn directions_held_at_nominal_are_not_determined() {
        let known = [("a", 1.0), ("b", 1.0), ("c", 0.5), ("d", 0.0)];
        let parameters = known.map(|(id, u)| BaseParameterRecord {
            id: id.into(),
            value: 0.0,
            u,
            unit: "um".into(),
            meaning: String::new(),
        });
        let covariance = vec![1.0, 1.0, 1.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0];
        let base = BaseRecord { held: Vec::new(), parameters: parameters.to_vec(), covariance };
        assert_eq!(base.determined(), 2);
        let record = Record { base: Some(base), ..Record::default() };
        let followed = record.followed(true);
        assert_eq!(followed.values.iter().map(|(id, ..)| *id).collect::<Vec<_>>(), ["a", "b", "c"]);
        assert_eq!((followed.covariance_of(0, 1), followed.covariance_of(2, 2)), (1.0, 0.25));
    }
}
