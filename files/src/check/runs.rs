//! Comparison of the runs of measured data with those that the session states.

use std::collections::BTreeSet;
use std::ops::Range;

use abbe_model::session::motion::{Motion, Moved};
use abbe_model::session::readings::Readings;
use abbe_model::words::counted;

/// A run is a forward and backward run if its net advance is less than this fraction of its path length.
const MIN_ADVANCE: f64 = 0.5;

/// A description of the difference between the runs of the data and those of the stated motion, if any. Data without a
/// `run` column are not compared.
pub(super) fn difference_from_stated(motion: Option<&Motion>, readings: &Readings) -> Option<String> {
    let motion = motion.filter(|_| !readings.run.is_empty())?;
    let (runs, both_directions) = (motion.course.traversals.runs(), motion.course.traversals.both_directions());
    let (mut forward, mut backward, mut turning) = (0, 0, Vec::new());
    for run in readings.runs() {
        let (net, whole) = advance_and_length(motion, readings, &run);
        if whole > 0.0 && net.abs() < MIN_ADVANCE * whole {
            turning.push(readings.run[run.start].to_string());
        } else if net > 0.0 {
            forward += 1;
        } else if net < 0.0 {
            backward += 1;
        }
    }
    let states = format!("the session states runs = {runs}, both_directions = {both_directions}");
    if !turning.is_empty() {
        let numbers = turning.join(", ");
        return Some(match turning.len() {
            1 => format!(
                "run {numbers} goes forward and backward under one number: `run` numbers each traversal in one direction; {states}"
            ),
            _ => format!(
                "runs {numbers} go forward and backward under one number each: `run` numbers each traversal in one direction; {states}"
            ),
        });
    }
    let enough = forward >= runs && (backward >= runs || !both_directions);
    let only_forward = both_directions || backward == 0;
    (!(enough && only_forward))
        .then(|| format!("the data contain {} forward and {backward} backward, but {states}", counted(forward, "run")))
}

/// A description of the gaps in the numbers of the runs, if any: `1, 3, 4` lacks run 2. Numbers with as many gaps as steps
/// (`1, 3`, `2, 4, 6`) are a numbering of their own.
pub(super) fn missing_numbers(readings: &Readings) -> Option<String> {
    let present: BTreeSet<i64> = readings.run.iter().copied().collect();
    let (first, last) = (*present.first()?, *present.last()?);
    let steps = present.len() as i64 - 1;
    // A large number is no count of runs.
    let gaps = last.checked_sub(first)?.checked_sub(steps)?;
    if !(1..steps).contains(&gaps) {
        return None;
    }
    let missing: Vec<String> = (first..=last).filter(|run| !present.contains(run)).map(|run| run.to_string()).collect();
    let runs = if missing.len() == 1 { "run" } else { "runs" };
    Some(format!("the data lack {runs} {} between runs {first} and {last}", missing.join(", ")))
}

/// Net advance of a run in the direction of the motion, and its total path length: along an axis, or around a circle by
/// the swept area.
fn advance_and_length(motion: &Motion, readings: &Readings, run: &Range<usize>) -> (f64, f64) {
    let sum = |steps: &mut dyn Iterator<Item = f64>| {
        let sense = motion.course.to - motion.course.from;
        steps.map(|step| step * sense).fold((0.0, 0.0), |(net, whole), step| (net + step, whole + step.abs()))
    };
    match &motion.moved {
        Moved::Axis(axis) | Moved::Follow { axis, .. } => {
            let positions = &readings.positions[*axis][run.clone()];
            sum(&mut positions.windows(2).map(|pair| pair[1] - pair[0]))
        }
        Moved::Circle { axes, .. } => {
            let [x, y] = axes.map(|axis| &readings.positions[axis][run.clone()]);
            let area = |k: usize| (x[k] - x[0]) * (y[k + 1] - y[0]) - (x[k + 1] - x[0]) * (y[k] - y[0]);
            sum(&mut (0..x.len() - 1).map(area))
        }
        Moved::Line { axes, ends, .. } => {
            let step = |k: usize| {
                let way = axes.iter().zip(ends).map(|(axis, [start, end])| {
                    let positions = &readings.positions[*axis][run.clone()];
                    (positions[k + 1] - positions[k]) * (end - start)
                });
                way.sum::<f64>()
            };
            sum(&mut (0..run.len() - 1).map(step))
        }
    }
}
