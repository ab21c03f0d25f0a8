//! Writer of additional effects and data files into the text of a session.

use std::fmt::Write as _;
use std::path::Path;

use super::document::Source;
use crate::chain::Machine;
use crate::effect::{Driver, Effect, Shape};
use crate::error::ModelError;

/// A session's text with additional effects at its end; the existing text and its comments are unchanged.
///
/// ```
/// use abbe_model::chain::Machine;
/// use abbe_model::effect::{Component, Driver, Effect, Shape};
/// use abbe_model::files::toml::write;
///
/// let machine = Machine::from_code("wCAbYXZt")?;
/// let effect = Effect {
///     component: Component::parse("EZC").unwrap(),
///     driver: Driver::parse("C"),
///     shape: Shape::Harmonic { order: 2.0 },
///     tests: Vec::new(),
/// };
/// let text = write::with_effects("# a session\n", &[effect], &machine);
/// assert_eq!(
///     text,
///     "# a session\n\n[[effect]]\ncomponent = \"EZC\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = 2\n"
/// );
/// # Ok::<(), abbe_model::ModelError>(())
/// ```
pub fn with_effects(original: &str, effects: &[Effect], machine: &Machine) -> String {
    let mut text = original.to_string();
    if !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    for effect in effects {
        text.push('\n');
        text.push_str(&effect_table(effect, machine));
    }
    text
}

/// One `[[effect]]`.
fn effect_table(effect: &Effect, machine: &Machine) -> String {
    let mut text = String::from("[[effect]]\n");
    let mut line = |key: &str, value: String| {
        // Writing to a String does not fail.
        let _ = writeln!(text, "{key} = {value}");
    };
    line("component", quoted(&effect.component.to_string()));
    line("driver", quoted(&effect.driver.to_string()));
    let word = match &effect.shape {
        Shape::Power { .. } => "power",
        other => other.word(),
    };
    line("shape", quoted(word));
    let unit = unit(&effect.driver, machine);
    let mut quantity = |id_stem: &str, value: f64| {
        let (suffix, number) = in_unit(unit, value);
        line(&format!("{id_stem}_{suffix}"), number);
    };
    match &effect.shape {
        Shape::Constant | Shape::Backlash | Shape::Lag | Shape::Drift => {}
        Shape::Polynomial { degree, scale } | Shape::Power { degree, scale } => {
            quantity("scale", *scale);
            line("order", degree.to_string());
        }
        Shape::Harmonic { order } => line("order", order.to_string()),
        Shape::Periodic { period } => quantity("period", *period),
        Shape::Curve {
            from,
            to,
            intervals,
            closed,
        } => {
            quantity("from", *from);
            quantity("to", *to);
            line("intervals", intervals.to_string());
            line("closed", closed.to_string());
        }
        Shape::ReversalSpike { width } => quantity("width", *width),
        Shape::Warmup { tau_s } => line("tau_s", tau_s.to_string()),
        Shape::Steps { at } => {
            // All positions in one unit: degrees if every one of them converts exactly both ways.
            let all: Vec<(&str, String)> = at.iter().map(|position| in_unit(unit, *position)).collect();
            let fallback = all.iter().any(|(suffix, _)| *suffix == "rad");
            let suffix = if fallback {
                "rad"
            } else {
                all.first().map_or(unit, |(suffix, _)| *suffix)
            };
            let numbers: Vec<String> = at
                .iter()
                .zip(all)
                .map(|(position, (_, number))| if fallback { position.to_string() } else { number })
                .collect();
            line(&format!("at_{suffix}"), format!("[{}]", numbers.join(", ")));
        }
        Shape::Local {
            centre,
            width,
            recurs,
        } => {
            quantity("centre", *centre);
            quantity("width", *width);
            if recurs.is_none() && unit == "deg" {
                line("recurs", "false".into());
            }
        }
    }
    if !effect.tests.is_empty() {
        let names: Vec<String> = effect.tests.iter().map(|name| quoted(name)).collect();
        line("tests", format!("[{}]", names.join(", ")));
    }
    text
}

/// The suffix of a driver's unit in files.
fn unit(driver: &Driver, machine: &Machine) -> &'static str {
    match driver {
        Driver::Axis(name) => match machine.axis_index(name).map(|index| machine.axes[index].kind) {
            Some(kind) => kind.unit(),
            None => "mm",
        },
        Driver::Time => "s",
        Driver::Temperature => "c",
        Driver::Gravity | Driver::None => "m",
    }
}

/// A number in a driver's unit that reads back to the same bits: degrees if they do, else radians.
fn in_unit(unit: &'static str, value: f64) -> (&'static str, String) {
    if unit != "deg" {
        return (unit, value.to_string());
    }
    let degrees = value.to_degrees();
    let round = (degrees * 1e9).round() / 1e9;
    for candidate in [round, degrees, degrees.next_up(), degrees.next_down()] {
        if candidate.to_radians() == value {
            return ("deg", candidate.to_string());
        }
    }
    ("rad", value.to_string())
}

/// A TOML string: JSON escapes are valid in TOML.
pub(super) fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", c as u32);
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// A plan's text with a data file for each named test, otherwise unchanged. An existing data file of a test is
/// replaced.
///
/// # Errors
/// If the text is not a session, or has its tests in inline tables.
pub fn with_data(original: &str, file: &Path, data: &[(String, String)]) -> Result<String, ModelError> {
    let source = Source::new(file, original);
    // Edits: the bytes to replace and their new text.
    let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    if let Some(tests) = source.parse()?.take("test") {
        for item in tests.list("tables [[test]]")? {
            let mut table = item.table("[[test]]".into())?;
            let name = table.require("name", "a name")?;
            let text = name.text()?;
            let Some((_, data)) = data.iter().find(|(test, _)| *test == text) else {
                continue;
            };
            match table.take("data") {
                Some(old) => edits.push((old.span.clone(), quoted(data))),
                None => {
                    let rest = &source.text[name.span.end..];
                    let end = name.span.end + rest.find('\n').unwrap_or(rest.len());
                    let between = source.text[name.span.end..end].trim_start();
                    if !(between.is_empty() || between.starts_with('#')) {
                        let help = "write each test as its own [[test]]";
                        return Err(name.error("a test in an inline table", Some(help.into())));
                    }
                    edits.push((end..end, format!("\ndata = {}", quoted(data))));
                }
            }
        }
    }
    edits.sort_by_key(|(range, _)| range.start);
    let mut text = source.text.clone();
    for (range, new) in edits.into_iter().rev() {
        text.replace_range(range, &new);
    }
    Ok(text)
}
