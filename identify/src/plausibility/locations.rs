//! Location errors of poses that are too large for a machine: more than a share of its links; and zeros of joints that are
//! too large for a mounting.
//!
//! What counts is the part of an estimate beyond its expanded uncertainty, `|value| − 2 u`: a location error that few poses
//! determine badly is large by chance.

use abbe_model::axis::AxisKind;
use abbe_model::chain::{ERRORS_PER_AXIS, Machine};
use abbe_model::component::{ErrorKind, ErrorName};
use nalgebra::Vector3;

use super::results::{Conflict, ConflictKind};
use crate::fit::Fit;
use crate::parameters::Role;
use crate::problem::Problem;
use crate::results::COVERAGE_FACTOR;

/// Largest share of a link by which an axis may lie beside its place; for angles, in radians.
const MAX_SHARE: f64 = 0.05;
/// Largest zero angle of a joint, rad: 10°. A scale is mounted anew by a few degrees, and the zero of a drawing is another
/// than that of the encoder.
const MAX_ZERO: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// A component of a unit vector above which it is taken as along the axis.
const ALONG: f64 = 0.9;
/// Axes that are nearer than this meet, mm.
const MEET_MM: f64 = 1.0;

/// The location errors above 5 % of their link and the zeros of joints above 10°, the largest against its limit first.
pub(super) fn conflicts(problem: &Problem, fit: &Fit) -> Vec<Conflict> {
    let machine = &problem.session.machine;
    let tool = problem.models.first().map(|model| model.station().tool_point_mm()).unwrap_or_default();
    let links = links_mm(machine, tool);
    let mut found: Vec<(f64, Conflict)> = Vec::new();
    for (k, (parameter, value)) in problem.parameters.list.iter().zip(&fit.beta).enumerate() {
        let Some(name) = ErrorName::parse(&parameter.id) else { continue };
        if parameter.role != Role::Error || name.kind != ErrorKind::Location {
            continue;
        }
        let Some(slot) = machine.error_slot(&name) else { continue };
        let is_length = slot % ERRORS_PER_AXIS < 3;
        let place = slot / ERRORS_PER_AXIS;
        let (Some(link), Some(axis)) = (links.get(place).copied(), machine.axes.get(place)) else { continue };
        let along = axis.direction[name.freedom.index() % 3].abs() > ALONG;
        let is_zero = axis.kind == AxisKind::Rotary && !is_length && along;
        let limit = match (is_length, is_zero) {
            (true, _) => MAX_SHARE * link,
            (false, true) => MAX_ZERO,
            (false, false) => MAX_SHARE,
        };
        let u = fit.covariance[(k, k)].max(0.0).sqrt() * fit.u_enlargement;
        let beyond = (value.abs() - COVERAGE_FACTOR * u) / limit;
        if beyond <= 1.0 || beyond.is_nan() {
            continue;
        }
        let shown = |value: f64| value * parameter.unit.display_per_internal;
        let words = if is_length {
            format!(
                "{} is {:.1} mm, {:.0} % of the link of {link:.0} mm: no machine is that far from its drawing",
                parameter.id,
                value,
                100.0 * value.abs() / link
            )
        } else if is_zero {
            format!(
                "{}, the zero angle of {}, is {:.2}°: does the column count from another zero or in the other sense than the \
                 machine file states?",
                parameter.id,
                axis.name,
                value.to_degrees()
            )
        } else {
            format!("{} is {:.2}°: no machine is that far from its drawing", parameter.id, value.to_degrees())
        };
        let conflict = Conflict {
            kind: if is_zero { ConflictKind::ZeroAngle } else { ConflictKind::LocationError },
            subject: parameter.id.clone(),
            value: shown(*value),
            stated: shown(limit),
            unit: parameter.unit.name.clone(),
            pull: None,
            words,
        };
        found.push((beyond, conflict));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, conflict)| conflict).collect()
}

/// The link of each axis, mm: the larger distance to the axes beside it, at the end to the tool point. Where axes meet, the
/// longest link of the chain.
fn links_mm(machine: &Machine, tool_mm: [f64; 3]) -> Vec<f64> {
    let origins: Vec<Vector3<f64>> = machine.axes.iter().map(|axis| Vector3::from(axis.origin_mm)).collect();
    let all: Vec<Vector3<f64>> = origins.iter().copied().chain([Vector3::from(tool_mm)]).collect();
    let between =
        |k: usize, other: Option<usize>| other.and_then(|other| all.get(other)).map_or(0.0, |p| (p - all[k]).norm());
    let links: Vec<f64> =
        (0..origins.len()).map(|k| between(k, k.checked_sub(1)).max(between(k, Some(k + 1)))).collect();
    let longest = links.iter().copied().fold(MEET_MM, f64::max);
    links.into_iter().map(|link| if link < MEET_MM { longest } else { link }).collect()
}
