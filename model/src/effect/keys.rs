//! The keys of an effect's shape in files: their declaration, and how a shape reads and writes them.

use std::fmt::Write as _;

use crate::driver::DriverUnit;
use crate::error::ModelError;

/// What a key holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeyForm {
    /// A number in the unit of the driver; the key has the unit as suffix.
    Quantity,
    /// Several numbers in the unit of the driver; the key has the unit as suffix.
    Quantities,
    /// A positive number.
    Positive,
    /// A whole number between two limits.
    Count(usize, usize),
    /// True or false.
    Flag,
}

/// A key of a shape.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// The key, without the suffix of a unit.
    pub name: &'static str,
    /// What it holds.
    pub form: KeyForm,
    /// Its description in the schema: a phrase without a full stop.
    pub meaning: &'static str,
}

/// Reads the keys of a shape. Errors point at the place in the file.
pub trait KeyReader {
    /// The unit of the driver.
    fn unit(&self) -> DriverUnit;
    /// The divisor of the driver in a polynomial that states none.
    fn default_scale(&self) -> f64;
    /// A number in the unit of the driver, converted to the internal unit; `None` if it is absent.
    ///
    /// # Errors
    /// If it is no number, is in the unit of another driver, or is given in two units.
    fn quantity(&mut self, key: &Key) -> Result<Option<f64>, ModelError>;
    /// As [`KeyReader::quantity`], for a key that is required.
    ///
    /// # Errors
    /// As before, or if it is absent.
    fn required_quantity(&mut self, key: &Key) -> Result<f64, ModelError>;
    /// Several numbers in the unit of the driver, converted; required.
    ///
    /// # Errors
    /// As [`KeyReader::required_quantity`].
    fn required_quantities(&mut self, key: &Key) -> Result<Vec<f64>, ModelError>;
    /// A positive number; `help` says what to add if it is absent.
    ///
    /// # Errors
    /// If it is absent or not positive.
    fn required_positive(&mut self, key: &'static str, help: &str) -> Result<f64, ModelError>;
    /// A whole number between two limits; `None` if it is absent.
    ///
    /// # Errors
    /// If it is not a whole number between the limits.
    fn count(&mut self, key: &'static str, least: usize, most: usize) -> Result<Option<usize>, ModelError>;
    /// As [`KeyReader::count`], for a key that is required; `help` says what to add.
    ///
    /// # Errors
    /// As before, or if it is absent.
    fn required_count(&mut self, key: &'static str, help: &str, least: usize, most: usize)
    -> Result<usize, ModelError>;
    /// True or false; `None` if it is absent.
    ///
    /// # Errors
    /// If it is neither.
    fn flag(&mut self, key: &'static str) -> Result<Option<bool>, ModelError>;
}

/// Writes the keys of an effect, a line each.
#[derive(Debug)]
pub struct KeyWriter {
    text: String,
    unit: DriverUnit,
}

impl KeyWriter {
    /// A table that starts with `heading`, of an effect whose driver has this unit.
    pub fn new(heading: &str, unit: DriverUnit) -> KeyWriter {
        KeyWriter { text: format!("{heading}\n"), unit }
    }

    /// The unit of the driver.
    pub fn unit(&self) -> DriverUnit {
        self.unit
    }

    /// A key and its value as TOML.
    pub fn line(&mut self, key: &str, value: impl std::fmt::Display) {
        // Writing to a String does not fail.
        let _ = writeln!(self.text, "{key} = {value}");
    }

    /// A number in the unit of the driver that reads back to the same bits.
    pub fn quantity(&mut self, key: &Key, value: f64) {
        let (suffix, number) = self.unit.exact(value);
        self.line(&format!("{}_{suffix}", key.name), number);
    }

    /// Several numbers in one unit: that of files if every one of them reads back to the same bits, else the internal
    /// unit.
    pub fn quantities(&mut self, key: &Key, values: &[f64]) {
        let unit = self.unit;
        let all: Vec<(&str, String)> = values.iter().map(|value| unit.exact(*value)).collect();
        let exact = all.iter().all(|(suffix, _)| *suffix == unit.file);
        let suffix = if exact { unit.file } else { unit.internal };
        let numbers: Vec<String> = (values.iter().zip(all))
            .map(|(value, (_, number))| if exact { number } else { value.to_string() })
            .collect();
        self.line(&format!("{}_{suffix}", key.name), format!("[{}]", numbers.join(", ")));
    }

    /// The text written.
    pub fn finish(self) -> String {
        self.text
    }
}
