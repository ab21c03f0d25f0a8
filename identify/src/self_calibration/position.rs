//! The position of the rotary axis, from the displacements of the table over a turn.
//!
//! The displacements are relative to the table at 0. A table that turns about `c` instead of the origin is displaced by
//! `c − R(C)·c`. The displacements lie on a circle about `c` through the origin. Zimmermann & Ibaraki (2020) use the
//! centre of the least-squares circle. A direct estimate from the displacements is
//!
//! ```text
//! a = Σ[(1 − cos C)·X − s·sin C·Y] / Σ2(1 − cos C),    b = Σ[s·sin C·X + (1 − cos C)·Y] / Σ2(1 − cos C)
//! ```
//!
//! `s` is the sense of rotation. This estimate uses the angle of every point and the known point at the origin, and is
//! linear in the readings.

use num_dual::{Dual64, DualNum};

use crate::numerics::circle;

/// Estimates of the axis position: by the circle and by the rotation.
#[derive(Clone, Copy, Debug)]
pub struct Position<D> {
    /// Centre of the least-squares circle; NaN if the points have none.
    pub circle: [D; 2],
    /// Its radius.
    pub radius: D,
    /// The estimate by the rotation.
    pub turn: [D; 2],
}

/// Estimates from the displacements at the positions of the axis, given as `[sine, cosine]`. `displacement(k)` is that
/// at position `k`.
pub fn position<D: DualNum<Primitive = f64> + Copy>(
    turns: &[[f64; 2]],
    sense: f64,
    points: &mut Vec<[D; 2]>,
    displacement: impl Fn(usize) -> [D; 2],
) -> Position<D> {
    points.clear();
    let (mut a, mut b, mut weight) = (D::from(0.0), D::from(0.0), 0.0);
    for (k, [sin, cos]) in turns.iter().enumerate() {
        let [x, y] = displacement(k);
        points.push([x, y]);
        let (across, versine) = (D::from(sense * sin), D::from(1.0 - cos));
        a += versine * x - across * y;
        b += across * x + versine * y;
        weight += 2.0 * (1.0 - cos);
    }
    let circle = circle::through(points);
    let nan = D::from(f64::NAN);
    Position {
        circle: circle.map_or([nan; 2], |circle| circle.centre),
        radius: circle.map_or(nan, |circle| circle.radius),
        turn: [a / weight, b / weight],
    }
}

/// The estimates and their derivatives by each displacement: circle `x, y`, rotation `x, y`. Columns are the first
/// displacements, then the second.
pub fn jacobian(turns: &[[f64; 2]], sense: f64, first: &[f64], second: &[f64]) -> [Vec<f64>; 4] {
    let mut rows: [Vec<f64>; 4] = Default::default();
    let mut points = Vec::new();
    let count = turns.len();
    for seed in 0..2 * count {
        let dual = |value: f64, place: usize| Dual64::new(value, f64::from(u8::from(place == seed)));
        let found = position(turns, sense, &mut points, |k| [dual(first[k], k), dual(second[k], count + k)]);
        for (row, value) in rows.iter_mut().zip(found.circle.iter().chain(&found.turn)) {
            row.push(value.eps);
        }
    }
    rows
}
