//! The next test: from a menu, greedily and by exchange, by what it does to the information. Nothing is refitted.
//!
//! Greedy: the entry after which the goal stands best, again and again. Exchange: each proposed test is taken away in turn and the best entry for
//! its place looked for, until no place changes (Fedorov's algorithm: Atkinson, Donev & Tobias, Optimum Experimental Designs, 2007, ch. 12).

use abbe_model::effect::Effect;
use faer::Mat;
use rayon::prelude::*;
use serde::Serialize;

use super::information::{Root, Shared, sum};
use super::linear::{Linearisation, is_wanted};
use super::menu::{Entry, Menu};
use crate::error::IdentifyError;
use crate::parameters::{Parameter, Role};
use crate::problem::Problem;

/// What a next test is for.
#[derive(Clone, Debug)]
pub enum Goal {
    /// The least worst standard uncertainty of the errors, 1 µm weighing as much as 1″.
    WorstUncertainty,
    /// The greatest distance in standard deviations between an effect of these coefficients (inside units; none: of one outside unit, at
    /// the worst phase) and the best that everything else, the other effect included, can make of it.
    Separation {
        /// The effect that is there.
        effect: String,
        /// Its coefficients.
        coefficients: Vec<f64>,
    },
}

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
#[derive(Clone, Debug, Serialize)]
pub struct Improvement {
    /// What the figures are: `worst standard uncertainty, um or arcsec`, or `separation, standard deviations`.
    pub figure: String,
    /// Number of entries looked at.
    pub menu_entries: usize,
    /// The figure before.
    pub before: f64,
    /// The errors and their standard uncertainties before, outside units.
    pub uncertainties_before: Vec<(String, f64)>,
    /// The tests, in the order in which they are taken up.
    pub steps: Vec<Step>,
    /// What the exchange changed, in words.
    pub exchanged: Vec<String>,
    /// The best by themselves.
    pub alternatives: Vec<Alternative>,
}

/// A proposed test.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// In words.
    pub test: String,
    /// The figure with it.
    pub after: f64,
    /// What it takes, min.
    pub minutes: f64,
    /// Whether a ball is mounted anew.
    pub new_setup: bool,
    /// Blind spots that it opens.
    pub opens: Vec<String>,
    /// The errors and their standard uncertainties with it, outside units.
    pub uncertainties: Vec<(String, f64)>,
    /// Centre of the workpiece ball in the table frame, mm.
    pub workpiece_ball_mm: [f64; 3],
    /// Centre of the spindle ball in the tool frame, mm.
    pub spindle_ball_mm: [f64; 3],
    /// Calibrated length of the bar, mm.
    pub bar_mm: f64,
}

/// An entry that comes close.
#[derive(Clone, Debug, Serialize)]
pub struct Alternative {
    /// In words.
    pub test: String,
    /// The figure with it.
    pub after: f64,
    /// What it takes, min.
    pub minutes: f64,
}

/// An uncertainty of this share of the physical size is that of a blind spot.
const BLIND_SHARE: f64 = 0.1;
/// Gain below which an exchange is not made.
const LEAST_GAIN: f64 = 1e-6;
/// Alternatives that are listed.
const ALTERNATIVES: usize = 5;
/// Rounds of exchange at most.
const ROUNDS: usize = 10;

/// A menu made ready: the information of every entry on the shared unknowns.
pub struct Prepared {
    /// The shared unknowns.
    pub shared: Shared,
    /// The plan's own information.
    pub base: Root,
    /// The entries.
    pub entries: Vec<Ready>,
}

/// An entry with its information.
pub struct Ready {
    /// The entry; its name says what is left mounted.
    pub entry: Entry,
    /// Its information.
    pub root: Root,
}

impl Prepared {
    /// The menu of a problem whose folds are its tests, at the unknowns' values `beta`. `asked` are the unknowns that the goal is about.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn new(
        problem: &Problem<'_>,
        beta: &[f64],
        entries: Vec<Entry>,
        menu: &Menu,
        asked: &[usize],
    ) -> Result<Prepared, IdentifyError> {
        let list = &problem.parameters.list;
        let kept: Vec<usize> = (0..list.len())
            .filter(|j| !asked.contains(j) && may_be_shared(problem, &list[*j]))
            .collect();
        let shared = Shared::of(problem, &kept, asked);
        let linear = Linearisation::of(problem, beta)?;
        let base = shared.root_of(problem, &linear)?;
        let ready: Vec<Vec<Ready>> = entries
            .into_par_iter()
            .map(|entry| ready(problem, &shared, entry, menu))
            .collect::<Result<_, IdentifyError>>()?;
        Ok(Prepared {
            shared,
            base,
            entries: ready.into_iter().flatten().collect(),
        })
    }

    /// The plan with some entries added.
    pub fn with(&self, entries: &[usize]) -> Root {
        entries.iter().fold(self.base.clone(), |root, entry| {
            sum(root.as_ref(), self.entries[*entry].root.as_ref())
        })
    }

    /// The entry after which a figure (the smaller the better) stands best, and the figures of all.
    pub fn best(&self, root: &Root, figure: &(impl Fn(&Root) -> f64 + Sync)) -> Option<(usize, Vec<f64>)> {
        let figures: Vec<f64> = self
            .entries
            .par_iter()
            .map(|ready| figure(&sum(root.as_ref(), ready.root.as_ref())))
            .collect();
        let best = (0..figures.len()).min_by(|a, b| figures[*a].total_cmp(&figures[*b]))?;
        Some((best, figures))
    }
}

/// Whether a new test can share an unknown: errors and effects, a mounted workpiece ball, the spindle ball of the last test, the sensor.
fn may_be_shared(problem: &Problem<'_>, parameter: &Parameter) -> bool {
    if parameter.role != Role::Setup {
        return true;
    }
    let last = problem
        .tests
        .last()
        .map_or("", |test| test.spindle_setup.as_str());
    parameter.id.starts_with("workpiece_ball.")
        || (parameter.id.starts_with("spindle_ball.") && parameter.id.ends_with(&format!("[{last}]")))
        || !parameter.id.contains('[')
}

/// The information of an entry, with its own spindle ball and, where the menu allows it, with the one that is left mounted.
fn ready(
    problem: &Problem<'_>,
    shared: &Shared,
    entry: Entry,
    menu: &Menu,
) -> Result<Vec<Ready>, IdentifyError> {
    let mut variants = vec![entry];
    let last = problem.tests.last().filter(|_| menu.keep_spindle_ball);
    if let Some(last) = last
        && last.station.tool_point_mm() == variants[0].test.station.tool_point_mm()
    {
        let mut left = variants[0].clone();
        left.test.spindle_setup = last.spindle_setup.clone();
        left.name
            .push_str(&format!(", spindle ball left as in {}", last.name));
        variants.push(left);
    }
    let weight = (menu.thin.max(1) as f64).sqrt();
    variants
        .into_iter()
        .map(|entry| {
            let mut session = problem.session.clone();
            session.tests = vec![entry.test.clone()];
            session.effects = Vec::new();
            session.socket_distances = Vec::new();
            let mut noise = problem.noise.clone();
            noise.sigma_mm /= weight;
            let mut alone = Problem::new(&session, noise, 0)?;
            alone.origin = problem.origin;
            for effect in &problem.parameters.effects {
                alone.add_effect(effect)?;
            }
            let root = shared.root_of_test(&alone)?;
            Ok(Ready { entry, root })
        })
        .collect()
}

/// Proposes tests for a problem whose folds are its tests.
///
/// # Errors
/// If there is nothing to propose or the model cannot be evaluated.
pub fn improve(
    problem: &Problem<'_>,
    menu: &Menu,
    options: &ImproveOptions,
) -> Result<Improvement, IdentifyError> {
    let list = &problem.parameters.list;
    let entries = super::menu::entries(problem.session, menu)?;
    let nominal = vec![0.0; list.len()];
    let asked = asked(problem, &options.goal);
    if asked.is_empty() {
        return Err(IdentifyError::NoUnknowns);
    }
    let prepared = Prepared::new(problem, &nominal, entries, menu, &asked)?;
    let shared = &prepared.shared;
    let figure = |root: &Root| figure(shared, root, &options.goal);
    let before = figure(&prepared.base);
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
            alternatives = listed(&prepared, &figures, &options.goal);
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
    let outside = |value: f64| reported(value, &options.goal);
    let steps = (0..chosen.len())
        .map(|k| step(&prepared, &chosen[..=k], &outside, &figure))
        .collect();
    Ok(Improvement {
        figure: match options.goal {
            Goal::WorstUncertainty => "worst standard uncertainty, um or arcsec".to_string(),
            Goal::Separation { .. } => "separation, standard deviations".to_string(),
        },
        menu_entries: prepared.entries.len(),
        before: outside(before),
        uncertainties_before: named_uncertainties(shared, &prepared.base),
        steps,
        exchanged,
        alternatives,
    })
}

/// The unknowns that a goal is about.
fn asked(problem: &Problem<'_>, goal: &Goal) -> Vec<usize> {
    let list = &problem.parameters.list;
    let is_asked = |parameter: &Parameter| match (goal, parameter.role) {
        (Goal::WorstUncertainty, _) => is_wanted(parameter),
        (Goal::Separation { effect, .. }, Role::Coefficient { effect: index, .. }) => {
            problem.parameters.effects[index].id() == *effect
        }
        _ => false,
    };
    (0..list.len()).filter(|j| is_asked(&list[*j])).collect()
}

/// The figure of a goal, the smaller the better.
pub fn figure(shared: &Shared, root: &Root, goal: &Goal) -> f64 {
    match goal {
        Goal::WorstUncertainty => shared.uncertainties(root).into_iter().fold(0.0, f64::max),
        Goal::Separation { coefficients, .. } => -separation(shared, root, coefficients),
    }
}

/// How many standard deviations what is asked about, with these coefficients, stands from the best that all others can make of it; without
/// coefficients that of one outside unit at the worst phase.
pub fn separation(shared: &Shared, root: &Root, coefficients: &[f64]) -> f64 {
    let block = shared.asked_block(root);
    let first = shared.ids.len() - shared.asked;
    if coefficients.len() == shared.asked {
        return (0..shared.asked)
            .map(|i| {
                (i..shared.asked)
                    .map(|j| block[(i, j)] * coefficients[j])
                    .sum::<f64>()
                    .powi(2)
            })
            .sum::<f64>()
            .sqrt();
    }
    let one = 1.0 / shared.per_inside[first];
    let square = Mat::from_fn(shared.asked, shared.asked, |i, j| block[(i, j)] * one);
    match square.svd() {
        Ok(svd) => svd
            .S()
            .column_vector()
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min),
        Err(_) => 0.0,
    }
}

fn reported(figure: f64, goal: &Goal) -> f64 {
    match goal {
        Goal::WorstUncertainty => figure,
        Goal::Separation { .. } => -figure,
    }
}

fn is_no_gain(before: f64, after: f64) -> bool {
    before - after <= LEAST_GAIN * before.abs()
}

/// The entry that lowers the logarithm of the figure most a minute.
fn best_a_minute(prepared: &Prepared, now: f64, figures: &[f64]) -> Option<usize> {
    // A separation is negative here: the ratio is turned round.
    let gain = |entry: usize| {
        let ratio = if now > 0.0 {
            now / figures[entry]
        } else {
            figures[entry].abs() / now.abs().max(1e-12)
        };
        ratio.max(1e-12).ln() / prepared.entries[entry].entry.minutes.max(1e-3)
    };
    (0..figures.len()).max_by(|a, b| gain(*a).total_cmp(&gain(*b)))
}

fn listed(prepared: &Prepared, figures: &[f64], goal: &Goal) -> Vec<Alternative> {
    let mut order: Vec<usize> = (0..figures.len()).collect();
    order.sort_by(|a, b| figures[*a].total_cmp(&figures[*b]));
    let of = |entry: usize| Alternative {
        test: prepared.entries[entry].entry.name.clone(),
        after: reported(figures[entry], goal),
        minutes: prepared.entries[entry].entry.minutes,
    };
    order.into_iter().take(ALTERNATIVES).map(of).collect()
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
    outside: &impl Fn(f64) -> f64,
    figure: &impl Fn(&Root) -> f64,
) -> Step {
    let shared = &prepared.shared;
    let entry = &prepared.entries[chosen[chosen.len() - 1]].entry;
    let root = prepared.with(chosen);
    let before = prepared.with(&chosen[..chosen.len() - 1]);
    let first = shared.ids.len() - shared.asked;
    let blind =
        |u: &[f64], j: usize| u[j] > BLIND_SHARE * shared.size[first + j] * shared.per_inside[first + j];
    let (u_before, u_after) = (shared.uncertainties(&before), shared.uncertainties(&root));
    let opens = (0..shared.asked)
        .filter(|j| blind(&u_before, *j) && !blind(&u_after, *j))
        .map(|j| shared.ids[first + j].clone())
        .collect();
    let (workpiece_ball_mm, spindle_ball_mm, bar_mm) = match &entry.test.station {
        abbe_model::instrument::Station::BallBar(bar) => (bar.workpiece_ball, bar.spindle_ball, bar.bar),
        _ => ([0.0; 3], [0.0; 3], 0.0),
    };
    Step {
        test: entry.name.clone(),
        after: outside(figure(&root)),
        minutes: entry.minutes,
        new_setup: entry.new_setup,
        opens,
        uncertainties: named_uncertainties(shared, &root),
        workpiece_ball_mm,
        spindle_ball_mm,
        bar_mm,
    }
}

fn named_uncertainties(shared: &Shared, root: &Root) -> Vec<(String, f64)> {
    let first = shared.ids.len() - shared.asked;
    shared.ids[first..]
        .iter()
        .cloned()
        .zip(shared.uncertainties(root))
        .collect()
}

/// A test that separates an effect from one that looks like it.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
pub fn separate(
    problem: &Problem<'_>,
    beta: &[f64],
    found: &Effect,
    coefficients: &[f64],
    alias: &Effect,
    menu: &Menu,
) -> Result<Option<Separated>, IdentifyError> {
    let mut both = problem.clone();
    super::states::fold_by_test(&mut both);
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
        .filter(|entry| -figures[*entry] >= 0.9 * after)
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
