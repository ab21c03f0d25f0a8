//! Mounting points of the balls of a generated plan, and positions of the linear axes in each test.
//!
//! A ball is mounted once. Linear axes move the spindle ball to the position relative to the workpiece ball that a test
//! needs. If no axis moves along a required direction, the ball that does not move in the test is mounted again.

use abbe_model::axis::AxisKind;

use super::body::{Body, Side};
use super::geometry::{EXTENDED_MM, Geometry, RADIUS_MM};

/// Lengths that differ by no more are equal, mm.
const SAME_MM: f64 = 1e-9;

/// A length over the constants of the plan: `radius` times `R`, plus `lift` times `sqrt(R_e^2 - R^2)`, plus `mm`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Length {
    pub radius: i32,
    pub lift: i32,
    pub mm: f64,
}

/// A point or a distance, along X, Y and Z of R.
pub(super) type Vector = [Length; 3];

impl Length {
    pub const ZERO: Length = Length { radius: 0, lift: 0, mm: 0.0 };
    pub const RADIUS: Length = Length { radius: 1, ..Length::ZERO };
    pub const LIFT: Length = Length { lift: 1, ..Length::ZERO };

    /// A length; the radius where it is that.
    pub fn of(mm: f64) -> Length {
        if (mm - RADIUS_MM).abs() < SAME_MM { Length::RADIUS } else { Length { mm, ..Length::ZERO } }
    }

    /// `0`, `12.5`, `"R"`, `"-R"`, `"R + sqrt(R_e^2 - R^2)"`: as in a session file.
    pub fn text(self) -> String {
        let mut text = String::new();
        for (count, name) in [(self.radius, "R"), (self.lift, "sqrt(R_e^2 - R^2)")] {
            if count == 0 {
                continue;
            }
            text.push_str(sign(text.is_empty(), count < 0));
            if count.abs() > 1 {
                text.push_str(&format!("{} * ", count.abs()));
            }
            text.push_str(name);
        }
        if self.mm.abs() < SAME_MM {
            return if text.is_empty() { "0".into() } else { format!("\"{text}\"") };
        }
        if text.is_empty() {
            return format!("{}", self.mm);
        }
        format!("\"{text}{}{}\"", sign(false, self.mm < 0.0), self.mm.abs())
    }

    pub fn is_zero(self) -> bool {
        self.value().abs() < SAME_MM
    }

    fn value(self) -> f64 {
        f64::from(self.radius) * RADIUS_MM
            + f64::from(self.lift) * (EXTENDED_MM.powi(2) - RADIUS_MM.powi(2)).sqrt()
            + self.mm
    }

    pub fn plus(self, other: Length) -> Length {
        Length { radius: self.radius + other.radius, lift: self.lift + other.lift, mm: self.mm + other.mm }
    }

    pub fn negative(self) -> Length {
        Length { radius: -self.radius, lift: -self.lift, mm: -self.mm }
    }

    fn less(self, other: Length) -> Length {
        self.plus(other.negative())
    }
}

fn sign(is_first: bool, is_negative: bool) -> &'static str {
    match (is_first, is_negative) {
        (true, false) => "",
        (true, true) => "-",
        (false, false) => " + ",
        (false, true) => " - ",
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
    /// The mounting points that all tests share: a workpiece ball beside the rotary axes of the table, a spindle ball in
    /// place of a tool, or on an arm if the head can turn and not tilt. Axes of the table along three directions need two
    /// workpiece balls.
    pub fn of(bodies: &[Body], geometry: &Geometry) -> Mounts {
        let turns = |tilts: bool| {
            let of_head = |own: &&Body| own.kind == AxisKind::Rotary && own.side() == Side::Tool;
            bodies.iter().filter(of_head).any(|own| (own.along != 2) == tilts)
        };
        let mut mounts = Mounts { workpiece: beside(bodies, geometry), spindle: Vec::new() };
        if turns(true) || !turns(false) {
            mounts.spindle.push([Length::ZERO; 3]);
        } else {
            mounts.on_arm();
        }
        mounts
    }

    /// The number of the spindle ball on an arm, at the radius from the axis of the spindle.
    pub fn on_arm(&mut self) -> usize {
        index_of(&mut self.spindle, [Length::RADIUS, Length::ZERO, Length::ZERO])
    }

    /// The number of the workpiece ball beside an axis of the table.
    pub fn beside(&self, axis: &Body) -> usize {
        let is_beside = |ball: &Vector| match axis.along {
            0 => !ball[1].is_zero(),
            1 => !ball[0].is_zero(),
            _ => ball[0].is_zero() != ball[1].is_zero(),
        };
        self.workpiece.iter().position(is_beside).unwrap_or(0)
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
    pub fn placed(
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
            if missing.is_zero() {
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
                Side::Tool => spindle[along] = spindle[along].plus(missing),
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
    let is_same = |other: &Vector| (0..3).all(|along| other[along].less(point[along]).is_zero());
    list.iter().position(is_same).unwrap_or_else(|| {
        list.push(point);
        list.len() - 1
    })
}

/// Workpiece balls beside the rotary axes of the table, at the height that the geometry gives; one on the axis of the
/// spindle if there are none.
fn beside(bodies: &[Body], geometry: &Geometry) -> Vec<Vector> {
    let turns = |along: usize| {
        bodies.iter().any(|own| own.kind == AxisKind::Rotary && own.side() == Side::Workpiece && own.along == along)
    };
    let [about_x, about_y, about_z] = [0, 1, 2].map(turns);
    let beside = Length::of(geometry.beside(about_x || about_y));
    let height = Length { mm: geometry.ball_height, ..Length::ZERO };
    match (about_x, about_y, about_z) {
        (false, false, false) => vec![[Length::ZERO, Length::ZERO, height]],
        (true, true, false) => vec![[beside, beside, height]],
        (true, true, true) => vec![[beside, Length::ZERO, height], [Length::ZERO, beside, height]],
        (false, true, _) => vec![[beside, Length::ZERO, height]],
        _ => vec![[Length::ZERO, beside, height]],
    }
}
