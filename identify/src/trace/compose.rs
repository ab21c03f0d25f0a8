//! Effects that are composed of several places: the steps of a compensation table.
//!
//! The library holds, for each component, a dictionary of all places. From it the places that count are chosen one after another, each choice
//! followed by a sweep of exchanges (best-subset selection by splicing: Zhu et al., PNAS 117 (2020) 33117). What `n` of `m` places gain is priced by
//! the number of ways to choose them, `ln (m over n)`: by the union bound the price is enough for the level of the search to hold.

use abbe_model::effect::{Effect, Shape};
use faer::Mat;
use faer::prelude::Solve;
use statrs::function::gamma::ln_gamma;

use super::chi_square_tail::ln_chi_square_tail;
use super::library::Candidate;
use super::observable::MIN_VISIBLE;
use super::score::TrainedModel;

/// The most places of one effect: what takes more is a curve.
const MAX_PLACES: usize = 6;
/// The most sweeps of exchanges after a choice.
const MAX_SWEEPS: usize = 4;

/// An effect composed of places.
#[derive(Clone, Debug)]
pub struct StepTable {
    /// As a candidate, with the price of the choice.
    pub candidate: Candidate,
    /// `−ln P` of its gain, less that price.
    pub evidence: f64,
}

impl StepTable {
    /// What it is compared by.
    pub fn score(&self) -> f64 {
        self.evidence - self.candidate.cost
    }
}

/// The best that can be composed of a dictionary beside a model: of two places or more, for one alone is an entry of the library by itself.
pub fn composed(
    model: &TrainedModel<'_>,
    number: usize,
    dictionary: &Candidate,
    variance: f64,
) -> Option<StepTable> {
    let Shape::Steps { at } = &dictionary.effect.shape else {
        return None;
    };
    let (d, g, own) = model.projected(number);
    let subset = Subset {
        d: &d,
        g: &g,
        own: &own,
    };
    let mut chosen: Vec<usize> = Vec::new();
    let mut best: Option<StepTable> = None;
    while chosen.len() < MAX_PLACES {
        let Some((place, _)) = subset.best_addition(&chosen) else {
            break;
        };
        chosen.push(place);
        let gain = subset.splice(&mut chosen);
        let n = chosen.len();
        if n < 2 {
            continue;
        }
        let price = ln_choices(at.len(), n);
        let evidence = -ln_chi_square_tail(gain / variance, n) - price;
        if best
            .as_ref()
            .is_none_or(|best| evidence - dictionary.cost > best.score())
        {
            let mut places: Vec<f64> = chosen.iter().map(|k| at[*k]).collect();
            places.sort_by(f64::total_cmp);
            let effect = Effect {
                shape: Shape::Steps { at: places },
                ..dictionary.effect.clone()
            };
            let candidate = Candidate {
                effect,
                price,
                dictionary: false,
                ..dictionary.clone()
            };
            best = Some(StepTable { candidate, evidence });
        }
    }
    best
}

/// `ln (m over n)`.
fn ln_choices(m: usize, n: usize) -> f64 {
    let ln_factorial = |k: usize| ln_gamma(k as f64 + 1.0);
    ln_factorial(m) - ln_factorial(n) - ln_factorial(m - n)
}

/// Products of a dictionary beside a model.
struct Subset<'d> {
    d: &'d Mat<f64>,
    g: &'d [f64],
    own: &'d Mat<f64>,
}

impl Subset<'_> {
    /// The place that gains most beside those chosen, and what it gains.
    fn best_addition(&self, chosen: &[usize]) -> Option<(usize, f64)> {
        let n = chosen.len();
        let m = self.g.len();
        // (D_SS)⁻¹ [D_S· | g_S]
        let solved = if n == 0 {
            Mat::zeros(0, m + 1)
        } else {
            let block = Mat::from_fn(n, n, |i, j| self.d[(chosen[i], chosen[j])]);
            let right = Mat::from_fn(n, m + 1, |i, j| {
                if j < m {
                    self.d[(chosen[i], j)]
                } else {
                    self.g[chosen[i]]
                }
            });
            block.partial_piv_lu().solve(&right)
        };
        let mut best: Option<(usize, f64)> = None;
        for j in (0..m).filter(|j| !chosen.contains(j)) {
            let with =
                |column: usize| -> f64 { (0..n).map(|i| self.d[(chosen[i], j)] * solved[(i, column)]).sum() };
            let left = self.d[(j, j)] - with(j);
            // A place that is all but a sum of the others adds rounding, not evidence.
            if left <= MIN_VISIBLE.sqrt() * self.own[(j, j)] {
                continue;
            }
            let along = self.g[j] - with(m);
            let gain = along * along / left;
            if best.is_none_or(|(_, most)| gain > most) {
                best = Some((j, gain));
            }
        }
        best
    }

    /// Exchanges chosen places while that gains anything; what all of them gain.
    fn splice(&self, chosen: &mut Vec<usize>) -> f64 {
        let mut gain = self.gain(chosen);
        for _ in 0..MAX_SWEEPS {
            let mut changed = false;
            for _ in 0..chosen.len() {
                let out = chosen.remove(0);
                let rest = self.gain(chosen);
                match self.best_addition(chosen) {
                    Some((place, more)) if rest + more > gain * (1.0 + 1e-9) => {
                        gain = rest + more;
                        chosen.push(place);
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
        let solved = block.partial_piv_lu().solve(&right);
        (0..n).map(|i| solved[(i, 0)] * right[(i, 0)]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_subset_that_gains_most_is_found() {
        // Steps over forty readings, the second and fourth of five real: the best pair by trying all.
        let places = [5, 12, 20, 28, 35];
        let column = |k: usize, i: usize| f64::from(u8::from(i >= places[k]));
        let y = |i: usize| 1.5 * column(1, i) - column(3, i) + 0.1 * ((i * i) % 7) as f64;
        let d = Mat::from_fn(5, 5, |k, l| (0..40).map(|i| column(k, i) * column(l, i)).sum());
        let g: Vec<f64> = (0..5)
            .map(|k| (0..40).map(|i| column(k, i) * y(i)).sum())
            .collect();
        let subset = Subset {
            d: &d,
            g: &g,
            own: &d,
        };
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
