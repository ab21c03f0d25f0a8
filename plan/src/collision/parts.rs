//! The parts of a test that can collide, and their clearance at one state.

use std::sync::Arc;

use abbe_model::axis::AxisKind;
use abbe_model::body::{ClearanceSizes, Holder};
use abbe_model::chain::{Frame, Machine};
use abbe_model::instrument::Target;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::session::Mounted;
use abbe_model::session::{Session, Test};
use parry3d_f64::math::{Pose, Vector};

use super::shape::{Placed, Shape};

/// On which side of the bed a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Workpiece,
    Bed,
    Tool,
}

#[derive(Clone)]
struct Part {
    name: String,
    side: Side,
    /// The axis that carries it.
    axis: Option<usize>,
    shape: Shape,
    /// The stem that holds a ball: its line and its radius.
    stem: Option<([[f64; 3]; 2], f64)>,
}

/// The bodies of a machine, prepared once for many tests.
pub struct Bodies(Arc<Vec<Part>>);

impl Bodies {
    /// The bodies of a machine.
    pub fn of(machine: &Machine) -> Bodies {
        let part = |body: &abbe_model::body::Body| {
            Some(Part {
                name: body.name.clone(),
                side: match body.axis {
                    None => Side::Bed,
                    Some(axis) if axis < machine.workpiece_side => Side::Workpiece,
                    Some(_) => Side::Tool,
                },
                axis: body.axis,
                shape: Shape::of(&body.shape)?,
                stem: None,
            })
        };
        Bodies(Arc::new(machine.bodies.iter().filter_map(part).collect()))
    }
}

/// Two parts that are compared; the first is the bar if it is `None`.
#[derive(Clone, Copy)]
struct Pair {
    one: Option<usize>,
    other: usize,
}

/// The parts of a test that can collide.
pub struct Parts<'m> {
    machine: &'m Machine,
    parts: Vec<Part>,
    pairs: Vec<Pair>,
    pub(super) sizes: ClearanceSizes,
    bar: Option<BallBar<f64>>,
}

/// The least clearance at a state.
#[derive(Clone)]
pub(super) struct Found {
    pub mm: f64,
    pub between: [String; 2],
}

/// Which pairs are compared.
#[derive(Clone, Copy)]
pub(super) enum Compared<'a> {
    /// All.
    All,
    /// Those between which an axis moves; `true` for each axis that does.
    Moving(&'a [bool]),
    /// The others.
    Still(&'a [bool]),
}

impl<'m> Parts<'m> {
    /// The parts of a test; `None` if the session states neither bodies nor sizes, so that nothing is to be compared.
    /// `bodies` are those of the session's machine.
    pub fn of(session: &'m Session, bodies: &Bodies, test: &Test) -> Option<Parts<'m>> {
        let machine = &*session.machine;
        if machine.bodies.is_empty() && session.clearance.is_none() {
            return None;
        }
        let sizes = session.clearance.unwrap_or_default();
        let mut parts: Vec<Part> = bodies.0.to_vec();
        let bar = test.station.bar().cloned();
        if let Some(bar) = &bar {
            let stem = |name: &str, side: Side, ball: Target<f64>, up: f64, Holder { radius_mm, length_mm }: Holder| {
                let from = ball.mm;
                let (radius_mm, length_mm) = (radius_mm.0, length_mm.0);
                let to = [from[0], from[1], from[2] + up * length_mm];
                Part {
                    name: name.to_string(),
                    side,
                    axis: machine.carriers(ball.frame).next(),
                    shape: Shape::capsule(from, to, radius_mm),
                    stem: Some(([from, to], radius_mm)),
                }
            };
            let workpiece = |holder| stem("workpiece holder", Side::Workpiece, bar.workpiece_ball, -1.0, holder);
            let spindle = |holder| stem("spindle holder", Side::Tool, bar.spindle_ball, 1.0, holder);
            parts.extend(sizes.workpiece_holder.map(workpiece));
            parts.extend(sizes.spindle_holder.map(spindle));
        }
        // The bar first: it is near, and what is farther apart than it needs no distance.
        let of_bar = (0..parts.len()).filter(|_| bar.is_some()).map(|other| Pair { one: None, other });
        let mut pairs: Vec<Pair> = of_bar.collect();
        for one in 0..parts.len() {
            // A holder on a side without axes stands on the bed, as bodies of the bed do.
            let moves = |other: &usize| parts[one].axis.is_some() || parts[*other].axis.is_some();
            let others = (one + 1..parts.len()).filter(|other| parts[one].side != parts[*other].side && moves(other));
            pairs.extend(others.map(|other| Pair { one: Some(one), other }));
        }
        Some(Parts { machine, parts, pairs, sizes, bar })
    }

    pub(super) fn machine(&self) -> &Machine {
        self.machine
    }

    /// The least clearance at one state, if it is less than `most`.
    pub(super) fn below(&self, at: &[f64], most: f64, mounted: Mounted, compared: Compared<'_>) -> Option<Found> {
        let placed: Vec<(Pose, Placed)> = self
            .parts
            .iter()
            .map(|part| {
                let motion = self.carried(frame(part.axis), at);
                let placed = part.shape.moved(&motion);
                (motion, placed)
            })
            .collect();
        let ends = self.bar.as_ref().map(|bar| {
            let of =
                |ball: Target<f64>| -> [f64; 3] { self.carried(ball.frame, at).transform_point(ball.mm.into()).into() };
            [of(bar.workpiece_ball), of(bar.spindle_ball)]
        });
        let mut found: Option<Found> = None;
        for pair in self.pairs.iter().filter(|pair| self.is_compared(pair, mounted, compared)) {
            let best = found.as_ref().map_or(most, |best| best.mm);
            let other = &placed[pair.other];
            let mm = match (pair.one, ends) {
                (Some(one), _) => placed[one].1.clearance(&other.1, best),
                (None, Some(ends)) => self.bar_clearance(ends, &self.parts[pair.other], other, best),
                (None, None) => continue,
            };
            if mm < best {
                let name = pair.one.map_or("bar", |one| self.parts[one].name.as_str());
                found = Some(Found { mm, between: [name, &self.parts[pair.other].name].map(str::to_string) });
            }
        }
        found
    }

    fn is_compared(&self, pair: &Pair, mounted: Mounted, compared: Compared<'_>) -> bool {
        let is_stem = |part: usize| self.parts[part].stem.is_some();
        let exists = match mounted {
            Mounted::Bar => true,
            Mounted::Nothing => pair.one.is_some(),
            // The cup of the spindle takes the ball of the workpiece.
            Mounted::BallInCup => pair.one.is_some_and(|one| !(is_stem(one) && is_stem(pair.other))),
        };
        exists
            && match compared {
                Compared::All => true,
                Compared::Moving(moving) => self.moves(pair, moving),
                Compared::Still(moving) => !self.moves(pair, moving),
            }
    }

    /// Whether an axis that moves is between two parts.
    fn moves(&self, pair: &Pair, moving: &[bool]) -> bool {
        let carries = |frame: Frame| self.machine.carriers(frame).any(|axis| moving[axis]);
        let one = match pair.one {
            Some(one) => carries(frame(self.parts[one].axis)),
            None => {
                self.bar.iter().flat_map(|bar| [bar.workpiece_ball, bar.spindle_ball]).any(|ball| carries(ball.frame))
            }
        };
        one || carries(frame(self.parts[pair.other].axis))
    }

    /// The clearance of the bar and a part, without what both have at the ball that they share.
    fn bar_clearance(&self, ends: [[f64; 3]; 2], part: &Part, (motion, placed): &(Pose, Placed), most: f64) -> f64 {
        let radius = self.sizes.bar_radius_mm.0;
        let at = Pose::identity();
        let [workpiece, spindle] = ends;
        let Some(([_, end], stem)) = part.stem else {
            return Shape::capsule(workpiece, spindle, radius).moved(&at).clearance(placed, most);
        };
        let skipped = 2.0 * (radius + stem);
        let (ball, far) = if part.side == Side::Workpiece { (workpiece, spindle) } else { (spindle, workpiece) };
        let end: [f64; 3] = motion.transform_point(end.into()).into();
        let bar = Shape::capsule(beyond(ball, far, skipped), far, radius).moved(&at);
        bar.clearance(&Shape::capsule(beyond(ball, end, skipped), end, stem).moved(&at), most)
    }

    /// The motion of a frame from all axes at zero.
    fn carried(&self, frame: Frame, at: &[f64]) -> Pose {
        self.machine.carriers(frame).fold(Pose::identity(), |pose, axis| {
            let (own, q) = (&self.machine.axes[axis], at[axis]);
            let direction = Vector::from(own.direction);
            match own.kind {
                AxisKind::Linear => pose.append_translation(q * direction),
                AxisKind::Rotary => {
                    let origin = Vector::from(own.origin_mm);
                    let turned = Pose::rotation(q * direction) * pose.append_translation(-origin);
                    turned.append_translation(origin)
                }
            }
        })
    }
}

/// The frame of what an axis carries, or of the bed.
fn frame(axis: Option<usize>) -> Frame {
    axis.map_or(Frame::Bed, Frame::Axis)
}

/// The point at a distance from one end of a line; its other end if it is shorter.
fn beyond(from: [f64; 3], to: [f64; 3], by: f64) -> [f64; 3] {
    let (from, along) = (Vector::from(from), Vector::from(to) - Vector::from(from));
    let length = along.length();
    if length <= by { to } else { (from + along * (by / length)).into() }
}
