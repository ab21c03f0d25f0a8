//! Selects the next tests from the candidate tests by their information ([`design`](super::design)). Nothing is refitted.

use abbe_identify::error;
use abbe_identify::noise::ReadingNoise;
use abbe_identify::numerics::ranking::smallest_first;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::document::measurement::Test as Document;
use abbe_model::document::print::Block;
use abbe_model::parameter_id::ParameterId;
use abbe_trace::candidates::named;
use schemars::JsonSchema;
use serde::Serialize;

use super::candidate_information::PreparedCandidates;
use super::design::exchange::is_no_gain;
use super::design::information::{Root, SharedParameters};
use super::design::{Design, Goal, bound};
use super::proposal::{self, proposal};
use super::range::Shrinkage;
use super::variations::TestVariations;

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
    /// A bound of the criterion: no tests of this number reach a smaller value. Only for several tests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<f64>,
    /// The proposed tests, in the order in which they are added.
    pub steps: Vec<ProposedTest>,
    /// The exchanges of proposed tests, one sentence each.
    pub exchanged: Vec<String>,
    /// The best single candidate tests, by the criterion or its gain per minute. Of tests with equal readings, one is
    /// listed.
    pub alternatives: Vec<AlternativeTest>,
}

/// A proposed test.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ProposedTest {
    /// Description of the test.
    pub test: String,
    /// Value of the criterion with this test and those before it; `null` where an error is not identifiable.
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
    /// Of a ball bar: centre of the workpiece ball in the table frame, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workpiece_ball_mm: Option<[f64; 3]>,
    /// Of a ball bar: centre of the spindle ball in the tool frame, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spindle_ball_mm: Option<[f64; 3]>,
    /// Of a ball bar: its calibrated length, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bar_mm: Option<f64>,
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
/// Least share by which a test lowers the uncertainty of an error, where others are not identifiable.
const MIN_LOWERED: f64 = 0.01;
/// Maximum number of listed alternatives.
const MAX_ALTERNATIVES: usize = 5;

/// Proposes a test that separates two effects of the library, named by their identifiers.
///
/// # Errors
/// As [`improve`], or if the library has no such effect for this plan.
pub fn separating(
    problem: &Problem,
    pair: [&str; 2],
    variations: &TestVariations,
    by_minute: bool,
) -> Result<Improvement, Diagnostic> {
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
) -> Result<Improvement, Diagnostic> {
    let list = &problem.parameters.list;
    let tests = super::candidates::candidate_tests(&problem.session, variations)?;
    let nominal = vec![0.0; list.len()];
    let targets = options.goal.targets(problem);
    if targets.is_empty() {
        return Err(error::no_unknowns());
    }
    let prepared = PreparedCandidates::new(problem, &nominal, tests, variations, &targets)?;
    let shared = &prepared.shared;
    let design = prepared.design(&options.goal);
    let mut chosen: Vec<usize> = Vec::new();
    let mut alternatives = Vec::new();
    for place in 0..options.tests {
        let now = design.figure(&chosen);
        let Some((best, figures)) = design.best(&chosen) else {
            break;
        };
        let best = if options.by_minute { best_per_minute(&prepared, now, &figures).unwrap_or(best) } else { best };
        if place == 0 {
            let score = |candidate: usize| match options.by_minute {
                true => -gain_per_minute(&prepared, now, &figures, candidate),
                false => figures[candidate],
            };
            let value = |candidate: usize| options.goal.value(shared, &prepared.added(&prepared.base, candidate));
            alternatives = listed(&prepared, figures.len(), score, value);
        }
        if is_no_gain(now, figures[best]) {
            break;
        }
        chosen.push(best);
    }
    // A test may be of use with the next one only.
    while options.goal.is_of_uncertainties()
        && let Some((_, others)) = chosen.split_last()
        && determines_nothing(shared, &design.with(others), &design.with(&chosen))
    {
        chosen.pop();
    }
    let exchanged = if options.by_minute || chosen.len() < 2 { Vec::new() } else { design.exchange(&mut chosen) };
    let name = |candidate: usize| prepared.candidates[candidate].test.name.as_str();
    let exchanged = exchanged.into_iter().map(|[gone, come]| format!("{} in place of {}", name(come), name(gone)));
    let exchanged = exchanged.collect();
    // An uncertainty near the physical size counts as infinite.
    let outside = |root: &Root| match options.goal {
        Goal::WorstUncertainty => {
            named_uncertainties(shared, root).into_iter().fold(0.0, |worst: f64, (_, u)| worst.max(u))
        }
        ref other => other.value(shared, root),
    };
    let with_units = |named: Vec<(ParameterId, f64)>| -> Vec<NamedUncertainty> {
        let unit = |id: &ParameterId| list.iter().find(|parameter| parameter.id == *id);
        (named.into_iter())
            .map(|(id, u)| NamedUncertainty {
                unit: unit(&id).map_or(String::new(), |parameter| parameter.unit.name.clone()),
                id: id.to_string(),
                u,
            })
            .collect()
    };
    let mut taken = Vec::new();
    let steps: Vec<ProposedTest> = (0..chosen.len())
        .map(|k| {
            let candidate = &prepared.candidates[chosen[k]].test;
            let proposal = proposal(&problem.session, &candidate.test, &candidate.name, variations, &mut taken);
            let step = step(&prepared, &design, &chosen[..=k], &outside, &with_units);
            match proposal {
                Some(proposal) => ProposedTest { name: proposal::name(&proposal), proposal, ..step },
                None => step,
            }
        })
        .collect();
    Ok(Improvement {
        criterion: options.goal.words().to_string(),
        candidate_tests: prepared.candidates.len(),
        before: outside(&prepared.base),
        uncertainties_before: with_units(named_uncertainties(shared, &prepared.base)),
        bound: if chosen.len() > 1 { bound::best_value(&design, &chosen) } else { None },
        exchanged,
        alternatives: if steps.is_empty() { Vec::new() } else { alternatives },
        steps,
    })
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
    count: usize,
    score: impl Fn(usize) -> f64,
    value: impl Fn(usize) -> f64,
) -> Vec<AlternativeTest> {
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| smallest_first(score(*a), score(*b)));
    let mut listed: Vec<AlternativeTest> = Vec::new();
    for candidate in order {
        let test = &prepared.candidates[candidate].test;
        // Mirror-image tests have equal names and figures.
        if listed.len() < MAX_ALTERNATIVES && !listed.iter().any(|other| other.test == test.name) {
            listed.push(AlternativeTest {
                test: test.name.clone(),
                after: value(candidate),
                duration_min: test.minutes,
            });
        }
    }
    listed
}

fn step(
    prepared: &PreparedCandidates,
    design: &Design<'_>,
    chosen: &[usize],
    outside: &impl Fn(&Root) -> f64,
    with_units: &impl Fn(Vec<(ParameterId, f64)>) -> Vec<NamedUncertainty>,
) -> ProposedTest {
    let shared = &prepared.shared;
    let candidate = &prepared.candidates[chosen[chosen.len() - 1]].test;
    let root = design.with(chosen);
    let before = design.with(&chosen[..chosen.len() - 1]);
    let first = shared.ids.len() - shared.targets;
    let unidentifiable = |u: &[f64], j: usize| is_unidentifiable(shared, u, j);
    let (u_before, u_after) = (shared.uncertainties(&before), shared.uncertainties(&root));
    let makes_identifiable = (0..shared.targets)
        .filter(|j| unidentifiable(&u_before, *j) && !unidentifiable(&u_after, *j))
        .map(|j| shared.ids[first + j].to_string())
        .collect();
    let bar = candidate.test.station.bar();
    ProposedTest {
        test: candidate.name.clone(),
        after: outside(&root),
        duration_min: candidate.minutes,
        new_setup: candidate.new_setup,
        makes_identifiable,
        uncertainties: with_units(named_uncertainties(shared, &root)),
        workpiece_ball_mm: bar.map(|bar| bar.workpiece_ball.mm),
        spindle_ball_mm: bar.map(|bar| bar.spindle_ball.mm),
        bar_mm: bar.map(|bar| bar.bar),
        name: String::new(),
        proposal: proposal::none(),
    }
}

/// Whether some error stays not identifiable while the uncertainty of no other falls: the figure then falls towards the
/// regularisation only.
fn determines_nothing(shared: &SharedParameters, before: &Root, after: &Root) -> bool {
    let (before, after) = (named_uncertainties(shared, before), named_uncertainties(shared, after));
    let lowered =
        |((_, before), (_, after)): (&(ParameterId, f64), &(ParameterId, f64))| *after < (1.0 - MIN_LOWERED) * before;
    after.iter().any(|(_, u)| u.is_infinite()) && !before.iter().zip(&after).any(lowered)
}

/// Whether the `j`-th target parameter is not identifiable. Its uncertainty is then that of the regularisation at its
/// physical size.
fn is_unidentifiable(shared: &SharedParameters, u: &[f64], j: usize) -> bool {
    let place = shared.ids.len() - shared.targets + j;
    u[j] > UNIDENTIFIABLE_SHARE * shared.size[place] * shared.display_per_internal[place]
}

/// The target parameters with their uncertainties. They are infinite for parameters that [`SharedParameters`]
/// regularises because they are not identifiable.
fn named_uncertainties(shared: &SharedParameters, root: &Root) -> Vec<(ParameterId, f64)> {
    let first = shared.ids.len() - shared.targets;
    let u = shared.uncertainties(root);
    (0..shared.targets)
        .map(|j| {
            let u_reported = if is_unidentifiable(shared, &u, j) { f64::INFINITY } else { u[j] };
            (shared.ids[first + j].clone(), u_reported)
        })
        .collect()
}

/// Proposed tests, and ranges that suffice.
#[derive(Serialize, JsonSchema)]
pub struct NextTest {
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
    /// The proposed tests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub improvement: Option<Improvement>,
    /// The smallest ranges of sweeps.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ranges: Vec<Shrinkage>,
}

impl NextTest {
    /// Of a plan.
    pub fn new(problem: &Problem, improvement: Option<Improvement>, ranges: Vec<Shrinkage>) -> NextTest {
        NextTest { noise: problem.reading_noise(), improvement, ranges }
    }
}
