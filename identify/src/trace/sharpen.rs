//! Shapes with a number in them (a period, a time constant, a place, a width): the library holds a grid, here the grid is left.

use abbe_model::effect::{Effect, Shape};

use super::library::Candidate;
use super::search::Search;

const STEPS: usize = 24;

/// Looks around a candidate for the number of its shape that gains most; adds the sharper candidate and returns its index, or the
/// candidate's own where nothing is gained. Line search by golden section (Kiefer, Proc. Am. Math. Soc. 4 (1953) 502).
pub fn sharpen(search: &mut Search<'_>, candidate: usize) -> usize {
    let original = search.candidates[candidate].clone();
    let mut effect = original.effect.clone();
    let Some(brackets) = brackets(&effect.shape) else {
        return candidate;
    };
    let mut best = search.gain_of(&effect).unwrap_or(0.0);
    let before = best;
    for _ in 0..2 {
        for (which, low, high) in &brackets {
            let value_at = |share: f64| low + (high - low) * share;
            let gain_at = |search: &Search<'_>, share: f64| {
                let trial = with_number(&effect, *which, value_at(share));
                (search.gain_of(&trial).unwrap_or(0.0), trial)
            };
            let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
            let (mut a, mut b) = (0.0, 1.0);
            let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
            let (mut at_c, mut at_d) = (gain_at(search, c), gain_at(search, d));
            for _ in 0..STEPS / 2 {
                if at_c.0 > at_d.0 {
                    (b, d) = (d, c);
                    at_d = at_c;
                    c = b - golden * (b - a);
                    at_c = gain_at(search, c);
                } else {
                    (a, c) = (c, d);
                    at_c = at_d;
                    d = a + golden * (b - a);
                    at_d = gain_at(search, d);
                }
            }
            let (gain, trial) = if at_c.0 > at_d.0 { at_c } else { at_d };
            if gain > best {
                best = gain;
                effect = trial;
            }
        }
    }
    if best <= before * (1.0 + 1e-6) {
        return candidate;
    }
    let Some(layout) = search.columns.layout(&effect) else {
        return candidate;
    };
    search.append(Candidate { effect, ..original }, layout)
}

/// The numbers of a shape with the interval around each that the grid leaves open.
fn brackets(shape: &Shape) -> Option<Vec<(usize, f64, f64)>> {
    match shape {
        // The grid of periods is even in frequency, half a cycle over the travel apart.
        Shape::Periodic { period } => Some(vec![(0, period * 0.94, period * 1.06)]),
        Shape::Warmup { tau_s } => Some(vec![(0, tau_s * 0.5, tau_s * 2.0)]),
        Shape::ReversalSpike { width } => Some(vec![(0, width * 0.4, width * 2.5)]),
        Shape::Local { centre, width, .. } => Some(vec![
            (0, centre - width, centre + width),
            (1, width * 0.5, width * 2.0),
        ]),
        _ => None,
    }
}

fn with_number(effect: &Effect, which: usize, value: f64) -> Effect {
    let mut changed = effect.clone();
    match (&mut changed.shape, which) {
        (Shape::Periodic { period }, _) => *period = value,
        (Shape::Warmup { tau_s }, _) => *tau_s = value,
        (Shape::ReversalSpike { width }, _) => *width = value,
        (Shape::Local { centre, .. }, 0) => *centre = value,
        (Shape::Local { width, .. }, _) => *width = value,
        _ => {}
    }
    changed
}
