//! Random machines, states and errors: the strategies of all property tests of the workspace.
//!
//! Axes are drawn one by one, each with its position and its errors, so that a failing machine shrinks axis by axis.

#![allow(dead_code)] // each test binary uses what it needs

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::{AxisPosition, BodyErrors, ERRORS_PER_AXIS, Machine};
use abbe_model::frames::Rotation;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

/// Number of cases of a property, drawn from a fixed seed: the same on every machine and every day.
pub fn cases(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(20_260_101), failure_persistence: None, ..Config::default() }
}

/// A machine, the positions of its axes, and its errors in mm and rad, slot by slot.
#[derive(Clone, Debug)]
pub struct Drawn {
    pub machine: Machine,
    pub positions: Vec<f64>,
    pub errors: Vec<f64>,
}

impl Drawn {
    pub fn state(&self) -> Vec<AxisPosition<f64>> {
        let axes = self.machine.axes.iter().zip(&self.positions);
        axes.map(|(axis, position)| AxisPosition::new(axis.kind, *position)).collect()
    }

    /// The prepared errors, multiplied by a factor.
    pub fn bodies(&self, factor: f64) -> Vec<BodyErrors<f64>> {
        let errors = &self.errors;
        self.machine.body_errors(|_| factor != 0.0, |slot| factor * errors[slot])
    }

    pub fn with(&self, rotation: Rotation) -> Drawn {
        let mut other = self.clone();
        other.machine.rotation = rotation;
        other
    }

    /// The same with lengths multiplied by `factor`, a change of the length unit.
    pub fn scaled(&self, factor: f64) -> Drawn {
        let mut other = self.clone();
        for axis in &mut other.machine.axes {
            axis.origin_mm = axis.origin_mm.map(|length| factor * length);
        }
        for (axis, position) in self.machine.axes.iter().zip(&mut other.positions) {
            if axis.kind == AxisKind::Linear {
                *position *= factor;
            }
        }
        for (slot, error) in other.errors.iter_mut().enumerate() {
            if !is_angle(slot) {
                *error *= factor;
            }
        }
        other
    }

    /// The mirror image in the plane perpendicular to `coordinate`. Translations along the normal change sign, and so
    /// do rotations about the other two coordinates. The direction of a rotary axis is opposite to its mirror image,
    /// because a mirrored right hand is a left one.
    pub fn mirrored(&self, coordinate: usize) -> Drawn {
        let mut other = self.clone();
        other.machine = mirrored(&self.machine, coordinate);
        for (slot, error) in other.errors.iter_mut().enumerate() {
            *error *= mirror_sign(slot % 6, coordinate);
        }
        other
    }
}

/// The sign of one of the six degrees of freedom `EX … EC` in a mirror perpendicular to `coordinate`.
pub fn mirror_sign(freedom: usize, coordinate: usize) -> f64 {
    let along = freedom % 3 == coordinate;
    let turns = freedom >= 3;
    if along == turns { 1.0 } else { -1.0 }
}

pub fn mirrored(machine: &Machine, coordinate: usize) -> Machine {
    let mut other = machine.clone();
    for axis in &mut other.axes {
        axis.origin_mm[coordinate] *= -1.0;
        axis.direction[coordinate] *= -1.0;
        if axis.kind == AxisKind::Rotary {
            axis.direction = axis.direction.map(|part| -part);
        }
    }
    other.gravity[coordinate] *= -1.0;
    other
}

/// Whether a slot of a machine is an angle.
pub fn is_angle(slot: usize) -> bool {
    slot % ERRORS_PER_AXIS % 6 >= 3
}

/// A random point of an instrument, mm.
pub fn point() -> impl Strategy<Value = [f64; 3]> {
    [-300.0..300.0, -300.0..300.0, -300.0..300.0]
}

/// A unit vector: along one of R's coordinates either way, or in any direction.
pub fn direction() -> impl Strategy<Value = [f64; 3]> {
    let principal = (0_usize..3, any::<bool>()).prop_map(|(along, back)| {
        let mut unit = [0.0; 3];
        unit[along] = if back { -1.0 } else { 1.0 };
        unit
    });
    let askew = [-1.0..1.0, -1.0..1.0, -1.0..1.0]
        .prop_filter("a direction has a length", |v: &[f64; 3]| norm(*v) > 0.1)
        .prop_map(|v| v.map(|part| part / norm(v)));
    prop_oneof![principal, askew]
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// An axis with its position in its travel and its errors, both from −1 to 1.
fn axis() -> impl Strategy<Value = (Axis, f64, Vec<f64>)> {
    let line = (any::<bool>(), direction(), point());
    (line, -1.0..1.0, vec(-1.0..1.0, ERRORS_PER_AXIS)).prop_map(|((turns, direction, origin), place, errors)| {
        let axis = Axis {
            name: String::new(),
            kind: if turns { AxisKind::Rotary } else { AxisKind::Linear },
            direction,
            origin_mm: if turns { origin } else { [0.0; 3] },
            travel: None,
            joint: None,
        };
        (axis, place, errors)
    })
}

/// Machines of one to six axes with errors of up to 0.1 mm and 2 mrad, which is very large.
pub fn machines() -> impl Strategy<Value = Drawn> {
    let rotation = prop_oneof![Just(Rotation::Exact), Just(Rotation::SmallAngle)];
    (vec(axis(), 1..=6), any::<prop::sample::Index>(), rotation).prop_map(|(axes, split, rotation)| {
        let workpiece_side = split.index(axes.len() + 1);
        let (mut machine, mut positions, mut errors) = (Vec::new(), Vec::new(), Vec::new());
        for (number, (mut axis, place, sizes)) in axes.into_iter().enumerate() {
            axis.name = format!("J{}", number + 1);
            positions.push(match axis.kind {
                AxisKind::Linear => 400.0 * place,
                AxisKind::Rotary => std::f64::consts::PI * place,
            });
            let slots = sizes.into_iter().enumerate();
            errors.extend(slots.map(|(slot, size)| size * if is_angle(slot) { 2e-3 } else { 0.1 }));
            machine.push(axis);
        }
        let machine = Machine {
            name: "drawn".into(),
            axes: machine,
            workpiece_side,
            rotation,
            gravity: [0.0, 0.0, -1.0],
            flange: None,
            bodies: Vec::new(),
        };
        Drawn { machine, positions, errors }
    })
}
