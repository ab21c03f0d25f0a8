//! A model as a JSON text.

use abbe_model::Diagnostic;
use abbe_model::document::kind::Kind;
use abbe_model::document::of_domain;
use abbe_model::document::value::{Long, Positive};
use abbe_model::driver::column::TEMPERATURE;
use abbe_model::session::Prior;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::IdentifiedModel;
use super::document::{self, Document, SCHEMA, SCHEMA_VERSION};
use crate::error;

/// The key of the checksum.
pub(super) const CHECKSUM: &str = "sha256";

impl IdentifiedModel {
    /// The text of the model file.
    ///
    /// # Errors
    /// If a number of the model is not finite.
    pub fn to_text(&self) -> Result<String, Diagnostic> {
        let fault = |cause: serde_json::Error| error::not_written("the model", cause);
        let finite = self.covariance.is_all_finite() && self.parameters.iter().all(|p| p.value.is_finite());
        if !finite {
            return Err(fault(serde::ser::Error::custom("a value or an uncertainty is not finite")));
        }
        let mut value = serde_json::to_value(self.document()).map_err(fault)?;
        let sum = checksum(&value);
        value[CHECKSUM] = Value::String(sum);
        let mut text = String::new();
        print(&value, 0, &mut text);
        text.push('\n');
        Ok(text)
    }

    fn document(&self) -> Document {
        let size = self.parameters.len();
        Document {
            schema: SCHEMA.to_string(),
            schema_version: SCHEMA_VERSION,
            sha256: String::new(),
            provenance: self.provenance.clone(),
            machine: of_domain::machine(&self.machine),
            instrument: Kind(self.instrument),
            effects: Long(self.effects.iter().map(|effect| of_domain::effect(effect, &self.machine)).collect()),
            parameters: Long((0..size).map(|j| self.parameter(j)).collect()),
            covariance: Long((0..size).map(|i| Long((0..=i).map(|j| self.covariance[(i, j)]).collect())).collect()),
            null_directions: Long(self.null_directions.iter().cloned().map(Long).collect()),
            locations: Long(self.locations.iter().map(location).collect()),
            reading_unit: self.unit,
            noise: document::Noise {
                noise_um: Positive(self.noise.sigma_mm * 1e3),
                source: self.noise.source,
                ar_coefficients: self.noise.ar_coefficients.clone(),
                ar_sum_u: self.noise.ar_sum_u,
                inflation: self.noise.inflation,
            },
            fit: self.fit,
            ranges: self.ranges.iter().map(|range| self.range(range)).collect(),
            motion_ranges: self.motion_ranges.clone(),
            tool_mm: self.tool_mm,
            table_mm: self.table_mm,
            reference: document::Reference {
                time_s: self.reference.time_s,
                temperature_c: self.reference.means.get(TEMPERATURE).copied().unwrap_or(0.0),
                drivers: self
                    .reference
                    .means
                    .iter()
                    .filter(|(name, _)| *name != TEMPERATURE)
                    .map(|(name, mean)| (name.clone(), *mean))
                    .collect(),
            },
        }
    }

    fn parameter(&self, j: usize) -> document::Parameter {
        let parameter = &self.parameters[j];
        let display = parameter.unit.display_per_internal;
        document::Parameter {
            id: parameter.id.clone(),
            role: document::Role::of(&parameter.id),
            effect: parameter.effect,
            coefficient: parameter.effect.map(|_| parameter.index),
            value: self.estimate(j) * display,
            u: (!parameter.held).then(|| self.u(j) * display),
            unit: parameter.unit.name.clone(),
            display_per_internal: Positive(display),
            internal: parameter.value,
            held: parameter.held,
            identifiable: parameter.identifiable,
            prior_u: match parameter.prior {
                Prior::Gaussian(u) => Some(Positive(u)),
                Prior::Free | Prior::Known => None,
            },
            size: Positive(parameter.size),
        }
    }

    fn range(&self, range: &super::DriverRange) -> document::Range {
        let component = range.component_axis.as_deref().and_then(|axis| self.machine.axis_index(axis));
        let kind = range.driver.kind_of_axis(&self.machine, component);
        let unit = range.driver.kind().unit(kind);
        document::Range {
            driver: range.driver.to_string(),
            axis: range.component_axis.clone(),
            range: range.range.map(|value| unit.to_display(value)),
            unit: unit.result().to_string(),
            internal: range.range,
        }
    }
}

fn location((name, value): &(abbe_model::component::ErrorName, f64)) -> document::Location {
    let unit = name.freedom.unit().displayed();
    document::Location {
        id: name.to_string(),
        value: unit.to_display(*value),
        unit: unit.name().to_string(),
        internal: *value,
    }
}

/// SHA-256 of a document without its checksum, as compact JSON.
pub(super) fn checksum(document: &Value) -> String {
    let mut content = document.clone();
    if let Some(keys) = content.as_object_mut() {
        keys.shift_remove(CHECKSUM);
    }
    Sha256::digest(content.to_string().as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Prints JSON with lists of numbers on one line.
fn print(value: &Value, depth: usize, text: &mut String) {
    let line = |text: &mut String, depth: usize| {
        text.push('\n');
        text.push_str(&"  ".repeat(depth));
    };
    match value {
        Value::Object(keys) if !keys.is_empty() => {
            text.push('{');
            for (place, (key, value)) in keys.iter().enumerate() {
                text.push_str(if place > 0 { "," } else { "" });
                line(text, depth + 1);
                text.push_str(&Value::String(key.clone()).to_string());
                text.push_str(": ");
                print(value, depth + 1, text);
            }
            line(text, depth);
            text.push('}');
        }
        Value::Array(items) if items.iter().any(|item| item.is_object() || item.is_array()) => {
            text.push('[');
            for (place, item) in items.iter().enumerate() {
                text.push_str(if place > 0 { "," } else { "" });
                line(text, depth + 1);
                print(item, depth + 1, text);
            }
            line(text, depth);
            text.push(']');
        }
        other => text.push_str(&other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two spaces for each level; a list of numbers or words stands on one line.
    #[test]
    fn a_model_is_indented_by_its_levels() {
        let value = serde_json::json!({
            "name": "A \"B\"",
            "empty": {},
            "numbers": [1.5, 2.0],
            "rows": [[1, 2], [3]],
            "parts": [{ "id": "x", "of": [{ "deep": [true] }] }, { "id": "y" }],
        });
        let mut text = String::new();
        print(&value, 0, &mut text);
        let wanted = r#"{
  "name": "A \"B\"",
  "empty": {},
  "numbers": [1.5,2.0],
  "rows": [
    [1,2],
    [3]
  ],
  "parts": [
    {
      "id": "x",
      "of": [
        {
          "deep": [true]
        }
      ]
    },
    {
      "id": "y"
    }
  ]
}"#;
        assert_eq!(text, wanted);
    }
}
