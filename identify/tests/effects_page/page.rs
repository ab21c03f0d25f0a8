//! Parses the page: its sections with their session and tables.

use std::collections::VecDeque;

use abbe_model::chain::Machine;
use abbe_model::driver::{Driver, DriverUnit};
use abbe_model::effect::keys::{Key, KeyReader};
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::error::ModelError;

/// A Markdown table: header and rows, with trimmed cells.
pub struct Table {
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// A part of the page under a second-level heading.
pub struct Section {
    pub title: String,
    pub toml: Option<String>,
    pub tables: Vec<Table>,
}

/// The sections of a page.
pub fn sections(text: &str) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    let mut fence: Option<Option<String>> = None;
    let mut in_table = false;
    for line in text.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            sections.push(Section { title: title.to_string(), toml: None, tables: Vec::new() });
        }
        let Some(section) = sections.last_mut() else {
            continue;
        };
        match (&mut fence, line.strip_prefix("```")) {
            (None, Some(language)) => fence = Some((language == "toml").then(String::new)),
            (Some(text), Some(_)) => {
                section.toml = text.take().or(section.toml.take());
                fence = None;
            }
            (Some(Some(text)), None) => {
                text.push_str(line);
                text.push('\n');
            }
            _ => {}
        }
        let cells = line.strip_prefix('|').and_then(|line| line.strip_suffix('|'));
        match cells {
            Some(cells) if fence.is_none() => {
                let cells: Vec<String> = cells.split('|').map(|cell| cell.trim().to_string()).collect();
                if !in_table {
                    section.tables.push(Table { header: cells, rows: Vec::new() });
                } else if !cells[0].starts_with("---") {
                    section.tables.last_mut().unwrap().rows.push(cells);
                }
                in_table = true;
            }
            _ => in_table = false,
        }
    }
    sections
}

/// Parses an effect of the page: `EXX~X:power2`, or with shape numbers in mm, degrees or seconds: `EXX~X:periodic 8`.
pub fn effect(machine: &Machine, cell: &str) -> Effect {
    let text = cell.trim_matches('`');
    let plain = |component: &str| Component::parse(component).unwrap_or_else(|| panic!("{text}"));
    let Some((component, rest)) = text.split_once('~') else {
        return Effect::new(plain(text), Driver::None, Shape::Constant);
    };
    let component = plain(component);
    let (driver, shape) = rest.split_once(':').unwrap_or_else(|| panic!("{text}"));
    let driver = Driver::parse(driver);
    let axis = driver.kind_of_axis(machine, component.axis(machine));
    let (name, more) = shape.split_once(' ').unwrap_or((shape, ""));
    let word = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let own = name[word.len()..].split_whitespace();
    let numbers = own.chain(more.split(' ').filter(|number| !number.is_empty())).map(|number| number.parse().unwrap());
    let (unit, default_scale) = (driver.kind().unit(axis), driver.kind().default_scale(axis));
    let mut keys = Numbers { numbers: numbers.collect(), unit, default_scale };
    let entry = Shape::entry_of(if word == "h" { "harmonic" } else { word }).unwrap_or_else(|| panic!("{text}"));
    let shape = (entry.read)(&mut keys).unwrap();
    assert!(keys.numbers.is_empty(), "{text}");
    Effect::new(component, driver, shape)
}

/// The numbers of a shape as the page states them: without keys, in the order in which the shape reads them. Optional
/// keys are absent, but a count is stated.
struct Numbers {
    numbers: VecDeque<f64>,
    unit: DriverUnit,
    default_scale: f64,
}

impl Numbers {
    fn next(&mut self) -> f64 {
        self.numbers.pop_front().expect("a number")
    }

    fn internal(&self, number: f64) -> f64 {
        self.unit.to_internal(self.unit.file, number).unwrap()
    }
}

impl KeyReader for Numbers {
    fn unit(&self) -> DriverUnit {
        self.unit
    }
    fn default_scale(&self) -> f64 {
        self.default_scale
    }
    fn quantity(&mut self, _: &Key) -> Result<Option<f64>, ModelError> {
        Ok(None)
    }
    /// A curve over a linear axis covers the travel of 200 mm.
    fn required_quantity(&mut self, key: &Key) -> Result<f64, ModelError> {
        Ok(match key.name {
            "from" => -100.0,
            "to" => 100.0,
            _ => {
                let number = self.next();
                self.internal(number)
            }
        })
    }
    fn required_quantities(&mut self, _: &Key) -> Result<Vec<f64>, ModelError> {
        let numbers = std::mem::take(&mut self.numbers);
        Ok(numbers.into_iter().map(|number| self.internal(number)).collect())
    }
    fn required_positive(&mut self, _: &'static str, _: &str) -> Result<f64, ModelError> {
        Ok(self.next())
    }
    fn count(&mut self, _: &'static str, _: usize, _: usize) -> Result<Option<usize>, ModelError> {
        Ok(Some(self.next() as usize))
    }
    fn required_count(&mut self, _: &'static str, _: &str, _: usize, _: usize) -> Result<usize, ModelError> {
        Ok(self.next() as usize)
    }
    fn flag(&mut self, _: &'static str) -> Result<Option<bool>, ModelError> {
        Ok(None)
    }
}
