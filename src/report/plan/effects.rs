//! Undeclared effects that the tests of a plan detect, and those that are confounded with the errors.

use std::sync::Arc;

use abbe::model::parameter_id::EffectId;
use abbe::model::words::first_of;
use abbe::plan::effects::confounded_by_error;
use abbe::plan::results::{Detectability, EffectDetectability, EffectsAnalysis};

use super::optional;
use crate::report::number::{three_digits, unit};
use crate::report::table::{Table, cells};

/// Effects in one table; the JSON lists all.
const MAX_EFFECTS: usize = 16;
/// Confounded effects named with each error.
const MAX_CONFOUNDED: usize = 3;

/// How many undeclared effects the tests detect.
pub struct Counts {
    /// Effects that the tests detect.
    pub detectable: usize,
    /// Effects that are confounded with the errors.
    pub confounded: usize,
    /// Effects that change no reading.
    pub without_signal: usize,
}

/// Counts the effects by their verdict.
pub fn counts(found: &EffectsAnalysis) -> Counts {
    let count =
        |verdict: fn(Detectability) -> bool| found.effects.iter().filter(|effect| verdict(effect.verdict)).count();
    Counts {
        detectable: count(|verdict| verdict == Detectability::Detectable),
        confounded: count(Detectability::is_confounded),
        without_signal: count(|verdict| verdict == Detectability::NoSignal),
    }
}

/// The effects that the tests detect.
pub fn detectable(found: &EffectsAnalysis) -> Table {
    table(found.effects.iter().filter(|effect| effect.verdict == Detectability::Detectable)).titled(format!(
        "Detectable: smallest amplitude that is found with {:.0} % power at {:.0} % significance by a single test of that effect and by a search of\n\
         the library of {} effects (Šidák, conservative); share of the signal that remains in the residual; bias of the errors while it is\n\
         undeclared; number of further effects of the same component and driver. A power has its amplitude at 100 mm\n\
         or at 180°, power 1 of a linear axis per metre",
        found.power * 100.0,
        found.significance_level * 100.0,
        found.effects_screened
    ))
}

/// The effects that are confounded with the errors.
pub fn confounded(found: &EffectsAnalysis) -> Table {
    table(found.effects.iter().filter(|effect| effect.verdict.is_confounded())).titled(
        "Confounded: less than 1 % of the signal remains in the residual. A clean residual does not exclude these effects, and they bias",
    )
}

/// The effects confounded with each error.
pub fn by_error(found: &EffectsAnalysis) -> Table {
    let rows = confounded_by_error(found).into_iter().map(|(error, effects)| {
        let named: Vec<String> = effects
            .iter()
            .map(|(id, per_unit, name)| format!("{id} {} {}", three_digits(*per_unit), unit(name)))
            .collect();
        cells![error, first_of(&named, MAX_CONFOUNDED, ", ", "")]
    });
    Table::new(["error", "effects"], rows).titled("Effects confounded with each error, the largest bias first")
}

/// Of effects with the same component and driver the table lists the one with the largest bias and counts the others.
fn table<'e>(effects: impl Iterator<Item = &'e EffectDetectability>) -> Table {
    let strongest = |effect: &EffectDetectability| effect.biases.first().map_or(0.0, |bias| bias.per_unit.abs());
    let mut sorted: Vec<&EffectDetectability> = effects.collect();
    // Equal rounded values are ordered by name: rounding differs between processors.
    let size = |effect: &EffectDetectability| three_digits(strongest(effect)).parse().unwrap_or(f64::INFINITY);
    sorted.sort_by(|a, b| f64::total_cmp(&size(b), &size(a)).then_with(|| a.id.cmp(&b.id)));
    let mut chosen: Vec<(&EffectDetectability, Option<Arc<EffectId>>, usize)> = Vec::new();
    for effect in sorted {
        let own = EffectId::parse(&effect.id);
        let is_alike =
            |first: &Option<Arc<EffectId>>| first.as_ref().zip(own.as_ref()).is_some_and(|(a, b)| a.is_alike(b));
        match chosen.iter_mut().find(|(_, first, _)| is_alike(first)) {
            Some((.., alike)) => *alike += 1,
            None => chosen.push((effect, own, 0)),
        }
    }
    let rows = chosen.iter().take(MAX_EFFECTS).map(|(effect, _, alike)| {
        let biases = effect.biases.iter().take(2);
        let biases: Vec<String> =
            biases.map(|bias| format!("{} {} {}", bias.id, three_digits(bias.per_unit), unit(&bias.unit))).collect();
        cells![
            &effect.id,
            optional(effect.detectable_amplitude),
            optional(effect.detectable_amplitude_screened),
            unit(&effect.unit),
            per_cent(effect.residual_share),
            if biases.is_empty() { "none".to_string() } else { biases.join(", ") },
            alike.to_string(),
        ]
    });
    let columns = ["effect", ">single", ">search", "unit", ">remains", "bias", ">further"];
    let mut table = Table::new(columns, rows);
    if chosen.len() > MAX_EFFECTS {
        table.notes.push(format!("… {} more in the JSON", chosen.len() - MAX_EFFECTS));
    }
    table
}

/// A share of a signal in per cent.
fn per_cent(share: f64) -> String {
    if share < 1e-4 { "< 0.01 %".to_string() } else { format!("{} %", three_digits(share * 100.0)) }
}
