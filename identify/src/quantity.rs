//! Values with units, as users write them: `EY0A=35.3um`, `"bar[A100]" = "-0.4 um"`.

use std::path::Path;

use abbe_files::read::lowered;
use abbe_model::Diagnostic;
use abbe_model::document::fault::Fault;
use abbe_model::document::node::{Named, Node};
use abbe_model::document::value::Long;
use abbe_model::session::limits::{LARGEST, MAX_LENGTH_MM};
use abbe_model::unit::{Dimension, Unit};
use abbe_model::words::number as number_in_words;
use schemars::JsonSchema;
use serde::Serialize;

use crate::unit::ParameterUnit;

/// The value of one parameter, with its unit.
///
/// ```
/// use abbe_identify::quantity::Given;
///
/// let given = Given::parse("EB0A = -1.3arcsec")?;
/// assert_eq!((given.id.as_str(), given.value, given.unit.as_str()), ("EB0A", -1.3, "arcsec"));
/// # Ok::<(), abbe_model::Diagnostic>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "TrueValue", description = "The true value of a parameter.")]
pub struct Given {
    /// The identifier in results, or the literature name: `EY0A`, `e_y0a`, `bar[A100]`, `EZC~C:h2.amplitude`.
    pub id: String,
    /// The number, in `unit`.
    pub value: f64,
    /// `um`, `arcsec`, `deg`, …
    pub unit: String,
}

/// Maximum length of a number with its unit, in bytes. It bounds the time to separate number and unit.
const MAX_BYTES: usize = 100;

impl Given {
    /// Reads `ID=VALUEUNIT`, spaces allowed.
    ///
    /// # Errors
    /// If there is no `=`, no finite number or no unit.
    pub fn parse(text: &str) -> Result<Given, Diagnostic> {
        let Some((id, quantity)) = text.rsplit_once('=') else {
            return Err(not_a_quantity(text, "has no value"));
        };
        Given::of(id.trim(), quantity)
    }

    /// From a name and a number with its unit, `35.3 um`.
    ///
    /// # Errors
    /// If the text does not start with a finite number of moderate size, or has no unit.
    pub fn of(id: &str, quantity: &str) -> Result<Given, Diagnostic> {
        let quantity = quantity.trim();
        if quantity.len() > MAX_BYTES {
            let found = format!("a number with its unit of {} bytes", quantity.len());
            return Err(too_large(id, &found, &format!("{MAX_BYTES} bytes")));
        }
        // The longest prefix that is a number: `1e3um` is a thousand µm, and an `e` that starts a unit is no exponent.
        let number = (1..=quantity.len()).rev().filter(|end| quantity.is_char_boundary(*end)).find_map(|end| {
            let value: f64 = quantity[..end].trim_end().parse().ok()?;
            Some((value, quantity[end..].trim()))
        });
        let text = format!("{id}={quantity}");
        match number {
            Some((value, _)) if value.is_finite() && value.abs() > LARGEST => {
                Err(too_large(&text, &number_in_words(value), &format!("{LARGEST:e}")))
            }
            Some((value, unit)) if longer_than_a_kilometre(value, unit) => {
                Err(too_large(&text, &format!("{} {unit}", number_in_words(value)), "1 km"))
            }
            Some((value, unit)) if value.is_finite() && (!unit.is_empty() || value == 0.0) => {
                Ok(Given { id: id.to_string(), value, unit: unit.to_string() })
            }
            Some((value, "")) if value.is_finite() => Err(not_a_quantity(&text, "has no unit")),
            _ => Err(not_a_quantity(&text, "is not a number with a unit")),
        }
    }

    /// The value in internal units, for a parameter with the display unit `unit`.
    ///
    /// # Errors
    /// If the two units are of different quantities.
    pub fn inside(&self, unit: &ParameterUnit) -> Result<f64, Diagnostic> {
        self.in_unit(&unit.name).map(|value| value / unit.display_per_internal)
    }

    /// The value in another unit.
    ///
    /// # Errors
    /// If the two units are of different quantities.
    pub fn in_unit(&self, wanted: &str) -> Result<f64, Diagnostic> {
        if self.value == 0.0 || self.unit == wanted {
            return Ok(self.value);
        }
        // A number over a temperature is a difference, and a temperature none.
        let parsed = |unit: &str| Unit::parse(unit).filter(|unit| unit.dimension() != Dimension::Temperature);
        let convert = |unit: &str, to: &str| parsed(unit)?.convert(self.value, parsed(to)?);
        let converted = convert(&self.unit, wanted).or_else(|| {
            // `mm/h` to `um/h`.
            let (above, below) = self.unit.split_once('/')?;
            let (wanted_above, wanted_below) = wanted.split_once('/')?;
            (below == wanted_below).then(|| convert(above, wanted_above))?
        });
        converted.ok_or_else(|| {
            Diagnostic::identification(format!(
                "`{}` has the unit `{}`; a unit such as `{wanted}` is expected",
                self.id, self.unit
            ))
        })
    }
}

fn not_a_quantity(text: &str, fault: &str) -> Diagnostic {
    let form = "write name, number and unit as in `EY0A=35.3um`";
    Diagnostic::identification(format!("`{text}` {fault}; {form}"))
}

fn too_large(name: &str, found: &str, limit: &str) -> Diagnostic {
    Diagnostic::identification(format!("`{name}`: {found} is too large; the limit is {limit}"))
}

/// Whether a value is a length beyond [`MAX_LENGTH_MM`].
fn longer_than_a_kilometre(value: f64, unit: &str) -> bool {
    let unit = Unit::parse(unit).filter(|unit| unit.is_length());
    unit.is_some_and(|unit| unit.to_internal(value.abs()) > MAX_LENGTH_MM)
}

/// Reads a file of values, one `EY0A = "35.3 um"` per line, in the order of the file.
///
/// # Errors
/// If the file cannot be read, is not TOML, or a value is not text with a number and a unit. The message names the file
/// and the entry.
pub fn read(path: &Path) -> Result<Vec<Given>, Diagnostic> {
    let given = |(key, value): &(String, Node)| match value.as_text() {
        Some(quantity) => Given::of(key, quantity).map_err(|error| Fault::new(error.to_string(), None).at(key)),
        None => {
            let help = format!("write number and unit in quotes, as in `{key} = \"35.3 um\"`");
            Err(Fault::new(format!("`{key}` is not text"), help).at(key))
        }
    };
    let source = abbe_files::text(path, "the file of values")?;
    lowered(&source, |Long(values): &Long<Named<Node>>| values.0.iter().map(given).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_units_and_exponents() {
        let cases = [
            ("EY0A=35.3um", 35.3, "um"),
            ("EY0A=-2e-3 mm", -2e-3, "mm"),
            ("EXC~time:drift=1um/h", 1.0, "um/h"),
            ("gain=0", 0.0, ""),
        ];
        for (text, value, unit) in cases {
            let given = Given::parse(text).unwrap();
            assert_eq!((given.value, given.unit.as_str()), (value, unit), "{text}");
        }
        for bad in ["EY0A", "EY0A=um", "EY0A=1", "EY0A=", "EY0A=NaNum", "EY0A=infum"] {
            assert!(Given::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn units_of_one_quantity_convert() {
        let value = |text: &str, unit: &str| Given::parse(text).unwrap().in_unit(unit);
        assert_eq!(value("x=1mm", "um").unwrap(), 1000.0);
        assert_eq!(value("x=1deg", "arcsec").unwrap(), 3600.0);
        assert_eq!(value("x=2mm/h", "um/h").unwrap(), 2000.0);
        assert_eq!(value("x=1%", "um/m").unwrap(), 10_000.0);
        assert_eq!(value("x=3s", "ms").unwrap(), 3000.0);
        // Zero needs no unit, and is zero in each.
        assert_eq!((value("x=0", "um").unwrap(), value("x=0mm", "um").unwrap()), (0.0, 0.0));
        assert!(value("x=1um", "arcsec").is_err());
        assert!(value("x=1um/h", "um/K").is_err());
    }
}
