//! Reader of the keys of a shape, with the location of each in the file.
//!
//! Numbers in the unit of the driver have a suffix: `_mm` for a linear axis, `_deg` (or `_rad`) for a rotary one; each
//! driver states its own.

use crate::driver::{DriverUnit, unit_suffixes};
use crate::effect::keys::{Key, KeyReader};
use crate::error::ModelError;
use crate::files::toml::document::{Table, Value};

/// The keys of the shape of one effect.
pub(super) struct ShapeKeys<'t, 'a> {
    table: &'t mut Table<'a>,
    /// The value of `shape`.
    place: &'t Value<'a>,
    /// The word of the shape.
    word: &'t str,
    unit: DriverUnit,
    default_scale: f64,
}

impl<'t, 'a> ShapeKeys<'t, 'a> {
    /// The keys of the shape `word`, which stands at `place`, of an effect whose driver has this unit.
    pub fn new(
        table: &'t mut Table<'a>,
        place: &'t Value<'a>,
        word: &'t str,
        unit: DriverUnit,
        default_scale: f64,
    ) -> ShapeKeys<'t, 'a> {
        ShapeKeys { table, place, word, unit, default_scale }
    }

    /// Takes the form of a key that is present; also returns its suffix.
    fn suffixed(&mut self, key: &Key) -> Result<Option<(Value<'a>, &'static str)>, ModelError> {
        let mut found = None;
        for suffix in unit_suffixes() {
            let name = format!("{}_{suffix}", key.name);
            let Some(value) = self.table.take(name.clone()) else {
                continue;
            };
            if self.unit.to_internal(suffix, 0.0).is_none() {
                let message = format!("`{name}` for a driver in {}", self.unit.file);
                let help = format!("use `{}_{}`", key.name, self.unit.file);
                return Err(value.source.error(value.key_span.clone(), message, Some(help)));
            }
            if found.is_some() {
                return Err(value.error(format!("`{name}` is given twice, in two units"), None));
            }
            found = Some((value, suffix));
        }
        Ok(found)
    }

    fn converted(&self, value: &Value<'_>, suffix: &str) -> Result<f64, ModelError> {
        let number = value.number()?;
        Ok(self.unit.to_internal(suffix, number).unwrap_or(number))
    }

    /// The error that a key is absent.
    fn missing(&self, key: &str, help: String) -> ModelError {
        let message = format!("the shape \"{}\" needs `{key}`", self.word);
        self.place.error(message, Some(help))
    }

    fn missing_quantity(&self, key: &Key, example: &str) -> ModelError {
        let name = format!("{}_{}", key.name, self.unit.file);
        let help = format!("add `{name} = {example}`");
        self.missing(&name, help)
    }
}

impl KeyReader for ShapeKeys<'_, '_> {
    fn unit(&self) -> DriverUnit {
        self.unit
    }

    fn default_scale(&self) -> f64 {
        self.default_scale
    }

    fn quantity(&mut self, key: &Key) -> Result<Option<f64>, ModelError> {
        match self.suffixed(key)? {
            Some((value, suffix)) => Ok(Some(self.converted(&value, suffix)?)),
            None => Ok(None),
        }
    }

    fn required_quantity(&mut self, key: &Key) -> Result<f64, ModelError> {
        let found = self.quantity(key)?;
        found.ok_or_else(|| self.missing_quantity(key, "…"))
    }

    fn required_quantities(&mut self, key: &Key) -> Result<Vec<f64>, ModelError> {
        let Some((list, suffix)) = self.suffixed(key)? else {
            return Err(self.missing_quantity(key, "[ … ]"));
        };
        let items = list.list("a list of positions")?;
        items.iter().map(|item| self.converted(item, suffix)).collect()
    }

    fn required_positive(&mut self, key: &'static str, help: &str) -> Result<f64, ModelError> {
        match self.table.take(key) {
            Some(value) => value.positive(),
            None => Err(self.missing(key, help.to_string())),
        }
    }

    fn count(&mut self, key: &'static str, least: usize, most: usize) -> Result<Option<usize>, ModelError> {
        let value = self.table.take(key);
        value.map(|value| value.count(least, most)).transpose()
    }

    fn required_count(
        &mut self,
        key: &'static str,
        help: &str,
        least: usize,
        most: usize,
    ) -> Result<usize, ModelError> {
        let found = self.count(key, least, most)?;
        found.ok_or_else(|| self.missing(key, help.to_string()))
    }

    fn flag(&mut self, key: &'static str) -> Result<Option<bool>, ModelError> {
        let value = self.table.take(key);
        value.map(|value| value.boolean()).transpose()
    }
}
