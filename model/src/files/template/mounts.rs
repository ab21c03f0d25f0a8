//! Mounting points of the balls of a generated plan, and positions of the linear axes in each test.
//!
//! A ball is mounted once. Linear axes move the spindle ball to the position relative to the workpiece ball that a test
//! needs. If no axis moves along a required direction, the ball that does not move in the test is mounted again.

use crate::axis::AxisKind;

use super::body::{Body, Side};

/// A length over the constants of the plan: `radius` times `R` plus `lift` times `sqrt(R_e^2 - R^2)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Length {
    pub radius: i32,
    pub lift: i32,
}

/// A point or a distance, along X, Y and Z of R.
pub(super) type Vector = [Length; 3];

impl Length {
    const ZERO: Length = Length { radius: 0, lift: 0 };

    /// `0`, `"R"`, `"-R"`, `"R + sqrt(R_e^2 - R^2)"`: as in a session file.
    pub fn text(self) -> String {
        let mut text = String::new();
        for (count, name) in [(self.radius, "R"), (self.lift, "sqrt(R_e^2 - R^2)")] {
            if count == 0 {
                continue;
            }
            text.push_str(match (text.is_empty(), count < 0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            });
            if count.abs() > 1 {
                text.push_str(&format!("{} * ", count.abs()));
            }
            text.push_str(name);
        }
        if text.is_empty() { "0".to_string() } else { format!("\"{text}\"") }
    }

    fn less(self, other: Length) -> Length {
        Length { radius: self.radius - other.radius, lift: self.lift - other.lift }
    }

    fn negative(self) -> Length {
        Length::ZERO.less(self)
    }
}

/// A point as in a session file: `[0, "R", 0]`.
pub(super) fn point_text(point: &Vector) -> String {
    let [x, y, z] = point.map(Length::text);
    format!("[{x}, {y}, {z}]")
}

/// All mounting points: workpiece balls in the table frame, spindle balls in the tool frame.
pub(super) struct Mounts {
    pub workpiece: Vec<Vector>,
    pub spindle: Vec<Vector>,
}

/// The set-up of a test: its mounting points by number, and the positions of the axes that it does not move.
pub(super) struct Setting {
    pub workpiece: usize,
    pub spindle: usize,
    /// Linear axes that the test does not move, by name and position.
    pub at: Vec<(String, Length)>,
    /// Directions of R along which no axis can move, so that a ball is mounted again.
    pub remounted_along: Vec<usize>,
}

impl Mounts {
    /// The mounting points that all tests share: a workpiece ball beside the rotary axes of the table, a spindle ball
    /// beside those of the head. Axes along three directions need two mounting points.
    pub fn of(bodies: &[Body]) -> Mounts {
        Mounts { workpiece: beside(bodies, Side::Workpiece), spindle: beside(bodies, Side::Tool) }
    }

    /// A test in which rotary axis `turning` moves its ball about the other ball, which is on the axis (`lift` 0) or
    /// raised along it (`lift` 1).
    pub fn sweep(&mut self, bodies: &[Body], turning: usize, lift: i32) -> Setting {
        let axis = &bodies[turning];
        let carried_on = axis.side();
        let (mut workpiece, mut spindle) = (0, 0);
        let (own, mounts) = match carried_on {
            Side::Workpiece => (&mut workpiece, &self.workpiece),
            Side::Tool => (&mut spindle, &self.spindle),
        };
        *own = (0..mounts.len()).find(|mount| is_off_axis(&mounts[*mount], axis.along)).unwrap_or(0);
        let ball = mounts[*own];
        // The vector from workpiece ball to spindle ball: from the moved ball to the axis, and along the axis.
        let mut wanted = match carried_on {
            Side::Workpiece => ball.map(Length::negative),
            Side::Tool => ball,
        };
        wanted[axis.along].lift += lift;
        // An axis that the turning axis carries changes the radius.
        let carried = |index: usize| match carried_on {
            Side::Workpiece => index < turning,
            Side::Tool => index > turning,
        };
        let usable: Vec<usize> =
            (0..bodies.len()).filter(|index| bodies[*index].side() != carried_on || !carried(*index)).collect();
        let standing = match carried_on {
            Side::Workpiece => Side::Tool,
            Side::Tool => Side::Workpiece,
        };
        self.placed(bodies, [workpiece, spindle], wanted, &usable, standing)
    }

    /// A test in which two linear axes move the spindle ball on a circle about the workpiece ball. The other axes move
    /// both into one plane.
    pub fn circle(&mut self, bodies: &[Body], pair: [usize; 2]) -> Setting {
        let usable: Vec<usize> = (0..bodies.len()).collect();
        let apart: Vector = std::array::from_fn(|d| self.spindle[0][d].less(self.workpiece[0][d]));
        // Along the axes of the circle the path starts from its centre.
        let mut wanted = [Length::ZERO; 3];
        for axis in pair {
            let along = bodies[axis].along;
            wanted[along] = apart[along];
        }
        let mut setting = self.placed(bodies, [0, 0], wanted, &usable, Side::Tool);
        setting.at.retain(|(name, _)| pair.iter().all(|axis| bodies[*axis].name != *name));
        setting
    }

    /// Moves the first usable linear axis along each direction until the spindle ball is at `wanted` from the workpiece
    /// ball, with all rotary axes at zero. Without such an axis the ball of the `standing` side is mounted again.
    fn placed(
        &mut self,
        bodies: &[Body],
        mounts: [usize; 2],
        wanted: Vector,
        usable: &[usize],
        standing: Side,
    ) -> Setting {
        let (mut workpiece, mut spindle) = (self.workpiece[mounts[0]], self.spindle[mounts[1]]);
        let is_linear = |index: &usize| bodies[*index].kind == AxisKind::Linear;
        let mut at: Vec<(usize, Length)> =
            (0..bodies.len()).filter(is_linear).map(|axis| (axis, Length::ZERO)).collect();
        let mut remounted_along = Vec::new();
        for along in 0..3 {
            let missing = wanted[along].less(spindle[along].less(workpiece[along]));
            if missing == Length::ZERO {
                continue;
            }
            let moves = |axis: usize| usable.contains(&axis) && bodies[axis].along == along;
            if let Some((axis, position)) = at.iter_mut().find(|(axis, _)| moves(*axis)) {
                // A table moves in the opposite direction.
                *position = match bodies[*axis].side() {
                    Side::Tool => missing,
                    Side::Workpiece => missing.negative(),
                };
                continue;
            }
            remounted_along.push(along);
            match standing {
                Side::Tool => spindle[along] = spindle[along].less(missing.negative()),
                Side::Workpiece => workpiece[along] = workpiece[along].less(missing),
            }
        }
        Setting {
            workpiece: index_of(&mut self.workpiece, workpiece),
            spindle: index_of(&mut self.spindle, spindle),
            at: at.into_iter().map(|(axis, position)| (bodies[axis].name.clone(), position)).collect(),
            remounted_along,
        }
    }
}

/// The index of a point in a list. A new point is added at the end.
fn index_of(list: &mut Vec<Vector>, point: Vector) -> usize {
    list.iter().position(|other| *other == point).unwrap_or_else(|| {
        list.push(point);
        list.len() - 1
    })
}

/// Whether an axis along this direction moves the ball on a circle of radius R.
fn is_off_axis(ball: &Vector, along: usize) -> bool {
    let beside: i32 =
        (0..3).filter(|direction| *direction != along).map(|direction| ball[direction].radius.abs()).sum();
    beside == 1
}

/// Balls at the distance R from the rotary axes of a side, one ball per two directions of axes; a ball at the origin of
/// R if the side has no rotary axis.
fn beside(bodies: &[Body], side: Side) -> Vec<Vector> {
    let mut directions: Vec<usize> = Vec::new();
    for body in bodies {
        if body.kind == AxisKind::Rotary && body.side() == side && !directions.contains(&body.along) {
            directions.push(body.along);
        }
    }
    if directions.is_empty() {
        return vec![[Length::ZERO; 3]];
    }
    let ball = |directions: &[usize]| -> Vector {
        // Below the head, in place of a tool; on the table beside the axis.
        let (order, sign) = match side {
            Side::Tool => ([2, 0, 1], -1),
            Side::Workpiece => ([1, 0, 2], 1),
        };
        let across = order.into_iter().find(|direction| !directions.contains(direction)).unwrap_or(2);
        let mut ball = [Length::ZERO; 3];
        ball[across].radius = if across == 2 { sign } else { 1 };
        ball
    };
    directions.chunks(2).map(ball).collect()
}
