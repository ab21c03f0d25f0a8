//! The explanations that a trace names: those that the user accepts, and of each other effect the most probable one beside
//! the others. Two effects are also exchanged together, since the best explanation of one depends on that of the other.

use abbe_identify::fit::Fit;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;

use super::TraceFindings;
use super::prediction::predicts_worse;
use crate::alias::{Alias, Explanations, explanations};
use crate::constants::{EQUALLY_PROBABLE, MAX_COMPARED, MAX_EXCHANGES, PAIRED};
use crate::judge::fitted;

/// The named explanation of each effect that the search has selected, and the model with them.
pub(super) struct Named {
    /// Their candidates.
    pub candidates: Vec<usize>,
    /// Whether the user accepts each.
    pub assumed: Vec<bool>,
    pub after: Problem,
    pub after_fit: Fit,
}

/// Other candidates for some effects, by the number of the effect.
type Exchange = Vec<(usize, usize)>;

impl Named {
    /// What the search has selected.
    fn as_found(findings: &TraceFindings<'_>) -> Named {
        let candidates: Vec<usize> = findings.search.selected().iter().map(|selected| selected.candidate).collect();
        Named {
            assumed: vec![false; candidates.len()],
            candidates,
            after: findings.after.clone(),
            after_fit: findings.after_fit.clone(),
        }
    }

    fn exchange(&mut self, findings: &TraceFindings<'_>, exchange: &Exchange) -> Result<(), Diagnostic> {
        exchange.iter().for_each(|(k, candidate)| self.candidates[*k] = *candidate);
        let effect = |candidate: &usize| findings.search.effect(*candidate).clone().with_estimated_numbers();
        let effects: Vec<Effect> = self.candidates.iter().map(effect).collect();
        (self.after, self.after_fit) = fitted(findings.before, &effects, findings.seed)?;
        Ok(())
    }
}

/// The named explanations, and those that compete with each of them.
///
/// # Errors
/// If a model with other explanations cannot be fitted.
pub(super) fn named(findings: &TraceFindings<'_>, variance: f64) -> Result<(Named, Vec<Explanations>), Diagnostic> {
    let mut named = Named::as_found(findings);
    let of_each = |named: &Named| {
        let of_one = |k| explanations(findings.search, &named.candidates, k, variance);
        (0..named.candidates.len()).map(of_one).collect::<Result<Vec<_>, _>>()
    };
    let mut all = of_each(&named)?;
    for k in 0..all.len() {
        let is_assumed = |candidate: usize| findings.assume.contains(&findings.search.effect(candidate).id());
        let accepted = all[k].aliases.iter().find(|alias| is_assumed(alias.candidate));
        named.assumed[k] = is_assumed(named.candidates[k]) || accepted.is_some();
        if let Some(alias) = accepted.filter(|_| !is_assumed(named.candidates[k])) {
            named.exchange(findings, &vec![(k, alias.candidate)])?;
            all = of_each(&named)?;
        }
    }
    for _ in 0..MAX_EXCHANGES {
        let Some(better) = more_probable(findings, &named, &all, variance)? else { break };
        named.exchange(findings, &better)?;
        all = of_each(&named)?;
    }
    Ok((named, all))
}

/// An exchange that makes the named explanations more probable and predicts left-out tests no worse: of one effect, or of two
/// where none of one is left.
fn more_probable(
    findings: &TraceFindings<'_>,
    named: &Named,
    all: &[Explanations],
    variance: f64,
) -> Result<Option<Exchange>, Diagnostic> {
    let own = |alias: &&Alias| alias.variant_of.is_none();
    let free: Vec<usize> = (0..all.len()).filter(|k| !named.assumed[*k]).collect();
    let mut better: Vec<(f64, Exchange)> = Vec::new();
    for k in &free {
        let aliases = all[*k].aliases.iter().filter(own);
        better.extend(aliases.map(|alias| (alias.ln_probability_ratio(), vec![(*k, alias.candidate)])));
    }
    if let Some(best) = best_of(findings, named, better)? {
        return Ok(Some(best));
    }
    let mut better = Vec::new();
    for k in free.iter().filter(|_| all.len() <= MAX_COMPARED) {
        for alias in all[*k].aliases.iter().filter(own).take(PAIRED) {
            let mut beside = named.candidates.clone();
            beside[*k] = alias.candidate;
            for other in free.iter().filter(|other| *other != k) {
                let of_other = explanations(findings.search, &beside, *other, variance)?.aliases;
                let ratio = |second: &Alias| alias.ln_probability_ratio() + second.ln_probability_ratio();
                let pair = |second: &Alias| (ratio(second), vec![(*k, alias.candidate), (*other, second.candidate)]);
                better.extend(of_other.iter().filter(own).map(pair));
            }
        }
    }
    best_of(findings, named, better)
}

/// The exchange with the largest logarithm of a probability ratio, if it is more probable, of those that predict left-out tests
/// no worse.
fn best_of(
    findings: &TraceFindings<'_>,
    named: &Named,
    mut better: Vec<(f64, Exchange)>,
) -> Result<Option<Exchange>, Diagnostic> {
    better.retain(|(ratio, _)| *ratio > EQUALLY_PROBABLE);
    better.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, exchange) in better {
        if !predicts_worse(findings, named, &exchange)? {
            return Ok(Some(exchange));
        }
    }
    Ok(None)
}
