//! Where an instrument stands that reads in a frame of its own: a tracker, a camera system.
//!
//! `m = B · E · P`: `P` is a point in R, `E` a small motion (the six parameters of the pose) and `B` a fixed rigid motion.
//! `B` keeps the estimated angles small for any orientation of the instrument.

use nalgebra::{Matrix3, Vector3};

use super::point;
use super::set_up::Written;
use crate::frames::{Point, Rotation, SmallMotion, dot_nominal};
use crate::median::median;
use crate::scalar::{Nominal, Scalar};

/// A point is a gross error if it is this many times the median farther from where it would be, and by so many mm.
const GROSS: f64 = 10.0;
const MIN_GROSS_MM: f64 = 1.0;
/// Points that are left at least.
const MIN_POINTS: usize = 3;
/// Points are on a line if the second singular value of their products is this share of the first.
const ON_A_LINE: f64 = 1e-9;
/// Share with which a rotation about such a line stays as it is.
const AS_IT_IS: f64 = 1e-6;

/// The small motion given by the first six parameters, if one of them is included.
pub(super) fn pose_error<S: Scalar>(unknown: &impl Fn(usize) -> Option<S>) -> Option<SmallMotion<S>> {
    let carried = (0..6).any(|i| unknown(i).is_some());
    carried.then(|| {
        let six = std::array::from_fn(|i| unknown(i).unwrap_or_else(|| S::constant(0.0)));
        SmallMotion::new(six, Rotation::Exact)
    })
}

/// The rigid motion `B` from R to the frame of an instrument.
#[derive(Clone, Debug, PartialEq)]
pub struct Stand<N> {
    /// The rotation, row by row.
    pub rotation: [[N; 3]; 3],
    /// R's origin in the instrument's frame, mm.
    pub origin: [N; 3],
}

impl Stand<Written> {
    /// Upright at the origin of R.
    pub(super) fn at_origin() -> Stand<Written> {
        let rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Stand { rotation: rotation.map(|row| row.map(Written::number)), origin: [0.0; 3].map(Written::number) }
    }
}

impl<N> Stand<N> {
    /// Converts every coordinate.
    pub(super) fn map<M>(&self, to: &impl Fn(&N) -> M) -> Stand<M> {
        Stand { rotation: self.rotation.each_ref().map(|row| point(row, to)), origin: point(&self.origin, to) }
    }
}

impl<N: Nominal> Stand<N> {
    /// A point of R in the instrument's frame.
    pub(super) fn point<S: Scalar<Nominal = N>>(&self, of_r: Point<S>) -> Point<S> {
        self.direction(of_r).shifted(self.origin)
    }

    /// A direction of R in the instrument's frame.
    pub(super) fn direction<S: Scalar<Nominal = N>>(&self, of_r: Point<S>) -> Point<S> {
        Point(self.rotation.map(|row| dot_nominal(of_r, row)))
    }
}

impl Stand<f64> {
    /// With this rotation, and the origin that maps the mean of points of R onto that of the same points as measured.
    pub(super) fn through(rotation: Matrix3<f64>, pairs: &[[Vector3<f64>; 2]]) -> Stand<f64> {
        let [of_r, measured] = means(pairs);
        let origin = measured - rotation * of_r;
        let rotation = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)]));
        Stand { rotation, origin: [origin.x, origin.y, origin.z] }
    }

    /// With the rotation and the origin that map points of R onto the same points as measured with the least sum of squares,
    /// without the gross errors: one point behind the instrument would turn it by degrees. Points on a line leave the
    /// rotation about it open, which stays as it is.
    pub(super) fn best(&self, pairs: &[[Vector3<f64>; 2]]) -> Stand<f64> {
        let through = |kept: &[_]| Stand::through(best_rotation(covariance(kept).0, &self.matrix()), kept);
        let mut kept = pairs.to_vec();
        loop {
            let stand = through(&kept);
            let apart = |[of_r, measured]: &[Vector3<f64>; 2]| {
                (stand.matrix() * of_r + Vector3::from(stand.origin) - measured).norm()
            };
            let limit = (GROSS * median(&mut pairs.iter().map(apart).collect::<Vec<_>>())).max(MIN_GROSS_MM);
            let within: Vec<_> = pairs.iter().filter(|pair| apart(pair) <= limit).copied().collect();
            if within.len() == kept.len() || within.len() < MIN_POINTS {
                return stand;
            }
            // Fewer in every round, or more for good: it ends.
            let is_less = within.len() < kept.len();
            kept = within;
            if !is_less {
                return through(&kept);
            }
        }
    }

    /// Where the instrument stands in R, mm.
    pub(super) fn place_mm(&self) -> [f64; 3] {
        let [x, y, z]: [f64; 3] = (self.matrix().transpose() * Vector3::from(self.origin)).into();
        [-x, -y, -z]
    }

    /// The rotation as a matrix.
    pub(super) fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.rotation[i][j])
    }
}

/// The means of points of R and of the same points as measured.
fn means(pairs: &[[Vector3<f64>; 2]]) -> [Vector3<f64>; 2] {
    let count = pairs.len().max(1) as f64;
    [0, 1].map(|side| pairs.iter().map(|pair| pair[side]).sum::<Vector3<f64>>() / count)
}

/// Sum of the products of the measured points and the points of R, each less its mean, and of the squares of the
/// latter, mm².
pub(super) fn covariance(pairs: &[[Vector3<f64>; 2]]) -> (Matrix3<f64>, f64) {
    let [of_r, measured] = means(pairs);
    let product = |[a, b]: &[Vector3<f64>; 2]| (b - measured) * (a - of_r).transpose();
    (pairs.iter().map(product).sum(), pairs.iter().map(|[a, _]| (a - of_r).norm_squared()).sum())
}

/// The rotation that maps vectors onto others with the least sum of squares, from the sum of their products `b · aᵀ`
/// (Kabsch, Acta Cryst. A32 (1976) 922). Of equal ones, that nearest to `present`.
pub(super) fn best_rotation(covariance: Matrix3<f64>, present: &Matrix3<f64>) -> Matrix3<f64> {
    let mut svd = covariance.svd(true, true);
    let [first, second, _] = svd.singular_values.as_slice() else { return *present };
    if *second <= ON_A_LINE * first {
        let share = if *first > 0.0 { AS_IT_IS * first } else { 1.0 };
        svd = (covariance + present * share).svd(true, true);
    }
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return *present;
    };
    // The sign on the smallest singular value makes the result a rotation, not a reflection.
    let mut signs = Matrix3::identity();
    let least = svd.singular_values.imin();
    signs[(least, least)] = (u * v_t).determinant().signum();
    u * signs * v_t
}
