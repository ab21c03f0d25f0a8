//! The next test: from a menu, greedily and by exchange, by what it does to the information. Nothing is refitted.
//!
//! Greedy: the entry after which the goal stands best, again and again. Exchange: each proposed test is taken away in turn and the best entry for
//! its place looked for, until no place changes (Fedorov's algorithm: Atkinson, Donev & Tobias, Optimum Experimental Designs, 2007, ch. 12).

use schemars::JsonSchema;
use serde::Serialize;

use super::candidate_information::Prepared;
use super::candidate_tests::CandidateTests;
use super::criterion::{Goal, asked, figure, reported};
use super::information::{Root, Shared};
use super::ranking::smallest_first;
use crate::error::IdentifyError;
use crate::problem::Problem;

/// How proposals are sought.
#[derive(Clone, Debug)]
pub struct ImproveOptions {
    /// What for.
    pub goal: Goal,
    /// How many tests are proposed.
    pub tests: usize,
    /// Whether the gain is judged a minute.
    pub by_minute: bool,
}

/// What is proposed.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Improvement {
    /// The criterion and the unit of its values: `worst standard uncertainty, um or arcsec`, or `separation, standard deviations`.
    pub criterion: String,
    /// Number of candidate tests that were evaluated.
    pub candidate_tests: usize,
    /// Value of the criterion before; infinite (`null` in JSON) where an error is not identifiable.
    #[schemars(with = "Option<f64>")]
    pub before: f64,
    /// The errors and their standard uncertainties before.
    pub uncertainties_before: Vec<NamedUncertainty>,
    /// The proposed tests, in the order in which they are added.
    pub steps: Vec<Step>,
    /// The exchanges of proposed tests, in words.
    pub exchanged: Vec<String>,
    /// The best candidate tests by themselves, in the order of the criterion, or of its gain per minute. Of tests with equal readings, one.
    pub alternatives: Vec<Alternative>,
}

/// A proposed test.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Step {
    /// In words.
    pub test: String,
    /// Value of the criterion with it; infinite (`null` in JSON) where an error is not identifiable.
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

/// A candidate test that comes close.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Alternative {
    /// In words.
    pub test: String,
    /// Value of the criterion with it; infinite (`null` in JSON) where an error is not identifiable.
    #[schemars(with = "Option<f64>")]
    pub after: f64,
    /// Duration of the test, min.
    pub duration_min: f64,
}

/// An uncertainty of this share of the physical size is that of a blind spot.
const UNIDENTIFIABLE_SHARE: f64 = 0.1;
/// Gain below which an exchange is not made.
const MIN_GAIN: f64 = 1e-6;
/// Alternatives that are listed.
const ALTERNATIVES: usize = 5;
/// Rounds of exchange at most.
const ROUNDS: usize = 10;

/// Proposes tests for a problem whose folds are its tests.
///
/// # Errors
/// If there is nothing to propose or the model cannot be evaluated.
pub fn improve(
    problem: &Problem<'_>,
    menu: &CandidateTests,
    options: &ImproveOptions,
) -> Result<Improvement, IdentifyError> {
    let list = &problem.parameters.list;
    let entries = super::candidate_tests::entries(problem.session, menu)?;
    let nominal = vec![0.0; list.len()];
    let asked = asked(problem, &options.goal);
    if asked.is_empty() {
        return Err(IdentifyError::NoUnknowns);
    }
    let prepared = Prepared::new(problem, &nominal, entries, menu, &asked)?;
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
        let best = if options.by_minute {
            best_a_minute(&prepared, now, &figures).unwrap_or(best)
        } else {
            best
        };
        if place == 0 {
            let score = |entry: usize| match options.by_minute {
                true => -gain_a_minute(&prepared, now, &figures, entry),
                false => figures[entry],
            };
            alternatives = listed(&prepared, &figures, &options.goal, score);
        }
        if is_no_gain(now, figures[best]) {
            break;
        }
        chosen.push(best);
    }
    let exchanged = if options.by_minute {
        Vec::new()
    } else {
        exchange(&prepared, &mut chosen, &figure)
    };
    // An uncertainty that is that of the physical size is none.
    let outside = |root: &Root| match options.goal {
        Goal::WorstUncertainty => named_uncertainties(shared, root)
            .into_iter()
            .fold(0.0, |worst: f64, (_, u)| worst.max(u)),
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
    let steps = (0..chosen.len())
        .map(|k| step(&prepared, &chosen[..=k], &outside, &with_units))
        .collect();
    Ok(Improvement {
        criterion: match options.goal {
            Goal::WorstUncertainty => "worst standard uncertainty, um or arcsec".to_string(),
            Goal::Separation { .. } => "separation, standard deviations".to_string(),
        },
        candidate_tests: prepared.entries.len(),
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

/// By how much an entry lowers the logarithm of the figure a minute.
fn gain_a_minute(prepared: &Prepared, now: f64, figures: &[f64], entry: usize) -> f64 {
    // A separation is negative here: the ratio is turned round.
    let ratio = if now > 0.0 {
        now / figures[entry]
    } else {
        figures[entry].abs() / now.abs().max(1e-12)
    };
    ratio.max(1e-12).ln() / prepared.entries[entry].entry.minutes.max(1e-3)
}

/// The entry that gains most a minute.
fn best_a_minute(prepared: &Prepared, now: f64, figures: &[f64]) -> Option<usize> {
    let gain = |entry: usize| gain_a_minute(prepared, now, figures, entry);
    (0..figures.len()).min_by(|a, b| smallest_first(-gain(*a), -gain(*b)))
}

/// The entries with the least scores, each name once.
fn listed(
    prepared: &Prepared,
    figures: &[f64],
    goal: &Goal,
    score: impl Fn(usize) -> f64,
) -> Vec<Alternative> {
    let mut order: Vec<usize> = (0..figures.len()).collect();
    order.sort_by(|a, b| smallest_first(score(*a), score(*b)));
    let of = |entry: usize| Alternative {
        test: prepared.entries[entry].entry.name.clone(),
        after: reported(figures[entry], goal),
        duration_min: prepared.entries[entry].entry.minutes,
    };
    let mut listed: Vec<Alternative> = Vec::new();
    for alternative in order.into_iter().map(of) {
        // Entries that are mirror images of one another read alike and are as good.
        if listed.len() < ALTERNATIVES && !listed.iter().any(|other| other.test == alternative.test) {
            listed.push(alternative);
        }
    }
    listed
}

/// Takes each proposed test away in turn and puts the best entry in its place.
fn exchange(
    prepared: &Prepared,
    chosen: &mut [usize],
    figure: &(impl Fn(&Root) -> f64 + Sync),
) -> Vec<String> {
    let mut words = Vec::new();
    if chosen.len() < 2 {
        return words;
    }
    for _ in 0..ROUNDS {
        let mut changed = false;
        for place in 0..chosen.len() {
            let others: Vec<usize> = chosen
                .iter()
                .enumerate()
                .filter(|(k, _)| *k != place)
                .map(|(_, entry)| *entry)
                .collect();
            let now = figure(&prepared.with(chosen));
            let Some((best, figures)) = prepared.best(&prepared.with(&others), figure) else {
                continue;
            };
            if is_no_gain(now, figures[best]) {
                continue;
            }
            words.push(format!(
                "{} in place of {}",
                prepared.entries[best].entry.name, prepared.entries[chosen[place]].entry.name
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
    prepared: &Prepared,
    chosen: &[usize],
    outside: &impl Fn(&Root) -> f64,
    with_units: &impl Fn(Vec<(String, f64)>) -> Vec<NamedUncertainty>,
) -> Step {
    let shared = &prepared.shared;
    let entry = &prepared.entries[chosen[chosen.len() - 1]].entry;
    let root = prepared.with(chosen);
    let before = prepared.with(&chosen[..chosen.len() - 1]);
    let first = shared.ids.len() - shared.asked;
    let unidentifiable = |u: &[f64], j: usize| is_unidentifiable(shared, u, j);
    let (u_before, u_after) = (shared.uncertainties(&before), shared.uncertainties(&root));
    let makes_identifiable = (0..shared.asked)
        .filter(|j| unidentifiable(&u_before, *j) && !unidentifiable(&u_after, *j))
        .map(|j| shared.ids[first + j].clone())
        .collect();
    let (workpiece_ball_mm, spindle_ball_mm, bar_mm) = match &entry.test.station {
        abbe_model::instrument::Station::BallBar(bar) => (bar.workpiece_ball, bar.spindle_ball, bar.bar),
        _ => ([0.0; 3], [0.0; 3], 0.0),
    };
    Step {
        test: entry.name.clone(),
        after: outside(&root),
        duration_min: entry.minutes,
        new_setup: entry.new_setup,
        makes_identifiable,
        uncertainties: with_units(named_uncertainties(shared, &root)),
        workpiece_ball_mm,
        spindle_ball_mm,
        bar_mm,
    }
}

/// Whether an uncertainty, the `j`-th of what is asked about, is that of a parameter which no reading tells and which is held at its physical size instead.
fn is_unidentifiable(shared: &Shared, u: &[f64], j: usize) -> bool {
    let place = shared.ids.len() - shared.asked + j;
    u[j] > UNIDENTIFIABLE_SHARE * shared.size[place] * shared.display_per_internal[place]
}

/// What is asked about, with its uncertainties: infinite where the figure would be that of the physical size at which [`Shared`] holds what is not
/// identifiable.
fn named_uncertainties(shared: &Shared, root: &Root) -> Vec<(String, f64)> {
    let first = shared.ids.len() - shared.asked;
    let u = shared.uncertainties(root);
    (0..shared.asked)
        .map(|j| {
            let told = if is_unidentifiable(shared, &u, j) {
                f64::INFINITY
            } else {
                u[j]
            };
            (shared.ids[first + j].clone(), told)
        })
        .collect()
}
