//! Tests the residual of independent poses for remaining structure: whether neighbouring poses deviate alike.
//!
//! Independent noise differs from pose to pose. What a model lacks is a function of the pose, so that neighbours have
//! similar residuals. Neighbours are the poses next to each other in joint space, or on the sky. In many dimensions the
//! nearest pose is far away, while an error of one joint depends on the angle of that joint alone. So the poses are also
//! sorted by each joint, and the residual is projected on what each error motion of that joint does to the readings:
//!
//! ```text
//! T = Σ z_i·z_n(i) / Σ z_i²       z: residual vector of a pose, or its projection;  n(i): the neighbour of pose i
//! ```
//!
//! The null distribution has the residuals with a random sign for each pose, less what the model explains of them: a fit
//! makes the residuals of neighbours opposite. Each T is referred to its mean and standard deviation, and the largest of all
//! decides. For the p-value these are of the null draws and the residual together: a reference that lacks the residual would
//! make it an outsider, and reject too often.

use abbe_identify::heldout::{coordinates, nearest_of};
use abbe_identify::numerics::parallel;
use abbe_identify::problem::Problem;
use abbe_model::axis::AxisKind;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::driver::Driver;
use abbe_model::effect::shape::Harmonic;
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::session::readings::Readings;
use faer::{Mat, MatRef};

use super::remainder::Structure;
use crate::candidates::columns::Columns;

/// Least number of poses for the test.
const MIN_POSES: usize = 20;
/// Maximum number of poses that look for their nearest pose, and that are sorted by a joint.
const MAX_POSES: usize = 4000;
/// Number of null draws that are projected together.
const DRAWS_AT_ONCE: usize = 32;

/// Tests the residual of a model, given by its orthonormal columns, for dependence between neighbouring poses. `None` if the
/// readings are not of independent poses, or of too few.
pub fn structure(
    problem: &Problem,
    columns: &Columns<'_>,
    model: MatRef<'_, f64>,
    residual: &[f64],
    mut null: impl Iterator<Item = Vec<f64>>,
) -> Option<Structure> {
    let poses = Poses::of(problem, columns);
    if poses.rows.len() < MIN_POSES {
        return None;
    }
    let statistics = poses.statistics(problem, columns);
    let found: Vec<f64> = statistics.iter().map(|one| one.correlation(residual)).collect();
    let mut drawn: Vec<Vec<f64>> = vec![Vec::new(); statistics.len()];
    loop {
        // The columns of the model are read once for many draws.
        let block: Vec<Vec<f64>> = null.by_ref().take(DRAWS_AT_ONCE).collect();
        if block.is_empty() {
            break;
        }
        let draws = Mat::from_fn(model.nrows(), block.len(), |i, j| block[j][i]);
        let remaining = &draws - model * (model.transpose() * &draws);
        for column in remaining.col_iter() {
            let remaining: Vec<f64> = column.iter().copied().collect();
            let correlations = parallel::map(statistics.len(), &|k| statistics[k].correlation(&remaining));
            drawn.iter_mut().zip(correlations).for_each(|(all, one)| all.push(one));
        }
    }
    let (place, p_value, excess) = judged(&found, drawn)?;
    Some(Structure {
        p_value,
        excess: excess.max(0.0),
        description: format!("{} (correlation {:.2})", statistics[place].description, found[place]),
    })
}

/// The statistic that deviates most from its null draws, its p-value among the largest deviations of all draws, and by how
/// many standard deviations of its own draws it exceeds their mean.
fn judged(found: &[f64], mut drawn: Vec<Vec<f64>>) -> Option<(usize, f64, f64)> {
    let draws = drawn.first().map_or(0, Vec::len);
    // The residual is the last of the values.
    drawn.iter_mut().zip(found).for_each(|(of_one, value)| of_one.push(*value));
    let references: Vec<(f64, f64)> = drawn.iter().map(|of_one| mean_and_deviation(of_one)).collect();
    let largest = |draw: usize| {
        let scores = drawn
            .iter()
            .zip(&references)
            .map(|(of_one, (mean, deviation))| (of_one[draw] - mean) / deviation.max(f64::MIN_POSITIVE));
        scores.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let (place, of_residual) = largest(draws)?;
    let above = (0..draws).filter(|draw| largest(*draw).is_some_and(|(_, score)| score >= of_residual)).count();
    let (mean, deviation) = mean_and_deviation(&drawn[place][..draws]);
    let excess = (found[place] - mean) / deviation.max(f64::MIN_POSITIVE);
    Some((place, (above + 1) as f64 / (draws + 1) as f64, excess))
}

fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (square / (count - 1.0).max(1.0)).sqrt())
}

/// The poses with accepted readings.
struct Poses {
    /// The whitened rows of each pose, with their test, reading and channel.
    rows: Vec<Vec<usize>>,
    /// Test and reading of the first row of each pose.
    first: Vec<(usize, usize)>,
}

/// Pairs of neighbouring poses, and a weight of each row of a pose.
struct Statistic {
    /// For each pose its whitened rows and their weights. Without weights the residual vectors are compared.
    rows: Vec<Vec<(usize, f64)>>,
    projected: bool,
    pairs: Vec<(usize, usize)>,
    description: String,
}

impl Statistic {
    /// The correlation of neighbours.
    fn correlation(&self, residual: &[f64]) -> f64 {
        let vectors = |(a, b): (usize, usize)| {
            let (a, b) = (self.rows[a].iter(), self.rows[b].iter());
            a.zip(b).map(|((a, _), (b, _))| residual[*a] * residual[*b]).sum::<f64>()
        };
        let (mut products, mut squares) = (0.0, 0.0);
        if self.projected {
            let value =
                |rows: &Vec<(usize, f64)>| rows.iter().map(|(row, weight)| weight * residual[*row]).sum::<f64>();
            let values: Vec<f64> = self.rows.iter().map(value).collect();
            for (a, b) in self.pairs.iter().map(|(a, b)| (values[*a], values[*b])) {
                products += a * b;
                squares += 0.5 * (a * a + b * b);
            }
        } else {
            let square = |rows: &Vec<(usize, f64)>| rows.iter().map(|(row, _)| residual[*row].powi(2)).sum::<f64>();
            let of_poses: Vec<f64> = self.rows.iter().map(square).collect();
            for &(a, b) in &self.pairs {
                products += vectors((a, b));
                squares += 0.5 * (of_poses[a] + of_poses[b]);
            }
        }
        if squares > 0.0 { products / squares } else { 0.0 }
    }
}

impl Poses {
    fn of(problem: &Problem, columns: &Columns<'_>) -> Poses {
        let pose_of_row = &problem.folds.pose_of_row;
        let mut poses = Poses { rows: Vec::new(), first: Vec::new() };
        if pose_of_row.is_empty() {
            return poses;
        }
        let mut places: Vec<Option<usize>> = Vec::new();
        let mut origins: Vec<_> = columns.origin_of_rows().into_iter().enumerate().collect();
        // The channels of one pose in the order of tests and channels.
        origins.sort_by_key(|(_, origin)| *origin);
        for (row, (test, reading, _)) in origins {
            let pose = pose_of_row[test][reading];
            places.resize(places.len().max(pose + 1), None);
            let place = *places[pose].get_or_insert_with(|| {
                poses.rows.push(Vec::new());
                poses.first.push((test, reading));
                poses.rows.len() - 1
            });
            poses.rows[place].push(row);
        }
        poses
    }

    /// The statistics: nearest poses, and neighbours by each rotary axis for each of its error motions.
    fn statistics(&self, problem: &Problem, columns: &Columns<'_>) -> Vec<Statistic> {
        let machine = &problem.session.machine;
        let plain = |rows: &Vec<usize>| rows.iter().map(|row| (*row, 1.0)).collect::<Vec<_>>();
        let mut statistics = vec![Statistic {
            rows: self.rows.iter().map(plain).collect(),
            projected: false,
            pairs: self.nearest(problem),
            description: "neighbouring poses deviate alike".to_string(),
        }];
        for (number, axis) in machine.axes.iter().enumerate().filter(|(_, axis)| axis.kind == AxisKind::Rotary) {
            let angle = |pose: usize| {
                let (test, reading) = self.first[pose];
                problem.tests[test].readings.as_ref().map_or(0.0, |r| r.positions[number][reading])
            };
            let mut order: Vec<usize> = (0..self.rows.len()).collect();
            order.sort_by(|a, b| angle(*a).total_cmp(&angle(*b)));
            if order.last().map(|last| angle(*last)) <= order.first().map(|first| angle(*first) + 1e-6) {
                continue;
            }
            let pairs: Vec<(usize, usize)> = order.windows(2).map(|pair| (pair[0], pair[1])).collect();
            for freedom in Freedom::ALL {
                let name = ErrorName { kind: ErrorKind::Motion, freedom, axis: axis.name.clone() };
                let driver = Driver::Axis(axis.name.clone());
                let effect = Effect::new(Component::Axis(name), driver, Shape::Harmonic(Harmonic { order: 1.0 }));
                let Some(sensitivity) = sensitivities(columns, &effect, &angle, self) else { continue };
                statistics.push(Statistic {
                    rows: (self.rows.iter().zip(sensitivity))
                        .map(|(rows, weights)| rows.iter().copied().zip(weights).collect())
                        .collect(),
                    projected: true,
                    pairs: pairs.clone(),
                    description: format!("{} follows the angle of {}", effect.component, axis.name),
                });
            }
        }
        statistics
    }

    /// Each pose and its nearest pose, in the coordinates of blocks of joint space.
    fn nearest(&self, problem: &Problem) -> Vec<(usize, usize)> {
        let readings: Vec<&Readings> = problem.tests.iter().filter_map(|test| test.readings.as_deref()).collect();
        let all = coordinates(&problem.session.machine, &readings);
        // The rows of all tests, one test after the other.
        let mut start = Vec::new();
        let mut next = 0;
        for test in &problem.tests {
            start.push(next);
            next += test.readings.as_ref().map_or(0, |r| r.rows());
        }
        let points: Vec<&Vec<f64>> = self.first.iter().map(|(test, reading)| &all[start[*test] + reading]).collect();
        let step = points.len().div_ceil(MAX_POSES);
        let asked: Vec<usize> = (0..points.len()).step_by(step).collect();
        parallel::map(asked.len(), &|k| {
            let own = asked[k];
            let is_comparable = |other: &usize| *other != own && self.rows[*other].len() == self.rows[own].len();
            let others = (0..points.len()).filter(is_comparable).map(|other| (other, points[other].as_slice()));
            nearest_of(points[own], others).map(|other| (own, other))
        })
        .into_iter()
        .flatten()
        .collect()
    }
}

/// For each pose the changes of its whitened rows by an error motion of one radian or millimetre, to unit length. `None` if
/// the readings do not depend on it.
fn sensitivities(
    columns: &Columns<'_>,
    effect: &Effect,
    angle: &dyn Fn(usize) -> f64,
    poses: &Poses,
) -> Option<Vec<Vec<f64>>> {
    let set = columns.effect_columns(effect)?;
    if set.count != 2 {
        return None;
    }
    // Of a harmonic of order 1 over the angle: s·cos q and s·sin q, with the sensitivity s.
    let mut values = Mat::<f64>::zeros(columns.rows(), 2);
    columns.fill(&[&set], values.as_mut());
    let mut largest = 0.0_f64;
    let of_poses: Vec<Vec<f64>> = (poses.rows.iter().enumerate())
        .map(|(pose, rows)| {
            let (sin, cos) = angle(pose).sin_cos();
            let own: Vec<f64> = rows.iter().map(|row| values[(*row, 0)] * cos + values[(*row, 1)] * sin).collect();
            let length = own.iter().map(|s| s * s).sum::<f64>().sqrt();
            largest = largest.max(length);
            own
        })
        .collect();
    if largest <= 0.0 {
        return None;
    }
    Some(of_poses.into_iter().map(|own| own.into_iter().map(|s| s / largest).collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 19 draws none deviates as the second statistic does: p = 1/20, the least that 19 draws give. Its draws have mean 2
    /// and standard deviation 1, so that 5 exceeds them by 3.
    #[test]
    fn the_statistic_that_deviates_most_is_judged_by_all_draws() {
        let draw = |k: usize| [1.0, -1.0][k % 2] * f64::from(u8::from(k < 18));
        let none: Vec<f64> = (0..19).map(|k| 10.0 + 4.0 * draw(k)).collect();
        let shifted: Vec<f64> = (0..19).map(|k| 2.0 + draw(k)).collect();
        let (place, p_value, excess) = judged(&[12.0, 5.0], vec![none.clone(), shifted.clone()]).unwrap();
        assert_eq!((place, p_value), (1, 0.05));
        assert!((excess - 3.0).abs() < 1e-12, "{excess}");
        // A residual like its draws: every draw with one standard deviation on either side is at least as extreme.
        let (_, p_value, excess) = judged(&[10.0, 2.0], vec![none, shifted]).unwrap();
        assert!(p_value > 0.4 && excess.abs() < 0.1, "{p_value}, {excess}");
        assert!(judged(&[], Vec::new()).is_none());
    }
}
