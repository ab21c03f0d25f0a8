//! Step tables: effects with several step positions, such as the steps of a compensation table.
//!
//! For each component the library holds a dictionary of all step positions. Positions are selected one at a time. An
//! exchange sweep follows each selection (best-subset selection by splicing: Zhu et al., PNAS 117 (2020) 33117). The
//! evidence of `n` selected out of `m` positions is reduced by `ln C(m, n)`, the logarithm of the number of possible
//! selections. By the union bound this penalty keeps the significance level of the search.
//!
//! Between two positions of the dictionary a step is approximated by two. Selected positions are therefore moved by
//! fractions of the grid, and those that this makes superfluous are removed.

use abbe_identify::numerics::solve::solve_square;
use abbe_identify::numerics::tails::ln_chi_square_tail;
use abbe_identify::numerics::tolerances::MIN_OBSERVABLE;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use faer::Mat;
use statrs::function::gamma::ln_gamma;

use super::candidate::Candidate;
use super::gain::{Projected, TrainedModel};
use super::tuned::TunedChannel;

/// Maximum number of positions of one effect. An effect with more positions is a curve.
const MAX_POSITIONS: usize = 6;
/// Maximum number of exchange sweeps after a selection.
const MAX_SWEEPS: usize = 4;
/// Places in an interval of the grid to which a position is moved.
const MOVES: i32 = 4;

/// An effect with several step positions.
#[derive(Clone, Debug)]
pub struct StepTable {
    /// Index of its dictionary among the candidates.
    pub dictionary: usize,
    /// The effect.
    pub effect: Effect,
    /// Penalty for the selection of its positions.
    pub selection_penalty: f64,
    /// Cost of its dictionary.
    pub cost: f64,
    /// `−ln P` of its gain, less the selection penalty.
    pub evidence: f64,
}

impl StepTable {
    /// Evidence less cost: the criterion of comparison.
    pub fn score(&self) -> f64 {
        self.evidence - self.cost
    }

    /// The table with its positions moved for the largest joint gain, without those whose removal does not reduce the
    /// evidence. One position that is left is a step of the library off its grid.
    pub fn with_best_positions(self, channel: &TunedChannel<'_>, dictionary: &Candidate, variance: f64) -> StepTable {
        let library = dictionary.effect.shape.positions().len();
        let evidence_of = |positions: &[f64], gain: f64| {
            let n = positions.len();
            -ln_chi_square_tail(gain / variance, n) - selection_penalty(library, n)
        };
        let shape_at = |positions: Vec<f64>| self.effect.shape.with_positions(positions);
        let moved = |mut positions: Vec<f64>| {
            let mut present = channel.effect(&shape_at(positions.clone()));
            let mut best = channel.gain(&present);
            for _ in 0..2 {
                for k in 0..positions.len() {
                    let middle = positions[k];
                    for part in 1 - MOVES..MOVES {
                        let position = middle + dictionary.grid * f64::from(part) / f64::from(MOVES);
                        let moved = channel.effect(&shape_at(vec![position]));
                        let gain = channel.gain_with(&present, k, &moved);
                        if gain > best * (1.0 + 1e-9) {
                            best = gain;
                            positions[k] = position;
                            channel.exchange(&mut present, k, &moved);
                        }
                    }
                }
            }
            let evidence = evidence_of(&positions, best);
            (positions, evidence)
        };
        let (mut positions, mut evidence) = moved(self.effect.shape.positions().to_vec());
        while positions.len() > 1 {
            let without = |k: usize| {
                let rest: Vec<f64> = (0..positions.len()).filter(|i| *i != k).map(|i| positions[i]).collect();
                let gain = channel.gain(&channel.effect(&shape_at(rest.clone())));
                (rest, gain)
            };
            let Some((rest, _)) = (0..positions.len()).map(without).max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            let (fewer, of_fewer) = moved(rest);
            if of_fewer < evidence {
                break;
            }
            (positions, evidence) = (fewer, of_fewer);
        }
        positions.sort_by(f64::total_cmp);
        let selection_penalty = selection_penalty(library, positions.len());
        let shape = shape_at(positions);
        let effect = Effect { shape, ..self.effect };
        StepTable { effect, selection_penalty, evidence, ..self }
    }
}

/// The best step table of a dictionary for addition to a model, with at least two positions. A single step is an effect
/// of the library itself.
///
/// # Errors
/// If products are not finite.
pub fn best_step_table(
    model: &TrainedModel<'_>,
    number: usize,
    dictionary: &Candidate,
    variance: f64,
) -> Result<Option<StepTable>, Diagnostic> {
    let at = dictionary.effect.shape.positions();
    if at.is_empty() {
        return Ok(None);
    }
    let Projected { d, g, own } = model.projected(number)?;
    let subset = Subset { d: &d, g: &g, own: &own };
    let mut chosen: Vec<usize> = Vec::new();
    let mut best: Option<StepTable> = None;
    while chosen.len() < MAX_POSITIONS {
        let Some((position, _)) = subset.best_addition(&chosen) else {
            break;
        };
        chosen.push(position);
        let gain = subset.splice(&mut chosen);
        let n = chosen.len();
        if n < 2 {
            continue;
        }
        let selection_penalty = selection_penalty(at.len(), n);
        let evidence = -ln_chi_square_tail(gain / variance, n) - selection_penalty;
        if best.as_ref().is_none_or(|best| evidence - dictionary.cost > best.score()) {
            let mut positions: Vec<f64> = chosen.iter().map(|k| at[*k]).collect();
            positions.sort_by(f64::total_cmp);
            let effect =
                Effect { shape: dictionary.effect.shape.with_positions(positions), ..dictionary.effect.clone() };
            let cost = dictionary.cost;
            best = Some(StepTable { dictionary: number, effect, selection_penalty, cost, evidence });
        }
    }
    Ok(best)
}

/// The penalty for `n` selected out of `m` positions. A single step is an effect of the library, whose number of effects
/// counts its positions.
fn selection_penalty(m: usize, n: usize) -> f64 {
    if n > 1 { ln_choices(m, n) } else { 0.0 }
}

/// `ln C(m, n)`, the logarithm of the binomial coefficient.
fn ln_choices(m: usize, n: usize) -> f64 {
    let ln_factorial = |k: usize| ln_gamma(k as f64 + 1.0);
    ln_factorial(m) - ln_factorial(n) - ln_factorial(m - n)
}

/// Products of a dictionary, projected on the complement of a model.
struct Subset<'d> {
    d: &'d Mat<f64>,
    g: &'d [f64],
    own: &'d Mat<f64>,
}

impl Subset<'_> {
    /// The position with the largest gain in addition to those chosen, and its gain.
    fn best_addition(&self, chosen: &[usize]) -> Option<(usize, f64)> {
        let n = chosen.len();
        let m = self.g.len();
        // (D_SS)⁻¹ [D_S· | g_S]
        let solved = if n == 0 {
            Mat::zeros(0, m + 1)
        } else {
            let block = Mat::from_fn(n, n, |i, j| self.d[(chosen[i], chosen[j])]);
            let right = Mat::from_fn(n, m + 1, |i, j| if j < m { self.d[(chosen[i], j)] } else { self.g[chosen[i]] });
            solve_square(block.as_ref(), right.as_ref())
        };
        let mut best: Option<(usize, f64)> = None;
        for j in (0..m).filter(|j| !chosen.contains(j)) {
            let with = |column: usize| -> f64 { (0..n).map(|i| self.d[(chosen[i], j)] * solved[(i, column)]).sum() };
            let projected = self.d[(j, j)] - with(j);
            // A position that is nearly a linear combination of the others adds rounding errors and no evidence.
            if projected <= MIN_OBSERVABLE.sqrt() * self.own[(j, j)] {
                continue;
            }
            let along = self.g[j] - with(m);
            let gain = along * along / projected;
            if best.is_none_or(|(_, most)| gain > most) {
                best = Some((j, gain));
            }
        }
        best
    }

    /// Exchanges chosen positions as long as the gain increases. Returns the gain of all chosen positions.
    fn splice(&self, chosen: &mut Vec<usize>) -> f64 {
        let mut gain = self.gain(chosen);
        for _ in 0..MAX_SWEEPS {
            let mut changed = false;
            for _ in 0..chosen.len() {
                let out = chosen.remove(0);
                let rest = self.gain(chosen);
                match self.best_addition(chosen) {
                    Some((position, more)) if rest + more > gain * (1.0 + 1e-9) => {
                        gain = rest + more;
                        chosen.push(position);
                        changed = true;
                    }
                    _ => chosen.push(out),
                }
            }
            if !changed {
                break;
            }
        }
        gain
    }

    fn gain(&self, chosen: &[usize]) -> f64 {
        let n = chosen.len();
        if n == 0 {
            return 0.0;
        }
        let block = Mat::from_fn(n, n, |i, j| self.d[(chosen[i], chosen[j])]);
        let right = Mat::from_fn(n, 1, |i, _| self.g[chosen[i]]);
        let solved = solve_square(block.as_ref(), right.as_ref());
        (0..n).map(|i| solved[(i, 0)] * right[(i, 0)]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_subset_with_the_largest_gain_is_found() {
        // Steps over forty readings. The second and fourth of five are real. The reference is the best pair by
        // exhaustive search.
        let positions = [5, 12, 20, 28, 35];
        let column = |k: usize, i: usize| f64::from(u8::from(i >= positions[k]));
        let y = |i: usize| 1.5 * column(1, i) - column(3, i) + 0.1 * ((i * i) % 7) as f64;
        let d = Mat::from_fn(5, 5, |k, l| (0..40).map(|i| column(k, i) * column(l, i)).sum());
        let g: Vec<f64> = (0..5).map(|k| (0..40).map(|i| column(k, i) * y(i)).sum()).collect();
        let subset = Subset { d: &d, g: &g, own: &d };
        let mut chosen = vec![0, 2];
        let gain = subset.splice(&mut chosen);
        let mut best = 0.0_f64;
        for k in 0..5 {
            for l in k + 1..5 {
                best = best.max(subset.gain(&[k, l]));
            }
        }
        assert!((gain / best - 1.0).abs() < 1e-12);
        assert!((ln_choices(39, 2) - (39.0 * 38.0 / 2.0_f64).ln()).abs() < 1e-9);
    }
}
