//! Clearance of bar, holders and bodies along a test: capsules, boxes and surfaces of triangles.
//!
//! | against | compared with |
//! |---|---|
//! | bar | bodies of both sides and of the bed; a holder beyond `2 (r_bar + r_holder)` from the ball that they share |
//! | workpiece holder | spindle holder, bodies of the tool side and of the bed |
//! | spindle holder | workpiece holder, bodies of the workpiece side and of the bed |
//! | body of the workpiece side | bodies of the tool side and of the bed |
//! | body of the tool side | bodies of the bed |
//!
//! Bodies of one side are not compared with each other. Between two states of a test, axes are interpolated around the
//! state with the least clearance.

mod distance;
mod shape;

use std::collections::BTreeMap;

use abbe_model::axis::AxisKind;
use abbe_model::body::{BodyShape, ClearanceSizes, Holder};
use abbe_model::chain::Machine;
use abbe_model::frames::{Point, SinCos};
use abbe_model::instrument::Station;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use schemars::JsonSchema;
use serde::Serialize;

pub(crate) use distance::segment_distance;
use shape::{Mesh, Motion, Shape};

/// Interpolated states beside the state with the least clearance, on either side.
const REFINED: usize = 16;

/// Clearances that differ by no more are equal, mm.
const SAME_MM: f64 = 1e-9;

/// The least clearance of a test.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TestClearance {
    /// The test.
    pub test: String,
    /// Least distance of two bodies over the test, mm. At most 0 if they collide.
    pub clearance_mm: f64,
    /// The two bodies: `bar`, `workpiece holder`, `spindle holder`, or names of the machine file.
    pub between: [String; 2],
    /// Positions of all axes there: `a_deg`, `x_mm`, …
    pub at: BTreeMap<String, f64>,
}

/// On which side of the bed a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Workpiece,
    Bed,
    Tool,
}

struct Part {
    name: String,
    side: Side,
    is_holder: bool,
    /// The axis that carries it.
    axis: Option<usize>,
    shape: Shape,
}

/// The parts of a test that can collide.
pub struct Parts<'m> {
    machine: &'m Machine,
    parts: Vec<Part>,
    sizes: ClearanceSizes,
    bar: Option<abbe_model::instrument::ballbar::BallBar<f64>>,
}

impl<'m> Parts<'m> {
    /// The parts of a test; `None` if the session states neither bodies nor sizes, so that nothing is to be compared.
    pub fn of(session: &'m Session, test: &Test) -> Option<Parts<'m>> {
        let machine = &*session.machine;
        if machine.bodies.is_empty() && session.clearance.is_none() {
            return None;
        }
        let sizes = session.clearance.unwrap_or_default();
        let mut parts: Vec<Part> = (machine.bodies.iter())
            .map(|body| Part {
                name: body.name.clone(),
                side: match body.axis {
                    None => Side::Bed,
                    Some(axis) if axis < machine.workpiece_side => Side::Workpiece,
                    Some(_) => Side::Tool,
                },
                is_holder: false,
                axis: body.axis,
                shape: match &body.shape {
                    BodyShape::Capsule { ends_mm, radius_mm } => Shape::Capsule { ends: *ends_mm, radius: *radius_mm },
                    BodyShape::Mesh(triangles) => Shape::Mesh(Mesh::new(triangles)),
                },
            })
            .collect();
        let bar = match &test.station {
            Station::BallBar(bar) => Some(bar.clone()),
            _ => None,
        };
        if let Some(bar) = &bar {
            let last = machine.axes.len().checked_sub(1).filter(|last| *last >= machine.workpiece_side);
            let first = (machine.workpiece_side > 0).then_some(0);
            let stem = |name: &str, side: Side, axis: Option<usize>, from: [f64; 3], up: f64, holder: Holder| Part {
                name: name.to_string(),
                side,
                is_holder: true,
                axis,
                shape: Shape::Capsule {
                    ends: [from, [from[0], from[1], from[2] + up * holder.length_mm]],
                    radius: holder.radius_mm,
                },
            };
            parts.extend(
                sizes
                    .workpiece_holder
                    .map(|holder| stem("workpiece holder", Side::Workpiece, first, bar.workpiece_ball, -1.0, holder)),
            );
            parts.extend(
                sizes
                    .spindle_holder
                    .map(|holder| stem("spindle holder", Side::Tool, last, bar.spindle_ball, 1.0, holder)),
            );
        }
        Some(Parts { machine, parts, sizes, bar })
    }

    /// The least clearance over the states of a test.
    pub fn least(&self, test: &str, readings: &Readings) -> Option<TestClearance> {
        // Every run of a path passes the same states. Poses are no path: each stands alone.
        let is_path = !readings.run.is_empty();
        let rows = if is_path { readings.runs().first().cloned()? } else { 0..readings.rows() };
        let state = |row: usize| -> Vec<f64> { readings.positions.iter().map(|column| column[row]).collect() };
        let states: Vec<Vec<f64>> = rows.map(state).collect();
        let found = states.iter().map(|at| self.at(at)).collect::<Option<Vec<Found>>>()?;
        let mm = |k: usize| found.get(k).map_or(f64::INFINITY, |found| found.mm);
        // One state stands for a run of equal clearances: its first.
        let lowest = |k: &usize| {
            mm(*k) <= mm(*k + 1) + SAME_MM && k.checked_sub(1).is_none_or(|before| mm(*k) < mm(before) - SAME_MM)
        };
        let refined = |k: usize| match is_path {
            true => self.refined(&states, k, &found[k]),
            false => (states[k].clone(), found[k].clone()),
        };
        let refined = (0..states.len()).filter(lowest).map(refined);
        let (at, best) = refined.min_by(|(_, a), (_, b)| a.mm.total_cmp(&b.mm))?;
        let named = |(axis, q): (&abbe_model::axis::Axis, &f64)| (axis.column(""), axis.kind.to_display(*q));
        Some(TestClearance {
            test: test.to_string(),
            clearance_mm: best.mm,
            between: best.between,
            at: self.machine.axes.iter().zip(&at).map(named).collect(),
        })
    }

    /// The least clearance between a state and its neighbours, with interpolated axes.
    fn refined(&self, states: &[Vec<f64>], k: usize, found: &Found) -> (Vec<f64>, Found) {
        let mut least = (states[k].clone(), found.clone());
        for other in [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|k| states.get(k)) {
            for step in 1..REFINED {
                let share = step as f64 / REFINED as f64;
                let at: Vec<f64> = states[k].iter().zip(other).map(|(a, b)| a + share * (b - a)).collect();
                if let Some(found) = self.at(&at).filter(|found| found.mm < least.1.mm) {
                    least = (at, found);
                }
            }
        }
        least
    }

    /// Whether a state has the least clearance that is asked for.
    pub fn clears(&self, at: &[f64]) -> bool {
        self.below(at, self.sizes.least_mm).is_none()
    }

    /// Whether all states of a test have the least clearance that is asked for.
    pub fn clears_all(&self, readings: &Readings) -> bool {
        let state = |row: usize| -> Vec<f64> { readings.positions.iter().map(|column| column[row]).collect() };
        let first = readings.runs().first().filter(|_| !readings.run.is_empty()).cloned();
        first.unwrap_or(0..readings.rows()).all(|row| self.clears(&state(row)))
    }

    /// The least clearance at one state.
    fn at(&self, at: &[f64]) -> Option<Found> {
        self.below(at, f64::INFINITY)
    }

    /// The least clearance at one state, if it is less than `most`.
    fn below(&self, at: &[f64], most: f64) -> Option<Found> {
        let placed: Vec<(&Part, Shape)> =
            self.parts.iter().map(|part| (part, part.shape.moved(&self.carried(part.axis, at)))).collect();
        let bar = self.bar.as_ref().map(|bar| {
            let last = self.machine.axes.len().checked_sub(1).filter(|last| *last >= self.machine.workpiece_side);
            let first = (self.machine.workpiece_side > 0).then_some(0);
            [self.carried(first, at).of(bar.workpiece_ball), self.carried(last, at).of(bar.spindle_ball)]
        });
        let mut found: Option<Found> = None;
        let mut compare = |names: [&str; 2], one: &Shape, other: &Shape| {
            let best = found.as_ref().map_or(most, |best| best.mm);
            let mm = one.clearance(other, best);
            if mm < best {
                found = Some(Found { mm, between: names.map(str::to_string) });
            }
        };
        // The bar first: it is near, and what is farther apart than it needs no distance.
        for (part, shape) in &placed {
            if let Some(ends) = bar {
                let (bar, beside) = self.bar_beside(ends, part, shape);
                compare(["bar", &part.name], &bar, &beside);
            }
        }
        for (number, (one, shape)) in placed.iter().enumerate() {
            for (other, other_shape) in &placed[number + 1..] {
                if one.side != other.side {
                    compare([&one.name, &other.name], shape, other_shape);
                }
            }
        }
        found
    }

    /// The bar and a part, without what both have at the ball that they share.
    fn bar_beside(&self, [workpiece, spindle]: [[f64; 3]; 2], part: &Part, shape: &Shape) -> (Shape, Shape) {
        let radius = self.sizes.bar_radius_mm;
        let whole = Shape::Capsule { ends: [workpiece, spindle], radius };
        let Shape::Capsule { ends: [ball, end], radius: stem } = shape else {
            return (whole, shape.clone());
        };
        if !part.is_holder {
            return (whole, shape.clone());
        }
        let skipped = 2.0 * (radius + stem);
        let far = if part.side == Side::Workpiece { spindle } else { workpiece };
        (
            Shape::Capsule { ends: [beyond(*ball, far, skipped), far], radius },
            Shape::Capsule { ends: [beyond(*ball, *end, skipped), *end], radius: *stem },
        )
    }

    /// The motion of what an axis carries, from all axes at zero.
    fn carried(&self, axis: Option<usize>, at: &[f64]) -> Motion {
        let of = |point: [f64; 3]| {
            let Some(axis) = axis else { return point };
            // From the body to the bed.
            let order: Vec<usize> = if axis < self.machine.workpiece_side {
                (axis..self.machine.workpiece_side).collect()
            } else {
                (self.machine.workpiece_side..=axis).rev().collect()
            };
            order.into_iter().fold(point, |point, axis| {
                let (own, q) = (&self.machine.axes[axis], at[axis]);
                match own.kind {
                    AxisKind::Linear => std::array::from_fn(|i| point[i] + q * own.direction[i]),
                    AxisKind::Rotary => {
                        let (sin, cos) = q.sin_cos();
                        let relative = std::array::from_fn(|i| point[i] - own.origin_mm[i]);
                        let turned = own.rotate(SinCos { sin, cos }, Point(relative)).0;
                        std::array::from_fn(|i| turned[i] + own.origin_mm[i])
                    }
                }
            })
        };
        let origin = of([0.0; 3]);
        let directions = [0, 1, 2].map(|k| {
            let end = of(std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 }));
            std::array::from_fn(|i| end[i] - origin[i])
        });
        Motion { directions, origin }
    }
}

#[derive(Clone)]
struct Found {
    mm: f64,
    between: [String; 2],
}

/// The point at a distance from one end of a line; its other end if it is shorter.
fn beyond(from: [f64; 3], to: [f64; 3], by: f64) -> [f64; 3] {
    let length = distance::between(from, to);
    if length <= by {
        return to;
    }
    std::array::from_fn(|i| from[i] + (to[i] - from[i]) * by / length)
}

/// The least clearance of every test with states, in their order; empty if nothing is to be compared.
pub fn clearances(session: &Session) -> Vec<TestClearance> {
    let of = |test: &Test| {
        let readings = test.readings.as_ref()?;
        Parts::of(session, test)?.least(&test.name, readings)
    };
    session.tests.iter().filter_map(of).collect()
}

/// The sentences about tests with less clearance than the session asks for.
pub fn warnings(session: &Session, found: &[TestClearance]) -> Vec<String> {
    let least_mm = session.clearance.unwrap_or_default().least_mm;
    let too_close = found.iter().filter(|found| found.clearance_mm < least_mm);
    too_close
        .map(|found| {
            let at: Vec<String> = found.at.iter().map(|(name, q)| format!("{name} = {q:.3}")).collect();
            let [one, other] = &found.between;
            let what = if found.clearance_mm <= 0.0 {
                format!("{one} and {other} collide")
            } else {
                format!("{one} and {other} come within {:.1} mm", found.clearance_mm)
            };
            format!("test \"{}\": {what} at {}", found.test, at.join(", "))
        })
        .collect()
}
