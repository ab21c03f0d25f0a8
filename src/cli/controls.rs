//! The words of `--control` and `--programs`, as the registry of controls has them.

use abbe::apply::compensation::TableFormat;
use abbe::apply::control::{CONTROLS, Control, control};
use abbe::codegen::nc;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// The controls of which something is known, with what it is.
fn words(known: impl Fn(&Control) -> Option<String>) -> PossibleValuesParser {
    let known = CONTROLS.iter().filter_map(|control| Some(PossibleValue::new(control.word).help(known(control)?)));
    PossibleValuesParser::new(known)
}

/// The controls with compensation tables.
pub fn with_tables() -> impl TypedValueParser<Value = &'static TableFormat> {
    let about = |own: &Control| own.tables.as_ref().map(|format| format!("{}, {}", own.name, format.about));
    words(about).try_map(|word| control(&word).and_then(|own| own.tables.as_ref()).ok_or("no tables of this control"))
}

/// The controls with NC programs.
pub fn with_programs() -> impl TypedValueParser<Value = &'static dyn nc::Control> {
    words(|own| own.has_programs.then(|| own.name.to_string())).try_map(|word| nc::control(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every dialect is that of a control of the registry, and the other way round.
    #[test]
    fn controls_with_programs_are_those_with_a_dialect() {
        let dialects = nc::CONTROLS.map(nc::Control::word);
        let controls: Vec<&str> = CONTROLS.iter().filter(|own| own.has_programs).map(|own| own.word).collect();
        assert_eq!(dialects[..], controls);
    }
}
