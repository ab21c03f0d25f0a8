//! A machine and effects as texts of their own, with the keys of machine and session files.
//!
//! Files of other formats (a saved model) hold machines and effects with the same keys. They convert their values to
//! TOML and back, so that there is one writer and one reader.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use super::body::BodyFiles;
use super::document::Source;
use super::quoted::quoted;
use super::write::with_effects;
use super::{Context, Declared, ReadOptions, effect, machine};
use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::driver::DriverUnit;
use crate::effect::Effect;
use crate::error::ModelError;
use crate::files::table::request::Format;
use crate::frames::Rotation;
use crate::instrument::InstrumentKind;

/// A machine as the text of a machine file. Numbers read back to the same bits, except a direction, which the reader
/// scales to length 1.
///
/// ```
/// use abbe_model::chain::Machine;
/// use abbe_model::files::toml::parts;
///
/// let machine = Machine::from_code("wCbXt")?;
/// let text = parts::machine_text(&machine);
/// assert!(text.contains("[axis.C]\nkind = \"rotary\"\ndirection = [0, 0, 1]\n"));
/// assert_eq!(parts::machine_of_text("a.toml".as_ref(), &text)?, machine);
/// # Ok::<(), abbe_model::ModelError>(())
/// ```
pub fn machine_text(machine: &Machine) -> String {
    const DEGREES: DriverUnit = DriverUnit::new("deg", "rad", "deg", "°");
    let list = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let mut text = format!("name = {}\nchain = {}\n", quoted(&machine.name), quoted(&machine.code()));
    if machine.rotation == Rotation::SmallAngle {
        text.push_str("rotation = \"small-angle\"\n");
    }
    // Writing to a String does not fail.
    let _ = writeln!(text, "gravity = [{}]", list(&machine.gravity));
    for axis in &machine.axes {
        // A key without quotes has ASCII letters and digits only.
        let plain = axis.name.chars().all(|c| c.is_ascii_alphanumeric());
        let key = if plain { axis.name.clone() } else { quoted(&axis.name) };
        let _ = write!(
            text,
            "\n[axis.{key}]\nkind = \"{}\"\ndirection = [{}]\norigin_mm = [{}]\n",
            super::quantity::kind_word(axis.kind),
            list(&axis.direction),
            list(&axis.origin_mm)
        );
        if let Some(travel) = axis.travel {
            let ends = travel.map(|end| match axis.kind {
                AxisKind::Linear => end.to_string(),
                // Degrees that read back to the same radians, where there are such.
                AxisKind::Rotary => match DEGREES.exact(end) {
                    ("deg", number) => number,
                    _ => end.to_degrees().to_string(),
                },
            });
            let _ = writeln!(text, "travel_{} = [{}]", axis.kind.unit(), ends.join(", "));
        }
    }
    text
}

/// Reads the text of a machine file; `file` names it in messages.
///
/// # Errors
/// As [`super::machine()`].
pub fn machine_of_text(file: &Path, text: &str) -> Result<Machine, ModelError> {
    machine::from_table(Source::new(file, text).parse()?, &mut BodyFiles::default())
}

/// Effects as tables `[[effect]]` of a session file.
pub fn effects_text(effects: &[Effect], machine: &Machine) -> String {
    with_effects("", effects, machine)
}

/// Reads tables `[[effect]]` of a session with this machine and instrument; `file` names the text in messages, `tests`
/// are the names of the session's tests.
///
/// # Errors
/// As for the effects of a session file.
pub fn effects_of_text(
    file: &Path,
    text: &str,
    machine: &Machine,
    instrument: InstrumentKind,
    tests: &[String],
) -> Result<Vec<Effect>, ModelError> {
    let source = Source::new(file, text);
    let mut root = source.parse()?;
    let context = Context {
        file,
        machine,
        instrument,
        constants: &[],
        format: Format::default(),
        columns: None,
        memory: None,
        options: &ReadOptions::default(),
    };
    let declared: Vec<Declared> =
        tests.iter().map(|name| Declared { name: name.clone(), parts: vec![name.clone()] }).collect();
    let effects = match root.take("effect") {
        Some(value) => value.list("tables [[effect]]")?,
        None => Vec::new(),
    };
    let effects = effects.into_iter().map(|item| effect::effect(&context, &declared, &BTreeSet::new(), item)).collect();
    root.finish()?;
    effects
}
