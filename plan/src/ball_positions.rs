//! Positions of the carried ball in candidate tests, and positions of the rotary axes that do not sweep.

use abbe_model::instrument::{InstrumentKind, Target};
use abbe_model::session::Session;

use super::variations::TestVariations;

/// Distance below which a ball position counts as one that is already mounted, mm.
const SAME_POSITION_MM: f64 = 0.5;

/// A position of the carried ball, with its set-up.
pub(super) struct BallPosition {
    /// Centre.
    pub ball: Target<f64>,
    /// The set-up of this position in the session. Empty for a new mount.
    pub setup: String,
    /// Whether the ball has to be mounted for it.
    pub new: bool,
}

/// The positions of the ball that an instrument of this kind has on a side: as mounted in the session, or newly mounted about
/// each rotary axis of that side.
pub(super) fn ball_positions(
    session: &Session,
    kind: InstrumentKind,
    variations: &TestVariations,
    rotary: &[usize],
    on_table: bool,
) -> Vec<BallPosition> {
    let machine = &session.machine;
    let mut positions: Vec<BallPosition> = Vec::new();
    for test in session.tests.iter().filter(|test| on_table && test.station.kind() == kind) {
        let Some(ball) = test.station.table_point() else { continue };
        if !positions.iter().any(|position| position.setup == test.setup) {
            positions.push(BallPosition { ball, setup: test.setup.clone(), new: false });
        }
    }
    for &about in rotary.iter().filter(|axis| (**axis < machine.workpiece_side) == on_table) {
        let axis = &machine.axes[about];
        let across = across(axis.direction);
        for &radius in &variations.radii_mm {
            for &height in &variations.heights_mm {
                for sign in sides(on_table, about, height) {
                    let up = if axis.direction[2] < 0.0 { -1.0 } else { 1.0 };
                    let mm: [f64; 3] = std::array::from_fn(|i| {
                        axis.origin_mm[i] + up * sign * height * axis.direction[i] + radius * across[i]
                    });
                    let present = positions.iter().any(|position| distance(position.ball.mm, mm) < SAME_POSITION_MM);
                    if !present {
                        let ball = if on_table { Target::on_table(mm) } else { Target::on_tool(mm) };
                        positions.push(BallPosition { ball, setup: String::new(), new: true });
                    }
                }
            }
        }
    }
    positions
}

/// The largest possible number of [`ball_positions`], counted before any is made: positions may coincide.
pub(super) fn ball_count(session: &Session, variations: &TestVariations, rotary: &[usize], on_table: bool) -> f64 {
    let mounted = if on_table { session.tests.len() } else { 0 };
    let about = rotary.iter().filter(|axis| (**axis < session.machine.workpiece_side) == on_table);
    let heights = |axis: &usize| -> usize {
        variations.heights_mm.iter().map(|height| sides(on_table, *axis, *height).len()).sum()
    };
    mounted as f64 + about.map(heights).sum::<usize>() as f64 * variations.radii_mm.len() as f64
}

/// The sides of a rotary axis on which balls at a height along it are candidates: nothing is below the table.
fn sides(on_table: bool, axis: usize, height: f64) -> &'static [f64] {
    let carries_table = on_table && axis == 0;
    if carries_table || height == 0.0 { &[1.0] } else { &[1.0, -1.0] }
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

#[cfg(test)]
mod tests {
    use abbe_model::chain::Machine;

    use super::*;

    /// New balls lie at the radius from the axis and at the height along it: above the table only about the axis that
    /// carries it, at both sides otherwise, and once where the height is zero.
    #[test]
    fn new_balls_lie_at_the_radii_and_heights() {
        let mut machine = Machine::from_code("w C A b Y X Z t").unwrap();
        machine.axes[0].origin_mm = [10.0, 20.0, 30.0];
        machine.axes[1].origin_mm = [0.0, 5.0, -40.0];
        let session = Session::new(machine, "ballbar".parse().unwrap());
        let variations =
            TestVariations { radii_mm: vec![60.0, 90.0], heights_mm: vec![0.0, 25.0], ..TestVariations::default() };
        let balls_about = |about: usize| -> Vec<[f64; 2]> {
            let axis = &session.machine.axes[about];
            let found = ball_positions(&session, session.instrument, &variations, &[about], true);
            let along_and_off = found.iter().map(|position| {
                assert!(position.new && position.setup.is_empty());
                let from: [f64; 3] = std::array::from_fn(|i| position.ball.mm[i] - axis.origin_mm[i]);
                let along: f64 = (0..3).map(|i| from[i] * axis.direction[i]).sum();
                [along, (from.iter().map(|x| x * x).sum::<f64>() - along * along).sqrt()]
            });
            along_and_off.collect()
        };
        let near = |found: Vec<[f64; 2]>, wanted: &[[f64; 2]]| {
            assert_eq!(found.len(), wanted.len(), "{found:?}");
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((0..2).all(|i| (found[i] - wanted[i]).abs() < 1e-9), "{found:?} {wanted:?}");
            }
        };
        near(balls_about(0), &[[0.0, 60.0], [25.0, 60.0], [0.0, 90.0], [25.0, 90.0]]);
        let both = [[0.0, 60.0], [25.0, 60.0], [-25.0, 60.0], [0.0, 90.0], [25.0, 90.0], [-25.0, 90.0]];
        near(balls_about(1), &both);
        // Counted beforehand: no test of this session has a ball.
        for (about, count) in [(0, 4.0), (1, 6.0)] {
            assert_eq!(ball_count(&session, &variations, &[about], true), count);
        }
        // Axes of the other side carry no ball of the table.
        assert!(ball_positions(&session, session.instrument, &variations, &[0, 1], false).is_empty());
    }

    #[test]
    fn across_is_a_unit_vector_across() {
        for direction in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.48, 0.6, 0.64]] {
            let found = across(direction);
            let dot: f64 = (0..3).map(|i| found[i] * direction[i]).sum();
            assert!(dot.abs() < 1e-12 && (norm(found) - 1.0).abs() < 1e-12, "{direction:?}: {found:?}");
        }
    }
}
