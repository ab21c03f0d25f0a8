//! The parameters of an equation by their names.

use abbe_codegen::Variable;
use abbe_files::{ReadOptions, Source, SourceMap};
use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::effect::{Component, Effect};
use abbe_model::instrument::InstrumentParameter;
use abbe_model::pattern;
use abbe_model::session::{Session, Test};

/// What an equation of a session without readings is made of.
pub const WITHOUT_READINGS: &str = "the equation is made without readings: in a test without a planned movement every axis moves that the test does not hold";

/// The session with its readings, or without them if they cannot be read, and why not.
///
/// # Errors
/// If the session cannot be read without its readings either.
pub fn session(source: &Source, options: &ReadOptions) -> Result<(Session, SourceMap, Option<Diagnostic>), Diagnostic> {
    let fault = match abbe_files::session_of(source, options) {
        Ok((session, sources)) => return Ok((session, sources, None)),
        Err(fault) => fault,
    };
    match abbe_files::session_of(source, &ReadOptions { read_data: false, ..options.clone() }) {
        Ok((session, sources)) => Ok((session, sources, Some(fault))),
        Err(_) => Err(fault),
    }
}

/// The test of a session by its name.
///
/// # Errors
/// If it has none of this name, in words.
pub fn test<'s>(session: &'s Session, name: &str) -> Result<&'s Test, String> {
    session.tests.iter().find(|test| test.name == name).ok_or_else(|| {
        let names: Vec<&str> = session.tests.iter().map(|test| test.name.as_str()).collect();
        format!("no test `{name}`; the session has {}", names.join(", "))
    })
}

/// Refuses two tests of a session whose files, each with its name and text, have one name; many file systems ignore
/// case.
///
/// # Errors
/// In words, with both.
pub fn refuse_equal_names(session: &Session, files: &[(String, String)]) -> Result<(), String> {
    for (place, (test, (name, _))) in session.tests.iter().zip(files).enumerate() {
        if let Some((other, _)) = files[..place].iter().find(|(other, _)| other.eq_ignore_ascii_case(name)) {
            return Err(format!(
                "test \"{}\" would be written to {name}, and another test is written to {other}; rename one of them",
                test.name
            ));
        }
    }
    Ok(())
}

/// The parameters of an equation; all others are zero.
#[derive(Clone, Debug, Default)]
pub struct EquationParameters {
    /// Errors of axes.
    pub errors: Vec<ErrorName>,
    /// Parameters of the instrument, by their indices in its list.
    pub instrument: Vec<usize>,
    /// Declared effects.
    pub effects: Vec<Effect>,
}

impl EquationParameters {
    /// The errors of a session, and its effects that act in a test.
    pub fn declared(session: &Session, test: &Test) -> EquationParameters {
        let effects = session.effects.iter().filter(|effect| effect.acts_in(&test.name)).cloned();
        EquationParameters { errors: session.unknowns.clone(), effects: effects.collect(), ..Default::default() }
    }

    /// The parameters of the readings of a test by their names; without names, the errors and declared effects of the
    /// session.
    ///
    /// # Errors
    /// As [`EquationParameters::parse`].
    pub fn of_test(session: &Session, test: &Test, names: &[String]) -> Result<EquationParameters, String> {
        if names.is_empty() {
            return Ok(EquationParameters::declared(session, test));
        }
        let effects = EquationParameters::declared(session, test).effects;
        EquationParameters::parse(names, &session.machine, test.station.kind().unknowns(), &effects)
    }

    /// Reads names and patterns of errors, parameters of the instrument and effects.
    ///
    /// # Errors
    /// If a name is no parameter of such an equation, in words.
    pub fn parse(
        names: &[String],
        machine: &Machine,
        of_instrument: &[InstrumentParameter],
        effects: &[Effect],
    ) -> Result<EquationParameters, String> {
        let mut parameters = EquationParameters::default();
        for name in names {
            if pattern::is_pattern(name) {
                let found = pattern::matching(machine, name);
                if found.is_empty() {
                    return Err(format!(
                        "`{name}` matches no error of the machine; `?` stands for one character, `*` for any number of them"
                    ));
                }
                for error in found {
                    if !parameters.errors.contains(&error) {
                        parameters.errors.push(error);
                    }
                }
                continue;
            }
            if name.contains('~') {
                parameters.effects.extend(named(name, effects)?);
                continue;
            }
            match Component::parse(name) {
                Some(Component::Axis(error)) => parameters.errors.push(error),
                Some(Component::Instrument { thing, coordinate }) => {
                    let place = of_instrument.iter().position(|u| u.thing == thing && u.coordinate == coordinate);
                    let name_of = |u: &InstrumentParameter| Variable::Instrument(*u).name();
                    parameters.instrument.push(place.ok_or_else(|| {
                        let has = match of_instrument {
                            [] => "an error vector has no parameters of an instrument".to_string(),
                            some => format!(
                                "this instrument has {}",
                                some.iter().map(name_of).collect::<Vec<_>>().join(", ")
                            ),
                        };
                        format!("`{name}` is a parameter of another instrument; {has}")
                    })?);
                }
                Some(Component::TriggerDelay | Component::Reading(_)) | None => {
                    return Err(format!(
                        "`{name}` is no parameter of an equation; errors have names of ISO 230-1, as EX0C or EZC, or of the literature, as e_x0c"
                    ));
                }
            }
        }
        Ok(parameters)
    }
}

/// The declared effects with a name such as `EZC~C:h2`. Effects that differ only in the numbers of their shapes share a
/// name.
fn named(name: &str, effects: &[Effect]) -> Result<Vec<Effect>, String> {
    let found: Vec<Effect> = effects.iter().filter(|effect| effect.id() == name).cloned().collect();
    if found.is_empty() {
        let declared: Vec<String> = effects.iter().map(Effect::id).collect();
        let has = match declared.as_slice() {
            [] => "no declared effect acts here".to_string(),
            declared => format!("declared here: {}", declared.join(", ")),
        };
        return Err(format!("no effect is called `{name}`; {has}"));
    }
    Ok(found)
}
