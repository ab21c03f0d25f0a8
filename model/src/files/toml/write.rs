//! Writer of additional effects and data files into the text of a session.

use std::path::Path;

use super::document::Source;
use super::prior;
use super::quoted::quoted;
use crate::chain::Machine;
use crate::effect::Effect;
use crate::effect::keys::KeyWriter;
use crate::error::ModelError;

/// A session's text with additional effects at its end; the existing text and its comments are unchanged.
///
/// ```
/// use abbe_model::chain::Machine;
/// use abbe_model::driver::Driver;
/// use abbe_model::effect::shape::Harmonic;
/// use abbe_model::effect::{Component, Effect, Shape};
/// use abbe_model::files::toml::write;
///
/// let machine = Machine::from_code("wCAbYXZt")?;
/// let component = Component::parse("EZC").unwrap();
/// let effect = Effect::new(component, Driver::parse("C"), Shape::Harmonic(Harmonic { order: 2.0 }));
/// let text = write::with_effects("# a session\n", &[effect], &machine);
/// assert_eq!(
///     text,
///     "# a session\n\n[[effect]]\ncomponent = \"EZC\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = 2\n"
/// );
/// # Ok::<(), abbe_model::ModelError>(())
/// ```
pub fn with_effects(original: &str, effects: &[Effect], machine: &Machine) -> String {
    with_blocks(original, effects.iter().map(|effect| effect_table(effect, machine)))
}

/// A session's text with additional blocks, such as `[[test]]`, at its end; the existing text and its comments are
/// unchanged.
pub fn with_blocks(original: &str, blocks: impl IntoIterator<Item = String>) -> String {
    let mut text = original.to_string();
    if !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    for block in blocks {
        text.push('\n');
        text.push_str(&block);
    }
    text
}

/// One `[[effect]]` with its aliases `[[effect.alias]]`.
fn effect_table(effect: &Effect, machine: &Machine) -> String {
    let mut text = table(effect, "[[effect]]", machine);
    for alias in &effect.aliases {
        text.push('\n');
        text.push_str(&table(alias, "[[effect.alias]]", machine));
    }
    text
}

/// The keys of an effect under a heading.
fn table(effect: &Effect, heading: &str, machine: &Machine) -> String {
    let mut keys = KeyWriter::new(heading, effect.driver_unit(machine));
    keys.line("component", quoted(&effect.component.to_string()));
    keys.line("driver", quoted(&effect.driver.to_string()));
    keys.line("shape", quoted(effect.shape.entry().word));
    effect.shape.write(&mut keys);
    prior::write(&effect.prior, &effect.component, &effect.shape, &mut keys);
    if !effect.tests.is_empty() {
        let names: Vec<String> = effect.tests.iter().map(|name| quoted(name)).collect();
        keys.line("tests", format!("[{}]", names.join(", ")));
    }
    if effect.assumed {
        keys.line("assumed", true);
    }
    keys.finish()
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
