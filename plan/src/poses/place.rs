//! What a pose has to meet beside the limits, by instrument, and the positions of the axes that meet it.
//!
//! | instrument | the tool's point is | drawn |
//! |---|---|---|
//! | tracker | anywhere | |
//! | ball bar, R-test | at the length of the bar from the workpiece ball | the direction of the bar |
//! | probe | on the cylinder, in front of it | a point of the cylinder |
//! | socket | in the socket | |
//!
//! Linear axes that span the space meet it by one linear solve, with the drawn rotary axes. Otherwise all axes of the
//! tool side meet it by Newton's iteration on the chain, from their drawn positions.

use std::f64::consts::TAU;

use abbe_model::chain::{BodyErrors, Frame, Machine, MachineState};
use abbe_model::frames::{Point, cross};
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::probe::Probe;
use abbe_model::instrument::{Contact, Station, Target};
use abbe_model::session::placing::positions_for_bar;
use rand_pcg::Pcg64;

use super::between;
use crate::ball_positions::across;
use abbe_model::pose::reach;

/// Least cosine of the angle between the probing direction and the inward normal of the surface. A probe that touches
/// at a smaller one slips.
const LEAST_COSINE: f64 = 0.5;
/// Largest distance of a probe from the surface that it touches, mm.
const TOUCHING_MM: f64 = 1e-6;

/// What a pose has to meet.
pub(super) enum Place {
    /// Nothing.
    Free,
    /// The tool's point is apart from a point of the table by a vector in R, mm.
    OnTable { point: Target<f64>, apart_mm: [f64; 3] },
    /// The tool's point is at a point of R, mm.
    InR([f64; 3]),
}

impl Place {
    /// Draws the place of one candidate. A probe touches its cylinder between two heights above its point, mm.
    pub fn draw(station: &Station<f64>, height_mm: [f64; 2], random: &mut Pcg64) -> Place {
        match (station.contact(), station.probe()) {
            (Contact::InR(point_mm), _) => Place::InR(point_mm),
            (_, Some(probe)) => {
                let turn = between(random, [0.0, TAU]);
                let height = between(random, height_mm);
                Place::OnTable { point: surface_point(probe, turn, height), apart_mm: [0.0; 3] }
            }
            (Contact::AtDistance(distance_mm), _) => {
                let apart_mm = upward(random).map(|x| x * distance_mm);
                let point = station.table_point().unwrap_or(Target::on_table([0.0; 3]));
                Place::OnTable { point, apart_mm }
            }
            (Contact::None | Contact::Touching, None) => Place::Free,
        }
    }

    /// The positions that meet it, from drawn ones; `None` if none are found.
    pub fn met(&self, machine: &Machine, station: &Station<f64>, drawn: &[f64]) -> Option<Vec<f64>> {
        let tool = station.tool_point();
        let at = match *self {
            Place::Free => drawn.to_vec(),
            Place::InR(point_mm) => solved(machine, tool.mm, point_mm, drawn)?,
            Place::OnTable { point, apart_mm } => {
                let bar = BallBar { workpiece_ball: point, spindle_ball: tool, bar: 0.0 };
                positions_for_bar(machine, &bar, drawn, apart_mm).or_else(|| {
                    let carried = point.nominal_mm(machine, &machine.axis_positions(drawn));
                    solved(machine, tool.mm, std::array::from_fn(|i| carried[i] + apart_mm[i]), drawn)
                })?
            }
        };
        station.probe().is_none_or(|probe| touches(machine, probe, &at)).then_some(at)
    }

    /// What poses have to do, and what to check if none does it.
    pub fn words(station: &Station<f64>) -> (String, &'static str) {
        match station.contact() {
            Contact::InR([x, y, z]) => (
                format!("brings the ball into the socket at ({x:.1}, {y:.1}, {z:.1}) mm"),
                "`socket_mm`, `ball_mm` and the travel of the axes",
            ),
            Contact::Touching => (
                "makes the probe touch the cylinder from outside".into(),
                "`artefact_mm`, `radius_mm`, `stylus_mm`, `direction` and the travel of the axes",
            ),
            _ => (
                "places the two balls at their distance".into(),
                "`workpiece_ball_mm`, `spindle_ball_mm` and the travel of the axes",
            ),
        }
    }
}

/// The positions at which the axes of the tool side bring the tool's point to a point of R.
fn solved(machine: &Machine, tool_mm: [f64; 3], point_mm: [f64; 3], drawn: &[f64]) -> Option<Vec<f64>> {
    let none = vec![BodyErrors::<f64>::NONE; drawn.len()];
    let wanted = machine.in_frame::<f64>(Frame::Table, &machine.axis_positions(drawn), &none, Point(point_mm)).0;
    let axes: Vec<usize> = (machine.workpiece_side..machine.axes.len()).collect();
    reach::from_start(machine, tool_mm, wanted, &axes, drawn)
}

/// Whether the probe touches the surface from outside.
fn touches(machine: &Machine, probe: &Probe<f64>, at: &[f64]) -> bool {
    let none = vec![BodyErrors::<f64>::NONE; at.len()];
    let state = machine.axis_positions(at);
    let geometry = probe.geometry::<f64>(MachineState { machine, state: &state, errors: &none }, |_| None);
    let [_, outward, _] = geometry.quadratic();
    let cosine = -outward / (geometry.radius * geometry.step_length.unwrap_or(1.0));
    cosine >= LEAST_COSINE && geometry.distance().abs() <= TOUCHING_MM
}

/// The centre of the stylus, in the frame of the artefact, that touches the cylinder at an angle and at a height above its point.
fn surface_point(probe: &Probe<f64>, turn: f64, height: f64) -> Target<f64> {
    let along = probe.axis;
    let first = across(along);
    let second = cross(along, Point(first)).0;
    let (sin, cos) = turn.sin_cos();
    let across = |i: usize| probe.radius * (cos * first[i] + sin * second[i]);
    Target { mm: std::array::from_fn(|i| probe.artefact.mm[i] + height * along[i] + across(i)), ..probe.artefact }
}

/// A direction, uniform over the upper half of the sphere.
fn upward(random: &mut Pcg64) -> [f64; 3] {
    let z = between(random, [0.0, 1.0]);
    let (sin, cos) = between(random, [-0.5 * TAU, 0.5 * TAU]).sin_cos();
    let across = (1.0 - z * z).sqrt();
    [across * cos, across * sin, z]
}
