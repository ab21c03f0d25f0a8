//! Left-out tests of a found effect and its aliases.
//!
//! Aliases explain the readings equally well. An effect that is attributed to the right component also predicts a test
//! that it was not fitted on ([`abbe_identify::heldout::left_out_tests`]). Each alias therefore replaces the found effect in the
//! model, and both predict the tests that the others identify. Aliases whose sums of squares differ by less than the
//! confounding margin keep their order.

use abbe_identify::heldout::{LeftOutTests, left_out_tests};
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;

use super::TraceFindings;
use crate::alias::Alias;
use crate::constants::{INDISTINGUISHABLE, MAX_PREDICTING};

/// Ratio of the left-out-test errors from which an alias predicts worse.
const WORSE: f64 = 1.01;

/// The left-out-test errors of a found effect and its aliases.
pub(super) struct Predictions {
    /// Rms of the left-out tests with the found effect, µm. `None` if no test can be left out.
    pub found_um: Option<f64>,
    /// The same for each alias. `None` if the other tests do not identify the alias for all of these tests.
    pub aliases_um: Vec<Option<f64>>,
}

impl Predictions {
    /// Keeps those of some aliases, by their place.
    pub fn keep(&mut self, is_kept: impl Fn(usize) -> bool) {
        let mut place = 0..;
        self.aliases_um.retain(|_| place.next().is_some_and(&is_kept));
    }

    /// Whether an alias predicts worse than the found effect, by its place.
    pub fn is_worse(&self, place: usize) -> bool {
        let of_alias = self.aliases_um.get(place).copied().flatten();
        of_alias.zip(self.found_um).is_some_and(|(alias, found)| alias > WORSE * found)
    }

    /// Exchanges the found effect for an alias: it becomes the first alias.
    pub fn exchange(&mut self, place: usize) {
        if place < self.aliases_um.len() {
            let of_alias = self.aliases_um.remove(place);
            self.aliases_um.insert(0, self.found_um);
            self.found_um = of_alias;
        }
    }

    /// Of no test.
    pub fn none(aliases: &[Alias]) -> Predictions {
        Predictions { found_um: None, aliases_um: vec![None; aliases.len()] }
    }
}

/// Predicts the left-out tests with the `k`-th found effect and with each of its aliases. Sorts the aliases: those that
/// predict better come first, otherwise the order remains.
pub(super) fn predictions(
    findings: &TraceFindings<'_>,
    k: usize,
    aliases: &mut Vec<Alias>,
) -> Result<Predictions, Diagnostic> {
    let none = Predictions::none(aliases);
    if aliases.is_empty() || findings.after.models.len() < 2 {
        return Ok(none);
    }
    let found = left_out_tests(findings.after, &findings.after_fit.beta)?;
    let Some(found_mm) = found.rms_mm(findings.after) else { return Ok(none) };
    let judged = scalars(findings.after, &found) / findings.after.noise.sigma_mm.powi(2);
    let mut ranked = Vec::with_capacity(aliases.len());
    for (place, alias) in aliases.drain(..).enumerate() {
        let mm = match place < MAX_PREDICTING {
            true => predicted_mm(findings, k, findings.search.effect(alias.candidate), &found)?,
            false => None,
        };
        // Twice the difference of the log-likelihoods; it counts in whole margins.
        let worse = mm.map_or(0.0, |mm| (mm.powi(2) - found_mm.powi(2)) * judged);
        ranked.push(((worse / (2.0 * INDISTINGUISHABLE)) as i64, mm, alias));
    }
    ranked.sort_by_key(|(margins, ..)| *margins);
    let mut predictions = Predictions { found_um: Some(found_mm * 1e3), aliases_um: Vec::new() };
    for (_, mm, alias) in ranked {
        predictions.aliases_um.push(mm.map(|mm| mm * 1e3));
        aliases.push(alias);
    }
    Ok(predictions)
}

/// Number of accepted scalar readings of the judged tests.
fn scalars(problem: &Problem, left_out: &LeftOutTests) -> f64 {
    let judged = left_out.residuals.iter().enumerate().filter(|(_, residual)| residual.is_some());
    judged.map(|(test, _)| problem.scalars_of(test)).sum::<usize>() as f64
}

/// Rms of the tests that the model with the found effect predicts, mm, with an alias in place of the `k`-th effect.
/// `None` if the other tests do not identify the alias for each of them.
fn predicted_mm(
    findings: &TraceFindings<'_>,
    k: usize,
    alias: &Effect,
    found: &LeftOutTests,
) -> Result<Option<f64>, Diagnostic> {
    let (before, after) = (findings.before, findings.after);
    let mut problem = before.clone();
    problem.noise = after.noise.clone();
    problem.rejected = after.rejected.clone();
    // The parameters of the declared model come first, then those of the found effects in their order.
    let mut beta = findings.after_fit.beta[..before.parameters.list.len()].to_vec();
    let declared = before.parameters.effects.len();
    for (number, effect) in after.parameters.effects.iter().enumerate().skip(declared) {
        if number == declared + k {
            problem.add_effect(alias)?;
            beta.resize(beta.len() + alias.shape.coefficients(), 0.0);
        } else {
            problem.add_effect(&effect.alone())?;
            let own = after.parameters.list.iter().zip(&findings.after_fit.beta);
            let own = own.filter(|(parameter, _)| parameter.coefficient_of() == Some(number));
            beta.extend(own.map(|(_, value)| value));
        }
    }
    let mut left_out = left_out_tests(&problem, &beta)?;
    for (residual, of_found) in left_out.residuals.iter_mut().zip(&found.residuals) {
        match (&residual, of_found) {
            (None, Some(_)) => return Ok(None),
            (_, Some(_)) => {}
            (_, None) => *residual = None,
        }
    }
    Ok(left_out.rms_mm(&problem))
}
