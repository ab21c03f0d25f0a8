//! Further tests that separate a found effect from its aliases.

use abbe_identify::error::INTERRUPTED;
use abbe_model::Diagnostic;
use abbe_model::document::measurement::Test as Document;
use abbe_model::document::print::Block;
use abbe_model::effect::Effect;

use crate::error::{NO_CANDIDATE_TEST, TOO_MANY};
use crate::proposal::{self, proposal};
use crate::separate::{AlternativeSeparation, SeparatingTest, separating_tests};
use crate::variations::TestVariations;
use abbe_trace::interrupt::Interrupt;
use abbe_trace::result::effect_name;
use abbe_trace::result::{AlternativeResult, EffectResult, SeparatingTestResult, SeparationResult};
use abbe_trace::{Progress, TraceOutcome};

/// Maximum number of aliases that are compared with an effect, the nearest first. Each alias adds columns.
const MAX_COMPARED_TESTS: usize = 24;

/// Adds to each found effect the candidate tests that separate it from its aliases. Adds nothing if the session's
/// instrument has no bar, or there are no candidate tests. If `progress` returns `false`, the trace is marked as interrupted and
/// keeps the tests found so far.
///
/// # Errors
/// If the basis columns of an effect cannot be computed for the session.
pub fn separate_aliases(
    trace: &mut TraceOutcome,
    variations: &TestVariations,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<(), Diagnostic> {
    // The candidates of other instruments are many, and a search that proposes them for every effect takes longer than the
    // search for the effects: `separation` compares one pair.
    let has_bar = trace.after.session.tests.last().is_some_and(|test| test.station.bar().is_some());
    if trace.result.interrupted || !has_bar {
        return Ok(());
    }
    let interrupt = Interrupt(progress);
    let mut taken = Vec::new();
    for k in 0..trace.effects.len() {
        match interrupt.check().and_then(|()| tests_for(trace, k, variations)) {
            Ok(tests) => {
                let propose = |test: &SeparatingTest| {
                    proposal(&trace.after.session, &test.planned, &test.test, variations, &mut taken)
                };
                let proposals: Vec<Option<Block<Document>>> = tests.iter().map(propose).collect();
                let (effect, aliases) = (&mut trace.result.effects[k], &trace.alias_effects[k]);
                fill_in(effect, aliases, &trace.after.session, tests);
                for (test, proposal) in effect.separating_tests.iter_mut().zip(proposals) {
                    let Some(proposal) = proposal else { continue };
                    test.name = proposal::name(&proposal);
                    test.proposal = proposal;
                }
            }
            Err(error) if [NO_CANDIDATE_TEST, TOO_MANY, INTERRUPTED].contains(&error.code) => break,
            Err(error) => return Err(error),
        }
    }
    if interrupt.check().is_err() {
        trace.result.mark_interrupted();
    }
    Ok(())
}

/// The tests that separate the `k`-th found effect from its aliases.
fn tests_for(trace: &TraceOutcome, k: usize, variations: &TestVariations) -> Result<Vec<SeparatingTest>, Diagnostic> {
    let number = trace.before.parameters.effects.len() + k;
    let parameters = trace.after.parameters.list.iter().zip(&trace.after_fit.beta);
    let own = parameters.filter(|(parameter, _)| parameter.coefficient_of() == Some(number));
    let coefficients: Vec<f64> = own.map(|(_, value)| *value).collect();
    let aliases = &trace.alias_effects[k];
    let weighed = &aliases[..aliases.len().min(MAX_COMPARED_TESTS)];
    let beta = &trace.after_fit.beta;
    separating_tests(&trace.after, beta, &trace.effects[k], &coefficients, weighed, variations)
}

/// Writes tests into an effect's result.
fn fill_in(
    effect: &mut EffectResult,
    aliases: &[Effect],
    session: &abbe_model::session::Session,
    tests: Vec<SeparatingTest>,
) {
    let name = |one: &AlternativeSeparation| effect_name(&session.machine, &aliases[one.number]);
    if let Some(first) = tests.first() {
        effect.separated_by = Some(first.test.clone());
        let nearest = first.alternatives.iter().find(|one| one.is_separated());
        effect.separation = nearest.map(|one| SeparationResult {
            from: name(one),
            before_sigma: one.before,
            after_sigma: one.after,
            duration_min: first.minutes,
        });
    }
    let alternative = |one: &AlternativeSeparation| AlternativeResult {
        name: name(one),
        before_sigma: one.before,
        after_sigma: one.after,
        separated: one.is_separated(),
    };
    let result = |test: &SeparatingTest| SeparatingTestResult {
        test: test.test.clone(),
        duration_min: test.minutes,
        separated_count: test.separates(),
        alternative_count: test.alternatives.len(),
        alternatives: test.alternatives.iter().map(alternative).collect(),
        name: String::new(),
        proposal: proposal::none(),
    };
    effect.separating_tests = tests.iter().map(result).collect();
}
