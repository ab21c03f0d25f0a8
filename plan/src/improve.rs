//! Selects the next tests from the candidate tests by their information, greedily and by exchange. Nothing is refitted.
//!
//! Greedy: the candidate test with the best figure is added, repeatedly. Exchange: each proposed test is removed in
//! turn and replaced by the best candidate test, until no test changes (Fedorov's algorithm: Atkinson, Donev & Tobias,
//! Optimum Experimental Designs, 2007, ch. 12).

use abbe_identify::IdentifyError;
use abbe_model::document::print::Block;
use abbe_model::document::test::Test as Document;
use schemars::JsonSchema;
use serde::Serialize;

use super::candidate_information::PreparedCandidates;
use super::criterion::{Goal, figure, reported, targets};
use super::information::{Root, SharedParameters};
use super::proposal::{self, proposal};
use super::test_variations::TestVariations;
use crate::PlanError;
use abbe_identify::candidates::named;
use abbe_identify::numerics::ranking::smallest_first;
use abbe_identify::problem::Problem;

/// Options of the selection of next tests.
#[derive(Clone, Debug)]
pub struct ImproveOptions {
    /// The goal.
    pub goal: Goal,
    /// Number of proposed tests.
    pub tests: usize,
    /// Whether the gain per minute decides.
    pub by_minute: bool,
}

/// The proposed tests.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Improvement {
    /// The criterion and the unit of its values: `worst standard uncertainty, um or arcsec`, or
    /// `separation, standard deviations`.
    pub criterion: String,
    /// Number of candidate tests that were evaluated.
    pub candidate_tests: usize,
    /// Value of the criterion before; infinite (`null` in JSON) where an error is not identifiable.
    #[schemars(with = "Option<f64>")]
    pub before: f64,
    /// The errors and their standard uncertainties before.
    pub uncertainties_before: Vec<NamedUncertainty>,
    /// The proposed tests, in the order in which they are added.
    pub steps: Vec<ProposedTest>,
    /// The exchanges of proposed tests, one sentence each.
    pub exchanged: Vec<String>,
    /// The best single candidate tests, in the order of the criterion or of its gain per minute. Of tests with equal
    /// readings, one is listed.
    pub alternatives: Vec<AlternativeTest>,
}

/// A proposed test.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ProposedTest {
    /// Description of the test.
    pub test: String,
    /// Value of the criterion with this test and those before it; infinite (`null` in JSON) where an error is not
    /// identifiable.
    #[schemars(with = "Option<f64>")]
    pub after: f64,
    /// Duration of the test, min.
    pub duration_min: f64,
    /// Whether the test needs a new set-up.
    pub new_setup: bool,
    /// Errors that it makes identifiable.
    pub makes_identifiable: Vec<String>,
    /// The errors and their standard uncertainties with it.
    pub uncertainties: Vec<NamedUncertainty>,
    /// Centre of the workpiece ball in the table frame, mm.
    pub workpiece_ball_mm: [f64; 3],
    /// Centre of the spindle ball in the tool frame, mm.
    pub spindle_ball_mm: [f64; 3],
    /// Calibrated length of the bar, mm.
    pub bar_mm: f64,
    /// Name of the test in `session_toml`.
    pub name: String,
    /// The test as a `[[test]]` block of a session file.
    #[serde(rename = "session_toml")]
    pub proposal: Block<Document>,
}

/// An error and its standard uncertainty.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct NamedUncertainty {
    /// The error.
    pub id: String,
    /// Its standard uncertainty, in `unit`; infinite (`null` in JSON) where it is not identifiable.
    #[schemars(with = "Option<f64>")]
    pub u: f64,
    /// `um`, `arcsec`, …
    pub unit: String,
}

/// One of the best candidate tests.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct AlternativeTest {
    /// Description of the test.
    pub test: String,
    /// Value of the criterion with it; infinite (`null` in JSON) where an error is not identifiable.
    #[schemars(with = "Option<f64>")]
    pub after: f64,
    /// Duration of the test, min.
    pub duration_min: f64,
}

/// Share of the physical size above which the uncertainty of an error means that the error is not identifiable.
const UNIDENTIFIABLE_SHARE: f64 = 0.1;
/// Relative gain below which a test is neither added nor exchanged.
const MIN_GAIN: f64 = 1e-6;
/// Maximum number of listed alternatives.
const MAX_ALTERNATIVES: usize = 5;
/// Maximum number of exchange rounds.
const MAX_ROUNDS: usize = 10;

/// Proposes a test that separates two effects of the library, named by their identifiers.
///
/// # Errors
/// As [`improve`], or if the library has no such effect for this plan.
pub fn separating(
    problem: &Problem,
    pair: [&str; 2],
    variations: &TestVariations,
    by_minute: bool,
) -> Result<Improvement, PlanError> {
    let mut both = problem.clone();
    for id in pair {
        named::add(&mut both, id)?;
    }
    let variations = variations.clone().for_effects(&both.parameters.effects);
    let goal = Goal::Separation { effect: pair[0].to_string(), coefficients: Vec::new() };
    improve(&both, &variations, &ImproveOptions { goal, tests: 1, by_minute })
}

/// Proposes tests for a problem whose folds are its tests.
///
/// # Errors
/// If there is no candidate test or the model cannot be evaluated.
pub fn improve(
    problem: &Problem,
    variations: &TestVariations,
    options: &ImproveOptions,
) -> Result<Improvement, PlanError> {
    let list = &problem.parameters.list;
    let tests = super::candidate_tests::candidate_tests(&problem.session, variations)?;
    let nominal = vec![0.0; list.len()];
    let targets = targets(problem, &options.goal);
    if targets.is_empty() {
        return Err(IdentifyError::NoUnknowns.into());
    }
    let prepared = PreparedCandidates::new(problem, &nominal, tests, variations, &targets)?;
    let shared = &prepared.shared;
    let figure = |root: &Root| figure(shared, root, &options.goal);
    let mut chosen: Vec<usize> = Vec::new();
    let mut alternatives = Vec::new();
    for place in 0..options.tests {
        let root = prepared.with(&chosen);
        let now = figure(&root);
        let Some((best, figures)) = prepared.best(&root, &figure) else {
            break;
        };
        let best = if options.by_minute { best_per_minute(&prepared, now, &figures).unwrap_or(best) } else { best };
        if place == 0 {
            let score = |candidate: usize| match options.by_minute {
                true => -gain_per_minute(&prepared, now, &figures, candidate),
                false => figures[candidate],
            };
            alternatives = listed(&prepared, &figures, &options.goal, score);
        }
        if is_no_gain(now, figures[best]) {
            break;
        }
        chosen.push(best);
    }
    let exchanged = if options.by_minute { Vec::new() } else { exchange(&prepared, &mut chosen, &figure) };
    // An uncertainty near the physical size counts as infinite.
    let outside = |root: &Root| match options.goal {
        Goal::WorstUncertainty => {
            named_uncertainties(shared, root).into_iter().fold(0.0, |worst: f64, (_, u)| worst.max(u))
        }
        Goal::Separation { .. } => reported(figure(root), &options.goal),
    };
    let with_units = |named: Vec<(String, f64)>| -> Vec<NamedUncertainty> {
        let unit = |id: &str| list.iter().find(|parameter| parameter.id == id);
        (named.into_iter())
            .map(|(id, u)| NamedUncertainty {
                unit: unit(&id).map_or(String::new(), |parameter| parameter.unit.name.clone()),
                id,
                u,
            })
            .collect()
    };
    let mut taken = Vec::new();
    let steps = (0..chosen.len())
        .map(|k| {
            let candidate = &prepared.candidates[chosen[k]].test;
            let proposal = proposal(&problem.session, &candidate.test, &candidate.name, variations, &mut taken);
            let step = step(&prepared, &chosen[..=k], &outside, &with_units);
            match proposal {
                Some(proposal) => ProposedTest { name: proposal::name(&proposal), proposal, ..step },
                None => step,
            }
        })
        .collect();
    Ok(Improvement {
        criterion: match options.goal {
            Goal::WorstUncertainty => "worst standard uncertainty, um or arcsec".to_string(),
            Goal::Separation { .. } => "separation, standard deviations".to_string(),
        },
        candidate_tests: prepared.candidates.len(),
        before: outside(&prepared.base),
        uncertainties_before: with_units(named_uncertainties(shared, &prepared.base)),
        steps,
        exchanged,
        alternatives,
    })
}

fn is_no_gain(before: f64, after: f64) -> bool {
    before - after <= MIN_GAIN * before.abs()
}

/// The decrease of the logarithm of the figure per minute.
fn gain_per_minute(prepared: &PreparedCandidates, now: f64, figures: &[f64], candidate: usize) -> f64 {
    // A separation is negative here, so the ratio is inverted.
    let ratio = if now > 0.0 { now / figures[candidate] } else { figures[candidate].abs() / now.abs().max(1e-12) };
    ratio.max(1e-12).ln() / prepared.candidates[candidate].test.minutes.max(1e-3)
}

/// The candidate test with the largest gain per minute.
fn best_per_minute(prepared: &PreparedCandidates, now: f64, figures: &[f64]) -> Option<usize> {
    let gain = |candidate: usize| gain_per_minute(prepared, now, figures, candidate);
    (0..figures.len()).min_by(|a, b| smallest_first(-gain(*a), -gain(*b)))
}

/// The candidate tests with the smallest scores, each name once.
fn listed(
    prepared: &PreparedCandidates,
    figures: &[f64],
    goal: &Goal,
    score: impl Fn(usize) -> f64,
) -> Vec<AlternativeTest> {
    let mut order: Vec<usize> = (0..figures.len()).collect();
    order.sort_by(|a, b| smallest_first(score(*a), score(*b)));
    let of = |candidate: usize| AlternativeTest {
        test: prepared.candidates[candidate].test.name.clone(),
        after: reported(figures[candidate], goal),
        duration_min: prepared.candidates[candidate].test.minutes,
    };
    let mut listed: Vec<AlternativeTest> = Vec::new();
    for alternative in order.into_iter().map(of) {
        // Mirror-image tests have equal names and figures.
        if listed.len() < MAX_ALTERNATIVES && !listed.iter().any(|other| other.test == alternative.test) {
            listed.push(alternative);
        }
    }
    listed
}

/// Removes each proposed test in turn and replaces it by the best candidate test.
fn exchange(
    prepared: &PreparedCandidates,
    chosen: &mut [usize],
    figure: &(impl Fn(&Root) -> f64 + Sync),
) -> Vec<String> {
    let mut words = Vec::new();
    if chosen.len() < 2 {
        return words;
    }
    for _ in 0..MAX_ROUNDS {
        let mut changed = false;
        for place in 0..chosen.len() {
            let others: Vec<usize> =
                chosen.iter().enumerate().filter(|(k, _)| *k != place).map(|(_, candidate)| *candidate).collect();
            let now = figure(&prepared.with(chosen));
            let Some((best, figures)) = prepared.best(&prepared.with(&others), figure) else {
                continue;
            };
            if is_no_gain(now, figures[best]) {
                continue;
            }
            words.push(format!(
                "{} in place of {}",
                prepared.candidates[best].test.name, prepared.candidates[chosen[place]].test.name
            ));
            chosen[place] = best;
            changed = true;
        }
        if !changed {
            break;
        }
    }
    words
}

fn step(
    prepared: &PreparedCandidates,
    chosen: &[usize],
    outside: &impl Fn(&Root) -> f64,
    with_units: &impl Fn(Vec<(String, f64)>) -> Vec<NamedUncertainty>,
) -> ProposedTest {
    let shared = &prepared.shared;
    let candidate = &prepared.candidates[chosen[chosen.len() - 1]].test;
    let root = prepared.with(chosen);
    let before = prepared.with(&chosen[..chosen.len() - 1]);
    let first = shared.ids.len() - shared.targets;
    let unidentifiable = |u: &[f64], j: usize| is_unidentifiable(shared, u, j);
    let (u_before, u_after) = (shared.uncertainties(&before), shared.uncertainties(&root));
    let makes_identifiable = (0..shared.targets)
        .filter(|j| unidentifiable(&u_before, *j) && !unidentifiable(&u_after, *j))
        .map(|j| shared.ids[first + j].clone())
        .collect();
    let bar = candidate.test.station.bar();
    let (workpiece_ball_mm, spindle_ball_mm, bar_mm) =
        bar.map_or(([0.0; 3], [0.0; 3], 0.0), |bar| (bar.workpiece_ball, bar.spindle_ball, bar.bar));
    ProposedTest {
        test: candidate.name.clone(),
        after: outside(&root),
        duration_min: candidate.minutes,
        new_setup: candidate.new_setup,
        makes_identifiable,
        uncertainties: with_units(named_uncertainties(shared, &root)),
        workpiece_ball_mm,
        spindle_ball_mm,
        bar_mm,
        name: String::new(),
        proposal: proposal::none(),
    }
}

/// Whether the `j`-th target parameter is not identifiable. Its uncertainty is then that of the regularisation at its
/// physical size.
fn is_unidentifiable(shared: &SharedParameters, u: &[f64], j: usize) -> bool {
    let place = shared.ids.len() - shared.targets + j;
    u[j] > UNIDENTIFIABLE_SHARE * shared.size[place] * shared.display_per_internal[place]
}

/// The target parameters with their uncertainties. They are infinite for parameters that [`SharedParameters`]
/// regularises because they are not identifiable.
fn named_uncertainties(shared: &SharedParameters, root: &Root) -> Vec<(String, f64)> {
    let first = shared.ids.len() - shared.targets;
    let u = shared.uncertainties(root);
    (0..shared.targets)
        .map(|j| {
            let u_reported = if is_unidentifiable(shared, &u, j) { f64::INFINITY } else { u[j] };
            (shared.ids[first + j].clone(), u_reported)
        })
        .collect()
}
