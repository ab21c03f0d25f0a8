//! When the machine is where: the commanded path of one traversal, with velocity, direction and reversals of every axis.

use super::component::AxisName;
use super::machine::{Commanded, Machine, Stated};
use std::f64::consts::PI;

/// The state of the world at one reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// Which test of the session.
    pub test: usize,
    /// Which traversal of that test, from 1.
    pub run: u32,
    /// Since the session began.
    pub time_s: f64,
    /// Time over the duration of the session, 0 to 1.
    pub share_of_session: f64,
    /// Where the axes are commanded to be, and how fast they go.
    pub commanded: Commanded,
    /// Sign of travel by axis; 0 for an axis that stands. At the very point of reversal it is the direction of arrival.
    pub direction: [f64; 5],
    /// Since the axis reversed last, s.
    pub since_reversal_s: [f64; 5],
    /// The way of the axis since it reversed last, mm or rad.
    pub way_since_reversal: [f64; 5],
    /// What the temperature column says.
    pub temperature_c: f64,
    /// See [`Machine::gravity_moment_a_mm`].
    pub gravity_moment_mm: f64,
}

/// How one axis follows the path angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// It stands at mm or rad.
    Stands(f64),
    /// It is the path angle.
    Turns,
    /// `centre + radius · cos(angle + phase)`, mm and rad.
    Circles {
        centre_mm: f64,
        radius_mm: f64,
        phase_rad: f64,
    },
}

/// One test: traversals of one path, there and back.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Its name; the data are in `NAME.csv`.
    pub name: String,
    /// Balls and bar as stated.
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
    /// Traversals; every second one goes back.
    pub traversals: u32,
}

/// Between traversals of a test, s.
const PAUSE_S: f64 = 8.0;
/// Between tests, s.
const CHANGE_S: f64 = 120.0;
/// A rotary axis reverses this long before the first reading of a traversal, s (an overshoot of 2° at 2 °/s).
const OVERSHOOT_S: f64 = 1.0;

/// The temperature beside the machine, °C, to the hundredth as a logger writes it: it swings and creeps upwards.
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
                    Place {
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

/// Where on the path a reading is taken.
struct Place {
    test: usize,
    run: u32,
    time_s: f64,
    since_start_s: f64,
    angle_rad: f64,
    rate: f64,
}

fn at_angle(machine: &Machine, test: &Test, place: Place) -> Instant {
    let states = test.motions.map(|motion| axis_state(motion, &place));
    let commanded = Commanded {
        position: states.map(|state| state.position),
        velocity: states.map(|state| state.velocity),
    };
    Instant {
        test: place.test,
        run: place.run,
        time_s: place.time_s,
        share_of_session: 0.0,
        direction: states.map(|state| state.direction),
        since_reversal_s: states.map(|state| state.since_reversal_s),
        way_since_reversal: states.map(|state| state.way),
        temperature_c: 20.0,
        gravity_moment_mm: machine.gravity_moment_a_mm(&commanded.position, test.stated.workpiece_ball_mm),
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

fn axis_state(motion: Motion, place: &Place) -> AxisState {
    match motion {
        Motion::Stands(position) => AxisState {
            position,
            velocity: 0.0,
            direction: 0.0,
            since_reversal_s: 0.0,
            way: 0.0,
        },
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
        Motion::Circles {
            centre_mm,
            radius_mm,
            phase_rad,
        } => {
            let angle = place.angle_rad + phase_rad;
            // The axis reverses at multiples of π; at the very point it has not yet done so.
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

/// Motions for [`Test::motions`]: every axis stands at zero.
pub fn all_stand() -> [Motion; 5] {
    [Motion::Stands(0.0); 5]
}

/// The same motions with one axis changed.
pub fn with(mut motions: [Motion; 5], axis: AxisName, motion: Motion) -> [Motion; 5] {
    motions[axis.index()] = motion;
    motions
}
