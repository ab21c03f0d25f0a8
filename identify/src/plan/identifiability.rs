//! Blind spots by name: what no reading sees, what only the set-up's priors hold, and what is nearly collinear.

use faer::Mat;

use super::linear::{Linearisation, is_wanted, marginal};
use super::ranking::smallest_first;
use super::results::{DeterminedByPrior, NearDependency};
use crate::error::IdentifyError;
use crate::parameters::{Parameter, Role};
use crate::problem::Problem;
use crate::rank::{Rank, combinations};
use crate::results::Unobservable;

/// Coefficients below this, relative to the largest, are rounding.
const NEGLIGIBLE: f64 = 1e-5;
/// Condition index from which a dependency is named: moderate from 10, strong from 30 (Belsley, Kuh & Welsch, Regression Diagnostics,
/// 1980, ch. 3).
const NAMED_FROM: f64 = 10.0;
/// Share of the largest part in the null space that an error needs to lead a combination with set-up quantities.
const MIN_ERROR: f64 = 1.37e-3;
/// Things that a combination names in words.
const MAX_NAMED: usize = 5;
/// The verb of a combination that no reading sees.
const CONFOUNDED: &str = "is confounded with";
/// Share of the largest coefficient below which an unknown is left out of a near dependency.
const MIN_PART: f64 = 0.1;

/// A thing and the group that it belongs to, in words: `spindle_ball.z[A150]` is `z of the spindle ball` in `A150`.
fn called<'i>(list: &[Parameter], id: &'i str) -> (String, Option<&'i str>) {
    let setup = list
        .iter()
        .any(|parameter| parameter.id == id && parameter.role == Role::Setup);
    if !setup {
        return (id.to_string(), None);
    }
    let (thing, group) = id.split_once('[').unwrap_or((id, ""));
    let (thing, coordinate) = thing.split_once('.').unwrap_or((thing, ""));
    let of = if coordinate.is_empty() {
        String::new()
    } else {
        format!("{coordinate} of ")
    };
    (
        format!("{of}the {}", thing.replace('_', " ")),
        group.strip_suffix(']'),
    )
}

/// A combination in words: what is confounded with what, and in which proportion, with units where they differ. One thing in several tests is
/// named once, and of a long combination only the first.
fn describe(list: &[Parameter], combination: &[(String, f64)], verb: &str) -> String {
    let unit_of = |id: &str| {
        list.iter()
            .find(|parameter| parameter.id == id)
            .map_or("", |parameter| parameter.unit.name.as_str())
    };
    let first_unit = combination.first().map_or("", |(id, _)| unit_of(id));
    let mixed = combination.iter().any(|(id, _)| unit_of(id) != first_unit);
    let mut things: Vec<(String, Vec<&str>, String)> = Vec::new();
    for (id, value) in combination {
        let (thing, group) = called(list, id);
        let value = if mixed {
            format!("{} {}", short(*value), unit_of(id))
        } else {
            short(*value)
        };
        match things
            .iter_mut()
            .find(|(other, groups, v)| *other == thing && *v == value && !groups.is_empty())
        {
            Some((_, groups, _)) => groups.extend(group),
            None => things.push((thing, group.into_iter().collect(), value)),
        }
    }
    // One more than is named is named too: it takes no more room than to say so.
    let unnamed = match things.len() {
        count if count > MAX_NAMED + 1 => count - MAX_NAMED,
        _ => 0,
    };
    things.truncate(things.len() - unnamed);
    let mut words = things.iter().map(|(thing, groups, _)| match groups.as_slice() {
        [] => thing.clone(),
        [one] => format!("{thing} in {one}"),
        [first @ .., last] => format!("{thing} in {} and {last}", first.join(", ")),
    });
    let proportion: Vec<&str> = things.iter().map(|(_, _, value)| value.as_str()).collect();
    let first = words.next().unwrap_or_default();
    let others: Vec<String> = words.collect();
    let (others, proportion) = (others.join(", "), proportion.join(" : "));
    match unnamed {
        0 => format!("{first} {verb} {others}: {proportion}"),
        _ => format!("{first} {verb} {others} and {unnamed} more together: {proportion} : …"),
    }
}

/// Two decimals, or two digits of a small number.
fn short(value: f64) -> String {
    let places = (1.0 - value.abs().max(1e-9).log10().floor()).clamp(1.0, 9.0) as usize;
    let text = format!("{value:.*}", places.max(if value.abs() < 10.0 { 2 } else { 1 }));
    text.trim_end_matches('0').trim_end_matches('.').replace('-', "−")
}

/// Combinations that no reading sees, priors included.
pub fn unidentifiable(problem: &Problem<'_>, rank: &Rank) -> Vec<Unobservable> {
    let list = &problem.parameters.list;
    rank.unseen
        .iter()
        .zip(&rank.pivots)
        .map(|(row, pivot)| {
            let combination = outside(problem, row, *pivot);
            let why = match combination.as_slice() {
                [(id, _)] => {
                    let (thing, group) = called(list, id);
                    let place = group.map_or(String::new(), |group| format!(" in {group}"));
                    format!("no reading of these tests changes with {thing}{place}")
                }
                _ => describe(list, &combination, CONFOUNDED),
            };
            Unobservable {
                combination: combination.into_iter().collect(),
                why,
            }
        })
        .collect()
}

/// A row over scaled unknowns in outside units: its pivot first, with 1, then the others in the order of the unknowns.
fn outside(problem: &Problem<'_>, row: &[f64], pivot: usize) -> Vec<(String, f64)> {
    let list = &problem.parameters.list;
    let largest = row.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let others = (0..row.len()).filter(|j| *j != pivot && row[*j].abs() > NEGLIGIBLE * largest);
    let entries: Vec<(String, f64)> = std::iter::once(pivot)
        .chain(others)
        .map(|j| {
            let parameter = &list[j];
            (
                parameter.id.clone(),
                row[j] * parameter.size * parameter.unit.display_per_internal,
            )
        })
        .collect();
    let leading = entries.first().map_or(1.0, |(_, value)| *value);
    entries
        .into_iter()
        .map(|(id, value)| (id, value / leading))
        .collect()
}

/// Errors that the readings alone cannot tell from set-up quantities, one sparse combination each: the null space of the readings
/// without priors, reduced with errors as pivots, so that each combination holds one error and set-up quantities.
///
/// # Errors
/// If the decomposition fails.
pub fn determined_by_prior(
    problem: &Problem<'_>,
    linear: &Linearisation,
) -> Result<Vec<DeterminedByPrior>, IdentifyError> {
    let list = &problem.parameters.list;
    let r = linear.readings.parts().0;
    let alone = Rank::decide(r.as_ref(), &linear.size, &linear.preference)?;
    let (errors, setups): (Vec<usize>, Vec<usize>) =
        (linear.preference.iter()).partition(|j| is_wanted(&list[**j]));
    let order = [errors, setups].concat();
    let scaled = Mat::from_fn(r.nrows(), r.ncols(), |i, j| r[(i, j)] * linear.size[j]);
    let (rows, pivots) = combinations(alone.null_space.as_ref(), scaled.as_ref(), &order, MIN_ERROR);
    let (mut of_errors, of_setups): (Vec<usize>, Vec<usize>) =
        (0..rows.len()).partition(|row| is_wanted(&list[pivots[*row]]));
    // Listed as the errors are declared.
    of_errors.sort_by_key(|row| pivots[*row]);
    let setups: Vec<Vec<f64>> = of_setups.iter().map(|row| rows[*row].clone()).collect();
    let mut held = Vec::new();
    for row in of_errors {
        let error = pivots[row];
        // What is not seen even with the priors is blind, and named there.
        let sparse = sparser(rows[row].clone(), &setups);
        let setup_only =
            (0..list.len()).all(|j| j == error || !is_wanted(&list[j]) || sparse[j].abs() < NEGLIGIBLE);
        if !linear.rank.is_identifiable(error) || !setup_only {
            continue;
        }
        let combination = outside(problem, &sparse, error);
        if combination.len() < 2 {
            continue;
        }
        let why = describe(list, &combination, CONFOUNDED);
        held.push(DeterminedByPrior {
            error: list[error].id.clone(),
            combination,
            why,
        });
    }
    Ok(held)
}

fn subtract(row: &mut [f64], factor: f64, other: &[f64]) {
    if factor != 0.0 {
        row.iter_mut()
            .zip(other)
            .for_each(|(value, o)| *value -= factor * o);
    }
}

/// A row less multiples of others such that fewer entries remain, as long as that succeeds.
fn sparser(mut row: Vec<f64>, others: &[Vec<f64>]) -> Vec<f64> {
    let support = |row: &[f64]| row.iter().filter(|value| value.abs() > NEGLIGIBLE).count();
    loop {
        let before = support(&row);
        let mut best: Option<(usize, Vec<f64>)> = None;
        for other in others {
            for column in (0..row.len()).filter(|c| row[*c].abs() > NEGLIGIBLE && other[*c].abs() > 1e-3) {
                let mut trial = row.clone();
                subtract(&mut trial, row[column] / other[column], other);
                let count = support(&trial);
                if count < best.as_ref().map_or(before, |(count, _)| *count) {
                    best = Some((count, trial));
                }
            }
        }
        match best {
            Some((_, trial)) => row = trial,
            None => return row,
        }
    }
}

/// Combinations of errors that are seen, but badly: small singular values of the information on the errors with columns of unit length.
///
/// # Errors
/// If the decomposition fails.
pub fn nearly_collinear(
    problem: &Problem<'_>,
    linear: &Linearisation,
    wanted: &[usize],
) -> Result<Vec<NearDependency>, IdentifyError> {
    let list = &problem.parameters.list;
    let seen: Vec<usize> = wanted
        .iter()
        .copied()
        .filter(|j| linear.rank.is_identifiable(*j))
        .collect();
    let r = marginal(linear.whole.parts().0.as_ref(), &seen, &linear.size)?;
    let n = seen.len();
    let norm: Vec<f64> = (0..n)
        .map(|j| {
            (0..n)
                .map(|i| r[(i, j)].powi(2))
                .sum::<f64>()
                .sqrt()
                .max(f64::MIN_POSITIVE)
        })
        .collect();
    let unit = Mat::from_fn(n, n, |i, j| r[(i, j)] / norm[j]);
    let svd = unit.svd().map_err(|_| IdentifyError::Decomposition)?;
    let singular: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    // Equal singular values share a space of which the decomposition returns any basis: the reduced one is the same everywhere.
    let mut directions: Vec<(f64, Vec<f64>)> = Vec::new();
    let mut first = 0;
    while first < n {
        let equal = (first..n).take_while(|k| smallest_first(singular[first], singular[*k]).is_eq());
        let equal: Vec<usize> = equal.collect();
        let rows = equal
            .iter()
            .map(|k| (0..n).map(|j| svd.V()[(j, *k)]).collect())
            .collect();
        let condition_index = singular[0] / singular[first];
        directions.extend(reduced(rows).into_iter().map(|row| (condition_index, row)));
        first += equal.len().max(1);
    }
    let mut found = Vec::new();
    for (condition_index, direction) in directions {
        if condition_index < NAMED_FROM {
            continue;
        }
        // A move along the direction, in outside units.
        let parts: Vec<(usize, f64)> = direction.into_iter().enumerate().collect();
        let largest = parts.iter().fold(0.0_f64, |most, (_, v)| most.max(v.abs()));
        let chosen: Vec<(usize, f64)> = parts
            .into_iter()
            .filter(|(_, v)| v.abs() >= MIN_PART * largest)
            .collect();
        if chosen.len() < 2 {
            continue;
        }
        let raw = chosen.iter().map(|(j, v)| {
            let parameter = &list[seen[*j]];
            (
                parameter.id.clone(),
                v / norm[*j] * parameter.unit.display_per_internal,
            )
        });
        let raw: Vec<(String, f64)> = raw.collect();
        let leading = raw[0].1;
        let combination: Vec<(String, f64)> = raw.into_iter().map(|(id, v)| (id, v / leading)).collect();
        let why = describe(
            list,
            &combination,
            &format!("is nearly collinear (condition index {condition_index:.0}) with"),
        );
        found.push(NearDependency {
            condition_index,
            combination,
            why,
        });
    }
    Ok(found)
}

/// The reduced row echelon form of independent rows, pivots in the order of the columns.
fn reduced(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let width = rows.first().map_or(0, Vec::len);
    let mut done = 0;
    for column in 0..width {
        let pivot = (done..rows.len())
            .filter(|row| rows[*row][column].abs() > NEGLIGIBLE)
            .min_by(|a, b| smallest_first(-rows[*a][column].abs(), -rows[*b][column].abs()));
        let Some(pivot) = pivot else { continue };
        rows.swap(done, pivot);
        let leading = rows[done][column];
        rows[done].iter_mut().for_each(|value| *value /= leading);
        let pivot_row = rows[done].clone();
        for (row, other) in rows.iter_mut().enumerate() {
            if row != done {
                let factor = other[column];
                subtract(other, factor, &pivot_row);
            }
        }
        done += 1;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_basis_of_a_space_reduces_to_one() {
        let plane = [[1.0, 0.0, 2.0, -1.0], [0.0, 1.0, 0.5, 3.0]];
        for turn in 0..16 {
            let (sin, cos) = (0.3 + f64::from(turn)).sin_cos();
            let mixed = |a: f64, b: f64| (0..4).map(|j| a * plane[0][j] + b * plane[1][j]).collect();
            let rows = reduced(vec![mixed(cos, sin), mixed(-sin, cos)]);
            for (row, expected) in rows.iter().zip(plane) {
                for (value, expected) in row.iter().zip(expected) {
                    assert!((value - expected).abs() < 1e-12, "{turn}: {rows:?}");
                }
            }
        }
    }
}
