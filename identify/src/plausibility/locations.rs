//! Location errors of poses that are too large for a machine: more than a share of its links.

use abbe_model::chain::{ERRORS_PER_AXIS, Machine};
use abbe_model::component::{ErrorKind, ErrorName};
use nalgebra::Vector3;

use super::results::{Conflict, ConflictKind};
use crate::parameters::Role;
use crate::problem::Problem;

/// Largest share of a link by which an axis may lie beside its place; for angles, in radians.
const MAX_SHARE: f64 = 0.05;
/// Axes that are nearer than this meet, mm.
const MEET_MM: f64 = 1.0;

/// The location errors above 5 % of their link, the largest first.
pub(super) fn conflicts(problem: &Problem, beta: &[f64]) -> Vec<Conflict> {
    let machine = &problem.session.machine;
    let tool = problem.models.first().map(|model| model.station().tool_point_mm()).unwrap_or_default();
    let links = links_mm(machine, tool);
    let mut found: Vec<(f64, Conflict)> = Vec::new();
    for (parameter, value) in problem.parameters.list.iter().zip(beta) {
        let Some(name) = ErrorName::parse(&parameter.id) else { continue };
        if parameter.role != Role::Error || name.kind != ErrorKind::Location {
            continue;
        }
        let Some(slot) = machine.error_slot(&name) else { continue };
        let is_length = slot % ERRORS_PER_AXIS < 3;
        let Some(link) = links.get(slot / ERRORS_PER_AXIS).copied() else { continue };
        let share = if is_length { value.abs() / link } else { value.abs() };
        if share <= MAX_SHARE || share.is_nan() {
            continue;
        }
        let shown = |value: f64| value * parameter.unit.display_per_internal;
        let words = if is_length {
            format!(
                "{} is {:.1} mm, {:.0} % of the link of {link:.0} mm: no machine is that far from its drawing",
                parameter.id,
                value,
                100.0 * share
            )
        } else {
            format!("{} is {:.2}°: no machine is that far from its drawing", parameter.id, value.to_degrees())
        };
        let stated = if is_length { MAX_SHARE * link } else { MAX_SHARE };
        found.push((
            share,
            Conflict {
                kind: ConflictKind::LocationError,
                subject: parameter.id.clone(),
                value: shown(*value),
                stated: shown(stated),
                unit: parameter.unit.name.clone(),
                pull: None,
                words,
            },
        ));
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
