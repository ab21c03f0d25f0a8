//! Location errors of poses that are too large for a machine: axes that stand far beside or tilted to their neighbours; and
//! zeros of joints that are too large for a mounting.
//!
//! A single parameter may be a matter of gauge: a shift of a joint along its axis changes no distance of axes. What readings
//! determine is how neighbouring axes with the directions `d` and `d′` lie to each other, along and about their common normal
//! `n = d × d′`; of parallel axes across their direction:
//!
//! ```text
//! displacement  n · (EX0, EY0, EZ0)      tilt  n · (EA0, EB0, EC0)
//! ```
//!
//! What counts is the part of an estimate beyond its expanded uncertainty, `|value| − 2 u`: what few poses determine badly is
//! large by chance.

use abbe_model::axis::AxisKind;
use abbe_model::chain::{ERRORS_PER_AXIS, Machine};
use abbe_model::component::ErrorKind;
use abbe_model::unit::Unit;
use nalgebra::Vector3;

use super::results::{Conflict, ConflictKind};
use crate::fit::Fit;
use crate::problem::Problem;
use crate::results::COVERAGE_FACTOR;

/// Largest share of a link by which an axis may lie beside its place; for angles, in radians.
const MAX_SHARE: f64 = 0.05;
/// Largest zero angle of a joint, rad: 10°. A scale is mounted anew by a few degrees, and the zero of a drawing is another
/// than that of the encoder.
const MAX_ZERO: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Length of the product of the directions of axes below which they are parallel: 5°.
const PARALLEL: f64 = 0.087;
/// Axes that are nearer than this meet, mm.
const MEET_MM: f64 = 1.0;
/// Part of a combination in the null space from which readings do not determine it.
const OPEN: f64 = 0.1;

/// What is judged of an axis: a combination of its six location errors.
struct Judged {
    kind: ConflictKind,
    is_length: bool,
    /// Along or about a direction.
    along: Vector3<f64>,
    limit: f64,
}

/// The displacements above 5 % of their link, the tilts above 0.05 rad and the zeros of joints above 10°, the largest against
/// its limit first.
pub(super) fn conflicts(problem: &Problem, fit: &Fit) -> Vec<Conflict> {
    let machine = &problem.session.machine;
    let tool = problem.models.first().map(|model| model.station().tool_point().mm).unwrap_or_default();
    let links = links_mm(machine, tool);
    let slots = slots(problem);
    let mut found: Vec<(f64, Conflict)> = Vec::new();
    for (place, link) in links.iter().enumerate() {
        for judged in judged(machine, place, *link) {
            let shift = if judged.is_length { 0 } else { 3 };
            let parts: Vec<(usize, f64)> =
                (0..3).filter_map(|k| Some((slots[place * ERRORS_PER_AXIS + shift + k]?, judged.along[k]))).collect();
            if !is_determined(problem, fit, &parts) {
                continue;
            }
            let value: f64 = parts.iter().map(|(j, share)| share * fit.beta[*j]).sum();
            let products =
                parts.iter().flat_map(|(j, a)| parts.iter().map(move |(k, b)| a * b * fit.covariance[(*j, *k)]));
            let u = products.sum::<f64>().max(0.0).sqrt() * fit.u_enlargement;
            let beyond = (value.abs() - COVERAGE_FACTOR * u) / judged.limit;
            if beyond > 1.0 {
                found.push((beyond, conflict(machine, place, &judged, value, *link)));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, conflict)| conflict).collect()
}

/// The parameter of each location error of the machine, by slot.
fn slots(problem: &Problem) -> Vec<Option<usize>> {
    let machine = &problem.session.machine;
    let mut slots = vec![None; machine.axes.len() * ERRORS_PER_AXIS];
    for (j, parameter) in problem.parameters.list.iter().enumerate() {
        let name = parameter.id.error().filter(|name| name.kind == ErrorKind::Location);
        if let Some(slot) = name.and_then(|name| machine.error_slot(name)) {
            slots[slot] = Some(j);
        }
    }
    slots
}

/// What is judged of an axis against the one before it.
fn judged(machine: &Machine, place: usize, link: f64) -> Vec<Judged> {
    let direction = |k: usize| Vector3::from(machine.axes[k].direction);
    let own = direction(place);
    let mut list = Vec::new();
    if machine.axes[place].kind == AxisKind::Rotary {
        list.push(Judged { kind: ConflictKind::ZeroAngle, is_length: false, along: own, limit: MAX_ZERO });
    }
    // An axis on the bed has none before it: the set-up takes its place.
    let before = machine.carrier(place).filter(|_| machine.axes[place].kind == AxisKind::Rotary);
    let Some(other) = before.map(direction) else { return list };
    let normal = other.cross(&own);
    let along = if normal.norm() > PARALLEL {
        vec![normal.normalize()]
    } else {
        let across = own.cross(&Vector3::ith(own.iamin(), 1.0)).normalize();
        vec![across, own.cross(&across)]
    };
    for along in along {
        for (is_length, limit) in [(true, MAX_SHARE * link), (false, MAX_SHARE)] {
            list.push(Judged { kind: ConflictKind::LocationError, is_length, along, limit });
        }
    }
    list
}

/// Whether readings determine a combination of parameters.
fn is_determined(problem: &Problem, fit: &Fit, parts: &[(usize, f64)]) -> bool {
    let sizes = |j: usize| problem.parameters.list[j].size;
    let length = parts.iter().map(|(j, share)| (share * sizes(*j)).powi(2)).sum::<f64>().sqrt();
    let open = fit.rank.null_space.col_iter();
    let open = open.map(|null| parts.iter().map(|(j, share)| null[*j] * share * sizes(*j)).sum::<f64>().powi(2));
    length > 0.0 && open.sum::<f64>().sqrt() < OPEN * length
}

fn conflict(machine: &Machine, place: usize, judged: &Judged, value: f64, link: f64) -> Conflict {
    let name = &machine.axes[place].name;
    let words = match (judged.kind, judged.is_length) {
        (ConflictKind::ZeroAngle, _) => format!(
            "the zero angle of {name} is {:.2}°: does the column count from another zero or in the other sense than the \
             machine file states?",
            value.to_degrees()
        ),
        (_, true) => format!(
            "axis {name} lies {:.1} mm beside its place, {:.0} % of the link of {link:.0} mm",
            value.abs(),
            100.0 * value.abs() / link
        ),
        (_, false) => format!("axis {name} is tilted by {:.2}° to the axis before it", value.abs().to_degrees()),
    };
    let unit = if judged.is_length { Unit::Micrometre } else { Unit::Arcsecond };
    Conflict {
        kind: judged.kind,
        subject: name.clone(),
        value: unit.to_display(value),
        stated: unit.to_display(judged.limit),
        unit: unit.to_string(),
        pull: None,
        words,
    }
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
