//! The shapes of a family for a component and a driver, as far as the session samples them. A family names a shape of
//! the registry, or one of the choices here, which combine a shape with tests or with other shapes.

use abbe_identify::problem::Problem;
use abbe_model::axis::AxisKind;
use abbe_model::driver::Driver;
use abbe_model::effect::sampled::Sampled;
use abbe_model::effect::shape::Harmonic;
use abbe_model::effect::{Component, Shape};
use abbe_model::instrument::SharedBy;

use super::Family;
use crate::candidates::sampling::{ColumnSampling, Sampling};

/// A constant in the tests of one mount of a set-up component.
const CONSTANT_PER_MOUNT: &str = "constant-per-mount";
/// The dependence of a location error on another axis: harmonics of a rotary axis, powers of a linear one, up to
/// [`LOW_ORDER`].
const HARMONIC_LOW: &str = "harmonic-low";
const LOW_ORDER: usize = 2;
/// The orders of gears of an axis about itself, for independent poses that read positions.
const HARMONIC_OF_GEARS: &str = "harmonic-of-gears";
/// The lost motion of an axis about itself by the direction of its last move, for observed directions.
const HYSTERESIS_OF_MOUNTS: &str = "hysteresis-of-mounts";
/// A power of the driver.
const POWER: &str = "power";

/// A shape, the tests to which it is confined, and its cost in addition to that of its family.
type Member = (Shape, Vec<String>, f64);

/// Whether a family can have this shape.
pub(super) fn is_known(word: &str) -> bool {
    [CONSTANT_PER_MOUNT, HARMONIC_LOW, HARMONIC_OF_GEARS, HYSTERESIS_OF_MOUNTS].contains(&word)
        || Shape::entry_of(word).is_some()
}

/// Shapes of a family for a component and a driver.
pub(super) fn shapes(
    problem: &Problem,
    sampling: &Sampling,
    family: &Family,
    component: &Component,
    driver: &Driver,
) -> Vec<Member> {
    if family.shape == CONSTANT_PER_MOUNT {
        let mounts = mounts(problem, component).into_iter();
        return mounts.map(|tests| (Shape::Constant, tests, 0.0)).collect();
    }
    if family.shape == HARMONIC_OF_GEARS {
        let is_robot = sampling.is_poses() && !sampling.reads_directions;
        let orders = if is_robot { Harmonic::of_gears() } else { Vec::new() };
        return orders.into_iter().map(|(shape, cost)| (shape, Vec::new(), cost)).collect();
    }
    if family.shape == HYSTERESIS_OF_MOUNTS {
        let axis = driver.axis(&problem.session.machine);
        let reverses = sampling.reads_directions && axis.is_some_and(|axis| sampling.both_directions[axis]);
        return if reverses { vec![(Shape::Backlash, Vec::new(), 0.0)] } else { Vec::new() };
    }
    let mut sampled = sampled(problem, sampling, component, driver);
    let members_of = |word: &str, sampled: &Sampled| {
        let entry = Shape::entry_of(word);
        entry.map_or_else(Vec::new, |entry| (entry.members)(sampled))
    };
    let members = if family.shape != HARMONIC_LOW {
        sampled.numbers.clone_from(&family.numbers);
        if let Some(column) = column(sampling, driver) {
            // A power that distinguishes no more levels than a lower one is the same effect.
            sampled.numbers.retain(|number| family.shape != POWER || *number < column.levels as f64);
        }
        members_of(&family.shape, &sampled)
    } else if sampled.rotary {
        Harmonic::up_to(LOW_ORDER)
    } else {
        sampled.numbers = (1..=LOW_ORDER).map(|degree| degree as f64).collect();
        members_of(POWER, &sampled)
    };
    members.into_iter().map(|(shape, cost)| (shape, Vec::new(), cost)).collect()
}

/// The sampling of a column; `None` for other drivers.
fn column<'s>(sampling: &'s Sampling, driver: &Driver) -> Option<&'s ColumnSampling> {
    let Driver::Column(name) = driver else { return None };
    sampling.columns.iter().find(|column| column.name == *name)
}

/// The sampling of a driver.
fn sampled(problem: &Problem, sampling: &Sampling, component: &Component, driver: &Driver) -> Sampled {
    let machine = &problem.session.machine;
    let axis = driver.axis(machine);
    Sampled {
        ends: axis.map(|axis| [sampling.low[axis], sampling.high[axis]]),
        rotary: axis.is_some_and(|axis| machine.axes[axis].kind == AxisKind::Rotary),
        is_elevation: sampling.reads_directions && axis.is_some_and(|axis| machine.stays_level(axis)),
        step: axis.map_or(0.0, |axis| sampling.step[axis]),
        poses: sampling.is_poses(),
        both_directions: axis.is_some_and(|axis| sampling.both_directions[axis]),
        reverses_inside_runs: axis.is_some_and(|axis| sampling.reverses_inside_runs[axis]),
        has_time: sampling.has_time,
        duration_s: sampling.duration_s,
        default_scale: driver.kind().default_scale(driver.kind_of_axis(machine, component.axis(machine))),
        numbers: Vec::new(),
        between_levels: column(sampling, driver).map_or_else(Vec::new, |column| column.between.clone()),
    }
}

/// The groups of tests that share one mount of a set-up component, each test alone, and each mount from a later test
/// on.
fn mounts(problem: &Problem, component: &Component) -> Vec<Vec<String>> {
    let Component::Instrument { thing, .. } = component else {
        return Vec::new();
    };
    let shared_by = problem
        .session
        .instrument_parameters()
        .into_iter()
        .find(|parameter| parameter.thing == thing)
        .map_or(SharedBy::Session, |parameter| parameter.shared_by);
    let mut groups: Vec<(String, Vec<String>)> = Vec::new();
    for test in &problem.tests {
        let name = test.group(shared_by).to_string();
        match groups.iter_mut().find(|(group, _)| *group == name) {
            Some((_, tests)) => tests.push(test.name.clone()),
            None => groups.push((name, vec![test.name.clone()])),
        }
    }
    // A mount that tests share may have been disturbed between them, so each test is a group too.
    let mut mounts: Vec<Vec<String>> = groups.into_iter().map(|(_, tests)| tests).collect();
    for test in &problem.tests {
        let alone = vec![test.name.clone()];
        if !mounts.contains(&alone) {
            mounts.push(alone);
        }
    }
    // A mount may have been disturbed once, so its later tests are a group too.
    for first in 1..problem.tests.len() {
        let mount = problem.tests[first].group(shared_by);
        let of_mount = |test: &&abbe_model::session::Test| test.group(shared_by) == mount;
        let later = problem.tests[first..].iter().filter(of_mount);
        let later: Vec<String> = later.map(|test| test.name.clone()).collect();
        if problem.tests[first - 1].group(shared_by) == mount && !mounts.contains(&later) {
            mounts.push(later);
        }
    }
    mounts
}
