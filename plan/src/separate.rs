//! Further tests that separate a found effect from its alternatives.
//!
//! The alternatives are compared one at a time. The separation of an effect from one of them is its distance, in
//! standard deviations, from the best approximation by that alternative and the rest of the model. The information of
//! every candidate test contains the coefficients of all alternatives. To remove one from the model, its columns are
//! removed from the root. One evaluation of the candidate tests therefore serves all alternatives.

use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Test;
use faer::Mat;
use schemars::JsonSchema;
use serde::Serialize;

use super::candidate_information::PreparedCandidates;
use super::design::goal;
use super::design::information::{Root, SharedParameters};
use super::states;
use super::variations::TestVariations;
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::ranking::{rounded, smallest_first};
use abbe_identify::numerics::triangle::upper;
use abbe_identify::problem::Problem;

/// Relative gain below which a test adds no information.
const MIN_GAIN: f64 = 1e-6;
/// Share of the best separation that a shorter test must reach to be preferred.
const EQUIVALENT_SHARE: f64 = 0.9;
/// Standard deviations from which two effects count as separated.
pub(crate) const SEPARATED_SIGMA: f64 = 3.0;
/// Maximum number of proposed tests.
const MAX_TESTS: usize = 3;

/// A test that separates an effect from an alias.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SeparationAnalysis {
    /// Description, for example `C150 with the workpiece ball at radius 50 mm`.
    pub test: String,
    /// Separation by the present readings, standard deviations.
    pub before_sigma: f64,
    /// Separation with the test added, standard deviations.
    pub after_sigma: f64,
    /// Duration of the test, min.
    pub duration_min: f64,
}

/// A test that separates an effect from some of its alternatives.
#[derive(Clone, Debug)]
pub struct SeparatingTest {
    /// Description, for example `C150 with the workpiece ball at radius 50 mm`.
    pub test: String,
    /// Duration, min.
    pub minutes: f64,
    /// The test with its planned states.
    pub planned: Test,
    /// The alternatives that no previous test separates, in their order.
    pub alternatives: Vec<AlternativeSeparation>,
}

impl SeparatingTest {
    /// Number of alternatives that it separates.
    pub fn separates(&self) -> usize {
        self.alternatives.iter().filter(|one| one.is_separated()).count()
    }
}

/// The separation of an effect from one alternative by a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlternativeSeparation {
    /// Index among the given alternatives.
    pub number: usize,
    /// Separation by the present readings and the previous tests, standard deviations.
    pub before: f64,
    /// Separation with the test added.
    pub after: f64,
}

impl AlternativeSeparation {
    /// Whether the test separates the two.
    pub fn is_separated(&self) -> bool {
        self.after >= SEPARATED_SIGMA
    }
}

/// The candidate test that best separates a found effect from an alias. `None` if no candidate test adds to the
/// separation. `coefficients` are those of the found effect, internal units.
///
/// # Errors
/// If the columns of an effect cannot be computed for the session, or if there are no candidate tests for its
/// instrument.
pub fn separation(
    problem: &Problem,
    beta: &[f64],
    found: &Effect,
    coefficients: &[f64],
    alias: &Effect,
    variations: &TestVariations,
) -> Result<Option<SeparationAnalysis>, Diagnostic> {
    let comparison =
        SeparationComparison::new(problem, beta, found, coefficients, std::slice::from_ref(alias), variations)?;
    let base = &comparison.prepared.base;
    let before = comparison.sigma(base, 0);
    let sigmas = comparison.with_each(base, &[0]);
    let Some(best) = comparison.best(&sigmas, f64::MIN_POSITIVE) else {
        return Ok(None);
    };
    let candidate = &comparison.prepared.candidates[best].test;
    let after = sigmas[best][0];
    Ok((after > before * (1.0 + MIN_GAIN)).then(|| SeparationAnalysis {
        test: candidate.name.clone(),
        before_sigma: before,
        after_sigma: after,
        duration_min: candidate.minutes,
    }))
}

/// The tests that separate a found effect from its alternatives. The first test separates the largest number, each
/// further test the largest number of the remaining ones. Empty if no test separates any. `coefficients` are those of
/// the found effect, internal units.
///
/// # Errors
/// If the columns of an effect cannot be computed for the session, or if there are no candidate tests for its
/// instrument.
pub fn separating_tests(
    problem: &Problem,
    beta: &[f64],
    found: &Effect,
    coefficients: &[f64],
    alternatives: &[Effect],
    variations: &TestVariations,
) -> Result<Vec<SeparatingTest>, Diagnostic> {
    if alternatives.is_empty() {
        return Ok(Vec::new());
    }
    let comparison = SeparationComparison::new(problem, beta, found, coefficients, alternatives, variations)?;
    let mut remaining: Vec<usize> = (0..alternatives.len()).collect();
    let mut root = comparison.prepared.base.clone();
    let mut tests: Vec<SeparatingTest> = Vec::new();
    while !remaining.is_empty() && tests.len() < MAX_TESTS {
        let before: Vec<f64> = remaining.iter().map(|one| comparison.sigma(&root, *one)).collect();
        let sigmas = comparison.with_each(&root, &remaining);
        let Some(best) = comparison.best(&sigmas, SEPARATED_SIGMA) else {
            break;
        };
        let candidate = &comparison.prepared.candidates[best].test;
        let of = |((number, before), after): ((&usize, &f64), &f64)| AlternativeSeparation {
            number: *number,
            before: *before,
            after: *after,
        };
        let test = SeparatingTest {
            test: candidate.name.clone(),
            minutes: candidate.minutes,
            planned: candidate.test.clone(),
            alternatives: remaining.iter().zip(&before).zip(&sigmas[best]).map(of).collect(),
        };
        // Alternatives that the readings separate already need no test.
        let gained = |one: &AlternativeSeparation| one.is_separated() && one.before < SEPARATED_SIGMA;
        if !test.alternatives.iter().any(gained) {
            break;
        }
        remaining = (test.alternatives.iter()).filter(|one| !one.is_separated()).map(|one| one.number).collect();
        root = comparison.prepared.added(&root, best);
        tests.push(test);
    }
    Ok(tests)
}

/// The separation of a found effect from each of its alternatives by every candidate test.
struct SeparationComparison {
    prepared: PreparedCandidates,
    coefficients: Vec<f64>,
    /// For each alternative, the columns that remain when it alone is in the model, and their parameters.
    pairs: Vec<(Vec<usize>, SharedParameters)>,
}

impl SeparationComparison {
    fn new(
        problem: &Problem,
        beta: &[f64],
        found: &Effect,
        coefficients: &[f64],
        alternatives: &[Effect],
        variations: &TestVariations,
    ) -> Result<SeparationComparison, Diagnostic> {
        let mut all = problem.clone();
        states::fold_by_test(&mut all);
        let mut values = beta.to_vec();
        let known = all.parameters.effects.len();
        for effect in std::iter::once(found).chain(alternatives) {
            if !all.parameters.effects.contains(effect) {
                all.add_effect(effect)?;
                values.resize(all.parameters.list.len(), 0.0);
            }
        }
        let place = |effect: &Effect| all.parameters.effects.iter().position(|other| other == effect);
        let effect_of = |j: usize| all.parameters.list[j].coefficient_of();
        let found_at = place(found);
        let targets: Vec<usize> =
            (0..all.parameters.list.len()).filter(|j| effect_of(*j).is_some() && effect_of(*j) == found_at).collect();
        let variations = &variations.clone().for_effects(std::iter::once(found).chain(alternatives));
        let tests = super::candidates::candidate_tests(&all.session, variations)?;
        let prepared = PreparedCandidates::new(&all, &values, tests, variations, &targets)?;
        // An alternative that is part of the model always remains in it.
        let is_added = |effect: usize| effect >= known && Some(effect) != found_at;
        let added: Vec<Option<usize>> = (prepared.shared.ids.iter())
            .map(|id| {
                let j = all.parameters.list.iter().position(|parameter| parameter.id == *id)?;
                effect_of(j).filter(|effect| is_added(*effect))
            })
            .collect();
        let pairs = alternatives
            .iter()
            .map(|alternative| {
                let own = place(alternative);
                let stays = |column: &usize| added[*column].is_none() || added[*column] == own;
                let columns: Vec<usize> = (0..added.len()).filter(stays).collect();
                let shared = prepared.shared.part(&columns);
                (columns, shared)
            })
            .collect();
        Ok(SeparationComparison { prepared, coefficients: coefficients.to_vec(), pairs })
    }

    /// The separation of the effect from an alternative under some information, standard deviations.
    fn sigma(&self, root: &Root, alternative: usize) -> f64 {
        let (columns, shared) = &self.pairs[alternative];
        let stays = Mat::from_fn(root.nrows(), columns.len(), |i, j| root[(i, columns[j])]);
        goal::separation(shared, &upper(stays), &self.coefficients)
    }

    /// The separations with each candidate test added, by test and alternative.
    fn with_each(&self, root: &Root, alternatives: &[usize]) -> Vec<Vec<f64>> {
        parallel::map(self.prepared.candidates.len(), &|candidate| {
            let root = self.prepared.added(root, candidate);
            alternatives.iter().map(|one| self.sigma(&root, *one)).collect()
        })
    }

    /// The candidate test that separates the largest number of alternatives by at least `least` standard deviations. Of
    /// several, the shortest test whose least separation is close to the largest. Names decide ties.
    fn best(&self, sigmas: &[Vec<f64>], least: f64) -> Option<usize> {
        let count = |candidate: usize| sigmas[candidate].iter().filter(|sigma| **sigma >= least).count();
        let worst = |candidate: usize| {
            let separated = sigmas[candidate].iter().filter(|sigma| **sigma >= least);
            rounded(separated.copied().fold(f64::INFINITY, f64::min))
        };
        let most = (0..sigmas.len()).map(count).max().filter(|most| *most > 0)?;
        let with_most = || (0..sigmas.len()).filter(|candidate| count(*candidate) == most);
        let best = with_most().map(worst).fold(0.0, f64::max);
        let candidate = |candidate: usize| &self.prepared.candidates[candidate].test;
        with_most().filter(|one| worst(*one) >= EQUIVALENT_SHARE * best).min_by(|a, b| {
            smallest_first(candidate(*a).minutes, candidate(*b).minutes)
                .then(worst(*b).total_cmp(&worst(*a)))
                .then_with(|| candidate(*a).name.cmp(&candidate(*b).name))
        })
    }
}
