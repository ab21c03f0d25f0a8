//! Characteristics of ISO 230-4: circular deviation G, bidirectional circular deviation G(b), radial deviation F, mean
//! bidirectional radial deviation D, and circular hysteresis H (edition of 1996).
//!
//! ```text
//! p(θ) = L(θ)·(cos θ, sin θ)     c, ρ: least-squares circle through p     G = max ‖p − c‖ − min ‖p − c‖     F(θ) = ‖p − c‖ − L_nominal
//! ```
//!
//! The standard permits the least-squares circle in place of the minimum-zone circles (clause 3). This module uses the
//! least-squares circle, so G is never smaller than with minimum-zone circles.

use std::f64::consts::{PI, TAU};

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::session::Test;

use super::names;
use super::path::{MovingAxes, Path};
use super::results::{CircularTest, DirectionFigures};
use crate::numerics::circle;

/// A path in polar form: angle, deviation of the length from nominal, nominal length.
struct PolarPath(Vec<[f64; 3]>);

/// The characteristics of a path.
pub(super) fn figures(machine: &Machine, test: &Test, path: &Path) -> CircularTest {
    let name = |axis: usize| machine.axes[axis].name.clone();
    let (axes, radius_mm) = match path.moves {
        MovingAxes::Linear { axes, radius_mm, .. } => (axes.map(name).concat(), Some(radius_mm)),
        MovingAxes::Rotary(axis) => (name(axis), None),
    };
    // Otherwise the readings still contain the set-up of the balls, or errors of the linear axes.
    let is_error_motion =
        matches!(path.moves, MovingAxes::Rotary(_)) && path.arc() >= TAU * 0.99 && linear_axes_rest(machine, test);
    let traces = [1.0, -1.0].map(|direction| mean(path, direction));
    let mut not_identifiable = Vec::new();
    let arc = path.arc();
    if arc < TAU * 0.99 {
        not_identifiable.push(format!(
            "an arc of {:.0}°: the characteristics refer to this arc; ISO 230-4 requires a full circle",
            arc.to_degrees()
        ));
    }
    let directions = traces
        .iter()
        .zip([("+", 1.0), ("-", -1.0)])
        .filter_map(|(trace, (direction, sign))| {
            let (trace, runs) = trace.as_ref()?;
            let around = about(path, trace);
            let (least, most) = range(&around.deviations_mm);
            Some(DirectionFigures {
                direction: direction.to_string(),
                runs: *runs,
                circular_deviation_um: (most - least) * 1e3,
                radial_deviation_max_um: most * 1e3,
                radial_deviation_min_um: least * 1e3,
                synchronous_error_motion_um: is_error_motion.then_some((most - least) * 1e3),
                asynchronous_error_motion_um: width_mm(path, sign).filter(|_| is_error_motion).map(|width| width * 1e3),
            })
        })
        .collect();
    let mut result = CircularTest {
        test: test.name.clone(),
        axes,
        iso_10791_6: names::iso_10791_6(machine, test).map(str::to_string),
        bar_direction: names::bar_direction(test).map(str::to_string),
        radius_mm,
        feed_mm_min: path.feed_mm_s.map(|feed| feed * 60.0),
        arc_deg: arc.to_degrees(),
        directions,
        bidirectional_circular_deviation_um: None,
        mean_bidirectional_radial_deviation_um: None,
        hysteresis_um: None,
        diagnosis: Vec::new(),
        diagnosis_rms_um: None,
        not_identifiable,
    };
    match &traces {
        [Some((there, _)), Some((back, _))] => {
            let both = PolarPath(there.0.iter().chain(&back.0).copied().collect());
            let around = about(path, &both);
            let (least, most) = range(&around.deviations_mm);
            result.bidirectional_circular_deviation_um = Some((most - least) * 1e3);
            result.mean_bidirectional_radial_deviation_um = Some(around.radius_mm * 1e3);
            let differences = there.0.iter().filter_map(|p| Some((p[1] - back.at(p[0])?).abs()));
            result.hysteresis_um = differences.reduce(f64::max).map(|most| most * 1e3);
        }
        _ => result.not_identifiable.push("one direction only: G(b), D and hysteresis require both directions".into()),
    }
    result
}

/// Whether no linear axis moves during a test.
fn linear_axes_rest(machine: &Machine, test: &Test) -> bool {
    const REST_MM: f64 = 1e-3;
    let Some(readings) = &test.readings else { return false };
    machine.axes.iter().zip(&readings.positions).filter(|(axis, _)| axis.kind == AxisKind::Linear).all(|(_, column)| {
        let (least, most) = range(column);
        most - least <= REST_MM
    })
}

/// The runs in one direction.
fn in_direction(path: &Path, direction: f64) -> Vec<PolarPath> {
    let runs = path.runs.iter().filter(|run| run.direction == direction);
    runs.map(|run| {
        let kept = run.rows.clone().filter(|row| !path.left_out.get(*row).copied().unwrap_or(false));
        let mut points: Vec<[f64; 3]> =
            kept.map(|row| [path.angle[row], path.deviation_mm[row], path.nominal_mm[row]]).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        PolarPath(points)
    })
    .collect()
}

/// The greatest range of the runs in one direction at one angle of the first run, mm; `None` for a single run.
fn width_mm(path: &Path, direction: f64) -> Option<f64> {
    let runs = in_direction(path, direction);
    let (first, others) = runs.split_first().filter(|(_, others)| !others.is_empty())?;
    let widths = first.0.iter().map(|p| {
        let deviations: Vec<f64> = others.iter().filter_map(|run| run.at(p[0])).chain([p[1]]).collect();
        let (least, most) = range(&deviations);
        most - least
    });
    widths.reduce(f64::max)
}

/// The mean path of the runs in one direction, at the angles of the first run, and the number of these runs.
fn mean(path: &Path, direction: f64) -> Option<(PolarPath, usize)> {
    let runs = in_direction(path, direction);
    let first = runs.first()?;
    let points = first.0.iter().map(|p| {
        let others: Vec<f64> = runs[1..].iter().filter_map(|run| run.at(p[0])).collect();
        let sum = p[1] + others.iter().sum::<f64>();
        [p[0], sum / (1 + others.len()) as f64, p[2]]
    });
    Some((PolarPath(points.collect()), runs.len()))
}

impl PolarPath {
    /// The deviation at an angle (modulo whole turns), interpolated between the neighbouring readings.
    fn at(&self, angle: f64) -> Option<f64> {
        const SAME: f64 = 1e-6;
        let points = &self.0;
        let (first, last) = (points.first()?[0], points.last()?[0]);
        let turns = ((first - SAME - angle) / TAU).ceil();
        let angle = (angle + turns * TAU).clamp(first, f64::INFINITY);
        if angle > last + SAME {
            return None;
        }
        let next = points.partition_point(|p| p[0] < angle).min(points.len() - 1);
        if next == 0 {
            return Some(points[0][1]);
        }
        let (a, b) = (points[next - 1], points[next]);
        let share = ((angle - a[0]) / (b[0] - a[0]).max(SAME)).clamp(0.0, 1.0);
        Some(a[1] + share * (b[1] - a[1]))
    }
}

/// Radial deviations about the centre of the least-squares circle.
struct RadialDeviations {
    /// Distance from the centre less the nominal length, mm.
    deviations_mm: Vec<f64>,
    /// Radius of the circle less the nominal length, mm.
    radius_mm: f64,
}

/// Removes the centre. If a rotary axis turns, the reading need not be a radius; the centre is then the first harmonic
/// of the reading.
fn about(path: &Path, trace: &PolarPath) -> RadialDeviations {
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / trace.0.len() as f64;
    let nominal = mean(&mut trace.0.iter().map(|p| p[2]));
    let radial = matches!(path.moves, MovingAxes::Linear { radial: true, .. });
    let points: Vec<[f64; 2]> = trace
        .0
        .iter()
        .map(|p| {
            let length = if radial { p[2] + p[1] } else { nominal + p[1] };
            [length * p[0].cos(), length * p[0].sin()]
        })
        .collect();
    // On a short arc the centre is confounded with the radius.
    let found = (path.arc() >= PI * 0.99).then(|| circle::through(&points)).flatten();
    let Some(circle) = found else {
        return RadialDeviations {
            deviations_mm: trace.0.iter().map(|p| p[1]).collect(),
            radius_mm: mean(&mut trace.0.iter().map(|p| p[1])),
        };
    };
    let distance = |p: &[f64; 2]| (p[0] - circle.centre[0]).hypot(p[1] - circle.centre[1]);
    RadialDeviations {
        deviations_mm: points
            .iter()
            .zip(&trace.0)
            .map(|(point, p)| distance(point) - if radial { p[2] } else { nominal })
            .collect(),
        radius_mm: circle.radius - nominal,
    }
}

fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| (least.min(*x), most.max(*x)))
}
