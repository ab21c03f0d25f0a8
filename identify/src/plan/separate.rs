//! Further tests that separate a found effect from its alternatives.
//!
//! The alternatives are weighed one at a time: the separation of an effect from one of them is its distance, in standard deviations, from the best that the
//! rest of the model and that alternative can make of it. The information of every candidate test holds the coefficients of all alternatives; to leave one
//! out of the model is to leave its columns out of the root, so that one evaluation of the candidate tests serves them all.

use abbe_model::effect::Effect;
use faer::Mat;
use schemars::JsonSchema;
use serde::Serialize;

use super::candidate_information::Prepared;
use super::candidate_tests::CandidateTests;
use super::criterion;
use super::information::{Root, Shared};
use super::ranking::{rounded, smallest_first};
use super::states;
use crate::error::IdentifyError;
use crate::parameters::Role;
use crate::problem::Problem;
use crate::triangle::upper;

/// Relative gain below which a test adds nothing.
const MIN_GAIN: f64 = 1e-6;
/// Share of the best separation that a quicker test must reach to be preferred.
const EQUIVALENT_SHARE: f64 = 0.9;
/// Standard deviations from which on two effects count as separated.
pub const SEPARATED_SIGMA: f64 = 3.0;
/// Tests that are proposed at most.
const MAX_TESTS: usize = 3;

/// A test that separates an effect from one that looks like it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SeparationAnalysis {
    /// In words: `C150 with the workpiece ball at radius 50 mm`.
    pub test: String,
    /// Separation by the present readings, standard deviations.
    pub before_sigma: f64,
    /// Separation with the test added, standard deviations.
    pub after_sigma: f64,
    /// Duration of the test, min.
    pub duration_min: f64,
}

/// A test that separates an effect from some of its alternatives.
#[derive(Clone, Debug, PartialEq)]
pub struct SeparatingTest {
    /// In words: `C150 with the workpiece ball at radius 50 mm`.
    pub test: String,
    /// What it takes, min.
    pub minutes: f64,
    /// The alternatives that no test before it separates, in their order.
    pub alternatives: Vec<Alternative>,
}

impl SeparatingTest {
    /// How many of its alternatives it separates.
    pub fn separates(&self) -> usize {
        self.alternatives.iter().filter(|one| one.is_separated()).count()
    }
}

/// How well a test separates an effect from one alternative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alternative {
    /// Its place among the alternatives that were asked about.
    pub number: usize,
    /// Separation by the readings that there are and the tests before, standard deviations.
    pub before: f64,
    /// Separation with the test as well.
    pub after: f64,
}

impl Alternative {
    /// Whether the test separates them.
    pub fn is_separated(&self) -> bool {
        self.after >= SEPARATED_SIGMA
    }
}

/// For a found effect and one that looks like it, the candidate test that separates them best; `None` where no candidate test adds to what
/// the readings tell. `coefficients` are those of the found effect, internal units.
///
/// # Errors
/// If an effect cannot be laid over the session, or there is no menu for its instrument.
pub fn separation(
    problem: &Problem<'_>,
    beta: &[f64],
    found: &Effect,
    coefficients: &[f64],
    alias: &Effect,
    menu: &CandidateTests,
) -> Result<Option<SeparationAnalysis>, IdentifyError> {
    let contest = Contest::new(
        problem,
        beta,
        found,
        coefficients,
        std::slice::from_ref(alias),
        menu,
    )?;
    let base = &contest.prepared.base;
    let before = contest.sigma(base, 0);
    let sigmas = contest.with_each(base, &[0]);
    let Some(best) = contest.best(&sigmas, f64::MIN_POSITIVE) else {
        return Ok(None);
    };
    let entry = &contest.prepared.entries[best].entry;
    let after = sigmas[best][0];
    Ok((after > before * (1.0 + MIN_GAIN)).then(|| SeparationAnalysis {
        test: entry.name.clone(),
        before_sigma: before,
        after_sigma: after,
        duration_min: entry.minutes,
    }))
}

/// For a found effect and its alternatives, tests of a menu that separate it from them: the first separates most of them, each further one most of those that
/// are left. Empty where no test separates any. `coefficients` are those of the found effect, internal units.
///
/// # Errors
/// If an effect cannot be laid over the session, or there is no menu for its instrument.
pub fn separating_tests(
    problem: &Problem<'_>,
    beta: &[f64],
    found: &Effect,
    coefficients: &[f64],
    alternatives: &[Effect],
    menu: &CandidateTests,
) -> Result<Vec<SeparatingTest>, IdentifyError> {
    if alternatives.is_empty() {
        return Ok(Vec::new());
    }
    let contest = Contest::new(problem, beta, found, coefficients, alternatives, menu)?;
    let mut left: Vec<usize> = (0..alternatives.len()).collect();
    let mut root = contest.prepared.base.clone();
    let mut tests: Vec<SeparatingTest> = Vec::new();
    while !left.is_empty() && tests.len() < MAX_TESTS {
        let before: Vec<f64> = left.iter().map(|one| contest.sigma(&root, *one)).collect();
        let sigmas = contest.with_each(&root, &left);
        let Some(best) = contest.best(&sigmas, SEPARATED_SIGMA) else {
            break;
        };
        let entry = &contest.prepared.entries[best].entry;
        let of = |((number, before), after): ((&usize, &f64), &f64)| Alternative {
            number: *number,
            before: *before,
            after: *after,
        };
        let test = SeparatingTest {
            test: entry.name.clone(),
            minutes: entry.minutes,
            alternatives: left.iter().zip(&before).zip(&sigmas[best]).map(of).collect(),
        };
        // What the readings separate already needs no test.
        let gained = |one: &Alternative| one.is_separated() && one.before < SEPARATED_SIGMA;
        if !test.alternatives.iter().any(gained) {
            break;
        }
        left = (test.alternatives.iter())
            .filter(|one| !one.is_separated())
            .map(|one| one.number)
            .collect();
        root = contest.prepared.added(&root, best);
        tests.push(test);
    }
    Ok(tests)
}

/// A found effect against each of its alternatives, with the information of every candidate test.
struct Contest {
    prepared: Prepared,
    coefficients: Vec<f64>,
    /// For each alternative the columns that stay when it alone is in the model, and the parameters that they are.
    pairs: Vec<(Vec<usize>, Shared)>,
}

impl Contest {
    fn new(
        problem: &Problem<'_>,
        beta: &[f64],
        found: &Effect,
        coefficients: &[f64],
        alternatives: &[Effect],
        menu: &CandidateTests,
    ) -> Result<Contest, IdentifyError> {
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
        let effect_of = |j: usize| match all.parameters.list[j].role {
            Role::Coefficient { effect, .. } => Some(effect),
            _ => None,
        };
        let found_at = place(found);
        let asked: Vec<usize> = (0..all.parameters.list.len())
            .filter(|j| effect_of(*j).is_some() && effect_of(*j) == found_at)
            .collect();
        let menu = &menu
            .clone()
            .for_effects(std::iter::once(found).chain(alternatives));
        let entries = super::candidate_tests::entries(all.session, menu)?;
        let prepared = Prepared::new(&all, &values, entries, menu, &asked)?;
        // An alternative that is part of the model stays in it, whichever one is weighed.
        let is_added = |effect: usize| effect >= known && Some(effect) != found_at;
        let added: Vec<Option<usize>> = (prepared.shared.ids.iter())
            .map(|id| {
                let j = all
                    .parameters
                    .list
                    .iter()
                    .position(|parameter| parameter.id == *id)?;
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
        Ok(Contest {
            prepared,
            coefficients: coefficients.to_vec(),
            pairs,
        })
    }

    /// How far the effect is from an alternative by some information, standard deviations.
    fn sigma(&self, root: &Root, alternative: usize) -> f64 {
        let (columns, shared) = &self.pairs[alternative];
        let stays = Mat::from_fn(root.nrows(), columns.len(), |i, j| root[(i, columns[j])]);
        criterion::separation(shared, &upper(stays), &self.coefficients)
    }

    /// The same with each candidate test added, for some alternatives: by test, by alternative.
    fn with_each(&self, root: &Root, alternatives: &[usize]) -> Vec<Vec<f64>> {
        self.prepared.figures(root, &|root: &Root| {
            alternatives.iter().map(|one| self.sigma(root, *one)).collect()
        })
    }

    /// The candidate test that separates most alternatives by so many standard deviations; of several the quickest whose least separation comes near the
    /// largest. Ties are decided by names.
    fn best(&self, sigmas: &[Vec<f64>], least: f64) -> Option<usize> {
        let count = |entry: usize| sigmas[entry].iter().filter(|sigma| **sigma >= least).count();
        let worst = |entry: usize| {
            let separated = sigmas[entry].iter().filter(|sigma| **sigma >= least);
            rounded(separated.copied().fold(f64::INFINITY, f64::min))
        };
        let most = (0..sigmas.len()).map(count).max().filter(|most| *most > 0)?;
        let with_most = || (0..sigmas.len()).filter(|entry| count(*entry) == most);
        let best = with_most().map(worst).fold(0.0, f64::max);
        let entry = |entry: usize| &self.prepared.entries[entry].entry;
        with_most()
            .filter(|one| worst(*one) >= EQUIVALENT_SHARE * best)
            .min_by(|a, b| {
                smallest_first(entry(*a).minutes, entry(*b).minutes)
                    .then(worst(*b).total_cmp(&worst(*a)))
                    .then_with(|| entry(*a).name.cmp(&entry(*b).name))
            })
    }
}
