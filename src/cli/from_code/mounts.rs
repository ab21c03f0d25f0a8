//! Where the balls of a generated plan are mounted, and where the linear axes stand in each test.
//!
//! A ball is mounted once and stays. What a test needs of another place is done by the machine: linear axes move the spindle ball beside the
//! workpiece ball, and stand there. Where no axis moves along the direction that is needed, the ball that stands still is mounted again.

use abbe::model::axis::AxisKind;

use super::Body;

/// A length over the constants of the plan: so many times `R`, and so many times the lift `sqrt(R_e^2 - R^2)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Length {
    pub radius: i32,
    pub lift: i32,
}

/// A point or a distance, along X, Y and Z of R.
pub type Vector = [Length; 3];

impl Length {
    const ZERO: Length = Length { radius: 0, lift: 0 };

    /// `0`, `"R"`, `"-R"`, `"R + sqrt(R_e^2 - R^2)"`: as it stands in a session file.
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
        if text.is_empty() {
            "0".to_string()
        } else {
            format!("\"{text}\"")
        }
    }

    fn less(self, other: Length) -> Length {
        Length {
            radius: self.radius - other.radius,
            lift: self.lift - other.lift,
        }
    }

    fn negative(self) -> Length {
        Length::ZERO.less(self)
    }
}

/// `[0, "R", 0]`: a point as it stands in a session file.
pub fn point_text(point: &Vector) -> String {
    let [x, y, z] = point.map(Length::text);
    format!("[{x}, {y}, {z}]")
}

/// The side of the chain, seen from the bed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Workpiece,
    Tool,
}

/// Every place at which a ball is mounted: workpiece balls in the table frame, spindle balls in the tool frame.
pub struct Mounts {
    pub workpiece: Vec<Vector>,
    pub spindle: Vec<Vector>,
}

/// What a test takes: its mounts by number, and where the axes stand that it does not move.
pub struct Setting {
    pub workpiece: usize,
    pub spindle: usize,
    /// Linear axes by name and position; those that the test moves are not listed.
    pub at: Vec<(String, Length)>,
    /// Directions of R along which no axis could move, so that a ball is mounted again.
    pub remounted_along: Vec<usize>,
}

impl Mounts {
    /// The mounts that all tests share, and the mount that each axis turns: a workpiece ball beside the rotary axes of the table, a spindle ball
    /// beside those of the head. Axes along three directions take two mounts.
    pub fn of(bodies: &[Body]) -> Mounts {
        Mounts {
            workpiece: beside(bodies, Side::Workpiece),
            spindle: beside(bodies, Side::Tool),
        }
    }

    /// A test in which rotary axis `turning` carries its ball round the other one, which stands on the axis (`lift` 0) or lifted along it (1).
    pub fn sweep(&mut self, bodies: &[Body], turning: usize, lift: i32) -> Setting {
        let axis = &bodies[turning];
        let carried_on = axis.side();
        let (mut workpiece, mut spindle) = (0, 0);
        let (own, mounts) = match carried_on {
            Side::Workpiece => (&mut workpiece, &self.workpiece),
            Side::Tool => (&mut spindle, &self.spindle),
        };
        *own = (0..mounts.len())
            .find(|mount| is_off_axis(&mounts[*mount], axis.along))
            .unwrap_or(0);
        let ball = mounts[*own];
        // From workpiece ball to spindle ball: away from the carried ball to the axis, and along the axis.
        let mut wanted = match carried_on {
            Side::Workpiece => ball.map(Length::negative),
            Side::Tool => ball,
        };
        wanted[axis.along].lift += lift;
        // An axis that the turning one carries would change the radius.
        let carried = |index: usize| match carried_on {
            Side::Workpiece => index < turning,
            Side::Tool => index > turning,
        };
        let open: Vec<usize> = (0..bodies.len())
            .filter(|index| bodies[*index].side() != carried_on || !carried(*index))
            .collect();
        let standing = match carried_on {
            Side::Workpiece => Side::Tool,
            Side::Tool => Side::Workpiece,
        };
        self.placed(bodies, [workpiece, spindle], wanted, &open, standing)
    }

    /// A test in which two linear axes move the spindle ball on a circle about the workpiece ball; the others bring both into one plane.
    pub fn circle(&mut self, bodies: &[Body], pair: [usize; 2]) -> Setting {
        let open: Vec<usize> = (0..bodies.len()).collect();
        let apart: Vector = std::array::from_fn(|d| self.spindle[0][d].less(self.workpiece[0][d]));
        // Along the circle's own axes the path itself finds its centre.
        let mut wanted = [Length::ZERO; 3];
        for axis in pair {
            let along = bodies[axis].along;
            wanted[along] = apart[along];
        }
        let mut setting = self.placed(bodies, [0, 0], wanted, &open, Side::Tool);
        setting
            .at
            .retain(|(name, _)| pair.iter().all(|axis| bodies[*axis].name != *name));
        setting
    }

    /// Moves the first open linear axis along each direction until the spindle ball lies at `wanted` from the workpiece ball, all rotary axes at
    /// zero; where there is none, mounts the ball of the `standing` side again.
    fn placed(
        &mut self,
        bodies: &[Body],
        mounts: [usize; 2],
        wanted: Vector,
        open: &[usize],
        standing: Side,
    ) -> Setting {
        let (mut workpiece, mut spindle) = (self.workpiece[mounts[0]], self.spindle[mounts[1]]);
        let is_linear = |index: &usize| bodies[*index].kind == AxisKind::Linear;
        let mut at: Vec<(usize, Length)> = (0..bodies.len())
            .filter(is_linear)
            .map(|axis| (axis, Length::ZERO))
            .collect();
        let mut remounted_along = Vec::new();
        for along in 0..3 {
            let missing = wanted[along].less(spindle[along].less(workpiece[along]));
            if missing == Length::ZERO {
                continue;
            }
            let moves = |axis: usize| open.contains(&axis) && bodies[axis].along == along;
            if let Some((axis, position)) = at.iter_mut().find(|(axis, _)| moves(*axis)) {
                // The table goes the other way to the same end.
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
            workpiece: place_of(&mut self.workpiece, workpiece),
            spindle: place_of(&mut self.spindle, spindle),
            at: at
                .into_iter()
                .map(|(axis, position)| (bodies[axis].name.clone(), position))
                .collect(),
            remounted_along,
        }
    }
}

/// Where a point stands in a list, at its end if it is not there yet.
fn place_of(list: &mut Vec<Vector>, point: Vector) -> usize {
    list.iter().position(|other| *other == point).unwrap_or_else(|| {
        list.push(point);
        list.len() - 1
    })
}

/// Whether an axis along this direction carries the ball round a circle of radius R.
fn is_off_axis(ball: &Vector, along: usize) -> bool {
    let beside: i32 = (0..3)
        .filter(|direction| *direction != along)
        .map(|direction| ball[direction].radius.abs())
        .sum();
    beside == 1
}

/// Balls that lie R from every rotary axis of a side, two directions of axes to a ball; at R's origin where nothing turns on that side.
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
        // Under the head, where a tool is; on the table beside the axis.
        let (order, sign) = match side {
            Side::Tool => ([2, 0, 1], -1),
            Side::Workpiece => ([1, 0, 2], 1),
        };
        let across = order
            .into_iter()
            .find(|direction| !directions.contains(direction))
            .unwrap_or(2);
        let mut ball = [Length::ZERO; 3];
        ball[across].radius = if across == 2 { sign } else { 1 };
        ball
    };
    directions.chunks(2).map(ball).collect()
}
