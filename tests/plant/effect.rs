//! Injected effects: the error of a component is an amplitude times a shape.
//!
//! Signs and units. Amplitudes are in the unit of the component (µm for lengths, arcsec for angles, % for the sensor's
//! gain, ms for the trigger); of a lag they are in ms.
//!
//! | shape | component = amplitude × |
//! |---|---|
//! | `Constant` | 1 |
//! | `Polynomial { degree }` | `(q / 100 mm)^degree` or `(q / 180°)^degree`; of a temperature `(T − 20 °C)^degree`; of the gravity moment `(m / 100 mm)^degree` |
//! | `Harmonic { order, phase_deg }` | `cos(order · q + phase)` |
//! | `Periodic { period, phase_deg }` | `cos(2π q / period + phase)`, period in mm or degree |
//! | `Backlash` | `−½ sign(velocity)`: the amplitude is the whole lost motion |
//! | `Lag` | `−velocity`: the axis is at its commanded position of `amplitude` ms ago |
//! | `ReversalSpike { decay }` | `−sign(velocity) exp(−t/T)`, t time or distance since the reversal, velocity after the reversal: stick |
//! | `Local { centre, width, profile }` | Gaussian `exp(−½ ((q − c)/w)²)`, or raised cosine `½ (1 + cos(π (q − c)/w))` inside \|q − c\| < w |
//! | `Steps { at, heights }` | the sum of the heights of the steps at or below q |
//! | `Drift` | `t / duration of the session` |
//! | `Warmup { tau_s }` | `1 − exp(−t / τ)` |
//! | `FirstOrderLag { tau_s }` | y with `τ dy/dt + y = T`, T the spindle's temperature above 27 °C, in equilibrium at the start |
//! | `Remount { after_test }` | 1 in every test after that one, 0 until then |
//! | `Modulated { order, period_s }` | `sin(order · q) · sin(2π t / period)` |
//! | `Chirp { cycles }` | `sin(2π cycles (q/360°)²)`: frequency rises along the axis |
//! | `Plateaus { edges, levels, sharpness }` | levels joined by `tanh` edges, a different set in every test |

use super::component::{AxisName, Component, unit_size};
use super::machine::Displacement;
use super::schedule::Instant;
use super::spindle::Spindle;
use std::f64::consts::PI;

/// The driver of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Driver {
    /// The position, direction of travel or speed of an axis.
    Axis(AxisName),
    /// Time since the start of the session.
    Time,
    /// The temperature column, in kelvin above 20 °C.
    Temperature,
    /// The temperature of the spindle, in kelvin above 27 °C.
    Spindle(Spindle),
    /// The moment of a unit weight at the workpiece ball about the A axis.
    Gravity,
    /// No driver: a constant.
    Nothing,
}

/// The decay of a reversal spike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decay {
    /// Over time: the time constant in s.
    Time(f64),
    /// Over the distance since the reversal: the decay length in mm or degree.
    Way(f64),
}

/// The profile of a local feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Profile {
    Gaussian,
    RaisedCosine,
}

/// The shape of an effect over its driver. The head of this file has the table of signs and units.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Shape {
    Constant,
    Polynomial { degree: u32 },
    Harmonic { order: u32, phase_deg: f64 },
    Periodic { period: f64, phase_deg: f64 },
    Backlash,
    Lag,
    ReversalSpike { decay: Decay },
    Local { centre: f64, width: f64, profile: Profile },
    Steps { at: Vec<f64>, heights: Vec<f64> },
    Drift,
    Warmup { tau_s: f64 },
    FirstOrderLag { tau_s: f64 },
    Remount { after_test: usize },
    Modulated { order: u32, period_s: f64 },
    Chirp { cycles: f64 },
    Plateaus { edges: Vec<f64>, levels: Vec<f64>, sharpness: f64 },
}

/// One effect that is injected into the plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Injected {
    /// The component.
    pub component: Component,
    /// The driver.
    pub driver: Driver,
    /// The shape.
    pub shape: Shape,
    /// The amplitude, in [`Injected::unit`].
    pub amplitude: f64,
}

impl Injected {
    /// An effect from component, driver, shape and amplitude.
    pub fn new(component: Component, driver: Driver, shape: Shape, amplitude: f64) -> Injected {
        Injected { component, driver, shape, amplitude }
    }

    /// The unit of the amplitude: `um`, `arcsec`, `percent` or `ms`.
    pub fn unit(&self) -> &'static str {
        if self.shape == Shape::Lag { "ms" } else { self.component.unit() }
    }

    /// The same effect with another amplitude, in [`Injected::unit`].
    pub fn with_amplitude(&self, amplitude: f64) -> Injected {
        Injected { amplitude, ..self.clone() }
    }

    /// The error of the component at an instant: mm, rad, s or a ratio.
    pub fn value(&self, instant: &Instant) -> f64 {
        self.amplitude * unit_size(self.unit()) * self.basis(instant)
    }

    /// Displaces the bodies. A lag along the motion of an axis changes the true axis position; every other effect
    /// displaces its component.
    pub fn displace(&self, instant: &Instant, displacement: &mut Displacement) {
        let value = self.value(instant);
        match (&self.shape, self.component) {
            (Shape::Lag, Component::Motion(freedom, axis)) if freedom == axis.own_freedom() => {
                displacement.position[axis.index()] += value;
            }
            _ => displacement.add(self.component, value),
        }
    }

    /// The value of the shape (for a lag in mm/s or rad/s).
    pub fn basis(&self, instant: &Instant) -> f64 {
        let driver = &self.driver;
        match &self.shape {
            Shape::Constant => 1.0,
            Shape::Polynomial { degree } => normalised(driver, instant).powi(degree.cast_signed()),
            Shape::Harmonic { order, phase_deg } => {
                (f64::from(*order) * position(driver, instant) + phase_deg.to_radians()).cos()
            }
            Shape::Periodic { period, phase_deg } => {
                (2.0 * PI * shown(driver, instant) / period + phase_deg.to_radians()).cos()
            }
            Shape::Backlash => -0.5 * of_axis(driver, &instant.direction),
            Shape::Lag => -of_axis(driver, &instant.commanded.velocity),
            Shape::ReversalSpike { decay } => {
                let spent = match decay {
                    Decay::Time(constant_s) => of_axis(driver, &instant.since_reversal_s) / constant_s,
                    Decay::Way(constant) => {
                        of_axis(driver, &instant.way_since_reversal) / in_plant_units(driver, *constant)
                    }
                };
                -of_axis(driver, &instant.direction) * (-spent).exp()
            }
            Shape::Local { centre, width, profile } => {
                local_feature(distance(driver, shown(driver, instant), *centre) / width, *profile)
            }
            Shape::Steps { at, heights } => {
                let here = shown(driver, instant);
                at.iter().zip(heights).filter(|(at, _)| here >= **at).map(|(_, height)| height).sum()
            }
            Shape::Drift => instant.share_of_session,
            Shape::Warmup { tau_s } => 1.0 - (-instant.time_s / tau_s).exp(),
            Shape::FirstOrderLag { tau_s } => match driver {
                Driver::Spindle(spindle) => spindle.lagged_k(instant.time_s, *tau_s),
                _ => 0.0,
            },
            Shape::Remount { after_test } => f64::from(instant.test > *after_test),
            Shape::Modulated { order, period_s } => {
                (f64::from(*order) * position(driver, instant)).sin() * (2.0 * PI * instant.time_s / period_s).sin()
            }
            Shape::Chirp { cycles } => {
                let turns = normalised(driver, instant) * 0.5;
                (2.0 * PI * cycles * turns * turns).sin()
            }
            Shape::Plateaus { edges, levels, sharpness } => {
                let here = shown(driver, instant);
                // The levels differ between tests, so no single function of the position explains them.
                let level = |k: usize| levels[(k + 3 * instant.test) % levels.len()];
                edges.iter().enumerate().fold(level(0), |sum, (k, edge)| {
                    let risen = 0.5 * (1.0 + (sharpness * (here - edge)).tanh());
                    sum + risen * (level(k + 1) - level(k))
                })
            }
        }
    }

    /// The effects of unit amplitude that span this effect at any phase: cosine and sine of a harmonic
    /// or periodic error; the effect itself otherwise.
    pub fn basis_effects(&self) -> Vec<Injected> {
        let at_phase = |phase_deg: f64| {
            let shape = match self.shape {
                Shape::Harmonic { order, .. } => Shape::Harmonic { order, phase_deg },
                Shape::Periodic { period, .. } => Shape::Periodic { period, phase_deg },
                _ => self.shape.clone(),
            };
            Injected { shape, amplitude: 1.0, ..self.clone() }
        };
        match self.shape {
            Shape::Harmonic { .. } | Shape::Periodic { .. } => vec![at_phase(0.0), at_phase(-90.0)],
            _ => vec![at_phase(0.0)],
        }
    }

    /// The coordinates of this effect in [`Injected::basis_effects`], at unit amplitude.
    pub fn coordinates(&self) -> Vec<f64> {
        match self.shape {
            Shape::Harmonic { phase_deg, .. } | Shape::Periodic { phase_deg, .. } => {
                let (sine, cosine) = phase_deg.to_radians().sin_cos();
                vec![cosine, -sine]
            }
            _ => vec![1.0],
        }
    }
}

/// The entry of the driving axis in a table by axis; 0 without a driving axis.
fn of_axis(driver: &Driver, table: &[f64; 5]) -> f64 {
    match driver {
        Driver::Axis(axis) => table[axis.index()],
        _ => 0.0,
    }
}

/// The value of the driver: mm or rad, kelvin above 20 °C, or mm of gravity moment.
fn position(driver: &Driver, instant: &Instant) -> f64 {
    match driver {
        Driver::Axis(axis) => instant.commanded.position[axis.index()],
        Driver::Time => instant.time_s,
        Driver::Temperature => instant.temperature_c - 20.0,
        Driver::Spindle(spindle) => spindle.above_k(instant.time_s),
        Driver::Gravity => instant.gravity_moment_mm,
        Driver::Nothing => 0.0,
    }
}

/// The driver in the unit of polynomials.
fn normalised(driver: &Driver, instant: &Instant) -> f64 {
    let scale = match driver {
        Driver::Axis(axis) if axis.is_rotary() => PI,
        Driver::Axis(_) | Driver::Gravity => 100.0,
        Driver::Time | Driver::Temperature | Driver::Spindle(_) | Driver::Nothing => 1.0,
    };
    position(driver, instant) / scale
}

/// The driver in mm or degree.
fn shown(driver: &Driver, instant: &Instant) -> f64 {
    match driver {
        Driver::Axis(axis) if axis.is_rotary() => position(driver, instant).to_degrees(),
        _ => position(driver, instant),
    }
}

fn in_plant_units(driver: &Driver, value: f64) -> f64 {
    match driver {
        Driver::Axis(axis) if axis.is_rotary() => value.to_radians(),
        _ => value,
    }
}

/// Signed distance from centre to position; modulo a turn on a rotary axis.
fn distance(driver: &Driver, here: f64, centre: f64) -> f64 {
    match driver {
        Driver::Axis(axis) if axis.is_rotary() => (here - centre + 180.0).rem_euclid(360.0) - 180.0,
        _ => here - centre,
    }
}

fn local_feature(widths: f64, profile: Profile) -> f64 {
    match profile {
        Profile::Gaussian => (-0.5 * widths * widths).exp(),
        Profile::RaisedCosine if widths.abs() < 1.0 => 0.5 * (1.0 + (PI * widths).cos()),
        Profile::RaisedCosine => 0.0,
    }
}
