//! Characteristics of ISO 230-4: circular deviation G, bidirectional circular deviation G(b), radial deviation F, mean
//! bidirectional radial deviation D, and circular hysteresis H (edition of 1996).
//!
//! ```text
//! p(θ) = L(θ)·(cos θ, sin θ)     c, ρ: least-squares circle through p     G = max ‖p − c‖ − min ‖p − c‖     F(θ) = ‖p − c‖ − L_nominal
//! ```
//!
//! The standard permits the least-squares circle in place of the minimum-zone circles (clause 3). This module uses the
//! least-squares circle, so G is never smaller than with minimum-zone circles. G of one direction is the smaller of the ranges
//! about its own circle and about that of both directions: both are bounds of the minimum zone, and no G exceeds G(b).

use std::f64::consts::TAU;
use std::sync::Arc;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{Frame, Machine};
use abbe_model::session::Test;
use abbe_model::session::placing::{axis_line, balls};
use nalgebra::Vector3;

use super::names;
use super::path::{MovingAxes, Path};
use super::polar::{Centre, Mean, PolarPath, mean};
use super::results::{CircularTest, DirectionFigures};
use super::set_up::{FigureUncertainties, SetUp};
use crate::figure::{Definition, Figure, IN_BOTH_DIRECTIONS, IN_ONE_DIRECTION};
use crate::numerics::{ends, range};

/// The characteristics of a path.
pub(super) fn figures(machine: &Arc<Machine>, test: &Test, path: &Path) -> CircularTest {
    let name = |axis: usize| machine.axes[axis].name.clone();
    let (axes, radius_mm) = match path.moves {
        MovingAxes::Linear { axes, radius_mm, .. } => (axes.map(name).concat(), Some(radius_mm)),
        MovingAxes::Rotary(axis) => (name(axis), None),
    };
    let set_up = SetUp::of(machine, test, &path.model);
    let traces = [1.0, -1.0].map(|direction| mean(path, direction));
    let mut not_identifiable = Vec::new();
    // Otherwise the readings still contain the set-up of the balls, or errors of the linear axes.
    let is_error_motion = match path.moves {
        MovingAxes::Rotary(axis) if path.arc() >= TAU * 0.99 && linear_axes_rest(machine, test) => {
            let radial = bar_is_radial(machine, test, axis);
            if !radial {
                not_identifiable.push(format!(
                    "the bar is not radial to {}: error motions of the axis need a bar across it, through it",
                    machine.axes[axis].name
                ));
            }
            radial
        }
        _ => false,
    };
    let arc = path.arc();
    if arc < TAU * 0.99 {
        not_identifiable.push(format!(
            "an arc of {:.0}°: the characteristics refer to this arc; ISO 230-4 requires a full circle",
            arc.to_degrees()
        ));
    }
    // Both directions as one path: those there, then those back.
    let both = match &traces {
        [Some(Mean { path: there, .. }), Some(Mean { path: back, .. })] => {
            let both = PolarPath(there.0.iter().chain(&back.0).copied().collect());
            let (centre, deviations_mm) = radial_deviations_mm(path, &both);
            Some((both, centre, deviations_mm, there.0.len()))
        }
        _ => None,
    };
    let directions = traces
        .iter()
        .zip([("+", 1.0), ("-", -1.0)])
        .filter_map(|(trace, (direction, sign))| {
            let Mean { path: trace, runs, width_mm } = trace.as_ref()?;
            let (_, deviations_mm) = radial_deviations_mm(path, trace);
            let [least, most] = ends(&deviations_mm);
            // The circle through both directions may be nearer to the minimum zone of one than its own.
            let about_both = both.as_ref().map_or(f64::INFINITY, |(_, _, deviations_mm, there)| {
                let (one, other) = deviations_mm.split_at(*there);
                range(if sign > 0.0 { one } else { other })
            });
            let u = FigureUncertainties::of(path, trace, &deviations_mm, &set_up);
            let width_mm = width_mm.filter(|_| is_error_motion);
            let values = [
                Some(((most - least).min(about_both) * 1e3, u.range_um)),
                Some((most * 1e3, u.max_um)),
                Some((least * 1e3, u.min_um)),
                is_error_motion.then_some(((most - least) * 1e3, u.range_um)),
                // Differences between runs, as those between directions, do not contain the set-up.
                width_mm.map(|width| (width * 1e3, 0.0)),
            ];
            let figures = with_values(&IN_ONE_DIRECTION, values);
            Some(DirectionFigures { direction: direction.to_string(), runs: *runs, figures })
        })
        .collect();
    let mut figures = Vec::new();
    if let ([Some(there), Some(back)], Some((both, centre, deviations_mm, _))) = (&traces, &both) {
        let [least, most] = ends(deviations_mm);
        let u = FigureUncertainties::of(path, both, deviations_mm, &set_up);
        let mut place = 0;
        let differences =
            there.path.0.iter().filter_map(|p| Some((p.deviation_mm - back.path.at(p.angle, &mut place)?).abs()));
        let values = [
            Some(((most - least) * 1e3, u.range_um)),
            Some((centre.radius_mm * 1e3, u.mean_um)),
            differences.reduce(f64::max).map(|most| (most * 1e3, 0.0)),
        ];
        figures = with_values(&IN_BOTH_DIRECTIONS, values);
    } else {
        not_identifiable.push("one direction only: G(b), D and hysteresis require both directions".into());
    }
    CircularTest {
        test: test.name.clone(),
        axes,
        iso_10791_6: names::iso_10791_6(machine, test).map(str::to_string),
        bar_direction: names::bar_direction(test).map(str::to_string),
        radius_mm,
        feed_mm_min: path.feed_mm_s.map(|feed| feed * 60.0),
        arc_deg: arc.to_degrees(),
        directions,
        figures,
        diagnosis: Vec::new(),
        diagnosis_rms_um: None,
        not_identifiable,
    }
}

/// The figures of a table that have a value, µm, each with its standard uncertainty by the set-up.
fn with_values<const N: usize>(table: &'static [Definition; N], values: [Option<(f64, f64)>; N]) -> Vec<Figure> {
    let figure = |(definition, found): (&'static Definition, Option<(f64, f64)>)| {
        let (value, set_up_u) = found?;
        Some(Figure { set_up_u, ..definition.with_value(value, "um") })
    };
    table.iter().zip(values).filter_map(figure).collect()
}

/// The centre of a path, and the radial deviations about it, mm.
fn radial_deviations_mm(path: &Path, trace: &PolarPath) -> (Centre<f64>, Vec<f64>) {
    let centre = Centre::of(path, trace, |p| p.deviation_mm);
    let deviations_mm = trace.0.iter().map(|p| centre.deviation_mm(p, p.deviation_mm)).collect();
    (centre, deviations_mm)
}

/// Whether no linear axis moves during a test.
fn linear_axes_rest(machine: &Machine, test: &Test) -> bool {
    const REST_MM: f64 = 1e-3;
    let Some(readings) = &test.readings else { return false };
    let mut linear = machine.axes.iter().zip(&readings.positions).filter(|(axis, _)| axis.kind == AxisKind::Linear);
    linear.all(|(_, column)| range(column) <= REST_MM)
}

/// Least share of the radial direction in that of the bar: as for the bar in the plane of a circle.
const RADIAL: f64 = 0.98;

/// Whether the bar lies along the radius of a rotary axis in every reading of a test in which no other axis moves.
fn bar_is_radial(machine: &Machine, test: &Test, axis: usize) -> bool {
    let (Some(bar), Some(readings)) = (test.station.bar(), &test.readings) else {
        return false;
    };
    let at: Vec<f64> = readings.positions.iter().filter_map(|column| column.first().copied()).collect();
    if at.len() < machine.axes.len() {
        return false;
    }
    let (origin, direction) = axis_line(machine, &at, axis);
    let [origin, direction] = [origin, direction].map(Vector3::from);
    let (workpiece, spindle) = balls(machine, bar, &at);
    let from_axis = |ball: [f64; 3]| {
        let ball = Vector3::from(ball) - origin;
        (ball - direction * direction.dot(&ball), direction.dot(&ball))
    };
    let ((one, height), (other, other_height)) = (from_axis(workpiece), from_axis(spindle));
    // Only this axis moves: a ball that it carries turns about its line, and another one rests.
    let turns = |frame: Frame| machine.carriers(frame).any(|carrier| carrier == axis);
    let [one_turns, other_turns] = [bar.workpiece_ball.frame, bar.spindle_ball.frame].map(turns);
    let [one_across, other_across] = [direction.cross(&one), direction.cross(&other)];
    readings.positions[axis].iter().all(|position| {
        let (sin, cos) = (position - at[axis]).sin_cos();
        let one = if one_turns { one * cos + one_across * sin } else { one };
        let other = if other_turns { other * cos + other_across * sin } else { other };
        let radius = if one.norm_squared() > other.norm_squared() { one } else { other };
        let across = other - one;
        let bar = across.norm_squared() + (other_height - height).powi(2);
        across.dot(&radius).abs() >= RADIAL * (bar * radius.norm_squared()).sqrt()
    })
}
