//! The sweep of an axis in the present tests, as the model of a new test.

use std::f64::consts::PI;

use abbe_model::session::Session;
use abbe_model::session::motion::{Course, Motion, Moved, Traversals};

/// Speed of an axis of which none is known, rad/s.
const SPEED_RAD_S: f64 = 5.0_f64.to_radians();

/// The sweep of an axis: as in the session, otherwise over its travel, limited to half a turn in either direction.
pub(super) fn sweep_of(session: &Session, axis: usize) -> Course {
    let planned = session.tests.iter().find_map(|test| match &test.motion {
        Some(Motion { moved: Moved::Axis(swept), course }) if *swept == axis => {
            Some(Course { traversals: Traversals::new(course.traversals.runs(), true), ..*course })
        }
        _ => None,
    });
    planned.or_else(|| sweep_of_data(session, axis)).unwrap_or_else(|| {
        let [low, high] = session.machine.axes[axis].travel.unwrap_or([-PI, PI]);
        Course {
            from: low.max(-PI),
            to: high.min(PI),
            step: 0.5_f64.to_radians(),
            speed: SPEED_RAD_S,
            traversals: Traversals::new(2, true),
        }
    })
}

/// The sweep of an axis in the data.
fn sweep_of_data(session: &Session, axis: usize) -> Option<Course> {
    session.tests.iter().filter_map(|test| test.readings.as_ref()).find_map(|readings| {
        let positions = readings.positions.get(axis)?;
        let first = readings.runs().first()?.clone();
        let run = &positions[first.clone()];
        let (from, to) = (run.first().copied()?, run.last().copied()?);
        if readings.run.is_empty() || (to - from).abs() < 0.1 || run.len() < 3 {
            return None;
        }
        let step = (to - from).abs() / (run.len() - 1) as f64;
        let elapsed = readings.time_s.get(first.end - 1).zip(readings.time_s.get(first.start));
        let speed = elapsed.map_or(0.0, |(end, start)| (to - from).abs() / (end - start));
        let speed = if speed.is_finite() && speed > 0.0 { speed } else { SPEED_RAD_S };
        let traversals = Traversals::new(readings.runs().len().div_ceil(2), true);
        Some(Course { from, to, step, speed, traversals })
    })
}
