//! A model from its JSON text, with the checks that a file of a user needs.

use std::path::Path;

use abbe_model::ModelError;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::driver::{Driver, Reference, TEMPERATURE};
use abbe_model::effect::Effect;
use abbe_model::error::Location;
use abbe_model::files;
use abbe_model::files::read::{effects_of_nodes, machine_of_node};
use abbe_model::instrument::InstrumentKind;
use abbe_model::session::Prior;
use faer::Mat;
use serde_json::Value;

use super::document::{self, Document, SCHEMA, SCHEMA_VERSION};
use super::location::path_at;
use super::write::{CHECKSUM, checksum};
use super::{DriverRange, IdentifiedModel, ModelParameter, Quality};
use crate::error::IdentifyError;
use crate::noise::{Noise, NoiseSource};
use crate::numerics::symmetric::Symmetric;
use crate::parameters::Role;
use crate::unit::Unit;

/// Least eigenvalue of a covariance over its largest, in scaled parameters, below 0 by rounding.
const ROUNDING_OF_COVARIANCE: f64 = 1e-9;

/// Reads a model file.
///
/// # Errors
/// If the file cannot be read, is no model, is of a newer version, or was changed by hand: the file, the key, what was
/// found and what to do.
pub fn read(path: &Path) -> Result<IdentifiedModel, IdentifyError> {
    read_text(path, &files::text(path, "the model file")?.text)
}

/// As [`read`], from the text of the file.
///
/// # Errors
/// As [`read`].
pub fn read_text(path: &Path, text: &str) -> Result<IdentifiedModel, IdentifyError> {
    let file = File { path };
    let value: Value = serde_json::from_str(text).map_err(|cause| file.not_json(text, &cause))?;
    file.check_header(&value)?;
    let document: Document = serde_json::from_str(text).map_err(|cause| file.wrong_value(text, &cause))?;
    if document.sha256 != checksum(&value) {
        let message = format!(
            "`{CHECKSUM}` is \"{}\", but the checksum of the other keys is another: the file was changed after it \
             was saved",
            document.sha256
        );
        return Err(file.error(message, SAVE_AGAIN));
    }
    file.model(document)
}

/// The file in messages.
struct File<'p> {
    path: &'p Path,
}

const SAVE_AGAIN: &str = "save the model again";

impl File<'_> {
    fn error(&self, message: impl Into<String>, help: &str) -> IdentifyError {
        self.error_in(Location::file(self.path), message, help)
    }

    fn error_in(&self, location: Location, message: impl Into<String>, help: &str) -> IdentifyError {
        IdentifyError::Model(ModelError::Input { location, message: message.into(), help: Some(help.to_string()) })
    }

    fn not_json(&self, text: &str, cause: &serde_json::Error) -> IdentifyError {
        let is_toml = text.contains("[[test]]") || text.contains("[machine]") || text.contains("[axis.");
        if is_toml {
            return self.error(
                "this is a session or machine file, not a model",
                "name a file in which a fit was saved as a model",
            );
        }
        let message = format!("not valid JSON: {cause}");
        self.error_in(
            Location::line(self.path, cause.line()),
            message,
            "name a file in which a fit was saved as a model",
        )
    }

    fn check_header(&self, value: &Value) -> Result<(), IdentifyError> {
        let help = "name a file in which a fit was saved as a model";
        match value.get("schema").and_then(Value::as_str) {
            Some(SCHEMA) => {}
            Some(other) => {
                return Err(self.error(format!("`schema` is \"{other}\"; \"{SCHEMA}\" is expected"), help));
            }
            None if value.get("command").is_some() => {
                return Err(self.error("this is the result of a command, not a model", help));
            }
            None => return Err(self.error(format!("the file has no `schema`; \"{SCHEMA}\" is expected"), help)),
        }
        let version = value.get("schema_version").and_then(Value::as_u64);
        match version {
            Some(version) if version == u64::from(SCHEMA_VERSION) => Ok(()),
            Some(version) if version > u64::from(SCHEMA_VERSION) => Err(self.error(
                format!(
                    "`schema_version` is {version}; this program reads versions up to {SCHEMA_VERSION}: a newer \
                     program saved the model"
                ),
                "use a newer version of Abbe, or save the model again with this one",
            )),
            _ => Err(self.error(
                format!("`schema_version` is missing or not a version; {SCHEMA_VERSION} is expected"),
                SAVE_AGAIN,
            )),
        }
    }

    /// A value of the wrong type, with the path of its key.
    fn wrong_value(&self, text: &str, cause: &serde_json::Error) -> IdentifyError {
        let before: usize = text.split_inclusive('\n').take(cause.line().saturating_sub(1)).map(str::len).sum();
        let path = path_at(text, before + cause.column());
        let cause_text = cause.to_string();
        let what = cause_text.split(" at line ").next().unwrap_or_default();
        let message = if path.is_empty() { what.to_string() } else { format!("`{path}`: {what}") };
        self.error_in(Location::line(self.path, cause.line()), message, SAVE_AGAIN)
    }

    fn model(&self, document: Document) -> Result<IdentifiedModel, IdentifyError> {
        let machine = self.machine(&document.machine)?;
        let Some(instrument) = InstrumentKind::of_word(&document.instrument) else {
            let message = format!("`instrument`: \"{}\" is not an instrument", document.instrument);
            return Err(self.error(message, SAVE_AGAIN));
        };
        let effects = self.effects(&document.effects, &machine, instrument)?;
        let parameters = self.parameters(&document.parameters, &effects, &machine)?;
        let covariance = self.covariance(&document, &parameters)?;
        for (k, direction) in document.null_directions.iter().enumerate() {
            if direction.len() != parameters.len() || !direction.iter().all(|share| share.is_finite()) {
                let message = format!(
                    "`null_directions[{k}]` has {} numbers; one for each of the {} parameters is expected",
                    direction.len(),
                    parameters.len()
                );
                return Err(self.error(message, SAVE_AGAIN));
            }
        }
        let locations = document.locations.iter().map(|location| {
            let name = ErrorName::parse(&location.id).filter(|name| machine.error_slot(name).is_some());
            let name = name.ok_or_else(|| {
                self.error(format!("`locations`: the machine has no error \"{}\"", location.id), SAVE_AGAIN)
            })?;
            Ok((name, location.internal))
        });
        let noise = self.noise(&document.noise)?;
        Ok(IdentifiedModel {
            locations: locations.collect::<Result<_, IdentifyError>>()?,
            ranges: document.ranges.iter().map(|of| range(&machine, of)).collect(),
            quality: Quality {
                readings: document.fit.readings,
                rms_um: document.fit.rms_um,
                heldout_rms_um: document.fit.heldout_rms_um,
                u_enlargement: document.fit.u_enlargement,
            },
            tool_mm: document.tool_mm,
            table_mm: document.table_mm,
            reference: reference(&document.reference),
            machine,
            instrument,
            effects,
            parameters,
            covariance,
            null_directions: document.null_directions,
            noise,
            provenance: document.provenance,
        })
    }

    /// The error of a part with the keys of TOML, as one of this file.
    fn part(&self, key: &str, error: ModelError) -> IdentifyError {
        let help = error.help().unwrap_or(SAVE_AGAIN).to_string();
        self.error(format!("`{key}`: {error}"), &help)
    }

    fn machine(&self, value: &Value) -> Result<Machine, IdentifyError> {
        machine_of_node(value.clone().into()).map_err(|error| self.part("machine", error))
    }

    fn effects(
        &self,
        values: &[Value],
        machine: &Machine,
        instrument: InstrumentKind,
    ) -> Result<Vec<Effect>, IdentifyError> {
        let lists = values.iter().filter_map(|effect| effect.get("tests")?.as_array());
        let mut tests: Vec<String> = lists.flatten().filter_map(|name| Some(name.as_str()?.to_string())).collect();
        tests.sort_unstable();
        tests.dedup();
        let mut effects = Vec::with_capacity(values.len());
        for (k, value) in values.iter().enumerate() {
            let key = format!("effects[{k}]");
            let read = effects_of_nodes(vec![value.clone().into()], machine, instrument, &tests);
            effects.extend(read.map_err(|error| self.part(&key, error))?);
        }
        Ok(effects)
    }

    fn parameters(
        &self,
        entries: &[document::Parameter],
        effects: &[Effect],
        machine: &Machine,
    ) -> Result<Vec<ModelParameter>, IdentifyError> {
        let mut parameters = Vec::with_capacity(entries.len());
        for (j, entry) in entries.iter().enumerate() {
            let fault = |message: &str| self.error(format!("`parameters[{j}]` ({}): {message}", entry.id), SAVE_AGAIN);
            if entries[..j].iter().any(|other| other.id == entry.id) {
                return Err(fault("another parameter has the same name"));
            }
            let same = |other: &&document::Parameter| {
                entry.effect.is_some() && (other.effect, other.coefficient) == (entry.effect, entry.coefficient)
            };
            if let Some(other) = entries[..j].iter().find(same) {
                return Err(fault(&format!("it is the coefficient of an effect that {} is too", other.id)));
            }
            let role = match (entry.role.as_str(), entry.effect, entry.coefficient) {
                ("location", None, None) => {
                    let known = ErrorName::parse(&entry.id).is_some_and(|name| machine.error_slot(&name).is_some());
                    if !known {
                        return Err(fault("the machine has no such error"));
                    }
                    Role::Error
                }
                ("set-up", None, None) => Role::Setup,
                ("coefficient", Some(effect), Some(coefficient))
                    if effects.get(effect).is_some_and(|effect| coefficient < effect.shape.coefficients()) =>
                {
                    Role::Coefficient { effect, coefficient }
                }
                _ => {
                    let what = "`role` is \"location\", \"set-up\", or \"coefficient\" with an index of `effects` and of its \
                                coefficients";
                    return Err(fault(what));
                }
            };
            let prior = match entry.prior_u {
                Some(u) if u > 0.0 => Prior::Gaussian(u),
                None => Prior::Free,
                Some(_) => return Err(fault("`prior_u` must be above 0, or `null`")),
            };
            if !(entry.size > 0.0 && entry.display_per_internal > 0.0) {
                return Err(fault("`size` and `display_per_internal` must be above 0"));
            }
            parameters.push(ModelParameter {
                id: entry.id.clone(),
                role,
                unit: Unit { name: entry.unit.clone(), display_per_internal: entry.display_per_internal },
                value: entry.internal,
                held: entry.held,
                prior,
                size: entry.size,
            });
        }
        for (k, effect) in effects.iter().enumerate() {
            let own = |j: &&ModelParameter| matches!(j.role, Role::Coefficient { effect, .. } if effect == k);
            if parameters.iter().filter(own).count() != effect.shape.coefficients() {
                let message = format!("`effects[{k}]` has {} coefficients", effect.shape.coefficients());
                return Err(self.error(format!("{message}, `parameters` other ones"), SAVE_AGAIN));
            }
        }
        Ok(parameters)
    }

    /// The covariance, which must be positive semidefinite.
    fn covariance(&self, document: &Document, parameters: &[ModelParameter]) -> Result<Mat<f64>, IdentifyError> {
        let rows = &document.covariance;
        let count = parameters.len();
        if rows.len() != count || rows.iter().enumerate().any(|(i, row)| row.len() != i + 1) {
            let message = format!("`covariance` is no lower triangle of {count} rows, one for each parameter");
            return Err(self.error(message, SAVE_AGAIN));
        }
        let entry = |i: usize, j: usize| rows[i.max(j)][i.min(j)];
        // In units of the uncertainties the matrix has ones on its diagonal.
        let deviation: Vec<f64> = (0..count).map(|j| entry(j, j).max(0.0).sqrt()).collect();
        let scaled = Mat::from_fn(count, count, |i, j| match deviation[i] * deviation[j] {
            0.0 => entry(i, j) / (parameters[i].size * parameters[j].size),
            product => entry(i, j) / product,
        });
        let not_definite =
            |what: String| self.error(format!("`covariance` is not positive semidefinite: {what}"), SAVE_AGAIN);
        if let Some(j) = (0..count).find(|j| entry(*j, *j) < 0.0) {
            return Err(not_definite(format!("the variance of {} is negative", parameters[j].id)));
        }
        let Symmetric { values, .. } = Symmetric::of(scaled.as_ref())
            .map_err(|_| not_definite("it has entries that are not finite".to_string()))?;
        let largest = values.last().copied().unwrap_or(0.0).max(1.0);
        if let Some(least) = values.first().filter(|least| **least < -ROUNDING_OF_COVARIANCE * largest) {
            return Err(not_definite(format!("its correlation matrix has the eigenvalue {least:.2e}")));
        }
        Ok(Mat::from_fn(count, count, entry))
    }

    fn noise(&self, noise: &document::Noise) -> Result<Noise, IdentifyError> {
        let sources = [NoiseSource::Stated, NoiseSource::Repeats, NoiseSource::Residual];
        let Some(source) = sources.into_iter().find(|source| source.word() == noise.source) else {
            let message = format!("`noise.source` is \"{}\"; stated, repeats or residual is expected", noise.source);
            return Err(self.error(message, SAVE_AGAIN));
        };
        if noise.noise_um <= 0.0 {
            return Err(self.error(format!("`noise.noise_um` is {}; it must be above 0", noise.noise_um), SAVE_AGAIN));
        }
        if noise.inflation < 1.0 {
            let message = format!("`noise.inflation` is {}; at least 1 is expected", noise.inflation);
            return Err(self.error(message, SAVE_AGAIN));
        }
        Ok(Noise {
            sigma_mm: noise.noise_um * 1e-3,
            ar_coefficients: noise.ar_coefficients.clone(),
            ar_sum_u: noise.ar_sum_u,
            source,
            inflation: noise.inflation,
        })
    }
}

fn range(machine: &Machine, range: &document::Range) -> DriverRange {
    let driver = Driver::parse_on(machine, &range.driver);
    DriverRange { driver, component_axis: range.axis.clone(), range: range.internal }
}

fn reference(stated: &document::Reference) -> Reference {
    let mut means = stated.drivers.clone();
    means.insert(TEMPERATURE.to_string(), stated.temperature_c);
    Reference::without_history(stated.time_s, means)
}
