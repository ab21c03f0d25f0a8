//! The least clearance along states: of a test, or of the other moves of its program.

use std::collections::BTreeMap;

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Mounted, Moves};

use super::TestClearance;
use super::parts::{Compared, Found, Parts};

/// Interpolated states beside the state with the least clearance, on either side.
const REFINED: usize = 16;
/// Clearances that differ by no more are equal, mm.
const SAME_MM: f64 = 1e-9;
/// Largest change of a linear axis between two compared states of a move, mm.
const STEP_MM: f64 = 2.0;
/// Largest change of a rotary axis between two compared states of a move, rad.
const STEP_RAD: f64 = 0.01;
/// Largest number of states between two ends of a move.
const MOST_STEPS: f64 = 10_000.0;

impl Parts<'_> {
    /// The least clearance over the states of a test.
    pub fn least(&self, test: &str, readings: &Readings) -> Option<TestClearance> {
        // Every run of a path passes the same states. Poses are no path: each stands alone.
        let is_path = !readings.run.is_empty();
        let rows = if is_path { readings.runs().first().cloned()? } else { 0..readings.rows() };
        let state = |row: usize| -> Vec<f64> { readings.positions.iter().map(|column| column[row]).collect() };
        self.over(test, &rows.map(state).collect::<Vec<_>>(), is_path, Mounted::Bar)
    }

    /// The least clearance over moves.
    pub fn least_of_moves(&self, moves: &Moves) -> Option<TestClearance> {
        let mut states: Vec<Vec<f64>> = moves.states.first().cloned().into_iter().collect();
        for pair in moves.states.windows(2) {
            let steps =
                self.machine().axes.iter().zip(pair[0].iter().zip(&pair[1])).map(|(axis, (a, b))| {
                    (b - a).abs() / if axis.kind == AxisKind::Linear { STEP_MM } else { STEP_RAD }
                });
            let count = steps.fold(1.0, f64::max).ceil().min(MOST_STEPS);
            states.extend((1..=count as usize).map(|step| between(&pair[0], &pair[1], step as f64 / count)));
        }
        self.over(&moves.test, &states, true, moves.mounted)
    }

    fn over(&self, test: &str, states: &[Vec<f64>], is_path: bool, mounted: Mounted) -> Option<TestClearance> {
        let first = states.first()?;
        let moving: Vec<bool> =
            (0..first.len()).map(|axis| states.iter().any(|state| state[axis] != first[axis])).collect();
        // What does not move against each other is compared once.
        let still = self.below(first, f64::INFINITY, mounted, Compared::Still(&moving));
        let at = |state: &[f64]| {
            let most = still.as_ref().map_or(f64::INFINITY, |still| still.mm);
            self.below(state, most, mounted, Compared::Moving(&moving)).or_else(|| still.clone())
        };
        let found = states.iter().map(|state| at(state)).collect::<Option<Vec<Found>>>()?;
        let lowest = lowest(&found.iter().map(|found| found.mm).collect::<Vec<f64>>());
        let refined = lowest.into_iter().map(|k| match is_path {
            true => refined(states, k, &found[k], &at),
            false => (states[k].clone(), found[k].clone()),
        });
        let (at, best) = refined.min_by(|(_, a), (_, b)| a.mm.total_cmp(&b.mm))?;
        let named = |(axis, q): (&Axis, &f64)| (axis.column(""), axis.kind.to_display(*q));
        let at: BTreeMap<String, f64> = self.machine().axes.iter().zip(&at).map(named).collect();
        Some(TestClearance { test: test.to_string(), clearance_mm: best.mm, between: best.between, at })
    }

    /// Whether a state has the least clearance that is asked for.
    pub fn clears(&self, at: &[f64]) -> bool {
        self.below(at, self.sizes.least_mm.0, Mounted::Bar, Compared::All).is_none()
    }

    /// Whether all states of a test have the least clearance that is asked for.
    pub fn clears_all(&self, readings: &Readings) -> bool {
        let state = |row: usize| -> Vec<f64> { readings.positions.iter().map(|column| column[row]).collect() };
        // Every run passes the same states; without runs all rows are one.
        readings.runs().into_iter().take(1).flatten().all(|row| self.clears(&state(row)))
    }
}

/// The states whose clearance is not above that of their neighbours. One state stands for a run of equal clearances
/// without lower neighbours: its ends, between which nothing changes.
fn lowest(mm: &[f64]) -> Vec<usize> {
    let mut lowest = Vec::new();
    let mut start = 0;
    while start < mm.len() {
        let same = |k: &usize| (mm[*k] - mm[start]).abs() <= SAME_MM;
        let end = (start..mm.len()).take_while(same).last().unwrap_or(start);
        let rises_before = start == 0 || mm[start - 1] > mm[start];
        let rises_after = mm.get(end + 1).is_none_or(|next| *next > mm[end]);
        if rises_before && rises_after {
            lowest.push(start);
            lowest.extend((end > start).then_some(end));
        }
        start = end + 1;
    }
    lowest
}

/// The least clearance between a state and its neighbours, with interpolated axes.
fn refined(states: &[Vec<f64>], k: usize, found: &Found, at: &dyn Fn(&[f64]) -> Option<Found>) -> (Vec<f64>, Found) {
    let mut least = (states[k].clone(), found.clone());
    for other in [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|k| states.get(k)) {
        for step in 1..REFINED {
            let state = between(&states[k], other, step as f64 / REFINED as f64);
            if let Some(found) = at(&state).filter(|found| found.mm < least.1.mm) {
                least = (state, found);
            }
        }
    }
    least
}

fn between(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
}

#[cfg(test)]
mod tests {
    use super::lowest;

    #[test]
    fn a_plateau_is_refined_at_both_ends_and_only_where_it_is_lowest() {
        assert_eq!(lowest(&[3.0, 2.0, 2.0, 2.0, 3.0]), [1, 3]);
        assert_eq!(lowest(&[3.0, 2.0, 2.0, 1.0, 3.0]), [3]);
        assert_eq!(lowest(&[1.0, 1.0, 1.0]), [0, 2]);
        assert_eq!(lowest(&[1.0, 2.0, 1.0]), [0, 2]);
        // Rounding makes no minimum.
        assert_eq!(lowest(&[3.0, 2.0, 2.0 + 1e-12, 2.0, 3.0]), [1, 3]);
        assert!(lowest(&[]).is_empty());
    }
}
