//! The schedule of a session: commanded path of each traversal over time, with velocity, direction and reversals of
//! every axis.

use super::component::AxisName;
use super::machine::{Commanded, Machine, Stated};
use std::f64::consts::PI;

/// The state at one reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// Index of the test.
    pub test: usize,
    /// Number of the traversal of that test, from 1.
    pub run: u32,
    /// Time since the start of the session.
    pub time_s: f64,
    /// Time over the duration of the session, 0 to 1.
    pub share_of_session: f64,
    /// Commanded positions and velocities.
    pub commanded: Commanded,
    /// Sign of travel by axis; 0 for a stationary axis. At the point of reversal it is the direction of arrival.
    pub direction: [f64; 5],
    /// Time since the last reversal of the axis, s.
    pub since_reversal_s: [f64; 5],
    /// Distance since the last reversal of the axis, mm or rad.
    pub way_since_reversal: [f64; 5],
    /// The value of the temperature column.
    pub temperature_c: f64,
    /// See [`Machine::gravity_moment_a_mm`].
    pub gravity_moment_mm: f64,
}

/// The motion of one axis as a function of the path angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Stationary at mm or rad.
    Stands(f64),
    /// Equal to the path angle.
    Turns,
    /// `centre + radius · cos(angle + phase)`, mm and rad.
    Circles { centre_mm: f64, radius_mm: f64, phase_rad: f64 },
}

/// One test: traversals of one path, forward and backward.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Its name; the data are in `NAME.csv`.
    pub name: String,
    /// Stated balls and bar.
    pub stated: Stated,
    /// Mount of the workpiece ball.
    pub setup: String,
    /// Axis motions by [`AxisName::index`].
    pub motions: [Motion; 5],
    /// First and last path angle of a traversal forward, degree.
    pub range_deg: [f64; 2],
    /// Path angle between readings, degree.
    pub step_deg: f64,
    /// Path angle per second, degree.
    pub speed_deg_s: f64,
    /// Traversals; every second one is backward.
    pub traversals: u32,
}

/// Pause between traversals of a test, s.
const PAUSE_S: f64 = 8.0;
/// Pause between tests, s.
const CHANGE_S: f64 = 120.0;
/// A rotary axis reverses this long before the first reading of a traversal, s (an overshoot of 2° at 2 °/s).
const OVERSHOOT_S: f64 = 1.0;

/// Ambient temperature, °C, rounded to 0.01 °C as by a logger: an oscillation and a rising trend.
pub fn temperature_c(time_s: f64, duration_s: f64) -> f64 {
    let temperature = 20.3 + 0.9 * (2.0 * PI * time_s / 700.0).sin() + 1.1 * time_s / duration_s;
    (temperature * 100.0).round() / 100.0
}

/// Every reading of a session, in the order of time.
pub fn instants(machine: &Machine, tests: &[Test]) -> Vec<Instant> {
    let mut instants = Vec::new();
    let mut start_s = 0.0;
    for (index, test) in tests.iter().enumerate() {
        let steps = ((test.range_deg[1] - test.range_deg[0]) / test.step_deg).round();
        let step_s = test.step_deg / test.speed_deg_s;
        for traversal in 0..test.traversals {
            let forward = traversal % 2 == 0;
            let mut step = 0.0;
            while step <= steps {
                let share = if forward { step / steps } else { 1.0 - step / steps };
                let angle_deg = test.range_deg[0] + share * (test.range_deg[1] - test.range_deg[0]);
                instants.push(at_angle(
                    machine,
                    test,
                    PathPoint {
                        test: index,
                        run: traversal + 1,
                        time_s: start_s + step * step_s,
                        since_start_s: step * step_s,
                        angle_rad: angle_deg.to_radians(),
                        rate: test.speed_deg_s.to_radians() * if forward { 1.0 } else { -1.0 },
                    },
                ));
                step += 1.0;
            }
            start_s += (steps + 1.0) * step_s + PAUSE_S;
        }
        start_s += CHANGE_S;
    }
    let duration_s = instants.last().map_or(1.0, |last| last.time_s);
    for instant in &mut instants {
        instant.share_of_session = instant.time_s / duration_s;
        instant.temperature_c = temperature_c(instant.time_s, duration_s);
    }
    instants
}

/// The point of the path at which a reading is taken.
struct PathPoint {
    test: usize,
    run: u32,
    time_s: f64,
    since_start_s: f64,
    angle_rad: f64,
    rate: f64,
}

fn at_angle(machine: &Machine, test: &Test, place: PathPoint) -> Instant {
    let states = test.motions.map(|motion| axis_state(motion, &place));
    let commanded =
        Commanded { position: states.map(|state| state.position), velocity: states.map(|state| state.velocity) };
    Instant {
        test: place.test,
        run: place.run,
        time_s: place.time_s,
        share_of_session: 0.0,
        direction: states.map(|state| state.direction),
        since_reversal_s: states.map(|state| state.since_reversal_s),
        way_since_reversal: states.map(|state| state.way),
        temperature_c: 20.0,
        gravity_moment_mm: machine.gravity_moment_a_mm(&commanded.position, &test.stated),
        commanded,
    }
}

/// One axis at one reading: mm or rad, seconds.
#[derive(Clone, Copy)]
struct AxisState {
    position: f64,
    velocity: f64,
    direction: f64,
    since_reversal_s: f64,
    way: f64,
}

fn axis_state(motion: Motion, place: &PathPoint) -> AxisState {
    match motion {
        Motion::Stands(position) => {
            AxisState { position, velocity: 0.0, direction: 0.0, since_reversal_s: 0.0, way: 0.0 }
        }
        Motion::Turns => {
            let since_reversal_s = place.since_start_s + OVERSHOOT_S;
            AxisState {
                position: place.angle_rad,
                velocity: place.rate,
                direction: place.rate.signum(),
                since_reversal_s,
                way: since_reversal_s * place.rate.abs(),
            }
        }
        Motion::Circles { centre_mm, radius_mm, phase_rad } => {
            let angle = place.angle_rad + phase_rad;
            // The axis reverses at multiples of π; at the point itself it has not reversed yet.
            let travelled = (angle * place.rate.signum()).rem_euclid(PI);
            let travelled = if travelled < 1e-9 { PI } else { travelled };
            let turning = angle - travelled * place.rate.signum();
            let middle = angle - 0.5 * travelled * place.rate.signum();
            AxisState {
                position: centre_mm + radius_mm * angle.cos(),
                velocity: -radius_mm * angle.sin() * place.rate,
                direction: (-middle.sin() * place.rate * radius_mm).signum(),
                since_reversal_s: travelled / place.rate.abs(),
                way: (radius_mm * (angle.cos() - turning.cos())).abs(),
            }
        }
    }
}

/// Motions for [`Test::motions`]: every axis is stationary at zero.
pub fn all_stand() -> [Motion; 5] {
    [Motion::Stands(0.0); 5]
}

/// The same motions with one axis changed.
pub fn with(mut motions: [Motion; 5], axis: AxisName, motion: Motion) -> [Motion; 5] {
    motions[axis.index()] = motion;
    motions
}
