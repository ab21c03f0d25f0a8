//! The abscissa of a test: the angle of a circular path, or the axis that moves most.

use std::ops::Range;

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::session::readings::Readings;

use crate::numerics::{circle, range};

/// Tolerance of equal positions: mm or rad.
const POSITION_TOLERANCE: f64 = 1e-6;
/// Readings per segment below which the test consists of poses, not of traversals.
const MIN_READINGS_PER_SEGMENT: usize = 10;

/// The abscissa of a test.
#[derive(Clone, Debug, PartialEq)]
pub struct Abscissa {
    /// `C`, or `XY` for the angle about the centre of a circle.
    pub name: String,
    /// Whether it is an angle.
    pub is_angle: bool,
    /// The axis, if the abscissa is an axis.
    pub axis: Option<usize>,
    /// Row by row: degrees, or mm.
    pub values: Vec<f64>,
    /// All axes that move, by index in the machine.
    pub moving: Vec<usize>,
}

/// Consecutive readings of one run in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct PathSegment {
    /// The number of the run in the file, or 1.
    pub run: i64,
    /// Its rows.
    pub rows: Range<usize>,
    /// Whether the abscissa increases; `None` for poses.
    pub forward: Option<bool>,
}

impl Abscissa {
    /// The abscissa of a test's readings: the rotary axis with the largest travel; else the angle about the circle of
    /// two linear axes; else the linear axis with the largest travel; else the number of the reading.
    pub fn of(machine: &Machine, readings: &Readings) -> Abscissa {
        let moving: Vec<usize> =
            (0..machine.axes.len()).filter(|axis| range(&readings.positions[*axis]) > POSITION_TOLERANCE).collect();
        let most = |kind: AxisKind| {
            moving
                .iter()
                .copied()
                .filter(|axis| machine.axes[*axis].kind == kind)
                .max_by(|a, b| range(&readings.positions[*a]).total_cmp(&range(&readings.positions[*b])))
        };
        if let Some(axis) = most(AxisKind::Rotary) {
            return Abscissa {
                name: machine.axes[axis].name.clone(),
                is_angle: true,
                axis: Some(axis),
                values: readings.positions[axis].iter().map(|q| q.to_degrees()).collect(),
                moving,
            };
        }
        // The names in their order: X to the right, Y up.
        let mut pair = moving.clone();
        pair.sort_by(|a, b| machine.axes[*a].name.cmp(&machine.axes[*b].name));
        if let &[first, second] = pair.as_slice()
            && let Some(values) = about_a_circle(&readings.positions[first], &readings.positions[second])
        {
            return Abscissa {
                name: format!("{}{}", machine.axes[first].name, machine.axes[second].name),
                is_angle: true,
                axis: None,
                values,
                moving,
            };
        }
        if let Some(axis) = most(AxisKind::Linear) {
            return Abscissa {
                name: machine.axes[axis].name.clone(),
                is_angle: false,
                axis: Some(axis),
                values: readings.positions[axis].clone(),
                moving,
            };
        }
        Abscissa {
            name: "reading".to_string(),
            is_angle: false,
            axis: None,
            values: (0..readings.rows()).map(|row| row as f64 + 1.0).collect(),
            moving,
        }
    }

    /// The segments of one direction of each run. For `poses`, and if the direction changes at every other reading,
    /// whole runs without a direction.
    pub fn stretches(&self, readings: &Readings, poses: bool) -> Vec<PathSegment> {
        let runs = readings.runs();
        let number = |row: usize| readings.run.get(row).copied().unwrap_or(1);
        let whole_run =
            |rows: &Range<usize>| PathSegment { run: number(rows.start), rows: rows.clone(), forward: None };
        if poses {
            return runs.iter().map(whole_run).collect();
        }
        let mut stretches = Vec::new();
        for run in &runs {
            let mut parts: Vec<PathSegment> = Vec::new();
            for row in run.start + 1..run.end {
                let step = self.values[row] - self.values[row - 1];
                if step.abs() <= POSITION_TOLERANCE {
                    continue;
                }
                let forward = Some(step > 0.0);
                match parts.last_mut() {
                    Some(last) if last.forward != forward => {
                        last.rows.end = row;
                        parts.push(PathSegment { run: number(run.start), rows: row..run.end, forward });
                    }
                    Some(_) => {}
                    None => parts.push(PathSegment { run: number(run.start), rows: run.clone(), forward }),
                }
            }
            if parts.is_empty() || parts.len() > 1 + run.len() / MIN_READINGS_PER_SEGMENT {
                stretches.push(whole_run(run));
            } else {
                stretches.extend(parts);
            }
        }
        stretches
    }
}

/// The unwrapped angle (degrees) about the circle of two axes; `None` if they describe none.
fn about_a_circle(first: &[f64], second: &[f64]) -> Option<Vec<f64>> {
    let points: Vec<[f64; 2]> = first.iter().zip(second).map(|(x, y)| [*x, *y]).collect();
    let circle = circle::through(&points)?;
    let off = points
        .iter()
        .map(|p| ((p[0] - circle.centre[0]).hypot(p[1] - circle.centre[1]) - circle.radius).abs())
        .fold(0.0, f64::max);
    if off > 0.01 * circle.radius {
        return None;
    }
    let mut turns = 0.0;
    let mut last: Option<f64> = None;
    let angles = points.iter().map(|p| {
        let angle = (p[1] - circle.centre[1]).atan2(p[0] - circle.centre[0]).to_degrees();
        if let Some(before) = last {
            turns -= ((angle - before) / 360.0).round() * 360.0;
        }
        last = Some(angle);
        angle + turns
    });
    Some(angles.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_of_two_axes_gives_an_unwrapped_angle() {
        let wanted: Vec<f64> = (0..=72).map(|k| 10.0 * f64::from(k)).collect();
        let at = |k: &f64| k.to_radians();
        let x: Vec<f64> = wanted.iter().map(|k| 5.0 + 100.0 * at(k).cos()).collect();
        let y: Vec<f64> = wanted.iter().map(|k| -7.0 + 100.0 * at(k).sin()).collect();
        let found = about_a_circle(&x, &y).unwrap();
        for (found, wanted) in found.iter().zip(&wanted) {
            assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
        }
        assert_eq!(about_a_circle(&wanted, &wanted), None);
    }

    #[test]
    fn a_forward_and_backward_run_has_two_segments() {
        let machine = Machine::from_code("wCbt").unwrap();
        let there = (0..=20).chain((0..20).rev()).map(f64::from);
        let positions: Vec<f64> = there.map(f64::to_radians).collect();
        let readings = Readings { positions: vec![positions], ..Readings::default() };
        let stretches = Abscissa::of(&machine, &readings).stretches(&readings, false);
        let found: Vec<_> = stretches.iter().map(|s| (s.rows.clone(), s.forward)).collect();
        assert_eq!(found, [(0..21, Some(true)), (21..41, Some(false))]);
    }
}
