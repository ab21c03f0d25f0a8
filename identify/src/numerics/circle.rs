//! The least-squares circle through points of a plane.
//!
//! `Σ (x² + y² − 2·a·x − 2·b·y − c)² → min` is linear in the centre `(a, b)` and in `c = ρ² − a² − b²`. It needs no
//! start value and has no local minima (Jiang 2014, Section 4.2). For points that scatter by σ about a circle of radius
//! ρ, the centre is that of the geometric least-squares circle of ISO 230-7 up to terms of σ²/ρ.
//!
//! Jiang (2014): X. Jiang, *Characterising Geometric Errors in Rotary Axes of 5-axis Machine Tools*, PhD thesis,
//! University of Birmingham.

use num_dual::DualNum;

/// A circle in the unit of its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle<D> {
    /// Its centre.
    pub centre: [D; 2],
    /// Its radius.
    pub radius: D,
}

/// The least-squares circle of `x² + y² − 2ax − 2by − c`; `None` for fewer than three points or collinear points.
pub fn through<D: DualNum<Primitive = f64> + Copy>(points: &[[D; 2]]) -> Option<Circle<D>> {
    if points.len() < 3 {
        return None;
    }
    let count = points.len() as f64;
    let zero = D::from(0.0);
    let mean = |k: usize| points.iter().fold(zero, |sum, p| sum + p[k]) / D::from(count);
    let (mx, my) = (mean(0), mean(1));
    let (mut sxx, mut sxy, mut syy, mut sxr, mut syr, mut sr) = (zero, zero, zero, zero, zero, zero);
    for p in points {
        let (x, y) = (p[0] - mx, p[1] - my);
        let r = x * x + y * y;
        sxx += x * x;
        sxy += x * y;
        syy += y * y;
        sxr += x * r;
        syr += y * r;
        sr += r;
    }
    let determinant = sxx * syy - sxy * sxy;
    let size = (sxx.re() + syy.re()).powi(2);
    // Below this limit the points are collinear within double precision.
    if determinant.re().is_nan() || determinant.re() <= 1e-14 * size {
        return None;
    }
    let half = D::from(0.5) / determinant;
    let a = (sxr * syy - syr * sxy) * half;
    let b = (syr * sxx - sxr * sxy) * half;
    let radius = (sr / D::from(count) + a * a + b * b).sqrt();
    Some(Circle { centre: [mx + a, my + b], radius })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_determines_the_circle() {
        let points: Vec<[f64; 2]> = (0..5)
            .map(|k| (0.3 * f64::from(k)).sin_cos())
            .map(|(sin, cos)| [3.0 + 2.0 * cos, -1.0 + 2.0 * sin])
            .collect();
        let circle = through(&points).unwrap();
        let misses = [circle.centre[0] - 3.0, circle.centre[1] + 1.0, circle.radius - 2.0];
        assert!(misses.iter().all(|miss| miss.abs() < 1e-12), "{misses:?}");
    }

    #[test]
    fn points_on_a_line_have_no_circle() {
        assert_eq!(through(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), None);
        assert_eq!(through(&[[0.0, 0.0], [1.0, 1.0]]), None);
        assert_eq!(through(&[[0.0; 2]; 8]), None);
    }
}
