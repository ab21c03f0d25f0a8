//! Parses the page: its sections with their session and tables.

use std::collections::VecDeque;

use abbe_model::chain::Machine;
use abbe_model::document::node::{Entries, Node};
use abbe_model::driver::{Driver, DriverUnit};
use abbe_model::effect::keys::{KeyForm, KeyReader};
use abbe_model::effect::shape::Entry;
use abbe_model::effect::{Component, Effect, Shape};

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
    let entry = Shape::entry_of(if word == "h" { "harmonic" } else { word }).unwrap_or_else(|| panic!("{text}"));
    let entries = entries(entry, unit, numbers.collect());
    let shape = (entry.read)(&KeyReader::new(&entries, entry.word, unit, default_scale)).unwrap();
    Effect::new(component, driver, shape)
}

/// The keys of a shape with the numbers of the page, which states them without keys, in the order of the shape. Optional
/// keys are absent, but a count is stated. A curve over a linear axis covers the travel of 200 mm.
fn entries(entry: &Entry, unit: DriverUnit, mut numbers: VecDeque<f64>) -> Entries {
    let mut entries = Entries::default();
    for key in entry.keys {
        let name = match key.form {
            KeyForm::Flag => continue,
            KeyForm::Positive | KeyForm::Count(..) => key.name.to_string(),
            KeyForm::Quantity | KeyForm::Quantities => format!("{}_{}", key.name, unit.file.key()),
        };
        match key.name {
            "scale" => {}
            "from" | "to" | "period" if unit.is_angle() && numbers.is_empty() => {}
            "from" => entries.push(name, -100.0),
            "to" => entries.push(name, 100.0),
            _ if matches!(key.form, KeyForm::Quantities) => {
                entries.push(name, std::mem::take(&mut numbers).into_iter().collect::<Node>());
            }
            _ => entries.push(name, numbers.pop_front().expect("a number")),
        }
    }
    assert!(numbers.is_empty(), "{}", entry.word);
    entries
}
