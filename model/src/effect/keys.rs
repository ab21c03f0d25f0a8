//! The keys of an effect's shape in files: their declaration, and how a shape reads and writes them.

use serde::Deserialize;

use crate::diagnostic::Help;
use crate::document::fault::{Fault, Within};
use crate::document::from_node;
use crate::document::node::{Entries, Node};
use crate::driver::{DriverUnit, unit_suffixes};
use crate::session::limits;
use crate::unit::Unit;

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

/// Reads the keys of a shape. Numbers in the unit of the driver have a suffix: `_mm` for a linear axis, `_deg` (or `_rad`)
/// for a rotary one; each driver states its own. A fault has the path of its key.
#[derive(Debug)]
pub struct KeyReader<'e> {
    entries: &'e Entries,
    word: &'static str,
    unit: DriverUnit,
    default_scale: f64,
}

impl<'e> KeyReader<'e> {
    /// The keys of the shape `word` of an effect whose driver has this unit; `default_scale` is the divisor of the driver in
    /// a polynomial that states none.
    pub fn new(entries: &'e Entries, word: &'static str, unit: DriverUnit, default_scale: f64) -> KeyReader<'e> {
        KeyReader { entries, word, unit, default_scale }
    }

    /// The unit of the driver.
    pub fn unit(&self) -> DriverUnit {
        self.unit
    }

    /// The divisor of the driver in a polynomial that states none.
    pub fn default_scale(&self) -> f64 {
        self.default_scale
    }

    /// A key that is present, as typed.
    fn get<T: Deserialize<'e>>(&self, key: &str) -> Result<Option<T>, Fault> {
        self.entries.get(key).map(|node| from_node(node).within(key)).transpose()
    }

    /// The form of a quantity that is present, with its suffix.
    fn suffixed<T: Deserialize<'e>>(&self, key: &Key) -> Result<Option<(T, &'static str)>, Fault> {
        let mut found = None;
        for suffix in unit_suffixes() {
            let name = format!("{}_{suffix}", key.name);
            if self.entries.get(&name).is_none() {
                continue;
            }
            if self.unit.to_internal(suffix, 0.0).is_none() {
                let message = format!("`{name}` for a driver in {}", self.unit.file.key());
                let help = format!("use `{}_{}`", key.name, self.unit.file.key());
                return Err(Fault::new(message, help).on_key().at(&name));
            }
            if found.is_some() {
                return Err(Fault::new(format!("`{name}` is given twice, in two units"), None).at(&name));
            }
            found = self.get(&name)?.map(|value| (value, suffix));
        }
        Ok(found)
    }

    fn converted(&self, number: f64, suffix: &str) -> f64 {
        self.unit.to_internal(suffix, number).unwrap_or(number)
    }

    /// The fault that a key is absent.
    fn missing(&self, key: &str, help: impl Into<Help>) -> Fault {
        let message = format!("the shape \"{}\" needs `{key}`", self.word);
        Fault::new(message, help).at("shape")
    }

    fn missing_quantity(&self, key: &Key, example: &str) -> Fault {
        let name = format!("{}_{}", key.name, self.unit.file.key());
        self.missing(&name, format!("add `{name} = {example}`"))
    }

    /// A number in the unit of the driver, converted to the internal unit; `None` if it is absent.
    ///
    /// # Errors
    /// If it is no number, is in the unit of another driver, or is given in two units.
    pub fn quantity(&self, key: &Key) -> Result<Option<f64>, Fault> {
        Ok(self.suffixed(key)?.map(|(number, suffix)| self.converted(number, suffix)))
    }

    /// As [`KeyReader::quantity`], for a key that is required.
    ///
    /// # Errors
    /// As before, or if it is absent.
    pub fn required_quantity(&self, key: &Key) -> Result<f64, Fault> {
        self.quantity(key)?.ok_or_else(|| self.missing_quantity(key, "…"))
    }

    /// Several numbers in the unit of the driver, converted; required.
    ///
    /// # Errors
    /// As [`KeyReader::required_quantity`].
    pub fn required_quantities(&self, key: &Key) -> Result<Vec<f64>, Fault> {
        let Some((list, suffix)) = self.suffixed::<Vec<f64>>(key)? else {
            return Err(self.missing_quantity(key, "[ … ]"));
        };
        Ok(list.into_iter().map(|number| self.converted(number, suffix)).collect())
    }

    /// A positive number; `help` says what to add if it is absent.
    ///
    /// # Errors
    /// If it is absent or not positive.
    pub fn required_positive(&self, key: &'static str, help: &str) -> Result<f64, Fault> {
        let number: Option<f64> = self.get(key)?;
        limits::positive(number.ok_or_else(|| self.missing(key, help))?).within(key)
    }

    /// A whole number between two limits; `None` if it is absent.
    ///
    /// # Errors
    /// If it is not a whole number between the limits.
    pub fn count(&self, key: &'static str, least: usize, most: usize) -> Result<Option<usize>, Fault> {
        let number: Option<f64> = self.get(key)?;
        number.map(|number| limits::count(number, least, most).within(key)).transpose()
    }

    /// As [`KeyReader::count`], for a key that is required; `help` says what to add.
    ///
    /// # Errors
    /// As before, or if it is absent.
    pub fn required_count(&self, key: &'static str, help: &str, least: usize, most: usize) -> Result<usize, Fault> {
        self.count(key, least, most)?.ok_or_else(|| self.missing(key, help))
    }

    /// True or false; `None` if it is absent.
    ///
    /// # Errors
    /// If it is neither.
    pub fn flag(&self, key: &'static str) -> Result<Option<bool>, Fault> {
        self.get(key)
    }
}

/// Writes the keys of a shape.
#[derive(Debug)]
pub struct KeyWriter {
    entries: Entries,
    unit: DriverUnit,
}

impl KeyWriter {
    /// The keys of an effect whose driver has this unit.
    pub fn new(unit: DriverUnit) -> KeyWriter {
        KeyWriter { entries: Entries::default(), unit }
    }

    /// The unit of the driver.
    pub fn unit(&self) -> DriverUnit {
        self.unit
    }

    /// A key and its value.
    pub fn set(&mut self, key: &str, value: impl Into<Node>) {
        self.entries.push(key, value);
    }

    /// A number in the unit of the driver that reads back to the same bits.
    pub fn quantity(&mut self, key: &Key, value: f64) {
        let (unit, number) = self.unit.exact(value);
        self.set(&format!("{}_{}", key.name, unit.key()), number);
    }

    /// Several numbers in one unit: that of files if every one of them reads back to the same bits, else the internal
    /// unit.
    pub fn quantities(&mut self, key: &Key, values: &[f64]) {
        let unit = self.unit;
        let all: Vec<(Unit, f64)> = values.iter().map(|value| unit.exact(*value)).collect();
        let exact = all.iter().all(|(found, _)| *found == unit.file);
        let suffix = if exact { unit.file } else { unit.internal }.key();
        let numbers: Node =
            values.iter().zip(all).map(|(value, (_, number))| if exact { number } else { *value }).collect();
        self.set(&format!("{}_{suffix}", key.name), numbers);
    }

    /// The keys written.
    pub fn finish(self) -> Entries {
        self.entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions are degrees if all read back to the same bits, and radians if one does not.
    #[test]
    fn quantities_are_degrees_if_they_read_back() {
        let unit = DriverUnit::ANGLE;
        let key = Key { name: "at", form: KeyForm::Quantities, meaning: "positions" };
        let written = |values: &[f64]| {
            let mut writer = KeyWriter::new(unit);
            writer.quantities(&key, values);
            let found = writer.finish();
            let numbers = |node: &Node| node.items().iter().filter_map(Node::as_number).collect::<Vec<f64>>();
            (found.get("at_deg").map(numbers), found.get("at_rad").map(numbers))
        };
        let exact = [30.0_f64.to_radians(), -12.5_f64.to_radians()];
        assert_eq!(written(&exact), (Some(vec![30.0, -12.5]), None));
        // No number of degrees near it is this one.
        let no_degrees = (1..10_000).map(|k| 1e-3 * f64::from(k)).find(|x| unit.exact(*x).0 == Unit::Radian).unwrap();
        assert_eq!(written(&[no_degrees]), (None, Some(vec![no_degrees])));
        assert_eq!(written(&[exact[0], no_degrees]), (None, Some(vec![exact[0], no_degrees])));
    }
}
