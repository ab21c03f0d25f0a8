//! The kinds of session: their tests and the errors that are parameters.

use super::component::{AxisName, Component, Freedom};
use super::machine::Stated;
use super::schedule::{Motion, Test, all_stand, with};
use std::f64::consts::FRAC_PI_2;

/// A kind of session on the Hermle C600U.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Chapter 5 of the thesis: A100, A150, C100, C150, one workpiece ball.
    Rotary,
    /// Chapter 4 of the thesis: the ball for the A tests at +Y of the A table, remounted at +X of the C table for the C
    /// tests.
    Chapter4,
    /// Chapter 6 of the thesis: A tests at X = ±550 mm of the A table, C tests at two heights, four mounts.
    Chapter6,
    /// Four tests of C with the table tilted to A = −20°, 0°, 30°, 60°: the influence of A on C.
    TiltedTable,
    /// Circles in XY at 1,000 and 3,000 mm/min; only the set-up has parameters.
    LinearCircles,
    /// The same with the squareness EC0Y as a parameter.
    SquarenessCircles,
    /// The same circles about a centre with a declared offset of (0.5, 0.3) mm: makes sensor gain and delay
    /// identifiable.
    EccentricCircles,
    /// BK2 of ISO 10791-6: C turns, X and Y follow; radial, tangential, axial, and tangential three times as fast.
    Simultaneous,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 8] = [
        Kind::Rotary,
        Kind::Chapter4,
        Kind::Chapter6,
        Kind::TiltedTable,
        Kind::LinearCircles,
        Kind::SquarenessCircles,
        Kind::EccentricCircles,
        Kind::Simultaneous,
    ];

    /// The step for about that many readings in the whole session: degrees of A (C alone has twice that step), or of
    /// the path angle if linear axes move.
    pub fn step_deg(self, readings: usize) -> f64 {
        // Number of quarter turns of a session: 8 traversals of A and 8 of C at twice the step, 16 of C, 8 circles, 16
        // circles.
        let turns = match self {
            Kind::Rotary | Kind::Chapter4 | Kind::Chapter6 => 6.0,
            Kind::TiltedTable | Kind::LinearCircles => 8.0,
            Kind::SquarenessCircles | Kind::EccentricCircles => 8.0,
            Kind::Simultaneous => 16.0,
        };
        // The 90° of the A tests are a whole number of steps, so every range is.
        let steps_in_90_deg = (readings as f64 / turns / 4.0).round().max(1.0);
        90.0 / steps_in_90_deg
    }

    /// The tests, with readings `step_deg` apart (see [`Kind::step_deg`]).
    pub fn tests(self, step_deg: f64) -> Vec<Test> {
        let offset_mm = (150.0_f64.powi(2) - 100.0_f64.powi(2)).sqrt();
        let zero = all_stand();
        let x = |mm| Motion::Stands(mm);
        match self {
            Kind::Rotary => vec![
                tilt("A100", 100.0, [0.0, 100.0, 0.0], "P1", 0.0, step_deg),
                tilt("A150", 150.0, [0.0, 100.0, 0.0], "P1", -offset_mm, step_deg),
                table("C100", 100.0, [0.0, 100.0, 0.0], "P1", zero, step_deg),
                table("C150", 150.0, [0.0, 100.0, 0.0], "P1", with(zero, AxisName::Z, x(offset_mm)), step_deg),
            ],
            Kind::Chapter4 => vec![
                on_a(tilt("A100", 100.0, [0.0, 100.0, 0.0], "P1", 0.0, step_deg)),
                on_a(tilt("A150", 150.0, [0.0, 100.0, 0.0], "P1", -offset_mm, step_deg)),
                table("C100", 100.0, [100.0, 0.0, 0.0], "P2", zero, step_deg),
                table("C150", 150.0, [100.0, 0.0, 0.0], "P2", with(zero, AxisName::Z, x(offset_mm)), step_deg),
            ],
            Kind::Chapter6 => vec![
                on_a(tilt("A-plus", 100.0, [550.0, 100.0, 0.0], "P1", 550.0, step_deg)),
                on_a(tilt("A-minus", 100.0, [-550.0, 100.0, 0.0], "P2", -550.0, step_deg)),
                table("C0", 100.0, [100.0, 0.0, 0.0], "P3", zero, step_deg),
                table("C78", 100.0, [100.0, 0.0, 78.0], "P4", with(zero, AxisName::Z, x(78.0)), step_deg),
            ],
            Kind::TiltedTable => [-20.0_f64, 0.0, 30.0, 60.0]
                .into_iter()
                .map(|tilt_deg| {
                    let tilted = with(zero, AxisName::A, Motion::Stands(tilt_deg.to_radians()));
                    let at = with(tilted, AxisName::Z, x(offset_mm * tilt_deg.to_radians().cos()));
                    let at = with(at, AxisName::Y, x(-offset_mm * tilt_deg.to_radians().sin()));
                    table(&format!("C-at-A{tilt_deg}"), 150.0, [0.0, 100.0, 0.0], "P1", at, step_deg)
                })
                .collect(),
            Kind::LinearCircles | Kind::SquarenessCircles | Kind::EccentricCircles => {
                let centre = if self == Kind::EccentricCircles { [0.5, 0.3, 0.0] } else { [0.0; 3] };
                [1000.0, 3000.0]
                    .into_iter()
                    .map(|feed_mm_min| Test {
                        name: format!("XY-F{feed_mm_min}"),
                        stated: stated(centre, 100.0),
                        setup: "P1".to_string(),
                        motions: circle(100.0, 0.0),
                        range_deg: [0.0, 360.0],
                        step_deg,
                        speed_deg_s: (feed_mm_min / 60.0 / 100.0_f64).to_degrees(),
                        traversals: 4,
                    })
                    .collect()
            }
            Kind::Simultaneous => {
                let follow = |name: &str, radius_mm, phase_rad, z_mm, speed_deg_s| Test {
                    name: name.to_string(),
                    stated: stated([100.0, 0.0, 0.0], 100.0),
                    setup: "P1".to_string(),
                    motions: with(with(circle(radius_mm, phase_rad), AxisName::C, Motion::Turns), AxisName::Z, x(z_mm)),
                    range_deg: [0.0, 360.0],
                    step_deg,
                    speed_deg_s,
                    traversals: 4,
                };
                let diagonal_mm = 100.0 * 2.0_f64.sqrt();
                let eighth = 0.5 * FRAC_PI_2;
                vec![
                    follow("BK2-radial", 200.0, 0.0, 0.0, 4.0),
                    follow("BK2-tangential", diagonal_mm, eighth, 0.0, 4.0),
                    follow("BK2-axial", 100.0, 0.0, 100.0, 4.0),
                    follow("BK2-tangential-fast", diagonal_mm, eighth, 0.0, 12.0),
                ]
            }
        }
    }

    /// The tests of [`Kind::Rotary`] with the workpiece ball at another radius, below 150 mm.
    pub fn rotary_at(radius_mm: f64, step_deg: f64) -> Vec<Test> {
        let offset_mm = (150.0_f64.powi(2) - radius_mm.powi(2)).sqrt();
        let ball = [0.0, radius_mm, 0.0];
        let raised = with(all_stand(), AxisName::Z, Motion::Stands(offset_mm));
        vec![
            tilt("A-short", radius_mm, ball, "Q1", 0.0, step_deg),
            tilt("A-long", 150.0, ball, "Q1", -offset_mm, step_deg),
            table("C-short", radius_mm, ball, "Q1", all_stand(), step_deg),
            table("C-long", 150.0, ball, "Q1", raised, step_deg),
        ]
    }

    /// The errors that the session file lists under `[unknowns]`; `None`: the default of a ball bar on two rotary axes.
    pub fn declared_unknowns(self) -> Option<Vec<Component>> {
        match self {
            Kind::LinearCircles | Kind::EccentricCircles => Some(Vec::new()),
            Kind::SquarenessCircles => Some(vec![Component::Location(Freedom::C, AxisName::Y)]),
            Kind::Simultaneous => Some(default_unknowns()[4..].to_vec()),
            _ => None,
        }
    }

    /// The errors that are parameters.
    pub fn unknowns(self) -> Vec<Component> {
        self.declared_unknowns().unwrap_or_else(default_unknowns)
    }

    /// The axes that move in some test.
    pub fn moving_axes(self) -> Vec<AxisName> {
        match self {
            Kind::Rotary | Kind::Chapter4 | Kind::Chapter6 => vec![AxisName::A, AxisName::C],
            Kind::TiltedTable => vec![AxisName::C],
            Kind::LinearCircles | Kind::SquarenessCircles | Kind::EccentricCircles => {
                vec![AxisName::X, AxisName::Y]
            }
            Kind::Simultaneous => vec![AxisName::X, AxisName::Y, AxisName::C],
        }
    }

    /// Standard uncertainty of each coordinate of the workpiece ball, µm.
    pub fn workpiece_ball_u_um(self) -> f64 {
        match self {
            Kind::LinearCircles | Kind::SquarenessCircles | Kind::EccentricCircles => 5.0,
            _ => 2.0,
        }
    }
}

/// Standard uncertainty of each coordinate of the spindle ball, µm.
pub const SPINDLE_BALL_U_UM: f64 = 1.0;
/// Standard uncertainty of the bar length, µm.
pub const BAR_U_UM: f64 = 0.5;

fn default_unknowns() -> Vec<Component> {
    use Freedom::{A, B, C, X, Y, Z};
    let of = |axis, freedoms: [Freedom; 4]| freedoms.map(|freedom| Component::Location(freedom, axis));
    [of(AxisName::A, [Y, Z, B, C]), of(AxisName::C, [X, Y, A, B])].concat()
}

fn stated(workpiece_ball_mm: [f64; 3], bar_mm: f64) -> Stated {
    Stated { workpiece_ball_mm, workpiece_ball_on: AxisName::C, spindle_ball_mm: [0.0; 3], bar_mm }
}

/// The test with its ball on the A table, below C.
fn on_a(test: Test) -> Test {
    Test { stated: Stated { workpiece_ball_on: AxisName::A, ..test.stated }, ..test }
}

fn circle(radius_mm: f64, phase_rad: f64) -> [Motion; 5] {
    let circles = |phase_rad| Motion::Circles { centre_mm: 0.0, radius_mm, phase_rad };
    let motions = with(all_stand(), AxisName::X, circles(phase_rad));
    with(motions, AxisName::Y, circles(phase_rad - FRAC_PI_2))
}

fn tilt(name: &str, bar_mm: f64, ball_mm: [f64; 3], setup: &str, x_mm: f64, step_deg: f64) -> Test {
    let motions = with(all_stand(), AxisName::X, Motion::Stands(x_mm));
    Test {
        name: name.to_string(),
        stated: stated(ball_mm, bar_mm),
        setup: setup.to_string(),
        motions: with(motions, AxisName::A, Motion::Turns),
        range_deg: [-20.0, 70.0],
        step_deg,
        speed_deg_s: 2.0,
        traversals: 4,
    }
}

fn table(name: &str, bar_mm: f64, ball_mm: [f64; 3], setup: &str, at: [Motion; 5], step_deg: f64) -> Test {
    Test {
        name: name.to_string(),
        stated: stated(ball_mm, bar_mm),
        setup: setup.to_string(),
        motions: with(at, AxisName::C, Motion::Turns),
        range_deg: [0.0, 360.0],
        step_deg: 2.0 * step_deg,
        speed_deg_s: 2.0,
        traversals: 4,
    }
}
