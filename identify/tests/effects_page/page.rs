//! Parses the page: its sections with their session and tables.

use std::f64::consts::PI;

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::driver::Driver;
use abbe_model::effect::shape::{Curve, Harmonic, Local, Periodic, Power, ReversalSpike, Steps, Warmup};
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
        return Effect { component: plain(text), driver: Driver::None, shape: Shape::Constant, tests: Vec::new() };
    };
    let (driver, shape) = rest.split_once(':').unwrap_or_else(|| panic!("{text}"));
    let driver = Driver::parse(driver);
    let mut words = shape.split(' ');
    let word = words.next().unwrap();
    let rotary = match &driver {
        Driver::Axis(name) => {
            let axis = machine.axis_index(name).unwrap_or_else(|| panic!("{text}"));
            machine.axes[axis].kind == AxisKind::Rotary
        }
        _ => false,
    };
    let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
    let inside = |number: f64| if rotary { number.to_radians() } else { number };
    // Half of a travel of 200 mm, or of a turn.
    let scale = match &driver {
        Driver::Axis(_) if rotary => PI,
        Driver::Axis(_) => 100.0,
        _ => 1.0,
    };
    let shape = match (word, numbers.as_slice()) {
        ("backlash", []) => Shape::Backlash,
        ("lag", []) => Shape::Lag,
        ("drift", []) => Shape::Drift,
        ("warmup", [tau_s]) => Shape::Warmup(Warmup { tau_s: *tau_s }),
        ("reversal-spike", [width]) => Shape::ReversalSpike(ReversalSpike { width: inside(*width) }),
        ("periodic", [period]) => Shape::Periodic(Periodic { period: inside(*period) }),
        ("steps", at) => Shape::Steps(Steps { at: at.iter().map(|at| inside(*at)).collect() }),
        ("local", [centre, width]) => {
            Shape::Local(Local { centre: inside(*centre), width: inside(*width), recurs: rotary.then_some(2.0 * PI) })
        }
        ("curve", [intervals]) => Shape::Curve(Curve {
            from: if rotary { 0.0 } else { -100.0 },
            to: if rotary { 2.0 * PI } else { 100.0 },
            intervals: *intervals as usize,
            closed: rotary,
        }),
        (word, []) if word.starts_with('h') => Shape::Harmonic(Harmonic { order: word[1..].parse().unwrap() }),
        (word, []) if word.starts_with("power") => Shape::Power(Power { degree: word[5..].parse().unwrap(), scale }),
        _ => panic!("{text}"),
    };
    Effect { component: plain(component), driver, shape, tests: Vec::new() }
}
