//! The Sobol' sequence: points that fill a cube evenly (I. M. Sobol', USSR Comput. Math. Math. Phys. 7 (1967) 86).
//!
//! Direction numbers of Joe & Kuo, SIAM J. Sci. Comput. 30 (2008) 2635, in the order of the Gray code. A random digital
//! shift keeps the evenness and moves all points off the faces of the cube.

use abbe_model::Diagnostic;

use crate::error::too_many;

/// Maximum number of dimensions.
pub const MAX_DIMENSIONS: usize = 128;
const BITS: usize = 32;
const NUMBERS: &str = include_str!("direction-numbers.txt");

/// The first `count` points in `dimensions` dimensions, each coordinate between 0 and 1. `shift` is the digital shift
/// of each dimension; absent ones are zero.
///
/// # Errors
/// If there are more than [`MAX_DIMENSIONS`].
pub fn points(dimensions: usize, count: usize, shift: &[u32]) -> Result<Vec<Vec<f64>>, Diagnostic> {
    if dimensions > MAX_DIMENSIONS {
        return Err(too_many(
            format!("{} varied inputs need {dimensions} dimensions of the Sobol' sequence", dimensions / 2),
            MAX_DIMENSIONS,
            "state fewer priors, or analyse fewer tests",
        ));
    }
    let lines: Vec<&str> = NUMBERS.lines().filter(|line| !line.starts_with('#')).collect();
    let directions: Vec<[u32; BITS]> =
        (0..dimensions).map(|k| if k == 0 { first() } else { of_line(lines[k - 1]) }).collect();
    let mut state: Vec<u32> = (0..dimensions).map(|k| shift.get(k).copied().unwrap_or(0)).collect();
    let mut points = Vec::with_capacity(count);
    for number in 0..count {
        // The centre of the cell, so that no coordinate is 0.
        points.push(state.iter().map(|bits| (f64::from(*bits) + 0.5) / 2.0_f64.powi(BITS as i32)).collect());
        let lowest_zero = (number + 1).trailing_zeros() as usize;
        state.iter_mut().zip(&directions).for_each(|(bits, numbers)| *bits ^= numbers[lowest_zero.min(BITS - 1)]);
    }
    Ok(points)
}

fn first() -> [u32; BITS] {
    std::array::from_fn(|k| 1 << (BITS - 1 - k))
}

/// Direction numbers from a polynomial `x^s + a_1 x^(s-1) + … + 1` and the first `s` of them.
fn of_line(line: &str) -> [u32; BITS] {
    let numbers: Vec<u32> = line.split(' ').filter_map(|number| number.parse().ok()).collect();
    let (polynomial, initial) = (numbers[0], &numbers[1..]);
    let degree = initial.len();
    let mut directions = [0_u32; BITS];
    for k in 0..BITS {
        directions[k] = if k < degree {
            initial[k] << (BITS - 1 - k)
        } else {
            let mut value = directions[k - degree] ^ (directions[k - degree] >> degree);
            for j in 1..degree {
                if polynomial >> (degree - j) & 1 == 1 {
                    value ^= directions[k - j];
                }
            }
            value
        };
    }
    directions
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points 1, 5 and 7 of `scipy.stats.qmc.Sobol(128, scramble=False)` in six dimensions.
    #[test]
    fn points_are_those_of_scipy() {
        let found = points(128, 8, &[]).unwrap();
        let expected = [
            (1, [0.5; 6]),
            (5, [0.875, 0.875, 0.125, 0.375, 0.375, 0.125]),
            (7, [0.125, 0.625, 0.375, 0.125, 0.625, 0.375]),
        ];
        for (number, wanted) in expected {
            let of = |k: usize| found[number][k] - 0.5 / 2.0_f64.powi(32);
            assert_eq!([0, 1, 2, 3, 10, 127].map(of), wanted, "point {number}");
        }
    }

    /// Every interval of a 2^m-th part of each dimension has one of the first 2^m points, with any shift.
    #[test]
    fn every_projection_is_even() {
        let shift: Vec<u32> = (0..128_u32).map(|k| k.wrapping_mul(0x9E37_79B9)).collect();
        let found = points(128, 256, &shift).unwrap();
        for dimension in 0..128 {
            let mut cells: Vec<usize> = found.iter().map(|point| (point[dimension] * 256.0) as usize).collect();
            cells.sort_unstable();
            assert_eq!(cells, (0..256).collect::<Vec<_>>(), "dimension {dimension}");
        }
        assert!(points(129, 1, &[]).is_err());
    }
}
