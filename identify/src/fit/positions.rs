//! The positions of steps that a fit estimates.
//!
//! χ² is constant in the position `p` of a step until the step passes a reading. It has no derivative by `p`, so that no
//! Gauss–Newton step can move it. With the other columns of the model projected out of the readings `y` and of the column
//! `s(p)` of the step,
//!
//! ```text
//! χ²(p) = |y|² − (s(p)·y)² / |s(p)|²
//! ```
//!
//! is the minimum over the height and all other parameters `β`. A fit moves each step to the gap between two readings where
//! it is least. The 95 % interval of a position ends where `χ²` has risen by the 95 % quantile of one degree of freedom,
//! enlarged as uncertainties are. Uncertainties of all parameters cover the positions by the law of total variance:
//!
//! ```text
//! u² = u₀² + Σ_p w(p) (β(p) − β)²,    w(p) ∝ Δp·exp(−χ²(p)/2)
//! ```

use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use faer::Mat;

use super::{Fit, Problem};
use crate::numerics::regression::dot;
use crate::numerics::solve::Svd;
use crate::numerics::tails::QUANTILE_95;
use crate::parameters::Parameter;

/// Share of a column that remains after the projection below which the model contains it.
const CONTAINED: f64 = 1e-9;
/// Least decrease of χ² for which a step moves.
const MIN_FALL: f64 = 0.01;
/// Gaps on each side of a step that are all tried; beyond them the distances grow.
const EACH: usize = 5;
/// Gaps between readings that are tried at a time between two others.
const TRIED_BETWEEN: usize = 8;
/// Maximum number of times that gaps between others are tried.
const MAX_PASSES: usize = 10;
/// Weight of a position from which on the gaps beside it are tried.
const PROBABLE: f64 = 0.02;
/// Least weight of a position whose changes of the parameters are covered.
const MIN_WEIGHT: f64 = 1e-6;

/// An estimated position of a step.
#[derive(Clone, Debug)]
pub struct StepPosition {
    /// Index of the effect.
    pub effect: usize,
    /// Index among its positions.
    pub step: usize,
    /// Standard uncertainty, of the positions within the interval, internal unit of the driver.
    pub u: f64,
    /// The 95 % interval, internal unit of the driver; `None` if the readings do not bound the position.
    pub interval_95: Option<[f64; 2]>,
    /// Other positions, by their weight, with the change of each parameter, internal units.
    pub others: Vec<(f64, Vec<f64>)>,
}

/// A step with the gaps between readings in which it may lie: from its neighbours on, or from the ends of the readings.
struct Step<'p> {
    effect: usize,
    step: usize,
    /// Its height, by index among the parameters.
    height: usize,
    at: f64,
    /// The gap in which it lies. Gap `g` begins behind `levels[g - 1]` and ends with `levels[g]`.
    gap: usize,
    first: usize,
    last: usize,
    /// The values of the driver at the readings, ascending.
    levels: &'p [f64],
}

/// A step in another gap, with all other parameters at their best values.
struct Moved {
    gap: usize,
    at: f64,
    chi_square: f64,
    /// Change of each parameter.
    changes: Vec<f64>,
}

/// Some columns of a triangular factor, for what they explain of another column.
pub(super) struct Projection {
    columns: Vec<usize>,
    svd: Svd,
    rank: usize,
}

impl Projection {
    /// Of the columns of these numbers, for parameters of these sizes.
    pub fn of(r: &Mat<f64>, sizes: &[f64], columns: Vec<usize>) -> Result<Projection, Diagnostic> {
        let scaled = Mat::from_fn(r.nrows(), columns.len(), |i, k| r[(i, columns[k])] * sizes[columns[k]]);
        let svd = Svd::of(scaled.as_ref())?;
        let rank = svd.identifiable_rank();
        Ok(Projection { columns, svd, rank })
    }

    /// A column as its coordinates in the directions of the columns, and the rest.
    pub fn split(&self, column: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut rest = column.to_vec();
        let along: Vec<f64> = (0..self.rank)
            .map(|k| {
                let direction = self.svd.left().col(k);
                let along: f64 = direction.iter().zip(column).map(|(u, c)| u * c).sum();
                rest.iter_mut().zip(direction.iter()).for_each(|(rest, u)| *rest -= along * u);
                along
            })
            .collect();
        (along, rest)
    }

    /// The square of the rest of a column; `None` if the columns contain it.
    pub fn information(column: &[f64], rest: &[f64]) -> Option<f64> {
        let square = dot(rest, rest);
        (square > CONTAINED * dot(column, column)).then_some(square)
    }

    /// Adds the parameters of the columns with these coordinates, internal units.
    pub fn add(&self, along: &[f64], sizes: &[f64], changes: &mut [f64]) {
        for (direction, along) in along.iter().enumerate() {
            let by = along / self.svd.singular_values[direction];
            for (j, v) in self.columns.iter().zip(self.svd.right().col(direction).iter()) {
                changes[*j] += by * v * sizes[*j];
            }
        }
    }
}

impl Step<'_> {
    /// A position in a gap: its own, or the middle.
    fn at(&self, gap: usize) -> f64 {
        if gap == self.gap { self.at } else { 0.5 * (self.levels[gap - 1] + self.levels[gap]) }
    }

    /// Gaps at growing distances on both sides, with those at both ends.
    fn around(&self) -> Vec<usize> {
        let mut gaps = vec![self.first, self.gap, self.last];
        let mut distance = 1;
        while self.gap - distance.min(self.gap) > self.first || self.gap + distance < self.last {
            gaps.extend(self.gap.checked_sub(distance).filter(|gap| *gap > self.first));
            gaps.extend(Some(self.gap + distance).filter(|gap| *gap < self.last));
            distance += (distance / EACH).max(1);
        }
        gaps.sort_unstable();
        gaps.dedup();
        gaps
    }
}

/// Some gaps between two others.
fn between(low: usize, high: usize) -> Vec<usize> {
    let count = (high - low).saturating_sub(1).min(TRIED_BETWEEN);
    (1..=count).map(|k| low + k * (high - low) / (count + 1)).filter(|gap| low < *gap && *gap < high).collect()
}

/// The levels of each effect whose positions are estimated; empty for others.
fn levels(problem: &Problem) -> Result<Vec<Vec<f64>>, Diagnostic> {
    let own = |effect: &Effect| if effect.positions_estimated { problem.levels(effect) } else { Ok(Vec::new()) };
    problem.parameters.effects.iter().map(own).collect()
}

/// The steps whose positions are estimated. A driver that takes one value has no gap.
fn steps<'p>(problem: &Problem, levels: &'p [Vec<f64>]) -> Vec<Step<'p>> {
    let (parameters, mut found) = (&problem.parameters, Vec::new());
    for (effect, step) in parameters.positions() {
        let (levels, positions) = (levels[effect].as_slice(), parameters.effects[effect].shape.positions());
        let is_height = |own: &Parameter| own.coefficient_of() == Some(effect) && own.index == step;
        let height = parameters.list.iter().position(is_height);
        let Some(height) = height.filter(|_| levels.len() > 1) else { continue };
        let gap_of = |at: f64| levels.partition_point(|level| *level < at).clamp(1, levels.len() - 1);
        let gap = gap_of(positions[step]);
        let others = || positions.iter().enumerate().filter(|(k, _)| *k != step).map(|(_, at)| gap_of(*at));
        let first = others().filter(|other| *other < gap).max().map_or(1, |other| other + 1);
        let last = others().filter(|other| *other > gap).min().map_or(levels.len() - 1, |other| other - 1);
        found.push(Step { effect, step, height, at: positions[step], gap, first, last, levels });
    }
    found
}

/// Each step in some gaps, in the order of these. One linearisation at `beta` serves all.
fn profiles(
    problem: &Problem,
    beta: &[f64],
    steps: &[Step<'_>],
    gaps: &[Vec<usize>],
) -> Result<Vec<Vec<Moved>>, Diagnostic> {
    let mut wide = problem.clone();
    let mut firsts = Vec::with_capacity(steps.len());
    let mut added: Vec<(Effect, usize)> = Vec::new();
    for (step, gaps) in steps.iter().zip(gaps) {
        let effect = problem.parameters.effects[step.effect].alone();
        let shape = effect.shape.with_positions(gaps.iter().map(|gap| step.at(*gap)).collect());
        let tried = Effect { shape, ..effect };
        // Steps at one position have the same gaps.
        let first = match added.iter().find(|(present, _)| *present == tried) {
            Some((_, first)) => *first,
            None => {
                let first = wide.parameters.list.len();
                if !gaps.is_empty() {
                    wide.add_effect(&tried)?;
                    added.push((tried, first));
                }
                first
            }
        };
        firsts.push(first);
    }
    let count = beta.len();
    let mut at = beta.to_vec();
    at.resize(wide.parameters.list.len(), 0.0);
    let (r, c, beside) = wide.prior_triangle(&at).merged(&wide.triangles(&at)?).parts();
    let sizes = wide.parameters.sizes();
    let mut found = Vec::with_capacity(steps.len());
    for ((step, gaps), first) in steps.iter().zip(gaps).zip(firsts) {
        if gaps.is_empty() {
            found.push(Vec::new());
            continue;
        }
        let others = (0..count).filter(|j| *j != step.height).collect();
        let others = Projection::of(&r, &sizes, others)?;
        let readings: Vec<f64> = (0..r.nrows()).map(|i| c[i] + r[(i, step.height)] * beta[step.height]).collect();
        let (along, rest) = others.split(&readings);
        let moved = |(k, gap): (usize, &usize)| {
            let column: Vec<f64> = (0..r.nrows()).map(|i| r[(i, first + k)] * sizes[first + k]).collect();
            let (along_column, rest_of_column) = others.split(&column);
            let information = Projection::information(&column, &rest_of_column);
            let height = information.map_or(0.0, |information| dot(&rest_of_column, &rest) / information);
            let mut changes = vec![0.0; count];
            changes[step.height] = height * sizes[first + k] - beta[step.height];
            let along: Vec<f64> = along.iter().zip(&along_column).map(|(y, column)| y - height * column).collect();
            others.add(&along, &sizes, &mut changes);
            let chi_square = beside + dot(&rest, &rest) - height * height * information.unwrap_or(0.0);
            Moved { gap: *gap, at: step.at(*gap), chi_square, changes }
        };
        found.push(gaps.iter().enumerate().map(moved).collect());
    }
    Ok(found)
}

/// Index of the place where χ² is least.
fn least(profile: &[Moved]) -> Option<usize> {
    (0..profile.len()).min_by(|a, b| profile[*a].chi_square.total_cmp(&profile[*b].chi_square))
}

/// The problem with the one step moved that lowers χ² the most, and the parameters there. `None` if none lowers it.
///
/// # Errors
/// If the model cannot be evaluated.
pub(super) fn moved(problem: &Problem, beta: &[f64]) -> Result<Option<(Problem, Vec<f64>)>, Diagnostic> {
    let levels = levels(problem)?;
    let steps = steps(problem, &levels);
    if steps.is_empty() {
        return Ok(None);
    }
    let gaps: Vec<Vec<usize>> = steps.iter().map(Step::around).collect();
    let found = profiles(problem, beta, &steps, &gaps)?;
    let found = steps.into_iter().zip(found);
    let most = found.max_by(|a, b| fall(&a.0, &a.1).total_cmp(&fall(&b.0, &b.1)));
    let Some((step, mut profile)) = most.filter(|(step, profile)| fall(step, profile) > MIN_FALL) else {
        return Ok(None);
    };
    let beside_least = |profile: &[Moved]| {
        let Some(best) = least(profile) else { return Vec::new() };
        let [low, high] = [best.saturating_sub(1), (best + 1).min(profile.len() - 1)].map(|place| profile[place].gap);
        let gap = profile[best].gap;
        [between(low, gap), between(gap, high)].concat()
    };
    refine(problem, beta, std::slice::from_ref(&step), std::slice::from_mut(&mut profile), |_, own| beside_least(own))?;
    let Some(best) = least(&profile).map(|best| profile.swap_remove(best)) else { return Ok(None) };
    let mut problem = problem.clone();
    let shape = &mut problem.parameters.effects[step.effect].shape;
    let mut positions = shape.positions().to_vec();
    positions[step.step] = best.at;
    *shape = shape.with_positions(positions);
    let mut beta: Vec<f64> = beta.iter().zip(&best.changes).map(|(value, change)| value + change).collect();
    problem.linearise_numbers(&mut beta)?;
    Ok(Some((problem, beta)))
}

/// Moves each step to the middle of its gap, which changes no reading: there its standard uncertainty is that of every
/// position in the gap.
///
/// # Errors
/// If the data lack the column of the driver.
pub(super) fn centre(problem: &mut Problem) -> Result<(), Diagnostic> {
    let levels = levels(problem)?;
    let steps = steps(problem, &levels);
    let centred = steps.iter().filter_map(|step| {
        let [low, high] = [step.levels[step.gap - 1], step.levels[step.gap]];
        let shares_gap =
            |other: &Step<'_>| other.effect == step.effect && other.step != step.step && other.gap == step.gap;
        let is_inside = low < step.at && step.at <= high;
        (is_inside && !steps.iter().any(shares_gap)).then_some((step.effect, step.step, 0.5 * (low + high)))
    });
    let centred: Vec<(usize, usize, f64)> = centred.collect();
    for (effect, step, middle) in centred {
        let shape = &mut problem.parameters.effects[effect].shape;
        let mut positions = shape.positions().to_vec();
        positions[step] = middle;
        *shape = shape.with_positions(positions);
    }
    Ok(())
}

/// By how much χ² falls if a step moves from its own gap to the best one.
fn fall(step: &Step<'_>, profile: &[Moved]) -> f64 {
    let own = profile.iter().find(|moved| moved.gap == step.gap);
    own.zip(least(profile)).map_or(0.0, |(own, best)| own.chi_square - profile[best].chi_square)
}

/// Tries the gaps between others that `wanted` names for the profile of a step, until it names none.
fn refine(
    problem: &Problem,
    beta: &[f64],
    steps: &[Step<'_>],
    found: &mut [Vec<Moved>],
    wanted: impl Fn(&Step<'_>, &[Moved]) -> Vec<usize>,
) -> Result<(), Diagnostic> {
    for _ in 0..MAX_PASSES {
        let gaps: Vec<Vec<usize>> = steps.iter().zip(&*found).map(|(step, profile)| wanted(step, profile)).collect();
        if gaps.iter().all(Vec::is_empty) {
            break;
        }
        for (profile, more) in found.iter_mut().zip(profiles(problem, beta, steps, &gaps)?) {
            profile.extend(more);
            profile.sort_by_key(|moved| moved.gap);
        }
    }
    Ok(())
}

/// The estimated positions at a solution.
///
/// # Errors
/// If the model cannot be evaluated.
pub(super) fn at_solution(problem: &Problem, fit: &Fit) -> Result<Vec<StepPosition>, Diagnostic> {
    let levels = levels(problem)?;
    let steps = steps(problem, &levels);
    if steps.is_empty() {
        return Ok(Vec::new());
    }
    let enlargement = fit.u_enlargement.powi(2);
    let allowed = |step: &Step<'_>, profile: &[Moved]| {
        let own = profile.iter().find(|moved| moved.gap == step.gap).map_or(0.0, |own| own.chi_square);
        own + QUANTILE_95 * enlargement
    };
    // The outermost gaps in which χ² has risen by less than is allowed, by their places in the profile.
    let ends = |step: &Step<'_>, profile: &[Moved]| {
        let allowed = allowed(step, profile);
        let mut inside = (0..profile.len()).filter(|place| profile[*place].chi_square <= allowed);
        let first = inside.next()?;
        Some([first, inside.next_back().unwrap_or(first)])
    };
    let gaps: Vec<Vec<usize>> = steps.iter().map(Step::around).collect();
    let mut found = profiles(problem, &fit.beta, &steps, &gaps)?;
    // Gaps between others are tried where the interval ends, and where the position probably lies.
    refine(problem, &fit.beta, &steps, &mut found, |step, profile| {
        let Some([first, last]) = ends(step, profile) else { return Vec::new() };
        let weights = weights(step, profile, enlargement);
        let is_probable = |place: usize| weights[place].0 > PROBABLE;
        let is_end = |place: usize| place + 1 == first || place == last;
        (0..profile.len() - 1)
            .filter(|place| is_end(*place) || is_probable(*place) || is_probable(*place + 1))
            .flat_map(|place| between(profile[place].gap, profile[place + 1].gap))
            .collect()
    })?;
    let position = |(step, profile): (Step<'_>, Vec<Moved>)| {
        let ends = ends(&step, &profile).filter(|[first, last]| *first > 0 && last + 1 < profile.len());
        let interval = ends.map(|[first, last]| [step.levels[profile[first].gap - 1], step.levels[profile[last].gap]]);
        let weights = weights(&step, &profile, enlargement);
        // A standard uncertainty beside an interval that excludes far positions does not contain them either.
        let [first, last] = ends.unwrap_or([0, profile.len() - 1]);
        let inside = || profile.iter().zip(&weights).take(last + 1).skip(first);
        let share: f64 = inside().map(|(_, (weight, _))| weight).sum();
        let variance: f64 = inside()
            .map(|(moved, (weight, width))| weight * ((moved.at - step.at).powi(2) + width * width / 12.0))
            .sum();
        let others = profile
            .into_iter()
            .zip(weights)
            .filter(|(moved, (weight, _))| moved.gap != step.gap && *weight >= MIN_WEIGHT);
        StepPosition {
            effect: step.effect,
            step: step.step,
            u: (variance / share).sqrt(),
            interval_95: interval,
            others: others.map(|(moved, (weight, _))| (weight, moved.changes)).collect(),
        }
    };
    Ok(steps.into_iter().zip(found).map(position).collect())
}

/// The weight of each place of a profile, and the width of the driver that it stands for: up to the middle between it and
/// the next.
fn weights(step: &Step<'_>, profile: &[Moved], enlargement: f64) -> Vec<(f64, f64)> {
    let lowest = profile.iter().map(|moved| moved.chi_square).fold(f64::INFINITY, f64::min);
    let middle = |place: usize| {
        let [low, high] = [&profile[place], &profile[place + 1]];
        if low.gap + 1 == high.gap { step.levels[low.gap] } else { 0.5 * (low.at + high.at) }
    };
    let width = |place: usize| {
        let from = place.checked_sub(1).map_or(step.levels[profile[place].gap - 1], middle);
        let to = if place + 1 < profile.len() { middle(place) } else { step.levels[profile[place].gap] };
        to - from
    };
    let widths: Vec<f64> = (0..profile.len()).map(width).collect();
    let raw: Vec<f64> = (profile.iter().zip(&widths))
        .map(|(moved, width)| width * (-0.5 * (moved.chi_square - lowest) / enlargement).exp())
        .collect();
    let total: f64 = raw.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    raw.into_iter().map(|weight| weight / total).zip(widths).collect()
}

#[cfg(test)]
mod tests;
