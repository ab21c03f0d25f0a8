//! Detection of outliers: along runs against neighbouring readings, among independent poses against the median
//! residual.
//!
//! Structure in the residual must not be excluded. Along a run a residual is therefore compared with the medians of its
//! neighbours on either side, not with zero (Hampel's identifier: Davies & Gather, J. Am. Stat. Assoc. 88 (1993) 782).
//! A deviation that returns in the repeats of the reading is structure too: a spike after every reversal. It is none at the
//! first reading of a run that begins at a reversal: the axis came from either side, so that its lost motion there is unknown.
//! A run of few readings has too few neighbours for a median. There a reading is compared with its repeats, less what all
//! readings of the run differ from theirs.
//! In the residual of a circle's own diagnosis, which contains all structure, it is compared with zero and with both
//! neighbours. Poses have no neighbours. A pose is an outlier if its residual is a large multiple of the median
//! residual.

use std::collections::HashMap;
use std::ops::Range;

use abbe_model::session::readings::Readings;

use super::RepeatKeys;
use crate::numerics::{median, parallel, robust_deviation};
use crate::problem::Problem;

/// Number of neighbours on either side in the median.
const NEIGHBOURS: usize = 5;
/// Least number of readings of a short run that have repeats.
const MIN_REPEATED: usize = 4;
/// Least number of differences from repeats in all short runs of a test.
const MIN_DIFFERENCES: usize = 12;
/// Limit along a run, in robust standard deviations: exceeded once in 10⁷ Gaussian readings.
const OUTLIER_ALONG_RUN: f64 = 5.3;
/// Limit for a pose, in median residual lengths: exceeded once in 10⁹ Gaussian poses of three coordinates. Unmodelled
/// structure is bounded and stayed far below it.
const OUTLIER_POSE: f64 = 5.0;

/// Limit for a single reading in the residual of a complete model, in robust standard deviations.
const OUTLIER_ALONE: f64 = 6.0;

/// The outliers of the problem, by test and row, from the residuals of a fit, mm.
pub fn reject(problem: &Problem, residuals: &[Vec<f64>]) -> Vec<Vec<bool>> {
    if problem.folds.kind.is_poses() {
        let lengths: Vec<Vec<f64>> = residuals
            .iter()
            .enumerate()
            .map(|(test, residual)| {
                residual
                    .chunks_exact(problem.channels(test))
                    .map(|v| v.iter().map(|x| x * x).sum::<f64>().sqrt())
                    .collect()
            })
            .collect();
        let mut all: Vec<f64> = lengths.iter().flatten().copied().collect();
        let limit = OUTLIER_POSE * median(&mut all);
        return lengths.iter().map(|test| test.iter().map(|length| *length > limit).collect()).collect();
    }
    parallel::map(problem.tests.len(), &|test| match &problem.tests[test].readings {
        Some(readings) => reject_along_runs(readings, &residuals[test], problem.channels(test), problem.noise.sigma_mm),
        None => Vec::new(),
    })
}

/// The outliers in the residual of a model that contains all structure, by index: large beside both neighbours too.
pub(crate) fn alone(residual: &[f64]) -> impl Iterator<Item = usize> {
    let limit = OUTLIER_ALONE * robust_deviation(residual);
    (0..residual.len()).filter(move |&i| residual[i].abs() > limit && is_isolated(residual, i))
}

fn reject_along_runs(readings: &Readings, residual: &[f64], channels: usize, sigma_mm: f64) -> Vec<bool> {
    let mut reject = vec![false; readings.rows()];
    let (long, short): (Vec<_>, Vec<_>) = readings.runs().into_iter().partition(|run| run.len() > 2 * NEIGHBOURS);
    let keys = (!short.is_empty()).then(|| RepeatKeys::of(readings));
    for channel in 0..channels {
        let value = |row: usize| residual[row * channels + channel];
        // The deviation of each reading from its neighbours, and the limits that single readings exceed.
        let mut deviations = vec![0.0; readings.rows()];
        let mut conspicuous = Vec::new();
        for run in &long {
            let rows: Vec<usize> = run.clone().filter(|row| readings.was_read(*row, channel)).collect();
            let values: Vec<f64> = rows.iter().map(|row| value(*row)).collect();
            let of_run = deviations_from_neighbours(&values);
            let limit = OUTLIER_ALONG_RUN * robust_deviation(&of_run).max(sigma_mm);
            for (row, deviation) in rows.into_iter().zip(of_run) {
                deviations[row] = deviation;
                if deviation.abs() > limit {
                    conspicuous.push((row, limit));
                }
            }
        }
        retain_unrepeated(&mut conspicuous, readings, &deviations);
        conspicuous.into_iter().for_each(|(row, _)| reject[row] = true);
        if let Some(keys) = &keys {
            let read = |row: usize| if readings.was_read(row, channel) { value(row) } else { f64::NAN };
            let values: Vec<f64> = (0..readings.rows()).map(read).collect();
            in_short_runs(&short, keys, &values, sigma_mm).into_iter().for_each(|row| reject[row] = true);
        }
    }
    reject
}

/// The outliers among the rows of short runs: readings that differ from their repeats while their neighbours agree with
/// theirs. `values` has a residual for each row, NaN where none was read.
fn in_short_runs(runs: &[Range<usize>], keys: &RepeatKeys, values: &[f64], sigma_mm: f64) -> Vec<usize> {
    let mut repeats: HashMap<&[i64], Vec<usize>> = HashMap::new();
    for row in runs.iter().cloned().flatten().filter(|row| !values[*row].is_nan()) {
        repeats.entry(keys.of_row(row)).or_default().push(row);
    }
    let repeats_of = |row: usize| repeats.get(keys.of_row(row)).map_or(&[][..], Vec::as_slice);
    let ordered: HashMap<&[i64], Ordered> =
        repeats.iter().map(|(key, rows)| (*key, Ordered::of(rows.iter().map(|row| values[*row])))).collect();
    let beyond_repeats = |row: usize| {
        let level = match repeats_of(row).len() {
            // Of two others their mean.
            3 => 0.5 * repeats_of(row).iter().filter(|other| **other != row).map(|other| values[*other]).sum::<f64>(),
            _ => ordered.get(keys.of_row(row))?.median_without(values[row])?,
        };
        Some(values[row] - level)
    };
    let mut differences = vec![f64::NAN; values.len()];
    let mut bends = vec![0.0; values.len()];
    for run in runs {
        let of_run: Vec<(usize, f64)> = run.clone().filter_map(|row| Some((row, beyond_repeats(row)?))).collect();
        if of_run.len() >= MIN_REPEATED {
            // The run as a whole may differ from its repeats, as by a drift.
            let level = median(&mut of_run.iter().map(|(_, difference)| *difference).collect::<Vec<f64>>());
            of_run.into_iter().for_each(|(row, difference)| differences[row] = difference - level);
        }
        for (place, row) in run.clone().enumerate() {
            bends[row] = beside_line(&values[run.clone()], place).abs();
        }
    }
    let known: Vec<f64> = differences.iter().copied().filter(|difference| !difference.is_nan()).collect();
    if known.len() < MIN_DIFFERENCES {
        return Vec::new();
    }
    let limit = OUTLIER_ALONG_RUN * robust_deviation(&known).max(sigma_mm);
    let largest = |rows: &Vec<usize>| rows.iter().map(|row| differences[*row].abs()).fold(0.0, f64::max);
    let largest: HashMap<&[i64], f64> = repeats.iter().map(|(key, rows)| (*key, largest(rows))).collect();
    // The worst of its repeats. Two differ from each other by the same: of these it is the one that its neighbours
    // contradict, and either if they contradict both.
    let is_worst = |row: usize| match *repeats_of(row) {
        [one, other] => bends[row] >= 0.5 * bends[if one == row { other } else { one }],
        _ => largest.get(keys.of_row(row)).is_none_or(|largest| differences[row].abs() >= *largest),
    };
    let in_run = |run: &Range<usize>| -> Vec<usize> {
        let is_alone = |row: &usize| is_isolated(&differences[run.clone()], row - run.start);
        run.clone().filter(|row| differences[*row].abs() > limit && is_alone(row) && is_worst(*row)).collect()
    };
    runs.iter().flat_map(in_run).collect()
}

/// The values of repeats in their order, from which the median of the others of each follows at once.
struct Ordered(Vec<f64>);

impl Ordered {
    fn of(values: impl Iterator<Item = f64>) -> Ordered {
        let mut values: Vec<f64> = values.collect();
        values.sort_unstable_by(f64::total_cmp);
        Ordered(values)
    }

    /// The median of all but one, which is among them; `None` if there is no other.
    fn median_without(&self, value: f64) -> Option<f64> {
        let middle = self.0.len().checked_sub(1)? / 2;
        let place = self.0.partition_point(|other| other.total_cmp(&value).is_lt());
        self.0.get(if middle < place { middle } else { middle + 1 }).copied()
    }
}

/// Whether both neighbours of a value are less than half as large. An end of the list has one; NaN counts as none.
fn is_isolated(values: &[f64], place: usize) -> bool {
    let size = values[place].abs();
    let is_small = |place: Option<usize>| {
        place.and_then(|place| values.get(place)).is_none_or(|other| other.is_nan() || other.abs() < 0.5 * size)
    };
    is_small(place.checked_sub(1)) && is_small(Some(place + 1))
}

/// The deviation of a value from the line through the values on either side, or at an end through the next two; 0 if one of
/// these is missing.
fn beside_line(values: &[f64], place: usize) -> f64 {
    let at = |place: usize| values.get(place).copied();
    let line = match place {
        0 => at(1).zip(at(2)).map(|(near, far)| 2.0 * near - far),
        last if last + 1 == values.len() => place.checked_sub(2).map(|far| 2.0 * values[place - 1] - values[far]),
        _ => Some(0.5 * (values[place - 1] + values[place + 1])),
    };
    line.filter(|line| !line.is_nan()).map_or(0.0, |line| values[place] - line)
}

/// The deviation of each value of a run from the medians of its neighbours: the lesser of the two.
fn deviations_from_neighbours(values: &[f64]) -> Vec<f64> {
    let middle: Vec<f64> = values.array_windows().map(|five| median_of_five(*five)).collect();
    let deviation = |(row, value): (usize, &f64)| {
        // Beside a step (backlash at a reversal) a reading agrees with one of the two sides. An outlier agrees with
        // neither.
        let start = row.saturating_sub(NEIGHBOURS);
        let end = (row + NEIGHBOURS + 1).min(values.len());
        let from = |side: Range<usize>| match side.len() {
            0..3 => None,
            NEIGHBOURS => Some(value - middle[side.start]),
            _ => Some(value - median(&mut values[side].to_vec())),
        };
        match (from(start..row), from(row + 1..end)) {
            (Some(before), Some(after)) if before * after <= 0.0 => 0.0,
            (Some(before), Some(after)) if before.abs() < after.abs() => before,
            (Some(_), Some(after)) => after,
            // At an end of the run a slope is structure too: the reading is compared with both medians on its only side,
            // and with the line through them.
            (None, Some(after)) => lesser(after, beyond(value, &middle, row + 1, row + 1 + NEIGHBOURS)),
            (Some(before), None) => {
                let near = row.saturating_sub(NEIGHBOURS);
                lesser(before, near.checked_sub(NEIGHBOURS).and_then(|far| beyond(value, &middle, near, far)))
            }
            (None, None) => 0.0,
        }
    };
    values.iter().enumerate().map(deviation).collect()
}

/// The deviation of a value at an end from the line through two medians of five, each given by the place of its first
/// value. The middle of the near five lies three readings away, that of the far five eight.
fn beyond(value: &f64, middle: &[f64], near: usize, far: usize) -> Option<f64> {
    let (near, far) = (middle.get(near)?, middle.get(far)?);
    Some(value - near - 0.6 * (near - far))
}

/// The deviation nearer to zero, and zero if the two have opposite signs.
fn lesser(deviation: f64, other: Option<f64>) -> f64 {
    match other {
        Some(other) if deviation * other <= 0.0 => 0.0,
        Some(other) if other.abs() < deviation.abs() => other,
        _ => deviation,
    }
}

/// Keeps the rows, with their limits, that deviate from their repeats too. What returns at the same position in the same
/// direction is structure, such as the spike after a reversal.
fn retain_unrepeated(rows: &mut Vec<(usize, f64)>, readings: &Readings, deviations: &[f64]) {
    if rows.is_empty() {
        return;
    }
    let keys = RepeatKeys::of(readings);
    let mut repeats: HashMap<&[i64], Vec<usize>> =
        rows.iter().map(|(row, _)| (keys.of_row(*row), Vec::new())).collect();
    for row in 0..readings.rows() {
        if let Some(repeats) = repeats.get_mut(keys.of_row(row)) {
            repeats.push(row);
        }
    }
    let ordered: HashMap<&[i64], Ordered> = (repeats.into_iter())
        .map(|(key, rows)| (key, Ordered::of(rows.into_iter().map(|row| deviations[row]))))
        .collect();
    let begins = firsts_at_reversal(readings);
    rows.retain(|(row, limit)| {
        if begins.contains(row) {
            return true;
        }
        let others = ordered.get(keys.of_row(*row)).and_then(|ordered| ordered.median_without(deviations[*row]));
        others.is_none_or(|median| (deviations[*row] - median).abs() > *limit)
    });
}

/// Share of the second step of an axis below which its first step is one from rest. From the end of a circle's diameter it
/// is a third; at constant speed both are equal.
const FROM_REST: f64 = 0.5;

/// The first readings of the runs that begin where an axis reverses: the axis came from either side.
pub fn firsts_at_reversal(readings: &Readings) -> Vec<usize> {
    readings.runs().iter().filter(|run| begins_at_reversal(readings, run)).map(|run| run.start).collect()
}

/// Whether a run begins where an axis reverses.
fn begins_at_reversal(readings: &Readings, run: &Range<usize>) -> bool {
    let from_rest = |positions: &Vec<f64>| match positions[run.clone()] {
        [first, second, third, ..] => {
            let [step, next] = [second - first, third - second];
            step * next > 0.0 && step.abs() < FROM_REST * next.abs()
        }
        _ => false,
    };
    readings.positions.iter().any(from_rest)
}

/// The median of five values: that of the fifth and the two middle values of the first four.
fn median_of_five([a, b, c, d, e]: [f64; NEIGHBOURS]) -> f64 {
    let low = a.min(b).max(c.min(d));
    let high = a.max(b).min(c.max(d));
    low.min(high).max(low.max(high).min(e))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four runs of one axis, to and fro. A spike at the first reading of each run stays, one of a single run does not.
    #[test]
    fn what_returns_in_every_repeat_is_no_outlier() {
        const PLACES: usize = 40;
        let place =
            |row: usize| if (row / PLACES).is_multiple_of(2) { row % PLACES } else { PLACES - 1 - row % PLACES };
        let readings = Readings {
            positions: vec![(0..4 * PLACES).map(|row| place(row) as f64).collect()],
            run: (0..4 * PLACES).map(|row| (row / PLACES) as i64).collect(),
            channels: 1,
            ..Readings::default()
        };
        let mut residual: Vec<f64> = (0..4 * PLACES).map(|row| 1e-4 * (((row * 7) % 11) as f64 - 5.0)).collect();
        for run in 0..4 {
            residual[run * PLACES] += 0.01;
        }
        residual[PLACES + 17] += 0.01;
        let rejected = reject_along_runs(&readings, &residual, 1, 3e-4);
        let rows: Vec<usize> = (0..rejected.len()).filter(|row| rejected[*row]).collect();
        assert_eq!(rows, [PLACES + 17]);
    }

    /// A circle that begins where X reverses, twice: the first reading has the lost motion of the way before. It returns, and
    /// is none of the way after. On a sweep at constant speed it is structure.
    #[test]
    fn the_first_reading_at_a_reversal_may_have_the_lost_motion_of_the_way_before() {
        const PLACES: usize = 60;
        let turn = |row: usize| std::f64::consts::TAU * (row % PLACES) as f64 / PLACES as f64;
        let of = |positions: Vec<f64>| {
            let readings = Readings {
                positions: vec![positions],
                run: (0..2 * PLACES).map(|row| (row / PLACES) as i64).collect(),
                channels: 1,
                ..Readings::default()
            };
            let backlash = |row: usize| match row % PLACES {
                0 => -2e-3,
                place => {
                    if turn(place) < std::f64::consts::PI {
                        2e-3
                    } else {
                        -2e-3
                    }
                }
            };
            let noise = |row: usize| 1e-4 * (((row * 7) % 11) as f64 - 5.0);
            let residual: Vec<f64> = (0..2 * PLACES).map(|row| backlash(row) + noise(row)).collect();
            let rejected = reject_along_runs(&readings, &residual, 1, 3e-4);
            (0..rejected.len()).filter(|row| rejected[*row]).collect::<Vec<_>>()
        };
        assert_eq!(of((0..2 * PLACES).map(|row| 100.0 * turn(row).cos()).collect()), [0, PLACES]);
        assert_eq!(of((0..2 * PLACES).map(turn).collect()), [0; 0]);
    }

    /// A slope that the model lacks stays whole. A spike at its first reading does not.
    #[test]
    fn the_ends_of_a_slope_are_no_outliers() {
        let readings = Readings {
            positions: vec![(0..60).map(f64::from).collect()],
            run: vec![1; 60],
            channels: 1,
            ..Readings::default()
        };
        let mut residual: Vec<f64> =
            (0..60).map(|row| 5e-4 * row as f64 + 1e-4 * (((row * 7) % 11) as f64 - 5.0) / 3.0).collect();
        let rejected = |residual: &[f64]| -> Vec<usize> {
            let rejected = reject_along_runs(&readings, residual, 1, 1e-4);
            (0..60).filter(|row| rejected[*row]).collect()
        };
        assert_eq!(rejected(&residual), [0; 0]);
        residual[0] += 0.01;
        residual[59] += 0.01;
        assert_eq!(rejected(&residual), [0, 59]);
    }

    /// Runs of six readings to and fro over a residual with structure, each direction twice or thrice. A reading is an
    /// outlier where its repeats contradict it; of two, the one that its neighbours contradict too. A spike that returns,
    /// a shift of a whole run and a step within one are structure.
    #[test]
    fn repeats_show_the_outliers_of_short_runs() {
        for runs in [4, 6] {
            let rejected = |changed: &[(usize, f64)]| rejected_in_short_runs(runs, 2, changed);
            assert_eq!(rejected(&[]), [0; 0]);
            for row in 0..runs * PLACES {
                assert_eq!(rejected(&[(row, 0.02)]), [row], "{runs} runs");
            }
            assert_eq!(rejected(&[(3, 0.02), (PLACES + 1, -0.01)]), [3, PLACES + 1]);
            let shifted: Vec<(usize, f64)> = (0..PLACES).map(|row| (row, 0.01)).collect();
            assert_eq!(rejected(&shifted), [0; 0]);
            assert_eq!(rejected(&shifted[3..]), [0; 0]);
        }
    }

    /// Beside a spike that returns, the neighbours contradict both of two repeats. A third one decides.
    #[test]
    fn of_two_repeats_that_their_neighbours_contradict_both_are_outliers() {
        let last = PLACES - 1;
        assert_eq!(rejected_in_short_runs(4, last - 1, &[(last, 0.02)]), [last, 2 * PLACES + last]);
        assert_eq!(rejected_in_short_runs(6, last - 1, &[(last, 0.02)]), [last]);
    }

    const PLACES: usize = 6;

    /// The outliers among runs of six readings to and fro. The residual has noise, a slow part and a spike of 6 µm at one
    /// place; some rows are changed by some mm.
    fn rejected_in_short_runs(runs: usize, spike: usize, changed: &[(usize, f64)]) -> Vec<usize> {
        let rows = runs * PLACES;
        let place = |row: usize| match (row / PLACES) % 2 {
            0 => row % PLACES,
            _ => PLACES - 1 - row % PLACES,
        };
        let readings = Readings {
            positions: vec![(0..rows).map(|row| place(row) as f64).collect()],
            run: (0..rows).map(|row| (row / PLACES) as i64).collect(),
            channels: 1,
            ..Readings::default()
        };
        let noise = |row: usize| 1e-4 * (((row * 7) % 11) as f64 - 5.0);
        let structure = |row: usize| if place(row) == spike { 0.006 } else { 1e-3 * (place(row) as f64).sin() };
        let change = |row: usize| changed.iter().filter(|c| c.0 == row).map(|c| c.1).sum::<f64>();
        let residual: Vec<f64> = (0..rows).map(|row| noise(row) + structure(row) + change(row)).collect();
        let rejected = reject_along_runs(&readings, &residual, 1, 3e-4);
        (0..rows).filter(|row| rejected[*row]).collect()
    }

    #[test]
    fn the_median_of_the_others_is_that_of_a_list_without_one() {
        // All lists of one to five small numbers, ties included.
        for length in 1..6_u32 {
            for code in 0..3_usize.pow(length) {
                let values: Vec<f64> = (0..length).map(|place| (code / 3_usize.pow(place) % 3) as f64).collect();
                let ordered = Ordered::of(values.iter().copied());
                for place in 0..values.len() {
                    let mut others = values.clone();
                    others.remove(place);
                    let expected = (!others.is_empty()).then(|| median(&mut others));
                    assert_eq!(ordered.median_without(values[place]), expected, "{values:?} without {place}");
                }
            }
        }
    }

    #[test]
    fn the_median_of_five_is_the_third_in_order() {
        // All orders of five numbers, ties included.
        for code in 0..5_usize.pow(5) {
            let values: [f64; 5] = std::array::from_fn(|place| (code / 5_usize.pow(place as u32) % 5) as f64);
            let mut sorted = values;
            sorted.sort_by(f64::total_cmp);
            assert_eq!(median_of_five(values), sorted[2], "{values:?}");
        }
    }
}
