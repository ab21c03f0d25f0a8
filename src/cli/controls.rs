//! The words of `--control`, as the registry of controls has them.

use abbe::apply::control::CONTROLS;
use abbe::codegen::nc;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// The controls with NC programs.
pub fn with_programs() -> impl TypedValueParser<Value = &'static dyn nc::Control> {
    let known = CONTROLS.iter().filter(|control| control.has_programs);
    let words = known.map(|control| PossibleValue::new(control.word).help(control.name));
    PossibleValuesParser::new(words).try_map(|word| nc::control(&word))
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
