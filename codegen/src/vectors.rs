//! Named points of a chain: the ball in the frame of each axis, and the bar between the balls.
//!
//! The chain records nothing about them. Equal expressions are one node, so transforming the point again, step by step,
//! finds the nodes of the reading.

use std::collections::HashMap;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, BodyErrors, Frame, Machine, MachineState};
use abbe_model::frames::Point;
use abbe_model::instrument::probe;
use abbe_model::instrument::rtest::Setting;
use abbe_model::scalar::Nominal;

use crate::program::Label;
use crate::subject::Subject;
use crate::symbol::{Adjoints, NodeId, Operand, Symbol};

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
        Label::Vector { letter: self.letter, frame: self.frame.clone(), prime: self.prime, coordinate }
    }
}

/// The letter of a ball or point, and its meaning.
type Body = (&'static str, &'static str);

/// The named vectors of a subject, from the ball outwards.
pub(crate) fn of_subject<'a>(
    subject: &Subject<Symbol<'a>>,
    machine: &Machine,
    state: &[AxisPosition<Symbol<'a>>],
    errors: &[BodyErrors<Symbol<'a>>],
    unknown: &impl Fn(usize) -> Option<Symbol<'a>>,
) -> Vec<NamedVector> {
    let walk = Walk { machine, state, errors };
    let station = match subject {
        Subject::Station(station) => station,
        Subject::Volumetric { tool } => return walk.outwards(("q", "tool point"), Frame::Tool, Point::nominal(*tool)),
    };
    if let Some(probe) = station.probe() {
        let frame = probe.stylus.frame;
        let stylus = probe.stylus.displaced(probe::STYLUS, unknown);
        let mut vectors = walk.outwards(("q", "stylus"), frame, stylus);
        let stylus = machine.in_r(frame, state, errors, stylus);
        let (step, _) = probe.step_at(machine, state);
        let meaning = match probe.direction {
            Some(_) => "step of the probe in R, 1 mm in the stated direction",
            None => "step of the probe in R, all the way to the artefact's nominal axis",
        };
        vectors.push(named("n", step, meaning));
        vectors.extend(walk.inwards(("q", "stylus"), probe.artefact.frame, stylus));
        vectors.extend(walk.inwards(("r", "a step ahead"), probe.artefact.frame, stylus.plus(step)));
        let geometry = probe.geometry(MachineState { machine, state, errors }, unknown);
        let meaning = "position of the stylus perpendicular to the artefact's axis";
        vectors.push(named("v", geometry.stylus, meaning));
        vectors.push(named("u", geometry.step, "the step perpendicular to the artefact's axis"));
        return vectors;
    }
    let mut vectors = Vec::new();
    let [on_table, on_tool] = station.points();
    // The point of an R-test that carries the sensors is the origin of the difference.
    let carrier = station.rtest().map(|rtest| rtest.setting);
    if let Some(point) = on_table.filter(|_| carrier != Some(Setting::Table)) {
        vectors.extend(walk.outwards(
            ("p", point.name),
            point.target.frame,
            point.target.displaced(point.first, unknown),
        ));
    }
    if let Some(point) = on_tool.filter(|_| carrier != Some(Setting::Spindle)) {
        vectors.extend(walk.outwards(
            ("q", point.name),
            point.target.frame,
            point.target.displaced(point.first, unknown),
        ));
    }
    if let Some(bar) = station.bar() {
        let (p, q) = bar.balls(MachineState { machine, state, errors }, unknown);
        vectors.push(named("b", p.minus(q), "bar, from the spindle ball to the workpiece ball, in R"));
    }
    vectors
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

/// A chain in one state, through which a point is transformed axis by axis.
struct Walk<'w, 'a> {
    machine: &'w Machine,
    state: &'w [AxisPosition<Symbol<'a>>],
    errors: &'w [BodyErrors<Symbol<'a>>],
}

impl<'a> Walk<'_, 'a> {
    /// From R into a frame.
    fn inwards(&self, (letter, body): Body, frame: Frame, point: Point<Symbol<'a>>) -> Vec<NamedVector> {
        let mut vectors: Vec<NamedVector> = Vec::new();
        let mut point = point;
        for index in self.machine.carriers(frame).rev() {
            let pulled = self.machine.pull(index, self.state, self.errors, point);
            if pulled != point {
                let axis = &self.machine.axes[index].name;
                vectors.push(NamedVector {
                    frame: axis.clone(),
                    ..named(letter, pulled, &format!("{body} in the frame of axis {axis}"))
                });
            }
            point = pulled;
        }
        vectors
    }

    /// From a frame to R: the point after each step.
    fn outwards(&self, (letter, body): Body, frame: Frame, point: Point<Symbol<'a>>) -> Vec<NamedVector> {
        let machine = self.machine;
        let mut vectors: Vec<NamedVector> = Vec::new();
        let start = point.0.map(Symbol::operand);
        let mut point = point;
        for index in machine.carriers(frame) {
            let axis = &machine.axes[index];
            let outside = machine.carrier(index).map(|outside| &machine.axes[outside].name);
            let frame = outside.cloned().unwrap_or_else(|| "R".to_string());
            let in_frame = outside.map_or_else(|| "R".to_string(), |name| format!("the frame of axis {name}"));
            let mut add = |point: Point<Symbol<'a>>, prime: bool, meaning: String| {
                let vector = NamedVector { frame: frame.clone(), prime, ..named(letter, point, &meaning) };
                let known = vectors.iter().any(|known| known.components == vector.components);
                let new = vector.components.iter().any(|c| matches!(c, Operand::Node(_)));
                if new && !known && vector.components != start {
                    vectors.push(vector);
                }
            };
            let pushed = machine.push(index, self.state, self.errors, point);
            if axis.kind == AxisKind::Rotary {
                let origin = axis.origin_mm.map(|o| Symbol::constant(-o));
                let turned = axis.rotate(self.state[index].turn, point.shifted(origin));
                if turned != pushed {
                    // Coordinates are relative to the origin of the axis before its errors apply.
                    let from = match axis.origin_mm {
                        [0.0, 0.0, 0.0] => String::new(),
                        _ => format!(", from the origin of {}", axis.name),
                    };
                    let meaning = format!("{body} in {in_frame}{from}, {} without its errors", axis.name);
                    add(turned, true, meaning);
                }
            }
            add(pushed, false, format!("{body} in {in_frame}"));
            point = pushed;
        }
        vectors
    }
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
            NamedVector { letter: "u", frame: vector.frame.clone(), prime: vector.prime, components, meaning }
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
