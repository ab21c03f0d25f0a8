//! Identifiability: null-space combinations, errors determined by set-up priors only, and near collinearity, each
//! described in words.

use abbe_model::Diagnostic;
use abbe_model::parameter_id::ParameterId;
use faer::Mat;
use schemars::JsonSchema;
use serde::Serialize;

use crate::linear::{Linearisation, is_of_interest};
use crate::numerics::null_space::{combinations, echelon};
use crate::numerics::rank::Rank;
use crate::numerics::ranking::smallest_first;
use crate::numerics::solve::Svd;
use crate::parameters::Parameter;
use crate::problem::Problem;
use crate::results::{Combination, DeterminedByPrior, Finding, Unobservable};

/// A combination of parameters whose columns are nearly collinear.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct NearDependency {
    /// Condition index: the largest singular value over this one, of the Jacobian with columns of unit length.
    pub condition_index: f64,
    /// Coefficient of each parameter, in its display unit.
    #[serde(serialize_with = "Combination::serialize_pairs")]
    #[schemars(with = "Combination")]
    pub combination: Vec<(String, f64)>,
    /// Explanation in words.
    pub why: String,
}

/// Coefficients below this value, relative to the largest, are rounding errors.
const NEGLIGIBLE: f64 = 1e-5;
/// Condition index from which a near dependency is reported: moderate from 10, strong from 30 (Belsley, Kuh & Welsch,
/// Regression Diagnostics, 1980, ch. 3).
const MIN_CONDITION_INDEX: f64 = 10.0;
/// Least share of the largest entry of the null space for an error to be the pivot of a combination with set-up
/// quantities.
const MIN_ERROR: f64 = 1.37e-3;
/// Maximum number of quantities that a description names.
const MAX_NAMED: usize = 5;
/// The verb of a combination that leaves every reading unchanged.
const CONFOUNDED: &str = "is confounded with";
/// Share of the largest coefficient below which a parameter is omitted from a near dependency.
const MIN_PART: f64 = 0.1;

/// The name of a quantity and its group: `spindle_ball.z[A150]` is `z of the spindle ball` in `A150`.
fn name_of(id: &ParameterId) -> (String, Option<&str>) {
    let ParameterId::Setup { thing, coordinate, .. } = id else { return (id.to_string(), None) };
    let of = if coordinate.is_empty() { String::new() } else { format!("{coordinate} of ") };
    (format!("{of}the {}", thing.replace('_', " ")), id.group())
}

/// A combination by the identifiers of its parameters.
fn named<C: FromIterator<(String, f64)>>(combination: &[(&Parameter, f64)]) -> C {
    combination.iter().map(|(parameter, value)| (parameter.id.to_string(), *value)).collect()
}

/// Describes a combination: the confounded quantities and their proportion, with units if they differ. A quantity that
/// occurs in several tests is named once. A long combination is shortened.
fn describe(combination: &[(&Parameter, f64)], verb: &str) -> String {
    let mixed = combination.iter().any(|(parameter, _)| parameter.unit.name != combination[0].0.unit.name);
    let mut quantities: Vec<(String, Vec<&str>, String)> = Vec::new();
    for (parameter, value) in combination {
        let (quantity, group) = name_of(&parameter.id);
        let value = format_short(*value);
        let value = if mixed { format!("{value} {}", parameter.unit.name) } else { value };
        match quantities.iter_mut().find(|(other, groups, v)| *other == quantity && *v == value && !groups.is_empty()) {
            Some((_, groups, _)) => groups.extend(group),
            None => quantities.push((quantity, group.into_iter().collect(), value)),
        }
    }
    // A single further quantity is named, because the count would take as much space.
    let unnamed = match quantities.len() {
        count if count > MAX_NAMED + 1 => count - MAX_NAMED,
        _ => 0,
    };
    quantities.truncate(quantities.len() - unnamed);
    let mut words = quantities.iter().map(|(quantity, groups, _)| match groups.as_slice() {
        [] => quantity.clone(),
        [one] => format!("{quantity} in {one}"),
        [first @ .., last] => format!("{quantity} in {} and {last}", first.join(", ")),
    });
    let proportion: Vec<&str> = quantities.iter().map(|(_, _, value)| value.as_str()).collect();
    let first = words.next().unwrap_or_default();
    let others: Vec<String> = words.collect();
    let (others, proportion) = (others.join(", "), proportion.join(" : "));
    match unnamed {
        0 => format!("{first} {verb} {others}: {proportion}"),
        _ => format!("{first} {verb} {others} and {unnamed} more together: {proportion} : …"),
    }
}

/// Two decimals, or two significant digits of a small number.
fn format_short(value: f64) -> String {
    let places = (1.0 - value.abs().max(1e-9).log10().floor()).clamp(1.0, 9.0) as usize;
    let text = format!("{value:.*}", places.max(if value.abs() < 10.0 { 2 } else { 1 }));
    text.trim_end_matches('0').trim_end_matches('.').replace('-', "−")
}

/// Combinations that are not identifiable, and that no prior determines: those that leave every reading unchanged, and
/// weak ones.
pub fn unidentifiable(problem: &Problem, rank: &Rank) -> Vec<Unobservable> {
    let list = &problem.parameters.list;
    let rows = rank.null_combinations.iter().zip(&rank.pivots).zip(&rank.weak_u);
    rows.map(|((row, pivot), weak_u)| {
        let combination = in_display_units(problem, row, *pivot);
        let finding = if weak_u.is_some() { Finding::Weak } else { Finding::Structural };
        let why = match (weak_u, combination.as_slice()) {
            (Some(u), _) => {
                let others: Vec<String> = combination[1..].iter().map(|(other, _)| other.id.to_string()).collect();
                weak(&list[*pivot], &others, *u)
            }
            (None, [(alone, _)]) => {
                let (quantity, group) = name_of(&alone.id);
                let place = group.map_or(String::new(), |group| format!(" in {group}"));
                format!("no reading of these tests changes with {quantity}{place}")
            }
            (None, _) => describe(&combination, CONFOUNDED),
        };
        Unobservable { combination: named(&combination), finding, why }
    })
    .collect()
}

/// Describes a weak combination: a parameter, the others that change with it, and the standard uncertainty in physical sizes.
pub(crate) fn weak(leader: &Parameter, others: &[String], u: f64) -> String {
    let u = format_short(u * leader.size * leader.unit.display_per_internal);
    let together = match others {
        [] => String::new(),
        [others @ .., _] if others.len() >= MAX_NAMED => {
            format!(" together with {} and {} more", others[..MAX_NAMED].join(", "), others.len() + 1 - MAX_NAMED)
        }
        _ => format!(" together with {}", others.join(", ")),
    };
    format!("{} is weakly determined{together}: u = {u} {}, more than such a machine has", leader.id, leader.unit.name)
}

/// A row over scaled parameters in display units: the pivot first, with 1, then the others in the order of the
/// parameters.
fn in_display_units<'p>(problem: &'p Problem, row: &[f64], pivot: usize) -> Vec<(&'p Parameter, f64)> {
    let list = &problem.parameters.list;
    let largest = row.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let others = (0..row.len()).filter(|j| *j != pivot && row[*j].abs() > NEGLIGIBLE * largest);
    let display = |j: usize| row[j] * list[j].size * list[j].unit.display_per_internal;
    std::iter::once(pivot).chain(others).map(|j| (&list[j], display(j) / display(pivot))).collect()
}

/// The errors that the readings alone confound with set-up quantities, one sparse combination each. They follow from
/// the null space of the readings without priors. It is reduced with errors as pivots, so that each combination
/// contains one error and set-up quantities.
///
/// # Errors
/// If the decomposition fails.
pub fn determined_by_prior(problem: &Problem, linear: &Linearisation) -> Result<Vec<DeterminedByPrior>, Diagnostic> {
    let list = &problem.parameters.list;
    let r = linear.readings.r();
    let alone = Rank::decide(&linear.readings, &linear.size, &linear.preference)?;
    let (errors, setups): (Vec<usize>, Vec<usize>) =
        (linear.preference.iter()).partition(|j| is_of_interest(&list[**j]));
    let order = [errors, setups].concat();
    let scaled = Mat::from_fn(r.nrows(), r.ncols(), |i, j| r[(i, j)] * linear.size[j]);
    let (rows, pivots) = combinations(alone.null_space.as_ref(), scaled.as_ref(), &order, MIN_ERROR);
    let (mut of_errors, of_setups): (Vec<usize>, Vec<usize>) =
        (0..rows.len()).partition(|row| is_of_interest(&list[pivots[*row]]));
    // In the order of declaration.
    of_errors.sort_by_key(|row| pivots[*row]);
    let setups: Vec<Vec<f64>> = of_setups.iter().map(|row| rows[*row].clone()).collect();
    let mut held = Vec::new();
    for row in of_errors {
        let error = pivots[row];
        // A combination that is not identifiable even with the priors is reported as such elsewhere.
        let sparse = sparser(rows[row].clone(), &setups);
        let setup_only =
            (0..list.len()).all(|j| j == error || !is_of_interest(&list[j]) || sparse[j].abs() < NEGLIGIBLE);
        if !linear.rank.is_identifiable(error) || !setup_only {
            continue;
        }
        let combination = in_display_units(problem, &sparse, error);
        if combination.len() < 2 {
            continue;
        }
        let why = describe(&combination, CONFOUNDED);
        held.push(DeterminedByPrior { error: list[error].id.to_string(), combination: named(&combination), why });
    }
    Ok(held)
}

fn subtract(row: &mut [f64], factor: f64, other: &[f64]) {
    if factor != 0.0 {
        row.iter_mut().zip(other).for_each(|(value, o)| *value -= factor * o);
    }
}

/// A row less multiples of others, as long as this reduces the number of nonzero entries.
fn sparser(mut row: Vec<f64>, others: &[Vec<f64>]) -> Vec<f64> {
    let support = |row: &[f64]| row.iter().filter(|value| value.abs() > NEGLIGIBLE).count();
    loop {
        let before = support(&row);
        let mut best: Option<(usize, Vec<f64>)> = None;
        for other in others {
            for column in (0..row.len()).filter(|c| row[*c].abs() > NEGLIGIBLE && other[*c].abs() > 1e-3) {
                let mut reduced_row = row.clone();
                subtract(&mut reduced_row, row[column] / other[column], other);
                let count = support(&reduced_row);
                if count < best.as_ref().map_or(before, |(count, _)| *count) {
                    best = Some((count, reduced_row));
                }
            }
        }
        match best {
            Some((_, reduced_row)) => row = reduced_row,
            None => return row,
        }
    }
}

/// Near dependencies of identifiable errors: small singular values of the information on the errors, with columns of
/// unit length.
///
/// # Errors
/// If the decomposition fails.
pub fn nearly_collinear(
    problem: &Problem,
    linear: &Linearisation,
    of_interest: &[usize],
) -> Result<Vec<NearDependency>, Diagnostic> {
    let list = &problem.parameters.list;
    let identifiable: Vec<usize> = of_interest.iter().copied().filter(|j| linear.rank.is_identifiable(*j)).collect();
    let r = linear.marginal(&identifiable)?;
    let n = identifiable.len();
    let norm: Vec<f64> =
        (0..n).map(|j| (0..n).map(|i| r[(i, j)].powi(2)).sum::<f64>().sqrt().max(f64::MIN_POSITIVE)).collect();
    let unit = Mat::from_fn(n, n, |i, j| r[(i, j)] / norm[j]);
    let decomposed = Svd::of(unit.as_ref())?;
    let singular = &decomposed.singular_values;
    // Equal singular values share a subspace, and the decomposition returns an arbitrary basis of it. The reduced basis
    // is unique.
    let order: Vec<usize> = (0..n).collect();
    let mut directions: Vec<(f64, Vec<f64>)> = Vec::new();
    let mut first = 0;
    while first < n {
        let equal = (first..n).take_while(|k| smallest_first(singular[first], singular[*k]).is_eq()).count().max(1);
        let (rows, _) = echelon(decomposed.right().subcols(first, equal), &order, NEGLIGIBLE);
        directions.extend(rows.into_iter().map(|row| (singular[0] / singular[first], row)));
        first += equal;
    }
    let mut found = Vec::new();
    for (condition_index, direction) in directions {
        if condition_index < MIN_CONDITION_INDEX {
            continue;
        }
        // The direction in display units.
        let parts: Vec<(usize, f64)> = direction.into_iter().enumerate().collect();
        let largest = parts.iter().fold(0.0_f64, |most, (_, v)| most.max(v.abs()));
        let chosen: Vec<(usize, f64)> = parts.into_iter().filter(|(_, v)| v.abs() >= MIN_PART * largest).collect();
        if chosen.len() < 2 {
            continue;
        }
        let raw = chosen.iter().map(|(j, v)| {
            let parameter = &list[identifiable[*j]];
            (parameter, v / norm[*j] * parameter.unit.display_per_internal)
        });
        let mut combination: Vec<(&Parameter, f64)> = raw.collect();
        let leading = combination[0].1;
        combination.iter_mut().for_each(|(_, value)| *value /= leading);
        let why = describe(&combination, &format!("is nearly collinear (condition index {condition_index:.0}) with"));
        found.push(NearDependency { condition_index, combination: named(&combination), why });
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use abbe_model::session::Prior;

    use super::*;

    /// Up to six quantities are named; of more, five, with the number of the others. A quantity that several groups share
    /// with one value is one.
    #[test]
    fn a_long_combination_names_five_quantities() {
        let parameter = |id: &str| {
            let unit = abbe_model::unit::Unit::Micrometre.into();
            let id = id.parse().unwrap();
            Parameter { id, unit, size: 1.0, prior: Prior::Free, effect: None, index: 0, found: 0.0 }
        };
        let ids = ["EX0C", "EY0C", "EX0A", "EY0A", "EZ0A", "EX0B", "EY0B"];
        let list: Vec<Parameter> = ids.iter().map(|id| parameter(id)).collect();
        let of = |count: usize| -> Vec<(&Parameter, f64)> {
            list[..count].iter().enumerate().map(|(k, parameter)| (parameter, 1.0 + k as f64)).collect()
        };
        let six = "EX0C is confounded with EY0C, EX0A, EY0A, EZ0A, EX0B: 1 : 2 : 3 : 4 : 5 : 6";
        assert_eq!(describe(&of(6), CONFOUNDED), six);
        let seven = "EX0C is confounded with EY0C, EX0A, EY0A, EZ0A and 2 more together: 1 : 2 : 3 : 4 : 5 : …";
        assert_eq!(describe(&of(7), CONFOUNDED), seven);
        let list = ["EX0C", "workpiece_ball.x[A100]", "workpiece_ball.x[A150]"].map(parameter);
        let shared = [(&list[0], 1.0), (&list[1], -2.0), (&list[2], -2.0)];
        let words = "EX0C is confounded with x of the workpiece ball in A100 and A150: 1 : −2";
        assert_eq!(describe(&shared, CONFOUNDED), words);
    }
}
