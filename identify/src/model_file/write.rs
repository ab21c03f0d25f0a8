//! A model as a JSON text.

use abbe_model::Diagnostic;
use abbe_model::document::of_domain;
use abbe_model::document::value::Long;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::document::{Document, IdentifiedModel};
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
        let row = |i: usize| Long((0..=i).map(|j| self.covariance[(i, j)]).collect());
        let triangle = Long((0..self.parameters.len()).map(row).collect());
        let effects = self.effects.iter().map(|effect| of_domain::effect(effect, &self.machine)).collect();
        self.clone().over(of_domain::machine(&self.machine), effects, triangle)
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
