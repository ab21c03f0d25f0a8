//! Boundary conditions of the self-calibration, without which the functions are not identifiable.
//!
//! A shift `(a, b)` of the machine coordinates leaves every reading unchanged: `E_radial` and `W_radial` absorb
//! `a·(1 − cos θ) + b·sin θ`, and the displacements of the table its opposite. The first four conditions refer every
//! function to its value at 0. The other two fix the shift.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use abbe_model::Diagnostic;
use faer::Mat;

use super::equations::{Equations, Function, refused};
use crate::numerics::rank::Rank;
use crate::numerics::triangle::Triangle;

/// A condition `Σ a·f(angle) = 0`.
#[derive(Clone, Debug)]
pub struct Condition {
    /// The condition in results.
    pub words: String,
    /// Column and coefficient.
    pub terms: Vec<(usize, f64)>,
}

/// The six conditions.
///
/// `E_radial` is interpolated at an angle without readings, so that any set of angles is valid. At an angle with
/// readings the condition is exactly that of Zimmermann & Ibaraki (2020).
///
/// # Errors
/// If a function has no readings at 0.
pub fn conditions(equations: &Equations, axis: &str) -> Result<Vec<Condition>, Diagnostic> {
    let name = |function| equations.name(function, axis);
    let mut conditions = Vec::new();
    for function in Function::ALL {
        let Some(column) = equations.column(function, 0.0) else {
            return Err(refused(
                format!("no reading determines {} at 0°", name(function)),
                "add a reading there, because every function is referred to its value at 0°",
            ));
        };
        conditions.push(Condition { words: format!("{}(0°) = 0", name(function)), terms: vec![(column, 1.0)] });
    }
    let difference = |one: f64, other: f64, words: &str| {
        let minus = at(equations, other).into_iter().map(|(column, weight)| (column, -weight));
        Condition { words: words.into(), terms: at(equations, one).into_iter().chain(minus).collect() }
    };
    conditions.push(difference(FRAC_PI_2, -FRAC_PI_2, "E_radial(90°) = E_radial(−90°)"));
    conditions.push(difference(PI, 0.0, "E_radial(180°) = E_radial(0°)"));
    Ok(conditions)
}

/// `E_radial` at an angle, interpolated between its neighbours.
fn at(equations: &Equations, angle: f64) -> Vec<(usize, f64)> {
    if let Some(column) = equations.column(Function::Linear, angle) {
        return vec![(column, 1.0)];
    }
    let offset = equations.offset(Function::Linear);
    let angles = &equations.angles[Function::Linear as usize];
    let ahead = |k: &usize| (angles[*k] - angle).rem_euclid(TAU);
    let behind = |k: &usize| (angle - angles[*k]).rem_euclid(TAU);
    let nearest = |distance: &dyn Fn(&usize) -> f64| {
        (0..angles.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    };
    let (next, last) = (nearest(&ahead), nearest(&behind));
    let (to_next, to_last) = (ahead(&next), behind(&last));
    let width = to_next + to_last;
    vec![(offset + next, to_last / width), (offset + last, to_next / width)]
}

/// The free values, and all values as linear combinations of them: columns × free.
#[derive(Clone, Debug)]
pub struct Reduction {
    /// The free columns.
    pub free: Vec<usize>,
    /// All columns from the free ones.
    pub spread: Mat<f64>,
}

/// Weight of a condition: far above the limit of an identifiable direction.
const WEIGHT: f64 = 1e6;

/// The values that the conditions leave free: the null space of the conditions.
///
/// # Errors
/// If a condition holds a number that is not finite.
pub fn reduce(columns: usize, conditions: &[Condition]) -> Result<Reduction, Diagnostic> {
    let mut rows = Mat::zeros(conditions.len(), columns + 1);
    for (row, condition) in conditions.iter().enumerate() {
        condition.terms.iter().for_each(|(column, weight)| rows[(row, *column)] += WEIGHT * weight);
    }
    let order: Vec<usize> = (0..columns).collect();
    let rank = Rank::decide(&Triangle::of(rows), &vec![1.0; columns], &order)?;
    let spread = Mat::from_fn(columns, rank.pivots.len(), |column, k| rank.null_combinations[k][column]);
    Ok(Reduction { free: rank.pivots, spread })
}
