//! The sweep of an axis in the present tests, as the model of a new test.

use abbe_model::session::Session;
use abbe_model::session::motion::Motion;

/// A sweep of an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    /// rad.
    pub from: f64,
    /// rad.
    pub to: f64,
    /// rad.
    pub step: f64,
    /// rad/s.
    pub speed: f64,
    /// Number of runs; each covers both directions if `both_directions`.
    pub runs: usize,
    /// Whether each run returns.
    pub both_directions: bool,
    /// Whether it covers less than the whole range.
    pub is_part: bool,
}

impl Sweep {
    /// A share of the range about its middle.
    pub fn part(self, share: f64, both_directions: bool) -> Sweep {
        let (middle, half) = (0.5 * (self.from + self.to), 0.5 * share * (self.to - self.from));
        Sweep { from: middle - half, to: middle + half, both_directions, is_part: share < 1.0, ..self }
    }
}

/// The sweep of an axis: as in the session, otherwise over its travel, limited to half a turn in either direction.
pub(super) fn sweep_of(session: &Session, axis: usize) -> Sweep {
    let planned = session.tests.iter().find_map(|test| match &test.motion {
        Some(Motion::Sweep { axis: swept, from, to, step, speed, runs, .. }) if *swept == axis => Some(Sweep {
            from: *from,
            to: *to,
            step: *step,
            speed: *speed,
            runs: *runs,
            both_directions: true,
            is_part: false,
        }),
        _ => None,
    });
    planned.or_else(|| sweep_of_data(session, axis)).unwrap_or_else(|| {
        let turn = std::f64::consts::PI;
        let [low, high] = session.machine.axes[axis].travel.unwrap_or([-turn, turn]);
        Sweep {
            from: low.max(-turn),
            to: high.min(turn),
            step: 0.5_f64.to_radians(),
            speed: 5.0_f64.to_radians(),
            runs: 2,
            both_directions: true,
            is_part: false,
        }
    })
}

/// The sweep of an axis in the data.
fn sweep_of_data(session: &Session, axis: usize) -> Option<Sweep> {
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
        let speed = if speed.is_finite() && speed > 0.0 { speed } else { 5.0_f64.to_radians() };
        Some(Sweep {
            from,
            to,
            step,
            speed,
            runs: readings.runs().len().div_ceil(2),
            both_directions: true,
            is_part: false,
        })
    })
}
