//! The test that tells a found effect from one that looks like it.

use abbe_model::effect::Effect;
use schemars::JsonSchema;
use serde::Serialize;

use super::goal::{Goal, asked, figure};
use super::information::Root;
use super::menu::Menu;
use super::prepared::Prepared;
use super::states;
use crate::error::IdentifyError;
use crate::problem::Problem;

/// Relative gain below which a test adds nothing.
const LEAST_GAIN: f64 = 1e-6;
/// Share of the best separation that a quicker test must reach to be preferred.
const AS_GOOD_AS: f64 = 0.9;

/// A test that separates an effect from one that looks like it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Separated {
    /// In words: `C150 with the workpiece ball at radius 50 mm`.
    pub test: String,
    /// Separation by the readings that there are, standard deviations.
    pub before: f64,
    /// Separation with the test added.
    pub after: f64,
    /// What it takes, min.
    pub minutes: f64,
}

/// For a found effect and one that looks like it, the entry of a menu that separates them best; `None` where none on the menu adds to what
/// the readings tell. `coefficients` are those of the found effect, inside units.
///
/// # Errors
/// If an effect cannot be laid over the session, or there is no menu for its instrument.
pub fn separation(
    problem: &Problem<'_>,
    beta: &[f64],
    found: &Effect,
    coefficients: &[f64],
    alias: &Effect,
    menu: &Menu,
) -> Result<Option<Separated>, IdentifyError> {
    let mut both = problem.clone();
    states::fold_by_test(&mut both);
    let mut values = beta.to_vec();
    for effect in [found, alias] {
        if !both
            .parameters
            .effects
            .iter()
            .any(|present| present.id() == effect.id())
        {
            both.add_effect(effect)?;
            values.resize(both.parameters.list.len(), 0.0);
        }
    }
    let goal = Goal::Separation {
        effect: found.id(),
        coefficients: coefficients.to_vec(),
    };
    let menu = &menu.clone().for_effects([found, alias]);
    let entries = super::menu::entries(both.session, menu)?;
    let asked = asked(&both, &goal);
    let prepared = Prepared::new(&both, &values, entries, menu, &asked)?;
    let figure = |root: &Root| figure(&prepared.shared, root, &goal);
    let before = -figure(&prepared.base);
    let Some((best, figures)) = prepared.best(&prepared.base, &figure) else {
        return Ok(None);
    };
    let after = -figures[best];
    // Among entries that separate all but as well, the quickest.
    let quickest = (0..figures.len())
        .filter(|entry| -figures[*entry] >= AS_GOOD_AS * after)
        .min_by(|a, b| {
            prepared.entries[*a]
                .entry
                .minutes
                .total_cmp(&prepared.entries[*b].entry.minutes)
        })
        .unwrap_or(best);
    let entry = &prepared.entries[quickest].entry;
    let separated = Separated {
        test: entry.name.clone(),
        before,
        after: -figures[quickest],
        minutes: entry.minutes,
    };
    Ok((after > before * (1.0 + LEAST_GAIN)).then_some(separated))
}
