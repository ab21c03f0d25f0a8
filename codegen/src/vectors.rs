//! Named points of a chain: the ball in the frame of each axis, and the bar between the balls.
//!
//! The chain records nothing about them. Equal expressions are one node, so transforming the point again, step by step,
//! finds the nodes of the reading.

use std::collections::HashMap;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
use abbe_model::frames::Point;
use abbe_model::instrument::rtest::Setting;
use abbe_model::instrument::{Station, displaced, probe};
use abbe_model::scalar::Nominal;

use crate::program::Label;
use crate::subject::Subject;
use crate::symbol::Adjoints;
use crate::symbol::{NodeId, Operand, Symbol};

/// A vector with a name, such as the workpiece ball in the frame of axis A.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedVector {
    /// `p` for a point on the workpiece side, `q` on the tool side, `b` for the bar, `u` for its unit vector. For a
    /// probe: `n`, `r`, `v` and `u` for its step in R, the point one step ahead, the stylus and the step in the frame
    /// of the artefact.
    pub letter: &'static str,
    /// The frame of its coordinates: an axis, or `R`; empty if it needs none.
    pub frame: String,
    /// Whether the axis rotation is applied but the errors of the axis are not.
    pub prime: bool,
    /// The coordinates.
    pub components: [Operand; 3],
    /// The meaning in words.
    pub meaning: String,
}

impl NamedVector {
    /// The label of one coordinate.
    pub fn label(&self, coordinate: usize) -> Label {
        Label::Vector {
            letter: self.letter,
            frame: self.frame.clone(),
            prime: self.prime,
            coordinate,
        }
    }
}

/// The name of a ball or point.
struct PointName {
    letter: &'static str,
    meaning: &'static str,
}

/// The named vectors of a subject, from the ball outwards.
pub(crate) fn of_subject<'a>(
    subject: &Subject<Symbol<'a>>,
    machine: &Machine,
    state: &[AxisPosition<Symbol<'a>>],
    errors: &[BodyErrors<Symbol<'a>>],
    unknown: &impl Fn(usize) -> Option<Symbol<'a>>,
) -> Vec<NamedVector> {
    let workpiece = PointName {
        letter: "p",
        meaning: "workpiece ball",
    };
    let tool = |meaning| PointName { letter: "q", meaning };
    match subject {
        Subject::Station(Station::BallBar(bar)) => {
            let p = displaced(bar.workpiece_ball, 0, unknown);
            let q = displaced(bar.spindle_ball, 3, unknown);
            let mut vectors = on_workpiece_side(workpiece, machine, state, errors, p);
            vectors.extend(on_tool_side(tool("spindle ball"), machine, state, errors, q));
            let (p, q) = bar.balls(machine, state, errors, unknown);
            vectors.push(NamedVector {
                letter: "b",
                frame: String::new(),
                prime: false,
                components: p.minus(q).0.map(Symbol::operand),
                meaning: "bar, from the spindle ball to the workpiece ball, in R".to_string(),
            });
            vectors
        }
        Subject::Station(Station::Tracker(tracker)) => {
            let q = displaced(tracker.target, 6, unknown);
            on_tool_side(tool("target"), machine, state, errors, q)
        }
        Subject::Station(Station::Socket(socket)) => {
            let q = displaced(socket.ball, 3, unknown);
            on_tool_side(tool("ball"), machine, state, errors, q)
        }
        Subject::Station(Station::Probe(probe)) => {
            let stylus = displaced(probe.stylus, probe::STYLUS, unknown);
            let mut vectors = on_tool_side(tool("stylus"), machine, state, errors, stylus);
            let stylus = machine.tool_point(state, errors, stylus);
            let (step, _) = probe.step_at(machine, state);
            let ahead = PointName {
                letter: "r",
                meaning: "a step ahead",
            };
            let meaning = match probe.direction {
                Some(_) => "step of the probe in R, 1 mm in the stated direction",
                None => "step of the probe in R, all the way to the artefact's nominal axis",
            };
            vectors.push(named("n", step, meaning));
            vectors.extend(into_the_table(tool("stylus"), machine, state, errors, stylus));
            vectors.extend(into_the_table(ahead, machine, state, errors, stylus.plus(step)));
            let geometry = probe.geometry(machine, state, errors, unknown);
            vectors.push(named(
                "v",
                geometry.stylus,
                "position of the stylus perpendicular to the artefact's axis",
            ));
            vectors.push(named(
                "u",
                geometry.step,
                "the step perpendicular to the artefact's axis",
            ));
            vectors
        }
        // The point that does not carry the sensors; the sensors' point is the origin of the difference.
        Subject::Station(Station::RTest(rtest)) => match rtest.setting {
            Setting::Table => {
                let q = displaced(rtest.spindle_ball, 3, unknown);
                on_tool_side(tool("master ball"), machine, state, errors, q)
            }
            Setting::Spindle => {
                let p = displaced(rtest.workpiece_ball, 0, unknown);
                let ball = PointName {
                    letter: "p",
                    meaning: "master ball",
                };
                on_workpiece_side(ball, machine, state, errors, p)
            }
        },
        Subject::Volumetric { tool: point } => {
            on_tool_side(tool("tool point"), machine, state, errors, Point::nominal(*point))
        }
    }
}

/// A vector that needs no frame.
fn named(letter: &'static str, vector: Point<Symbol<'_>>, meaning: &str) -> NamedVector {
    NamedVector {
        letter,
        frame: String::new(),
        prime: false,
        components: vector.0.map(Symbol::operand),
        meaning: meaning.to_string(),
    }
}

/// Transforms a point of R to the table frame, axis by axis.
fn into_the_table<'a>(
    body: PointName,
    machine: &Machine,
    state: &[AxisPosition<Symbol<'a>>],
    errors: &[BodyErrors<Symbol<'a>>],
    point: Point<Symbol<'a>>,
) -> Vec<NamedVector> {
    let mut vectors: Vec<NamedVector> = Vec::new();
    let mut point = point;
    for index in (0..machine.workpiece_side).rev() {
        let pulled = machine.pull(index, state, errors, point);
        if pulled != point {
            let axis = &machine.axes[index].name;
            vectors.push(NamedVector {
                frame: axis.clone(),
                ..named(
                    body.letter,
                    pulled,
                    &format!("{} in the frame of axis {axis}", body.meaning),
                )
            });
        }
        point = pulled;
    }
    vectors
}

fn on_workpiece_side<'a>(
    body: PointName,
    machine: &Machine,
    state: &[AxisPosition<Symbol<'a>>],
    errors: &[BodyErrors<Symbol<'a>>],
    point: Point<Symbol<'a>>,
) -> Vec<NamedVector> {
    let steps = (0..machine.workpiece_side).map(|index| {
        let outside = index + 1;
        (index, (outside < machine.workpiece_side).then_some(outside))
    });
    along(body, machine, state, errors, point, steps)
}

fn on_tool_side<'a>(
    body: PointName,
    machine: &Machine,
    state: &[AxisPosition<Symbol<'a>>],
    errors: &[BodyErrors<Symbol<'a>>],
    point: Point<Symbol<'a>>,
) -> Vec<NamedVector> {
    let steps = (machine.workpiece_side..machine.axes.len()).rev().map(|index| {
        let outside = index.checked_sub(1).filter(|o| *o >= machine.workpiece_side);
        (index, outside)
    });
    along(body, machine, state, errors, point, steps)
}

/// The point after each step; `steps` gives the axis of the step and the axis in whose frame the point then is.
fn along<'a>(
    body: PointName,
    machine: &Machine,
    state: &[AxisPosition<Symbol<'a>>],
    errors: &[BodyErrors<Symbol<'a>>],
    point: Point<Symbol<'a>>,
    steps: impl Iterator<Item = (usize, Option<usize>)>,
) -> Vec<NamedVector> {
    let mut vectors: Vec<NamedVector> = Vec::new();
    let start = point.0.map(Symbol::operand);
    let mut point = point;
    for (index, outside) in steps {
        let axis = &machine.axes[index];
        let (frame, frame_words) = match outside {
            Some(outside) => {
                let name = machine.axes[outside].name.clone();
                (name.clone(), format!("the frame of axis {name}"))
            }
            None => ("R".to_string(), "R".to_string()),
        };
        let mut vector = |point: Point<Symbol<'a>>, prime: bool, meaning: String| {
            let components = point.0.map(Symbol::operand);
            let known = vectors.iter().any(|known| known.components == components);
            let new = components.iter().any(|c| matches!(c, Operand::Node(_)));
            if new && !known && components != start {
                vectors.push(NamedVector {
                    letter: body.letter,
                    frame: frame.clone(),
                    prime,
                    components,
                    meaning,
                });
            }
        };
        let pushed = machine.push(index, state, errors, point);
        if axis.kind == AxisKind::Rotary {
            let origin = axis.origin_mm.map(|o| Symbol::constant(-o));
            let turned = axis.rotate(state[index].turn, point.shifted(origin));
            if turned != pushed {
                // Coordinates are relative to the origin of the axis before its errors apply.
                let from = match axis.origin_mm {
                    [0.0, 0.0, 0.0] => String::new(),
                    _ => format!(", from the origin of {}", axis.name),
                };
                let meaning = format!(
                    "{} in {frame_words}{from}, {} without its errors",
                    body.meaning, axis.name
                );
                vector(turned, true, meaning);
            }
        }
        vector(pushed, false, format!("{} in {frame_words}", body.meaning));
        point = pushed;
    }
    vectors
}

/// The unit vector of the bar, transformed back into each frame: the adjoints of the named points, by name.
pub(crate) fn adjoint_vectors(vectors: &[NamedVector], adjoints: &Adjoints) -> Vec<NamedVector> {
    vectors
        .iter()
        .rev()
        .filter(|vector| vector.letter == "b" || vector.letter == "p")
        .map(|vector| {
            let components = vector.components.map(|component| adjoints.of(component));
            let meaning = match vector.letter {
                "b" => "unit vector of the bar".to_string(),
                _ => format!("the same transformed back: derivatives by the {}", vector.meaning),
            };
            NamedVector {
                letter: "u",
                frame: vector.frame.clone(),
                prime: vector.prime,
                components,
                meaning,
            }
        })
        .collect()
}

/// The nodes of the vectors' coordinates, each under its first name.
pub(crate) fn labels(vectors: &[NamedVector]) -> HashMap<NodeId, Label> {
    let mut labels = HashMap::new();
    for vector in vectors {
        for (coordinate, component) in vector.components.iter().enumerate() {
            if let Operand::Node(id) = component {
                labels.entry(*id).or_insert_with(|| vector.label(coordinate));
            }
        }
    }
    labels
}
