//! One explanation of several, on the user's word.

use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Session;
use abbe_model::words::counted;

use crate::error;
use crate::problem::Problem;

/// An effect with one of its explanations assumed, by its identifier: its own, or that of an alias, which then takes its
/// place. `None` if it is neither.
fn explained_by(effect: &Effect, id: &str) -> Option<Effect> {
    if effect.id() == id {
        return Some(Effect { assumed: true, ..effect.clone() });
    }
    let place = effect.aliases.iter().position(|alias| alias.id() == id)?;
    let mut aliases = effect.aliases.clone();
    let chosen = aliases.remove(place);
    aliases.insert(0, effect.alone());
    Some(Effect { aliases, assumed: true, ..chosen })
}

/// The session with explanations of its effects assumed, each by the identifier of the effect or of one of its aliases:
/// `EZC~C:h2`. Uncertainties then do not cover the other explanations.
///
/// # Errors
/// If no effect of the session has this explanation.
pub fn assume(session: &Session, ids: &[String]) -> Result<Session, Diagnostic> {
    let mut session = session.clone();
    for id in ids {
        let found = session.effects.iter().enumerate().find_map(|(k, effect)| Some((k, explained_by(effect, id)?)));
        let Some((k, effect)) = found else {
            let own = session.effects.iter().map(Effect::id);
            let known = own.chain(session.effects.iter().flat_map(|effect| effect.aliases.iter().map(Effect::id)));
            let (what, these) = ("effect that is explained by", "the explanations are:");
            return Err(error::unknown("the session", what, id, these, known));
        };
        session.effects[k] = effect;
    }
    Ok(session)
}

/// What a model assumes of its effects, in words: the explanation, and how many others the readings do not separate from
/// it.
pub fn statements(problem: &Problem) -> Vec<String> {
    let effects = problem.parameters.effects.iter().filter(|effect| effect.assumed && !effect.aliases.is_empty());
    let words = effects.map(|effect| {
        let others = counted(effect.aliases.len(), "other explanation");
        format!("{} is assumed on the user's word; the readings do not separate it from {others}", effect.id())
    });
    words.collect()
}
