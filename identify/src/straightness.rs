//! Straightness figures of ISO 230-1:2012 of tests in which one linear axis moves and a laser reads across it.
//!
//! At every position the deviation is the mean over all runs. A reference line is subtracted: the line of least squares, or
//! the line through the first and the last position. The straightness error is the range of what is left.

use abbe_model::session::{Session, Test};
use schemars::JsonSchema;
use serde::Serialize;

use crate::figure::{Figure, STRAIGHTNESS};
use crate::numerics::range;
use crate::positioning::{self, Position};

/// Straightness of an axis in one direction across it (ISO 230-1).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StraightnessTest {
    /// The test.
    pub test: String,
    /// The axis.
    pub axis: String,
    /// The channel: `horizontal`, `vertical`.
    pub channel: String,
    /// The positions, ascending.
    pub positions: Vec<StraightnessPosition>,
    /// The straightness error about either line.
    pub figures: Vec<Figure>,
}

/// The straightness deviation at one position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StraightnessPosition {
    /// The commanded position, mm.
    pub at_mm: f64,
    /// Mean of the readings, µm.
    pub mean_um: f64,
    /// The same less the line of least squares, µm.
    pub least_squares_um: f64,
    /// The same less the line through the end points, µm.
    pub end_points_um: f64,
}

/// The figures of every test with readings in which one linear axis moves, for each direction that is read across it.
pub fn of_session(session: &Session, left_out: &[Vec<bool>]) -> Vec<StraightnessTest> {
    let measured = session.tests.iter().filter(|test| test.readings.is_some());
    measured.zip(left_out).flat_map(|(test, left_out)| of_test(session, test, left_out)).collect()
}

fn of_test(session: &Session, test: &Test, left_out: &[bool]) -> Vec<StraightnessTest> {
    let machine = &session.machine;
    if !(0..test.station.channels().len()).any(|place| test.station.is_straightness(place)) {
        return Vec::new();
    }
    let Some((axis, readings)) = positioning::moved_axis(machine, test).zip(test.readings.as_ref()) else {
        return Vec::new();
    };
    let kind = machine.axes[axis].kind;
    let places = positioning::along_axis(readings, axis, kind);
    let channels = test.station.channels().iter().enumerate();
    let across = channels.filter(|(place, _)| test.station.is_straightness(*place));
    across
        .filter_map(|(place, channel)| {
            let per_unit = channel.unit.displayed().per_internal();
            let observed = |row: usize, values: &[f64]| (row, values[place] * per_unit).1;
            let shown = |at| kind.to_display(at);
            let positions = positioning::approaches(readings, left_out, place, &places, shown, observed);
            let points: Vec<[f64; 2]> = positions.iter().filter_map(point).collect();
            figures(&points).map(|[least_squares, end_points]| StraightnessTest {
                test: test.name.clone(),
                axis: machine.axes[axis].name.clone(),
                channel: channel.name.to_string(),
                figures: (STRAIGHTNESS.iter().zip([&least_squares, &end_points]))
                    .map(|(definition, deviations)| definition.with_value(range(deviations), "um"))
                    .collect(),
                positions: (points.iter().zip(least_squares).zip(end_points))
                    .map(|(([at_mm, mean_um], least_squares_um), end_points_um)| StraightnessPosition {
                        at_mm: *at_mm,
                        mean_um: *mean_um,
                        least_squares_um,
                        end_points_um,
                    })
                    .collect(),
            })
        })
        .collect()
}

/// Position and mean over both directions.
fn point(position: &Position) -> Option<[f64; 2]> {
    let approaches: Vec<_> = [position.forward, position.backward].into_iter().flatten().collect();
    let count: usize = approaches.iter().map(|one| one.count).sum();
    let sum: f64 = approaches.iter().map(|one| one.mean * one.count as f64).sum();
    (count > 0).then(|| [position.at, sum / count as f64])
}

/// The deviations from the line of least squares and from the line through the end points; `None` with fewer than three
/// positions, which every line meets.
fn figures(points: &[[f64; 2]]) -> Option<[Vec<f64>; 2]> {
    let [first, .., last] = points else { return None };
    if points.len() < 3 {
        return None;
    }
    let count = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|point| point[k]).sum::<f64>() / count);
    let sum = |k: usize| -> f64 { points.iter().map(|point| (point[0] - mean[0]) * (point[k] - mean[k])).sum() };
    let less = |through: [f64; 2], slope: f64| -> Vec<f64> {
        points.iter().map(|point| point[1] - through[1] - slope * (point[0] - through[0])).collect()
    };
    Some([less(mean, sum(1) / sum(0)), less(*first, (last[1] - first[1]) / (last[0] - first[0]))])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola over five positions, y = x²: the line of least squares is y = 2, the line through the ends y = 4. An
    /// inclination changes neither figure.
    #[test]
    fn a_parabola_has_the_range_about_either_line() {
        for slope in [0.0, 3.0] {
            let points: Vec<[f64; 2]> = (-2..=2).map(f64::from).map(|x| [x, x * x + slope * x + 7.0]).collect();
            let [least_squares, end_points] = figures(&points).unwrap();
            assert!(least_squares.iter().zip([2.0, -1.0, -2.0, -1.0, 2.0]).all(|(found, y)| (found - y).abs() < 1e-12));
            assert!(end_points.iter().zip([0.0, -3.0, -4.0, -3.0, 0.0]).all(|(found, y)| (found - y).abs() < 1e-12));
            assert_eq!((range(&least_squares), range(&end_points)), (4.0, 4.0));
        }
        // A cubic differs: y = x³ over −1, 0, 1, 2.
        let points: Vec<[f64; 2]> = [-1.0, 0.0, 1.0, 2.0].map(|x: f64| [x, x.powi(3)]).to_vec();
        let [least_squares, end_points] = figures(&points).unwrap();
        // Mean x = ½, mean y = 2, Σ(x−½)(y−2) = 14, Σ(x−½)² = 5.
        let expected = [1.2, -0.6, -2.4, 1.8];
        assert!(least_squares.iter().zip(expected).all(|(found, y)| (found - y).abs() < 1e-12), "{least_squares:?}");
        assert!(end_points.iter().zip([0.0, -2.0, -4.0, 0.0]).all(|(found, y)| (found - y).abs() < 1e-12));
        assert!(figures(&points[..2]).is_none());
    }
}
