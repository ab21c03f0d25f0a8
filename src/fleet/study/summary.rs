//! Power, false claims and coverage of a study, with their sampling errors.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::draw::Draw;

/// A proportion of independent draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Rate {
    /// How often.
    pub count: usize,
    /// Of so many.
    pub of: usize,
    /// The proportion; 0 of none.
    pub rate: f64,
    /// Its standard error, by the rule of succession.
    pub u: f64,
}

impl Rate {
    /// A proportion.
    pub fn of(count: usize, of: usize) -> Rate {
        let share = (count + 1) as f64 / (of + 2) as f64;
        Rate {
            count,
            of,
            rate: if of > 0 { count as f64 / of as f64 } else { 0.0 },
            u: (share * (1.0 - share) / (of + 2) as f64).sqrt(),
        }
    }
}

/// The draws of one combination, or of several.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Cell {
    /// Name of the plan; `all` for several.
    pub plan: String,
    /// Name of the effect.
    pub effect: String,
    /// Name of the noise; `all` for several.
    pub noise: String,
    /// Number of draws with a result.
    pub draws: usize,
    /// Number of draws without one.
    pub failed: usize,
    /// Number of draws, of those with a result, whose effect the plan does not observe.
    pub not_observed: usize,
    /// The true effect is named or among the aliases; of traces with an effect.
    pub found: Rate,
    /// The true effect is named; of those in which it is found.
    pub named: Rate,
    /// An effect is claimed beside the true one; of traces.
    pub false_claims: Rate,
    /// 95 % intervals of location errors that contain the true value. The sampling error counts intervals as
    /// independent.
    pub coverage: Rate,
    /// Rms of (estimate − true value)/u of the location errors.
    pub pull_rms: f64,
    /// Mean standard uncertainty of the determined location errors, over all units; `null` if none is determined.
    pub mean_u: Option<f64>,
    /// Mean number of location errors that are not determined.
    pub undetermined: f64,
}

/// A study.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StudyResult {
    /// Number of draws.
    pub draws: usize,
    /// All combinations.
    pub cells: Vec<Cell>,
    /// Each effect over all plans and kinds of noise.
    pub effects: Vec<Cell>,
    /// The plans over all effects and kinds of noise, best first: by the number of location errors that are not
    /// determined, then by the mean uncertainty of the others.
    pub ranking: Vec<Cell>,
}

/// The summary of draws.
pub fn summary(draws: &[Draw]) -> StudyResult {
    let by = |name: &dyn Fn(&Draw) -> [String; 3]| -> Vec<Cell> {
        let mut cells: BTreeMap<[String; 3], Vec<&Draw>> = BTreeMap::new();
        for draw in draws {
            cells.entry(name(draw)).or_default().push(draw);
        }
        cells.into_iter().map(|(name, draws)| cell(name, &draws)).collect()
    };
    let all = || "all".to_string();
    let mut ranking = by(&|draw| [draw.plan.clone(), all(), all()]);
    let u = |cell: &Cell| cell.mean_u.unwrap_or(f64::INFINITY);
    ranking.sort_by(|a, b| a.undetermined.total_cmp(&b.undetermined).then(u(a).total_cmp(&u(b))));
    StudyResult {
        draws: draws.len(),
        cells: by(&|draw| [draw.plan.clone(), draw.effect.clone(), draw.noise.clone()]),
        effects: by(&|draw| [all(), draw.effect.clone(), all()]),
        ranking,
    }
}

fn cell([plan, effect, noise]: [String; 3], all: &[&Draw]) -> Cell {
    let draws: Vec<&&Draw> = all.iter().filter(|draw| draw.error.is_none()).collect();
    let count = |is: &dyn Fn(&Draw) -> bool| draws.iter().filter(|draw| is(draw)).count();
    let intervals: usize = draws.iter().map(|draw| draw.intervals).sum();
    // A fit searches no effect.
    let traces = draws.iter().any(|draw| draw.verdict.is_some());
    let searched = |draw: &Draw| draw.truth.is_some() && draw.verdict.is_some() || traces && draw.not_observed;
    let analysed: Vec<&&&Draw> = draws.iter().filter(|draw| !draw.not_observed).collect();
    let mean = |sum: f64, of: usize| if of > 0 { sum / of as f64 } else { 0.0 };
    let determined: Vec<&&&&Draw> = analysed.iter().filter(|draw| draw.intervals > 0).collect();
    let found = count(&|draw| searched(draw) && draw.found);
    let squares: f64 = draws.iter().map(|draw| draw.pull_squares).sum();
    Cell {
        plan,
        effect,
        noise,
        draws: draws.len(),
        failed: all.len() - draws.len(),
        not_observed: draws.len() - analysed.len(),
        found: Rate::of(found, count(&searched)),
        named: Rate::of(count(&|draw| searched(draw) && draw.named), found),
        false_claims: Rate::of(count(&|draw| draw.false_claims > 0), count(&|draw| draw.verdict.is_some())),
        coverage: Rate::of(draws.iter().map(|draw| draw.covered).sum(), intervals),
        pull_rms: (squares / intervals.max(1) as f64).sqrt(),
        mean_u: (!determined.is_empty())
            .then(|| mean(determined.iter().map(|draw| draw.mean_u).sum(), determined.len())),
        undetermined: mean(analysed.iter().map(|draw| draw.undetermined as f64).sum(), analysed.len()),
    }
}
