//! The rotation and translation between two sets of points.

use faer::Mat;
use nalgebra::{Matrix3, Vector3};

use super::solve::Directions;

/// The rotation and translation that map `from` onto `to` with the least sum of squares (Kabsch, Acta Cryst. A32 (1976)
/// 922).
pub(crate) fn rigid_motion(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> (Matrix3<f64>, Vector3<f64>) {
    if from.is_empty() {
        return (Matrix3::identity(), Vector3::zeros());
    }
    let count = from.len() as f64;
    let centre_from = from.iter().sum::<Vector3<f64>>() / count;
    let centre_to = to.iter().sum::<Vector3<f64>>() / count;
    let covariance: Matrix3<f64> =
        from.iter().zip(to).map(|(a, b)| (b - centre_to) * (a - centre_from).transpose()).sum();
    let Ok(directions) = Directions::of(Mat::from_fn(3, 3, |i, j| covariance[(i, j)]).as_ref()) else {
        return (Matrix3::identity(), centre_to - centre_from);
    };
    let [u, v] = [directions.left(), directions.right()].map(|vectors| Matrix3::from_fn(|i, j| vectors[(i, j)]));
    // The sign on the smallest singular value makes the result a rotation, not a reflection.
    let mut signs = Matrix3::identity();
    signs[(2, 2)] = (u * v.transpose()).determinant().signum();
    let rotation = u * signs * v.transpose();
    (rotation, centre_to - rotation * centre_from)
}
