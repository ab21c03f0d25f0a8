//! Blocks of joint space: k-means of the axis positions of poses.
//!
//! Poses of a dense grid have neighbours in every direction. A model that holds out single poses only interpolates
//! between them. A model that holds out a block of joint space has to predict a region that it never saw.
//!
//! The coordinates of a pose are `cos q` and `sin q` of each rotary axis, and `2 (q − q_mid)/range` of each linear
//! axis. Lloyd's algorithm (S. P. Lloyd, Least squares quantization in PCM, IEEE Trans. Inf. Theory 28, 1982, 129–137)
//! minimises the sum of squared distances to the centres. Its start is k-means++ (D. Arthur, S. Vassilvitskii,
//! k-means++: the advantages of careful seeding, SODA 2007, 1027–1035). Of several seeded starts the best result holds.

use std::collections::HashMap;

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::session::readings::Readings;
use rand::seq::index;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Largest number of blocks.
const BLOCKS: usize = 10;
/// Least mean number of poses per block.
const POSES_PER_BLOCK: usize = 3;
/// Number of starts.
const STARTS: usize = 4;
/// Maximum number of iterations of a start.
const MAX_ITERATIONS: usize = 100;
/// Maximum number of poses from which the centres follow. Further poses only join the nearest centre.
const MAX_SAMPLE: usize = 4000;
/// Coordinates after which a distance is compared with the least one so far.
const COORDINATES_AT_ONCE: usize = 4;

/// The block of each pose, over all tests, numbered in the order of the poses. `None` if there are too few poses, or if
/// all have the same axis positions.
pub(super) fn blocks(machine: &Machine, readings: &[&Readings], seed: u64) -> Option<Vec<usize>> {
    let points = coordinates(machine, readings);
    let distinct = poses(readings).into_iter().max().map_or(0, |last| last + 1);
    let count = BLOCKS.min(distinct / POSES_PER_BLOCK);
    if count < 2 {
        return None;
    }
    let mut random = Pcg64::seed_from_u64(seed);
    let sample: Vec<&Point> = if points.len() <= MAX_SAMPLE {
        points.iter().collect()
    } else {
        let mut chosen = index::sample(&mut random, points.len(), MAX_SAMPLE).into_vec();
        chosen.sort_unstable();
        chosen.into_iter().map(|k| &points[k]).collect()
    };
    let mut best: Option<(f64, Vec<Point>)> = None;
    for _ in 0..STARTS {
        let found = lloyd(&sample, plus_plus(&sample, count, &mut random));
        if best.as_ref().is_none_or(|(least, _)| found.0 < *least) {
            best = Some(found);
        }
    }
    let (_, centres) = best?;
    let blocks = numbered(points.iter().map(|point| nearest(point, &centres).0));
    blocks.contains(&1).then_some(blocks)
}

/// The coordinates of a pose.
pub(crate) type Point = Vec<f64>;

/// The pose of each row, over all tests, numbered in the order of their first rows: rows at the same axis positions are one
/// pose.
pub(super) fn poses(readings: &[&Readings]) -> Vec<usize> {
    /// Steps per millimetre or radian below which positions are the same.
    const STEPS: f64 = 1e7;
    let mut numbers: HashMap<Vec<i64>, usize> = HashMap::new();
    let key = |r: &Readings, row: usize| r.positions.iter().map(|axis| (axis[row] * STEPS).round() as i64).collect();
    let mut of_row = Vec::new();
    for r in readings {
        for row in 0..r.rows() {
            let next = numbers.len();
            of_row.push(*numbers.entry(key(r, row)).or_insert(next));
        }
    }
    of_row
}

/// The place of every row in joint space, over all tests: for each linear axis that moves its position, from −1 to 1 over the
/// readings, for each rotary axis its cosine and sine.
pub fn coordinates(machine: &Machine, readings: &[&Readings]) -> Vec<Point> {
    let mut points = vec![Point::new(); readings.iter().map(|r| r.rows()).sum()];
    for (number, axis) in machine.axes.iter().enumerate() {
        let positions = || readings.iter().flat_map(move |r| r.positions[number].iter().copied());
        let least = positions().fold(f64::INFINITY, f64::min);
        let most = positions().fold(f64::NEG_INFINITY, f64::max);
        for (point, position) in points.iter_mut().zip(positions()) {
            match axis.kind {
                AxisKind::Rotary => point.extend([position.cos(), position.sin()]),
                AxisKind::Linear if most > least => point.push((2.0 * position - least - most) / (most - least)),
                AxisKind::Linear => {}
            }
        }
    }
    points
}

/// The square of the distance of two points of joint space, in the units of [`coordinates`].
fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// The place of the point of some others that is nearest to a point; the first of equally near ones.
pub fn nearest_of<'p>(point: &[f64], others: impl Iterator<Item = (usize, &'p [f64])>) -> Option<usize> {
    let mut nearest = (None, f64::INFINITY);
    for (place, other) in others {
        // Most points are further away already by the first coordinates.
        let mut distance = 0.0;
        let may_be_nearer = point.chunks(COORDINATES_AT_ONCE).zip(other.chunks(COORDINATES_AT_ONCE)).all(|(a, b)| {
            distance = a.iter().zip(b).fold(distance, |sum, (a, b)| sum + (a - b).powi(2));
            distance < nearest.1
        });
        if may_be_nearer && distance < nearest.1 {
            nearest = (Some(place), distance);
        }
    }
    nearest.0
}

/// The index of the nearest centre, and the squared distance to it.
fn nearest(point: &[f64], centres: &[Point]) -> (usize, f64) {
    let distances = centres.iter().map(|centre| squared_distance(point, centre)).enumerate();
    distances.fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best })
}

/// Start centres: each is drawn with a probability proportional to the squared distance to the nearest centre so far.
fn plus_plus(points: &[&Point], count: usize, random: &mut Pcg64) -> Vec<Point> {
    let mut centres = vec![points[random.random_range(0..points.len())].clone()];
    let mut distances = vec![f64::INFINITY; points.len()];
    while centres.len() < count {
        if let Some(last) = centres.last() {
            for (distance, point) in distances.iter_mut().zip(points) {
                *distance = distance.min(squared_distance(point, last));
            }
        }
        let total: f64 = distances.iter().sum();
        if total <= 0.0 {
            break;
        }
        let mut rest = random.random_range(0.0..total);
        let passed = distances.iter().position(|distance| {
            rest -= distance;
            rest < 0.0
        });
        let farthest = || (0..points.len()).max_by(|a, b| distances[*a].total_cmp(&distances[*b])).unwrap_or(0);
        centres.push(points[passed.unwrap_or_else(farthest)].clone());
    }
    centres
}

/// Moves the centres to the means of their points until no point changes its centre. Returns the sum of squared
/// distances and the centres.
fn lloyd(points: &[&Point], mut centres: Vec<Point>) -> (f64, Vec<Point>) {
    let mut of_point = Vec::new();
    let mut sum = 0.0;
    for _ in 0..MAX_ITERATIONS {
        let found: Vec<(usize, f64)> = points.iter().map(|point| nearest(point, &centres)).collect();
        sum = found.iter().map(|(_, distance)| distance).sum();
        let next: Vec<usize> = found.into_iter().map(|(centre, _)| centre).collect();
        if next == of_point {
            break;
        }
        of_point = next;
        for (number, centre) in centres.iter_mut().enumerate() {
            let own = || points.iter().zip(&of_point).filter(|(_, k)| **k == number).map(|(point, _)| point);
            // A centre without points remains where it is.
            let count = own().count();
            if count > 0 {
                for (k, coordinate) in centre.iter_mut().enumerate() {
                    *coordinate = own().map(|point| point[k]).sum::<f64>() / count as f64;
                }
            }
        }
    }
    (sum, centres)
}

/// Numbers the blocks in the order of their first pose. Centres without poses have no number.
fn numbered(blocks: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut numbers: Vec<usize> = Vec::new();
    let number = |block: usize| match numbers.iter().position(|known| *known == block) {
        Some(number) => number,
        None => {
            numbers.push(block);
            numbers.len() - 1
        }
    };
    blocks.map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rotary axis counts as a point of the unit circle, a linear axis from -1 to 1 over the range of its positions.
    #[test]
    fn axes_of_both_kinds_have_coordinates_of_one_size() {
        let machine = Machine::from_code("w C b X t").unwrap();
        let [x, c] = ["X", "C"].map(|name| machine.axis_index(name).unwrap());
        let mut positions = vec![Vec::new(); 2];
        positions[x] = vec![10.0, 15.0, 30.0];
        positions[c] = vec![0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::PI];
        let readings = Readings { positions, ..Readings::default() };
        let found = coordinates(&machine, &[&readings]);
        for (point, (along, turn)) in found.iter().zip([(-1.0, [1.0, 0.0]), (-0.5, [0.0, 1.0]), (1.0, [-1.0, 0.0])]) {
            let expected = if x < c { vec![along, turn[0], turn[1]] } else { vec![turn[0], turn[1], along] };
            assert!(point.len() == 3 && point.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12), "{point:?}");
        }
        assert_eq!(found.len(), 3);
    }

    /// Three groups of points far from each other: k-means finds them from any start, and each start ends at the same
    /// sum of squares, which follows from the offsets within the groups.
    #[test]
    fn separate_groups_are_found() {
        let offsets = [[0.0, 0.1], [0.1, 0.0], [0.0, -0.1], [-0.1, 0.0]];
        let groups = [[0.0, 0.0], [5.0, 0.0], [0.0, 7.0]];
        let points: Vec<Point> =
            (offsets.iter()).flat_map(|by| groups.iter().map(|at| vec![at[0] + by[0], at[1] + by[1]])).collect();
        let points: Vec<&Point> = points.iter().collect();
        for seed in 0..8 {
            let mut random = Pcg64::seed_from_u64(seed);
            let (sum, centres) = lloyd(&points, plus_plus(&points, 3, &mut random));
            assert!((sum - 12.0 * 0.01).abs() < 1e-12, "{sum}");
            let blocks = numbered(points.iter().map(|point| nearest(point, &centres).0));
            assert_eq!(blocks, [0, 1, 2].repeat(4));
        }
    }

    /// Two tests that hold the same three poses, as two targets on one flange do, have three poses.
    #[test]
    fn rows_of_two_targets_at_the_same_positions_are_one_pose() {
        let axis = |q: [f64; 3]| Readings { positions: vec![q.to_vec()], ..Readings::default() };
        let (first, second) = (axis([0.1, 0.2, 0.3]), axis([0.3, 0.1, 0.2]));
        assert_eq!(poses(&[&first, &second]), [0, 1, 2, 2, 0, 1]);
    }

    /// Of points in nine coordinates the nearest is the one with the least of all distances; of two equally near ones the first.
    #[test]
    fn the_nearest_point_has_the_least_distance() {
        let mut random = Pcg64::seed_from_u64(3);
        let points: Vec<Point> = (0..200).map(|_| (0..9).map(|_| random.random_range(-1.0..1.0)).collect()).collect();
        for (k, point) in points.iter().enumerate() {
            let others = || (0..points.len()).filter(|other| *other != k);
            let expected = others().map(|other| (squared_distance(point, &points[other]), other));
            let expected = expected.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, other)| other);
            assert_eq!(nearest_of(point, others().map(|other| (other, points[other].as_slice()))), expected);
        }
        let twice = [(7, &points[0][..]), (4, &points[1][..]), (2, &points[1][..])];
        assert_eq!(nearest_of(&points[1], twice.into_iter()), Some(4));
        assert_eq!(nearest_of(&points[1], std::iter::empty()), None);
        // Of an axis that does not move there is no coordinate.
        assert_eq!(nearest_of(&[], [(3, &[][..]), (5, &[][..])].into_iter()), Some(3));
    }

    #[test]
    fn points_at_one_place_have_one_centre() {
        let point = vec![0.3, 0.4];
        let points = vec![&point; 9];
        let centres = plus_plus(&points, 3, &mut Pcg64::seed_from_u64(1));
        assert_eq!(centres.len(), 1);
    }

    /// Blocks have three poses each: six poses have two blocks, five none.
    #[test]
    fn two_blocks_need_six_poses() {
        let machine = Machine::from_code("w C b X t").unwrap();
        for (count, wanted) in [(5, None), (6, Some(2)), (8, Some(2)), (9, Some(3))] {
            let along = |k: usize| (k * k) as f64;
            let positions = vec![(0..count).map(along).collect(); 2];
            let readings = Readings { positions, ..Readings::default() };
            let found = blocks(&machine, &[&readings], 1).map(|blocks| blocks.into_iter().max().unwrap_or(0) + 1);
            assert_eq!(found, wanted, "{count} poses");
        }
    }
}
