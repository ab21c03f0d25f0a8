//! The machine of a robot as the other convention reads its table of Denavit–Hartenberg parameters.
//!
//! A machine holds the axes of the table with all joints at zero, each with the origin of its frame. They give the rows of the
//! table back, but for the sign of each X axis. Such a sign changes nothing in the convention that the table was read in; in the
//! other one it adds half a turn to two joints, so that all signs are tried. Behind the last axis a table in the modified
//! convention has one more angle, of which the machine knows nothing: zero or a right angle.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use abbe_files::robot::dh::{Convention, DhRow, Table};
use abbe_model::session::Session;
use nalgebra::Vector3;

use super::super::results::SuggestionKind;
use super::Hypothesis;

/// Most axes: each doubles the number of tables.
const MAX_JOINTS: usize = 8;
/// Sine of an angle below which two axes are parallel, and length below which a normal has no direction, mm.
const MIN_NORMAL: f64 = 1e-6;

/// The machines of the tables that a session's machine may come from, each read in the other convention.
pub fn conventions(session: &Session) -> Vec<Hypothesis> {
    let machine = &session.machine;
    let count = machine.axes.len();
    if machine.workpiece_side > 0 || !(2..=MAX_JOINTS).contains(&count) {
        return Vec::new();
    }
    let signs = 0..1_usize << (count - 1);
    let in_standard = signs.clone().flat_map(|signs| [0.0, FRAC_PI_2, -FRAC_PI_2].map(|end| (signs, end)));
    let as_standard = in_standard.map(|(signs, end)| reread(session, Convention::Standard, signs, end));
    let as_modified = signs.map(|signs| reread(session, Convention::Modified, signs, 0.0));
    as_standard.chain(as_modified).collect()
}

/// The session with the machine of the table, which was read in one convention, in the other one.
fn reread(session: &Session, convention: Convention, signs: usize, end: f64) -> Hypothesis {
    let (read, is, other) = match convention {
        Convention::Standard => ("standard", "modified", Convention::Modified),
        Convention::Modified => ("modified", "standard", Convention::Standard),
    };
    let rows = rows(session, convention, signs, end);
    let chain = Table { convention: other, rows, assumed: Vec::new() }.chain(&session.machine.name);
    let mut changed = session.clone();
    for (axis, joint) in Arc::make_mut(&mut changed.machine).axes.iter_mut().zip(&chain.joints) {
        axis.direction = (joint.pose.rotation * Vector3::z()).into();
        axis.origin_mm = joint.pose.translation.vector.into();
    }
    let words = format!("the machine is that of a Denavit–Hartenberg table read as {read}, which is {is}");
    Hypothesis::new(SuggestionKind::DhConvention, &session.machine.name, words, changed)
}

/// The rows of the table in the convention that it was read in: bit `k` of `signs` is the sign of the X axis between axes `k` and
/// `k + 1`, `end` the angle behind the last axis.
fn rows(session: &Session, convention: Convention, signs: usize, end: f64) -> Vec<DhRow> {
    let axes = &session.machine.axes;
    let (z, origin) = (|k: usize| Vector3::from(axes[k].direction), |k: usize| Vector3::from(axes[k].origin_mm));
    let angle =
        |from: Vector3<f64>, to: Vector3<f64>, about: Vector3<f64>| from.cross(&to).dot(&about).atan2(from.dot(&to));
    let mut x = Vector3::x();
    // a and α from each axis to the next, θ and d of each axis.
    let mut across = vec![[origin(0).x, angle(Vector3::z(), z(0), x)]];
    let mut along = Vec::new();
    for k in 0..axes.len() - 1 {
        let step = origin(k + 1) - origin(k);
        let normal = Some(z(k).cross(&z(k + 1))).filter(|normal| normal.norm() > MIN_NORMAL);
        let normal = normal.unwrap_or_else(|| step - z(k) * step.dot(&z(k)));
        let sign = if signs >> k & 1 == 1 { -1.0 } else { 1.0 };
        let next = normal.try_normalize(MIN_NORMAL).unwrap_or(x) * sign;
        along.push([angle(x, next, z(k)), step.dot(&z(k))]);
        across.push([step.dot(&next), angle(z(k), z(k + 1), next)]);
        x = next;
    }
    along.push([0.0; 2]);
    across.push([0.0, end]);
    let first = if convention == Convention::Modified { 0 } else { 1 };
    let row = |k: usize| {
        let ([a, alpha], [theta, d]) = (across[k + first], along[k]);
        DhRow { kind: Some(axes[k].kind), a, alpha, theta, d, ..DhRow::default() }
    };
    (0..axes.len()).map(row).collect()
}
