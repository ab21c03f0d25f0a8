//! The range of positions over which an error motion was observed while its axis moved.
//!
//! A table of an error over the position of its axis is no better than this range: at other positions the axis stood
//! still, or no reading observed the error.

use std::ops::Range;

use abbe_model::axis::AxisKind;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::driver::Driver;
use abbe_model::effect::{Component, Effect};
use abbe_model::sensitivity::SlotValues;

use super::document::MotionRange;
use crate::problem::Problem;

/// The error motion of an effect that is a function of the position of its own axis; `None` for another effect.
pub fn over_own_axis(effect: &Effect) -> Option<&ErrorName> {
    let Component::Axis(error) = &effect.component else { return None };
    let own = matches!(&effect.driver, Driver::Axis(driver) if *driver == error.axis);
    (own && error.kind == ErrorKind::Motion && effect.shape.fits_position_table()).then_some(error)
}

/// The ranges of the error motions of effects that are functions of the position of their own axis.
pub(super) fn of_problem(problem: &Problem) -> Vec<MotionRange> {
    let mut found: Vec<MotionRange> = Vec::new();
    for error in problem.parameters.effects.iter().filter_map(over_own_axis) {
        let id = error.to_string();
        let Some(axis) = problem.session.machine.axis_index(&error.axis) else { continue };
        if found.iter().all(|range| range.error != id) {
            let ranges = observed_ranges(problem, error, axis);
            let ends = ranges.into_iter().map(|range| [range.start, range.end]);
            found.push(MotionRange { error: id, internal: ends.collect() });
        }
    }
    found
}

/// A reading observes an error if its sensitivity is at least this share of the largest one.
const MOVED_SHARE: f64 = 0.01;
/// Ranges that are more than this number of steps unconnected are separate.
const GAP_STEPS: f64 = 1.5;

/// A range of motion of an axis, and its longest step.
#[derive(Clone, Debug, PartialEq)]
struct Motion {
    range: Range<f64>,
    step: f64,
}

/// The unconnected ranges in which an axis moved while readings observed its error, mm or rad, the longest first; none if
/// it stood still.
fn observed_ranges(problem: &Problem, error: &ErrorName, axis: usize) -> Vec<Range<f64>> {
    let machine = &problem.session.machine;
    let Some(slot) = machine.error_slot(error) else { return Vec::new() };
    let sensitivity: Vec<Vec<f64>> = problem
        .models
        .iter()
        .map(|model| {
            if !model.effective_slots().contains(&slot) {
                return vec![0.0; model.rows()];
            }
            let values = SlotValues::zero(model.slots());
            let found = model.sensitivities(&values, &[slot], 0..model.rows());
            let derivatives = found.derivatives.first().map_or(&[][..], Vec::as_slice);
            let channels = model.channels().len().max(1);
            let length = |of_row: &[f64]| of_row.iter().map(|d| d * d).sum::<f64>().sqrt();
            derivatives.chunks(channels).map(length).collect()
        })
        .collect();
    let best = sensitivity.iter().flatten().copied().fold(0.0, f64::max);
    if best <= 0.0 {
        return Vec::new();
    }
    // Positions in a file are rounded; a smaller change is no movement.
    let still = match machine.axes[axis].kind {
        AxisKind::Linear => 1e-6,
        AxisKind::Rotary => 1e-9,
    };
    let mut ranges_of_runs = Vec::new();
    for (test, sensitivity) in problem.tests.iter().zip(&sensitivity) {
        let Some(readings) = &test.readings else { continue };
        let positions = &readings.positions[axis];
        for run in readings.runs() {
            let observing: Vec<usize> = run.filter(|row| sensitivity[*row] >= MOVED_SHARE * best).collect();
            let mut moved: Option<Motion> = None;
            for pair in observing.windows(2) {
                let (a, b) = (positions[pair[0]], positions[pair[1]]);
                // The axis moves through readings in between that do not observe the error.
                if (b - a).abs() <= still {
                    continue;
                }
                let motion = moved.get_or_insert(Motion { range: a.min(b)..a.max(b), step: 0.0 });
                motion.range = motion.range.start.min(a.min(b))..motion.range.end.max(a.max(b));
                motion.step = motion.step.max((b - a).abs());
            }
            ranges_of_runs.extend(moved);
        }
    }
    let mut merged = merged(ranges_of_runs);
    merged.sort_by(|a, b| {
        let length = |motion: &Motion| motion.range.end - motion.range.start;
        length(b).total_cmp(&length(a))
    });
    merged.into_iter().map(|motion| motion.range).collect()
}

/// Merges ranges that touch.
fn merged(mut ranges_of_runs: Vec<Motion>) -> Vec<Motion> {
    ranges_of_runs.sort_by(|a, b| a.range.start.total_cmp(&b.range.start));
    let mut merged: Vec<Motion> = Vec::new();
    for next in ranges_of_runs {
        match merged.last_mut() {
            Some(last) if next.range.start - last.range.end <= GAP_STEPS * last.step.max(next.step) => {
                last.range.end = last.range.end.max(next.range.end);
                last.step = last.step.max(next.step);
            }
            _ => merged.push(next),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_ranges_are_merged() {
        let motion = |start: f64, end: f64| Motion { range: start..end, step: 5.0 };
        let found = merged(vec![motion(5.0, 100.0), motion(300.0, 350.0), motion(-100.0, 0.0), motion(-50.0, 20.0)]);
        assert_eq!(found, [motion(-100.0, 100.0), motion(300.0, 350.0)]);
    }
}
