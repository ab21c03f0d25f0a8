//! Boundary conditions of the self-calibration, without which the functions are not identifiable.
//!
//! A shift `(a, b)` of the machine coordinates leaves every reading unchanged: `E_radial` and `W_radial` absorb
//! `a·(1 − cos θ) + b·sin θ`, and the displacements of the table its opposite. The first four conditions refer every
//! function to its value at 0. The other two fix the shift.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use faer::Mat;

use super::equations::{Equations, Function};
use crate::error::IdentifyError;

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
pub fn conditions(equations: &Equations, axis: &str) -> Result<Vec<Condition>, IdentifyError> {
    let name = |function| equations.name(function, axis);
    let mut conditions = Vec::new();
    for function in Function::ALL {
        let Some(column) = equations.column(function, 0.0) else {
            return Err(IdentifyError::Request(format!(
                "self-calibration: no reading determines {} at 0°; add a reading there, because every function is referred to its value at 0°",
                name(function)
            )));
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

/// Eliminates one value per condition (Gauss–Jordan).
pub fn reduce(columns: usize, conditions: &[Condition]) -> Reduction {
    // Row k expresses column pivots[k] as the negative of the rest of the row.
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut pivots: Vec<usize> = Vec::new();
    for condition in conditions {
        let mut row = vec![0.0; columns];
        for (column, weight) in &condition.terms {
            row[*column] += weight;
        }
        for (known, pivot) in rows.iter().zip(&pivots) {
            let part = row[*pivot];
            row.iter_mut().zip(known).for_each(|(entry, k)| *entry -= part * k);
        }
        let largest = (0..columns).max_by(|a, b| row[*a].abs().total_cmp(&row[*b].abs()));
        let Some(pivot) = largest.filter(|column| row[*column].abs() > 1e-9) else {
            continue;
        };
        let scale = row[pivot];
        row.iter_mut().for_each(|entry| *entry /= scale);
        for known in &mut rows {
            let part = known[pivot];
            known.iter_mut().zip(&row).for_each(|(entry, r)| *entry -= part * r);
        }
        rows.push(row);
        pivots.push(pivot);
    }
    let free: Vec<usize> = (0..columns).filter(|column| !pivots.contains(column)).collect();
    let spread =
        Mat::from_fn(columns, free.len(), |column, k| match pivots.iter().position(|pivot| *pivot == column) {
            Some(row) => -rows[row][free[k]],
            None => f64::from(u8::from(column == free[k])),
        });
    Reduction { free, spread }
}
