//! Noise from several targets that one instrument sees at the same pose.
//!
//! Targets on one rigid body keep their distances wherever the machine carries them and wherever the instrument stands. What
//! the distances deviate from their means over the poses is therefore noise alone: the part of the readings that the pose
//! cannot explain. K targets have 3K coordinates and a pose explains 6 of them, so three targets leave 3.
//!
//! ```text
//! δ_p = d_p − mean of d         d: distances of all pairs of targets at a pose p
//! cov(δ) = σ² G (1 − 1/P)       G = A Aᵀ, A the derivative of the distances by the coordinates, ± the unit vectors
//! σ² = Σ_p δ_pᵀ G⁺ δ_p / ν      ν = rank(G) · (P − 1)
//! ```
//!
//! G contains angles between pairs, which are the same at every pose. More than four targets have more distances than
//! degrees of freedom; the pseudo-inverse and the rank of G count them once.

use std::collections::BTreeMap;

use abbe_model::instrument::SharedBy;
use abbe_model::session::Test;
use faer::Mat;
use nalgebra::Vector3;

use super::RepeatKeys;
use crate::numerics::symmetric::Symmetric;

/// Eigenvalue of G relative to the largest one below which a combination of distances is redundant.
const REDUNDANT: f64 = 1e-6;
/// Least distance of two targets, mm: that of closer ones is not linear in noise.
const MIN_APART_MM: f64 = 1.0;
/// Least degrees of freedom of an estimate.
const MIN_FREEDOM: usize = 10;

/// Standard deviation of one coordinate, mm, and its degrees of freedom, from tests that have one target each, of
/// instruments that read three coordinates. `None` with fewer than ten degrees of freedom. `kept(test, row)` is false for
/// outliers.
pub(super) fn noise_of_targets(tests: &[Test], kept: impl Fn(usize, usize) -> bool) -> Option<(f64, usize)> {
    let (mut sum, mut freedom) = (0.0, 0);
    for poses in seen(tests, kept) {
        let (of_group, of_freedom) = deviations(&poses);
        sum += of_group;
        freedom += of_freedom;
    }
    (freedom >= MIN_FREEDOM).then(|| ((sum / freedom as f64).sqrt(), freedom))
}

/// What a test reads at a pose, and how often it was there before.
type Visit = (String, Vec<i64>, usize);

/// The poses at which the same targets were seen, by these targets: for each pose the measured position of each target.
fn seen(tests: &[Test], kept: impl Fn(usize, usize) -> bool) -> Vec<Vec<Vec<Vector3<f64>>>> {
    let mut visits: BTreeMap<Visit, Vec<(usize, Vector3<f64>)>> = BTreeMap::new();
    for (number, test) in tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let channels = test.station.channels();
        if channels.len() != 3 || channels.iter().any(|channel| channel.is_angle()) {
            continue;
        }
        let keys = RepeatKeys::between_tests(readings);
        let mut times: BTreeMap<&[i64], usize> = BTreeMap::new();
        for (row, values) in readings.observed.chunks_exact(channels.len()).enumerate() {
            let Some(seen) = test.station.measured_mm(values) else { break };
            let time = times.entry(keys.of_row(row)).or_default();
            if kept(number, row) && seen.iter().all(|value| value.is_finite()) {
                let frame = test.group(SharedBy::Setup).to_string();
                visits.entry((frame, keys.of_row(row).to_vec(), *time)).or_default().push((number, seen));
            }
            *time += 1;
        }
    }
    let mut groups: BTreeMap<(String, Vec<usize>), Vec<Vec<Vector3<f64>>>> = BTreeMap::new();
    for ((frame, ..), targets) in visits {
        let (numbers, places): (Vec<usize>, Vec<Vector3<f64>>) = targets.into_iter().unzip();
        groups.entry((frame, numbers)).or_default().push(places);
    }
    groups.into_values().collect()
}

/// The sum of squares of the deviations of the distances over σ², and its degrees of freedom.
fn deviations(poses: &[Vec<Vector3<f64>>]) -> (f64, usize) {
    let Some(first) = poses.first().filter(|first| poses.len() > 1 && first.len() > 1) else { return (0.0, 0) };
    let count = first.len();
    let pairs: Vec<(usize, usize)> = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j))).collect();
    let distances: Vec<Vec<f64>> =
        poses.iter().map(|pose| pairs.iter().map(|(i, j)| (pose[*i] - pose[*j]).norm()).collect()).collect();
    let mean = |k: usize| distances.iter().map(|of_pose| of_pose[k]).sum::<f64>() / poses.len() as f64;
    let means: Vec<f64> = (0..pairs.len()).map(mean).collect();
    if means.iter().any(|distance| *distance < MIN_APART_MM) {
        return (0.0, 0);
    }
    let units: Vec<Vector3<f64>> = pairs.iter().map(|(i, j)| (first[*i] - first[*j]).normalize()).collect();
    // The derivative by the coordinates of a target is the unit vector at one end, and its opposite at the other.
    let share = |(i, j): (usize, usize), target: usize| f64::from(i == target) - f64::from(j == target);
    let covariance = Mat::from_fn(pairs.len(), pairs.len(), |a, b| {
        let common: f64 = (0..count).map(|target| share(pairs[a], target) * share(pairs[b], target)).sum();
        common * units[a].dot(&units[b])
    });
    let Ok(Symmetric { values, vectors }) = Symmetric::of(covariance.as_ref()) else { return (0.0, 0) };
    let largest = values.iter().copied().fold(0.0, f64::max);
    let (mut sum, mut rank) = (0.0, 0);
    for (k, value) in values.iter().enumerate().filter(|(_, value)| **value > REDUNDANT * largest) {
        rank += 1;
        for of_pose in &distances {
            let along: f64 = (0..pairs.len()).map(|pair| vectors[(pair, k)] * (of_pose[pair] - means[pair])).sum();
            sum += along * along / value;
        }
    }
    (sum, rank * (poses.len() - 1))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Unit};
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    use super::*;

    /// White noise of 20 µm on targets that a rigid body carries to random poses. The sum of squares follows χ² with
    /// 3K − 6 degrees of freedom for each pose but one (1 for two targets): its mean and its scatter over 400 sets.
    #[test]
    fn targets_on_a_rigid_body_give_their_noise_at_any_pose() {
        const SIGMA_MM: f64 = 0.02;
        const SETS: usize = 400;
        let body = [[0.0, 0.0, 0.0], [80.0, 0.0, 5.0], [20.0, 90.0, -10.0], [-40.0, 30.0, 70.0], [55.0, 60.0, 40.0]];
        let mut generator = Pcg64::seed_from_u64(7);
        for (targets, of_pose) in [(2_usize, 1_usize), (3, 3), (4, 6), (5, 9)] {
            const POSES: usize = 12;
            let (mut sum, mut squares, mut inside) = (0.0, 0.0, 0);
            for _ in 0..SETS {
                let mut normal = || -> f64 { generator.sample(StandardNormal) };
                let poses: Vec<Vec<Vector3<f64>>> = (0..POSES)
                    .map(|_| {
                        let about = Unit::new_normalize(Vector3::new(normal(), normal(), normal()));
                        let turn = Rotation3::from_axis_angle(&about, 3.0 * normal());
                        let away = 500.0 * Vector3::new(normal(), normal(), normal());
                        let place = |target: &[f64; 3]| turn * Vector3::from(*target) + away;
                        body[..targets]
                            .iter()
                            .map(|target| place(target) + SIGMA_MM * Vector3::new(normal(), normal(), normal()))
                            .collect()
                    })
                    .collect();
                let (found, freedom) = deviations(&poses);
                assert_eq!(freedom, of_pose * (POSES - 1), "{targets} targets");
                let ratio = found / SIGMA_MM.powi(2);
                sum += ratio;
                squares += ratio * ratio;
                let [below, above] = crate::numerics::tails::chi_square_tails(ratio, freedom as f64).unwrap();
                inside += usize::from(below.min(above) > 0.025);
            }
            let (count, freedom) = (SETS as f64, (of_pose * (POSES - 1)) as f64);
            let mean = sum / count;
            let scatter = squares / count - mean * mean;
            println!(
                "{targets} targets, {freedom} degrees of freedom: mean of \u{3c7}\u{b2} {mean:.2}, variance {scatter:.1} of {}; \
                 {inside} of {SETS} within 95 %",
                2.0 * freedom
            );
            assert!((mean - freedom).abs() < 4.0 * (2.0 * freedom / count).sqrt(), "{targets} targets: {mean}");
            assert!((scatter / (2.0 * freedom) - 1.0).abs() < 0.4, "{targets} targets: {scatter}");
            assert!((360..=396).contains(&inside), "{targets} targets: {inside}");
        }
    }
}
