//! What has to be agreed upon before the functions have values: the boundary conditions of the method.
//!
//! A shift `(a, b)` of the machine's coordinates changes no reading: `E_radial` and `W_radial` absorb `a·(1 − cos θ) + b·sin θ`, the table's
//! displacements its opposite. The first four conditions refer every function to its value at 0; the other two settle the shift.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use faer::Mat;

use super::equations::{Equations, Function};
use crate::error::IdentifyError;

/// A condition `Σ a·f(angle) = 0`.
#[derive(Clone, Debug)]
pub struct Condition {
    /// As it is reported.
    pub words: String,
    /// Column and coefficient.
    pub terms: Vec<(usize, f64)>,
}

/// The six conditions.
///
/// `E_radial` at an angle that no reading meets is interpolated between its neighbours, so that any number of angles will do; where the angle is met, the
/// condition is that of the paper.
///
/// # Errors
/// If a function is not met at 0.
pub fn conditions(equations: &Equations, axis: &str) -> Result<Vec<Condition>, IdentifyError> {
    let name = |function| equations.name(function, axis);
    let mut conditions = Vec::new();
    for function in Function::ALL {
        let Some(column) = equations.column(function, 0.0) else {
            return Err(IdentifyError::Request(format!(
                "self-calibration: no reading meets {} at 0°; every function is referred to its value there",
                name(function)
            )));
        };
        conditions.push(Condition {
            words: format!("{}(0°) = 0", name(function)),
            terms: vec![(column, 1.0)],
        });
    }
    let difference = |one: f64, other: f64, words: &str| {
        let minus = at(equations, other)
            .into_iter()
            .map(|(column, weight)| (column, -weight));
        Condition {
            words: words.into(),
            terms: at(equations, one).into_iter().chain(minus).collect(),
        }
    };
    conditions.push(difference(
        FRAC_PI_2,
        -FRAC_PI_2,
        "E_radial(90°) = E_radial(−90°)",
    ));
    conditions.push(difference(PI, 0.0, "E_radial(180°) = E_radial(0°)"));
    Ok(conditions)
}

/// `E_radial` at an angle, between its neighbours.
fn at(equations: &Equations, angle: f64) -> Vec<(usize, f64)> {
    if let Some(column) = equations.column(Function::Linear, angle) {
        return vec![(column, 1.0)];
    }
    let offset = equations.offset(Function::Linear);
    let angles = &equations.angles[Function::Linear as usize];
    let ahead = |k: &usize| (angles[*k] - angle).rem_euclid(TAU);
    let behind = |k: &usize| (angle - angles[*k]).rem_euclid(TAU);
    let nearest = |way: &dyn Fn(&usize) -> f64| {
        (0..angles.len())
            .min_by(|a, b| way(a).total_cmp(&way(b)))
            .unwrap_or(0)
    };
    let (next, last) = (nearest(&ahead), nearest(&behind));
    let (to_next, to_last) = (ahead(&next), behind(&last));
    let width = to_next + to_last;
    vec![(offset + next, to_last / width), (offset + last, to_next / width)]
}

/// The values that remain free, and all values in terms of them: columns × free.
#[derive(Clone, Debug)]
pub struct Reduction {
    /// The columns that remain.
    pub free: Vec<usize>,
    /// All columns from those.
    pub spread: Mat<f64>,
}

/// Solves each condition for one of its values (Gauss–Jordan) and leaves it out.
pub fn reduce(columns: usize, conditions: &[Condition]) -> Reduction {
    // Row k expresses column pivots[k] as minus the rest of the row.
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut pivots: Vec<usize> = Vec::new();
    for condition in conditions {
        let mut row = vec![0.0; columns];
        for (column, weight) in &condition.terms {
            row[*column] += weight;
        }
        for (known, pivot) in rows.iter().zip(&pivots) {
            let part = row[*pivot];
            row.iter_mut()
                .zip(known)
                .for_each(|(entry, k)| *entry -= part * k);
        }
        let largest = (0..columns).max_by(|a, b| row[*a].abs().total_cmp(&row[*b].abs()));
        let Some(pivot) = largest.filter(|column| row[*column].abs() > 1e-9) else {
            continue;
        };
        let scale = row[pivot];
        row.iter_mut().for_each(|entry| *entry /= scale);
        for known in &mut rows {
            let part = known[pivot];
            known
                .iter_mut()
                .zip(&row)
                .for_each(|(entry, r)| *entry -= part * r);
        }
        rows.push(row);
        pivots.push(pivot);
    }
    let free: Vec<usize> = (0..columns).filter(|column| !pivots.contains(column)).collect();
    let spread = Mat::from_fn(columns, free.len(), |column, k| {
        match pivots.iter().position(|pivot| *pivot == column) {
            Some(row) => -rows[row][free[k]],
            None => f64::from(u8::from(column == free[k])),
        }
    });
    Reduction { free, spread }
}
