//! The tests of a rotary axis in a generated plan: positions at which spindle and holders stay clear of the table.
//!
//! | axis | tests |
//! |---|---|
//! | of the table | a sweep about the spindle ball on the axis, in the plane of the circle and beside it |
//! | of a table that is too high above the tilting axis | paths that the linear axes follow, radial and axial |
//! | of the head, across Z | paths that the linear axes follow, radial and axial: on its axis is the head itself |
//! | of the head, along Z | a sweep about the workpiece ball on the axis, with the head tilted or the spindle ball on an arm |

use abbe_model::axis::AxisKind;

use super::body::{Body, Side};
use super::geometry::{EXTENDED_MM, Geometry, HEAD_TILT_DEG, RADIUS_MM, TABLE_TILT_DEG};
use super::mounts::{Length, Mounts, Setting, Vector};

/// A test of the plan.
pub(super) struct PlannedTest {
    /// Its name.
    pub name: String,
    /// What it does, a sentence.
    pub about: String,
    /// Whether the bar has its extension.
    pub extended: bool,
    pub setting: Setting,
    /// The side whose ball does not move.
    pub standing: Side,
    /// The position of another rotary axis, by index, degrees.
    pub tilted: Option<(usize, f64)>,
    /// The axes that it names, by index.
    pub moving: Vec<usize>,
    pub motion: PlannedMotion,
}

/// The motion of a test, degrees.
pub(super) enum PlannedMotion {
    /// A rotary axis alone.
    Sweep { from: f64, to: f64 },
    /// The linear axes follow it, with the bar in this direction.
    Follow { offset: &'static str, to: f64 },
    /// Two linear axes on a circle.
    Circle,
}

/// The tests of the rotary axis `turning`; none if no bar can be set up for it.
pub(super) fn tests(mounts: &mut Mounts, bodies: &[Body], turning: usize, geometry: &Geometry) -> Vec<PlannedTest> {
    let axis = &bodies[turning];
    let on_table = axis.side() == Side::Workpiece;
    match (on_table, axis.along == 2) {
        (true, true) => of_table(mounts, bodies, turning, [-180.0, 180.0]),
        (true, false) => match geometry.tilt_deg() {
            // A ball at +X goes down for a positive turn about Y.
            Some([down, up]) if axis.along == 1 => of_table(mounts, bodies, turning, [-up, -down]),
            Some(range) => of_table(mounts, bodies, turning, range),
            None => followed(mounts, bodies, turning, TABLE_TILT_DEG),
        },
        (false, false) => followed(mounts, bodies, turning, HEAD_TILT_DEG),
        (false, true) => of_vertical_head(mounts, bodies, turning, geometry),
    }
}

/// Where the ball that does not move is, in words.
fn place(extended: bool) -> &'static str {
    if extended {
        "on the axis outside the plane of the circle, at the reach of the extended bar, so that the orientation of the axis changes the readings"
    } else {
        "on the axis in the plane of the circle, or as near to it as the bar reaches, so that the position of the axis changes the readings"
    }
}

fn named(name: &str, extended: bool) -> String {
    format!("{name}{}", if extended { EXTENDED_MM } else { RADIUS_MM })
}

/// The distance along the axis at which the bar reaches a ball at this distance from it.
fn lift(beside: Length, extended: bool) -> Length {
    match (beside.mm == 0.0, extended) {
        (true, false) => Length::ZERO,
        (true, true) => Length::LIFT,
        (false, extended) => {
            let bar = if extended { EXTENDED_MM } else { RADIUS_MM };
            Length { mm: (bar.powi(2) - beside.mm.powi(2)).max(0.0).sqrt(), ..Length::ZERO }
        }
    }
}

/// Axes that the turning axis does not carry, by index: others change the circle, or are errors of their own in it.
fn usable(bodies: &[Body], turning: usize) -> Vec<usize> {
    let side = bodies[turning].side();
    let carried = |index: usize| match side {
        Side::Workpiece => index < turning,
        Side::Tool => index > turning,
    };
    (0..bodies.len()).filter(|index| bodies[*index].side() != side || !carried(*index)).collect()
}

/// Sweeps of an axis of the table about the spindle ball on it.
fn of_table(mounts: &mut Mounts, bodies: &[Body], turning: usize, [from, to]: [f64; 2]) -> Vec<PlannedTest> {
    let axis = &bodies[turning];
    let workpiece = mounts.beside(axis);
    let ball = mounts.workpiece[workpiece];
    let mut test = |extended: bool| {
        let mut wanted: Vector = ball.map(Length::negative);
        wanted[axis.along] = match axis.along {
            2 => lift(if ball[0].is_zero() { ball[1] } else { ball[0] }, extended),
            // Beside and above the axis the ball is at the radius.
            _ => lift(Length::RADIUS, extended),
        };
        PlannedTest {
            name: named(&axis.name, extended),
            about: format!(
                "{} turns the workpiece ball about the spindle ball, which is {}.",
                axis.name,
                place(extended)
            ),
            extended,
            setting: mounts.placed(bodies, [workpiece, 0], wanted, &usable(bodies, turning), Side::Tool),
            standing: Side::Tool,
            tilted: None,
            moving: vec![turning],
            motion: PlannedMotion::Sweep { from, to },
        }
    };
    vec![test(false), test(true)]
}

/// Paths on which the linear axes keep the bar radial and axial while a rotary axis turns.
fn followed(mounts: &mut Mounts, bodies: &[Body], turning: usize, tilt_deg: f64) -> Vec<PlannedTest> {
    let spans = |along: usize| bodies.iter().any(|own| own.kind == AxisKind::Linear && own.along == along);
    if !(0..3).all(spans) {
        return Vec::new();
    }
    let axis = &bodies[turning];
    let on_table = axis.side() == Side::Workpiece;
    let workpiece = if on_table { mounts.beside(axis) } else { 0 };
    let all: Vec<usize> = (0..bodies.len()).collect();
    let mut test = |offset: &'static str, sees: &str, apart: Length| {
        // Along the axis no linear axis moves: it stands where the bar asks for.
        let (ball, other) = (mounts.workpiece[workpiece], mounts.spindle[0]);
        let mut wanted: Vector = std::array::from_fn(|d| other[d].plus(ball[d].negative()));
        wanted[axis.along] = if on_table { apart } else { apart.negative() };
        let mut setting = mounts.placed(bodies, [workpiece, 0], wanted, &all, Side::Tool);
        setting.at.retain(|(name, _)| bodies.iter().any(|own| own.name == *name && own.along == axis.along));
        PlannedTest {
            name: format!("{} {offset}", axis.name),
            about: format!(
                "The linear axes follow {} with the bar {offset}, so that the {sees} of the axis changes the readings.",
                axis.name
            ),
            extended: false,
            setting,
            standing: if on_table { Side::Tool } else { Side::Workpiece },
            tilted: None,
            moving: vec![turning],
            motion: PlannedMotion::Follow { offset, to: tilt_deg },
        }
    };
    vec![test("radial", "position", Length::ZERO), test("axial", "orientation", Length::RADIUS)]
}

/// Sweeps of a vertical axis of the head about the workpiece ball on it.
fn of_vertical_head(mounts: &mut Mounts, bodies: &[Body], turning: usize, geometry: &Geometry) -> Vec<PlannedTest> {
    let axis = &bodies[turning];
    let tilting = (turning + 1..bodies.len()).find(|k| bodies[*k].kind == AxisKind::Rotary && bodies[*k].along != 2);
    let tilt_deg = geometry.tilted_head_deg();
    let (sin, cos) = tilt_deg.to_radians().sin_cos();
    // Where the spindle ball is from the axis, and how the tilt has moved it.
    let (spindle, beside, moved) = match tilting {
        None => (mounts.on_arm(), [Length::RADIUS, Length::ZERO], [Length::ZERO; 3]),
        Some(tilting) => {
            let out = Length::of(geometry.lever * sin);
            let up = Length { mm: geometry.lever * (1.0 - cos), ..Length::ZERO };
            match bodies[tilting].along {
                0 => (0, [Length::ZERO, out], [Length::ZERO, out, up]),
                _ => (0, [out.negative(), Length::ZERO], [out.negative(), Length::ZERO, up]),
            }
        }
    };
    let out = if beside[0].is_zero() { beside[1] } else { beside[0] };
    let mut test = |extended: bool| {
        // The workpiece ball is below the plane of the circle.
        let wanted = [beside[0], beside[1], lift(out, extended)];
        // The placing has no tilt.
        let wanted: Vector = std::array::from_fn(|d| wanted[d].plus(moved[d].negative()));
        PlannedTest {
            name: named(&axis.name, extended),
            about: format!(
                "{} turns the spindle ball about the workpiece ball, which is {}.",
                axis.name,
                place(extended)
            ),
            extended,
            setting: mounts.placed(bodies, [0, spindle], wanted, &usable(bodies, turning), Side::Workpiece),
            standing: Side::Workpiece,
            moving: vec![turning],
            tilted: tilting.map(|tilting| (tilting, tilt_deg)),
            motion: PlannedMotion::Sweep { from: -180.0, to: 180.0 },
        }
    };
    vec![test(false), test(true)]
}
