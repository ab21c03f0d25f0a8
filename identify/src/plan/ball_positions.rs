//! Positions of the carried ball in candidate tests, and positions of the rotary axes that do not sweep.

use abbe_model::instrument::Station;
use abbe_model::session::Session;

use super::test_variations::TestVariations;

/// Distance below which a ball position counts as one that is already mounted, mm.
const SAME_POSITION_MM: f64 = 0.5;

/// A position of the carried ball, with its set-up.
pub(super) struct BallPosition {
    /// Centre, mm.
    pub ball: [f64; 3],
    /// The set-up of this position in the session. Empty for a new mount.
    pub setup: String,
    /// Whether the ball has to be mounted for it.
    pub new: bool,
}

/// The positions of the carried ball: as mounted in the session, or newly mounted about each rotary axis of its side.
pub(super) fn ball_positions(
    session: &Session,
    variations: &TestVariations,
    rotary: &[usize],
    on_table: bool,
) -> Vec<BallPosition> {
    let machine = &session.machine;
    let mut positions: Vec<BallPosition> = Vec::new();
    for test in &session.tests {
        let Station::BallBar(bar) = &test.station else {
            continue;
        };
        let (ball, setup) = if on_table {
            (bar.workpiece_ball, test.setup.clone())
        } else {
            (bar.spindle_ball, test.spindle_setup.clone())
        };
        if on_table && !positions.iter().any(|position| position.setup == setup) {
            positions.push(BallPosition { ball, setup, new: false });
        }
    }
    for &about in rotary.iter().filter(|axis| (**axis < machine.workpiece_side) == on_table) {
        let axis = &machine.axes[about];
        let across = across(axis.direction);
        let carries_table = on_table && about == 0;
        for &radius in &variations.radii_mm {
            for &height in &variations.heights_mm {
                let both = if carries_table || height == 0.0 { &[1.0][..] } else { &[1.0, -1.0][..] };
                for sign in both {
                    let up = if axis.direction[2] < 0.0 { -1.0 } else { 1.0 };
                    let ball: [f64; 3] = std::array::from_fn(|i| {
                        axis.origin_mm[i] + up * sign * height * axis.direction[i] + radius * across[i]
                    });
                    let present = positions.iter().any(|position| distance(position.ball, ball) < SAME_POSITION_MM);
                    if !present {
                        positions.push(BallPosition { ball, setup: String::new(), new: true });
                    }
                }
            }
        }
    }
    positions
}

/// A unit vector perpendicular to an axis: the projection of R's Y, or of Z if the axis is close to Y.
pub(super) fn across(direction: [f64; 3]) -> [f64; 3] {
    let start = if direction[1].abs() < 0.5 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let along: f64 = (0..3).map(|i| start[i] * direction[i]).sum();
    let rest: [f64; 3] = std::array::from_fn(|i| start[i] - along * direction[i]);
    let length = norm(rest);
    rest.map(|x| x / length)
}

/// The candidate positions of a rotary axis that does not sweep, rad: those within its travel.
pub(super) fn standing_positions(
    session: &Session,
    variations: &TestVariations,
    axis: usize,
) -> impl Iterator<Item = f64> {
    let [low, high] = session.machine.axes[axis].travel.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    let positions = variations.standing_deg.iter().map(|degrees| degrees.to_radians());
    positions.filter(move |position| *position >= low - 1e-9 && *position <= high + 1e-9)
}

/// The positions of all axes, with the rotary axes other than the swept one at the candidate positions.
pub(super) fn axis_positions(
    session: &Session,
    variations: &TestVariations,
    rotary: &[usize],
    swept: usize,
) -> Vec<Vec<f64>> {
    let machine = &session.machine;
    let mut all = vec![vec![0.0; machine.axes.len()]];
    for &other in rotary.iter().filter(|axis| **axis != swept) {
        let mut more = Vec::new();
        for at in &all {
            for position in standing_positions(session, variations, other) {
                let mut at = at.clone();
                at[other] = position;
                more.push(at);
            }
        }
        all = more;
    }
    all
}

/// `a · b`.
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// `√(a · a)`.
pub(super) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    norm(std::array::from_fn(|i| a[i] - b[i]))
}
