//! The frames of a calibrated chain that lie nearest to nominal Denavit–Hartenberg frames.
//!
//! The frame `H_k` has its Z on axis `k` and its X on the common normal to the next axis, with the sign of the nominal one. Where
//! the two axes are nearly parallel, its origin keeps the nominal `d` from the frame before it, so that it does not depend on
//! where the base is, and its X leads to the next axis in the plane across Z (Hayati).

use abbe_files::robot::dh::{Convention, Table};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::frames::Branch;

/// Sine of the angle between two axes below which they count as parallel.
pub(super) const PARALLEL: f64 = 0.02;
/// Length below which a normal has no direction, mm.
const SHORT_MM: f64 = 1e-6;

/// The frames of a chain.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    /// `B`.
    pub base: Isometry3<f64>,
    /// The rows that do not depend on the axes beside them: `Tx(a)·Rx(α)` before the first axis (modified) and behind the last
    /// one (standard): a and α, mm and rad.
    pub first: [f64; 2],
    pub last: [f64; 2],
    /// `H_k` of each axis.
    pub own: Vec<Isometry3<f64>>,
    /// `F`.
    pub tool: Isometry3<f64>,
}

fn about_x([a, alpha]: [f64; 2]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(a, 0.0, 0.0), UnitQuaternion::from_scaled_axis(Vector3::x() * alpha))
}

impl Frames {
    /// Those of the first rows of a table; the others and the end are its tool.
    pub fn of_table(table: &Table, joints: usize, end: &Isometry3<f64>) -> Frames {
        let (frames, _) = table.frames();
        let own = |k: usize| {
            let row = &table.rows[k];
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * row.theta);
            frames[k] * Isometry3::from_parts(Translation3::new(0.0, 0.0, row.d), turn)
        };
        let own: Vec<Isometry3<f64>> = (0..joints).map(own).collect();
        let parameters = |k: usize| [table.rows[k].a, table.rows[k].alpha];
        let (first, last) = match table.convention {
            Convention::Standard => ([0.0; 2], parameters(joints - 1)),
            Convention::Modified => (parameters(0), [0.0; 2]),
        };
        let tool = (own[joints - 1] * about_x(last)).inverse() * end;
        Frames { base: Isometry3::identity(), first, last, own, tool }
    }

    /// The parameters a, α, β, θ, d of each row, mm and degrees.
    pub fn rows(&self, convention: Convention) -> Vec<[f64; 5]> {
        let count = self.own.len();
        // a, α, β from the frame of an axis to the next one, and θ, d of each axis.
        let mut across = vec![[self.first[0], self.first[1], 0.0]];
        let mut along = Vec::with_capacity(count);
        for k in 0..count {
            let before = if k == 0 { self.base * about_x(self.first) } else { self.own[k - 1] };
            let step = before.inverse() * self.own[k];
            let (parameters, turned) = if k == 0 { (across[0], Isometry3::identity()) } else { to_next(&step) };
            if k > 0 {
                across.push(parameters);
            }
            let rest = turned.inverse() * step;
            let x = rest.rotation * Vector3::x();
            along.push([x.y.atan2(x.x), rest.translation.z]);
        }
        across.push([self.last[0], self.last[1], 0.0]);
        let first = if convention == Convention::Modified { 0 } else { 1 };
        let row = |k: usize| {
            let ([a, alpha, beta], [theta, d]) = (across[k + first], along[k]);
            [a, alpha.to_degrees(), beta.to_degrees(), theta.to_degrees(), d]
        };
        (0..count).map(row).collect()
    }
}

/// `Tx(a)·Rx(α)·Ry(β)` from a frame to the axis of the next one, and the pose that it is.
fn to_next(step: &Isometry3<f64>) -> ([f64; 3], Isometry3<f64>) {
    let (z, origin) = (step.rotation * Vector3::z(), step.translation.vector);
    let meeting = meeting(origin, z);
    let beta = if is_parallel(z) { z.x.clamp(-1.0, 1.0).asin() } else { 0.0 };
    let alpha = (-z.y).atan2(z.z);
    let turn =
        UnitQuaternion::from_scaled_axis(Vector3::x() * alpha) * UnitQuaternion::from_scaled_axis(Vector3::y() * beta);
    ([meeting.x, alpha, beta], Isometry3::from_parts(Translation3::new(meeting.x, 0.0, 0.0), turn))
}

fn is_parallel(z: Vector3<f64>) -> bool {
    Vector3::z().cross(&z).norm() < PARALLEL
}

/// Where an axis meets the X axis of the frame before it, both in this frame; of a nearly parallel one, where it meets the
/// plane across Z.
fn meeting(point: Vector3<f64>, z: Vector3<f64>) -> Vector3<f64> {
    if is_parallel(z) { point - z * (point.z / z.z) } else { foot_on_x(point, z) }
}

/// The point of an axis at the length `d` from where it meets the frame before it, in R.
fn along(before: &Isometry3<f64>, point: Vector3<f64>, z: Vector3<f64>, d: f64) -> Vector3<f64> {
    let own = before.inverse();
    let (local, turned) = (own.transform_point(&point.into()).coords, own.rotation * z);
    before.transform_point(&(meeting(local, turned) + turned * d).into()).coords
}

/// The frames of these axes (point and direction in R at zero) and this end near the nominal ones.
pub(super) fn near(nominal: &Frames, lines: &[(Vector3<f64>, Vector3<f64>)], end: &Isometry3<f64>) -> Frames {
    let count = lines.len();
    let mut own: Vec<Isometry3<f64>> = Vec::with_capacity(count);
    for k in 0..count {
        let (point, z) = (lines[k].0, lines[k].1.normalize());
        let there = &nominal.own[k];
        let usual = there.rotation * Vector3::x();
        let Some((next, next_z)) = lines.get(k + 1).map(|(next, z)| (*next, z.normalize())) else {
            // The frame that the tool is fixed to, on the axis.
            let fixed = end * (about_x(nominal.last) * nominal.tool).inverse();
            own.push(pose(nearest(point, z, fixed.translation.vector), fixed.rotation * Vector3::x(), z));
            break;
        };
        let normal = z.cross(&next_z);
        if normal.norm() >= PARALLEL {
            let sign = if normal.dot(&usual) < 0.0 { -1.0 } else { 1.0 };
            own.push(pose(foot(point, z, next, next_z), normal * sign, z));
            continue;
        }
        let origin = match own.last() {
            None => nearest(point, z, there.translation.vector),
            Some(before) => {
                let (nominal_z, origin) = (there.rotation * Vector3::z(), there.translation.vector);
                let d = (origin - along(&nominal.own[k - 1], origin, nominal_z, 0.0)).dot(&nominal_z);
                along(before, point, z, d)
            }
        };
        let to = next + next_z * ((origin - next).dot(&z) / next_z.dot(&z)) - origin;
        let sign = if to.dot(&usual) < 0.0 { -1.0 } else { 1.0 };
        own.push(pose(origin, if to.norm() > SHORT_MM { to * sign } else { usual }, z));
    }
    // The least displacement of the nominal first axis onto the calibrated one is the base's.
    let first = nominal.base * about_x(nominal.first);
    let (old, z) = (first.rotation * Vector3::z(), lines[0].1.normalize());
    let turn = UnitQuaternion::rotation_between(&old, &z).unwrap_or_else(UnitQuaternion::identity);
    let to = nearest(lines[0].0, z, first.translation.vector);
    let displaced = Isometry3::from_parts(Translation3::from(to - turn * first.translation.vector), turn);
    let base = displaced * nominal.base;
    let tool = (own[count - 1] * about_x(nominal.last)).inverse() * end;
    Frames { base, own, tool, ..nominal.clone() }
}

/// The point of a line nearest to another point.
fn nearest(point: Vector3<f64>, z: Vector3<f64>, to: Vector3<f64>) -> Vector3<f64> {
    point + z * (to - point).dot(&z)
}

/// The point of a line nearest to the X axis: origin and direction in the frame.
fn foot_on_x(point: Vector3<f64>, z: Vector3<f64>) -> Vector3<f64> {
    let across = z - Vector3::x() * z.x;
    let offset = point - Vector3::x() * point.x;
    let square = across.norm_squared();
    if square > 0.0 { point - z * (offset.dot(&across) / square) } else { point }
}

/// The foot of the common normal with the line `b + t·v` on the line `a + s·u`; the lines are not parallel.
pub(super) fn foot(a: Vector3<f64>, u: Vector3<f64>, b: Vector3<f64>, v: Vector3<f64>) -> Vector3<f64> {
    let (between, cosine) = (b - a, u.dot(&v));
    a + u * ((between.dot(&u) - cosine * between.dot(&v)) / (1.0 - cosine * cosine))
}

/// A frame with this origin, its X along the part of `x` across `z`.
pub(super) fn pose(origin: Vector3<f64>, x: Vector3<f64>, z: Vector3<f64>) -> Isometry3<f64> {
    let z = z.normalize();
    let least = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let across = |x: Vector3<f64>| (x - z * z.dot(&x)).try_normalize(1e-9);
    let x = across(x).or_else(|| across(least)).unwrap_or(least);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Isometry3::from_parts(Translation3::from(origin), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The frames of a branch: the first at the axis' own point, each further one where the one before meets its axis, unless the
/// common normal decides. Rows before the first and behind the last axis are empty.
pub(super) fn frames(branch: &Branch) -> Frames {
    let (lines, end) = branch.at_zero();
    let mut own: Vec<Isometry3<f64>> = Vec::with_capacity(lines.len());
    for (k, &(point, z)) in lines.iter().enumerate() {
        // Where the frame lies along its axis if nothing else decides.
        let met = match own.last() {
            Some(before) => meets(before.translation.vector, lines[k - 1].1, point, z),
            None => point,
        };
        let (origin, x) = match lines.get(k + 1) {
            None => (met, Vector3::zeros()),
            Some((next, next_z)) => {
                let across = z.cross(next_z);
                match across.norm() >= PARALLEL {
                    true => (foot(point, z, *next, *next_z), across),
                    false => (met, meets(met, z, *next, *next_z) - met),
                }
            }
        };
        own.push(pose(origin, x, z));
    }
    let tool = own.last().map_or(end, |last| last.inverse() * end);
    let base = own.first().copied().unwrap_or_else(Isometry3::identity);
    Frames { base, first: [0.0; 2], last: [0.0; 2], own, tool }
}

/// The point of a line in the plane through `origin` across `z`.
fn meets(origin: Vector3<f64>, z: Vector3<f64>, point: Vector3<f64>, direction: Vector3<f64>) -> Vector3<f64> {
    let along = direction.dot(&z);
    if along.abs() < PARALLEL {
        return point;
    }
    point + direction * ((origin - point).dot(&z) / along)
}
