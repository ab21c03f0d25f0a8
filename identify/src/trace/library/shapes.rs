//! The shapes of a family for a component and a driver, as far as the session samples them.

use std::f64::consts::TAU;

use abbe_model::axis::AxisKind;
use abbe_model::effect::{Component, Driver, Shape};
use abbe_model::instrument::SharedBy;

use super::sampling::Sampling;
use super::{Family, STEP_POSITIONS, ShapeChoice};
use crate::problem::Problem;

/// Highest harmonic order of the library.
const HIGHEST_ORDER: usize = 120;
/// Highest harmonic order for poses, which sample an axis at random. An independent search found no significant order above it.
const HIGHEST_ORDER_OF_POSES: usize = 40;
/// Readings per cycle of the shortest wave in the library. The sampling theorem requires two.
const READINGS_PER_CYCLE: f64 = 2.4;
/// Maximum number of half cycles over the travel.
const MAX_HALF_CYCLES: usize = 240;

/// A shape, the tests to which it is confined, and its cost in addition to that of its family.
type Member = (Shape, Vec<String>, f64);

/// A shape in all tests without additional cost.
fn plain(shape: Shape) -> Member {
    (shape, Vec::new(), 0.0)
}

/// Shapes of a family for a component and a driver.
pub(super) fn shapes(
    problem: &Problem<'_>,
    sampling: &Sampling,
    family: &Family,
    component: &Component,
    driver: &Driver,
) -> Vec<Member> {
    let axis = match driver {
        Driver::Axis(name) => problem.session.machine.axis_index(name),
        _ => None,
    };
    let over = FamilyScope {
        sampling,
        axis,
        rotary: axis.is_some_and(|axis| problem.session.machine.axes[axis].kind == AxisKind::Rotary),
        span: axis.map_or(1.0, |axis| sampling.span(axis)),
        step: axis.map_or(0.0, |axis| sampling.step[axis]),
        poses: sampling.is_poses(),
    };
    let only_if = |observable: bool, shape: Shape| {
        if observable {
            vec![plain(shape)]
        } else {
            Vec::new()
        }
    };
    match family.shape {
        ShapeChoice::Constant => vec![plain(Shape::Constant)],
        ShapeChoice::ConstantPerMount => mounts(problem, component)
            .into_iter()
            .map(|tests| (Shape::Constant, tests, 0.0))
            .collect(),
        ShapeChoice::Harmonic => harmonics(over.highest_order()),
        ShapeChoice::HarmonicLow if over.rotary => harmonics(2),
        ShapeChoice::HarmonicLow => powers(&[1, 2], driver.default_scale(&problem.session.machine)),
        ShapeChoice::Power => powers(&family.degrees, driver.default_scale(&problem.session.machine)),
        ShapeChoice::Periodic => over.periods(),
        ShapeChoice::Backlash => {
            let observable = axis.is_some_and(|axis| sampling.both_directions[axis]);
            only_if(observable && !over.poses, Shape::Backlash)
        }
        ShapeChoice::Lag => only_if(sampling.has_time && !over.poses, Shape::Lag),
        ShapeChoice::ReversalSpike => over.spikes(),
        ShapeChoice::Drift => vec![plain(Shape::Drift)],
        ShapeChoice::Warmup => family
            .tau_s
            .iter()
            .filter(|tau| **tau < 2.0 * sampling.duration_s)
            .map(|tau| plain(Shape::Warmup { tau_s: *tau }))
            .collect(),
        ShapeChoice::Steps => over.steps(),
        ShapeChoice::Local => over.features(),
        ShapeChoice::Curve => over.curves(),
    }
}

/// Harmonics up to an order.
fn harmonics(most: usize) -> Vec<Member> {
    (1..=most)
        .map(|order| {
            let shape = Shape::Harmonic { order: order as f64 };
            (shape, Vec::new(), harmonic_cost(order))
        })
        .collect()
}

fn powers(degrees: &[usize], scale: f64) -> Vec<Member> {
    degrees
        .iter()
        .map(|&degree| (Shape::Power { degree, scale }, Vec::new(), 0.2 * degree as f64))
        .collect()
}

/// The driver of the shapes: an axis as the session samples it, or another driver.
struct FamilyScope<'s> {
    sampling: &'s Sampling,
    axis: Option<usize>,
    rotary: bool,
    /// 1 without an axis.
    span: f64,
    /// 0 without an axis, and for poses.
    step: f64,
    poses: bool,
}

impl FamilyScope<'_> {
    /// The highest harmonic order that the sampling resolves.
    fn highest_order(&self) -> usize {
        if self.poses {
            HIGHEST_ORDER_OF_POSES
        } else if self.step > 0.0 {
            ((TAU / (READINGS_PER_CYCLE * self.step)) as usize).clamp(1, HIGHEST_ORDER)
        } else {
            0
        }
    }

    /// Whether the readings cover a full turn.
    fn is_sin_cos(&self) -> bool {
        self.rotary && self.span > 0.99 * TAU
    }

    /// Frequencies from one cycle on, half a cycle over the travel apart.
    fn periods(&self) -> Vec<Member> {
        if self.step <= 0.0 || self.poses {
            return Vec::new();
        }
        let most = ((2.0 * self.span / (READINGS_PER_CYCLE * self.step)) as usize).min(MAX_HALF_CYCLES);
        // Over full turns, whole cycles are harmonics.
        let turns = self.span / TAU;
        let whole = self.rotary && (turns - turns.round()).abs() < 0.01;
        (2..=most)
            .filter(|half_cycles| !whole || half_cycles % 2 == 1)
            .map(|half_cycles| {
                let period = 2.0 * self.span / half_cycles as f64;
                (Shape::Periodic { period }, Vec::new(), 0.5)
            })
            .collect()
    }

    fn spikes(&self) -> Vec<Member> {
        // A run that starts where the previous run ended starts with a reversal.
        let observable = self.axis.is_some_and(|axis| {
            self.sampling.reverses_inside_runs[axis] || self.sampling.both_directions[axis]
        });
        if !observable || self.poses {
            return Vec::new();
        }
        let spike = |share: f64| Shape::ReversalSpike {
            width: share * self.span,
        };
        [0.002, 0.005, 0.01, 0.02, 0.05]
            .map(|share| plain(spike(share)))
            .to_vec()
    }

    /// A single step at each position, and the dictionary of all positions.
    fn steps(&self) -> Vec<Member> {
        let Some(axis) = self.axis.filter(|_| !self.poses && self.step > 0.0) else {
            return Vec::new();
        };
        let low = self.sampling.low[axis];
        let position = |k: usize| low + self.span * k as f64 / STEP_POSITIONS as f64;
        let positions: Vec<f64> = (1..STEP_POSITIONS).map(position).collect();
        let singles = positions.iter().map(|position| vec![*position]);
        singles
            .chain([positions.clone()])
            .map(|at| plain(Shape::Steps { at }))
            .collect()
    }

    fn features(&self) -> Vec<Member> {
        let Some(axis) = self.axis.filter(|_| !self.poses) else {
            return Vec::new();
        };
        let recurs = self.is_sin_cos().then_some(TAU);
        let mut features = Vec::new();
        for share in [0.02, 0.04, 0.08] {
            let width = share * self.span;
            let count = (1.0 / share) as usize;
            for k in 0..count {
                let centre = self.sampling.low[axis] + self.span * (k as f64 + 0.5) / count as f64;
                features.push(plain(Shape::Local {
                    centre,
                    width,
                    recurs,
                }));
            }
        }
        features
    }

    fn curves(&self) -> Vec<Member> {
        let Some(axis) = self.axis.filter(|_| !self.poses || self.rotary) else {
            return Vec::new();
        };
        let closed = self.is_sin_cos();
        let from = self.sampling.low[axis];
        let to = if closed {
            from + TAU
        } else {
            self.sampling.high[axis]
        };
        // At least 1.5 readings per interval.
        let carried = |intervals: usize| {
            self.poses && intervals <= 16
                || self.step > 0.0 && 1.5 * self.step * intervals as f64 <= self.span
        };
        [8, 16, 32, 64]
            .into_iter()
            .filter(|intervals| carried(*intervals))
            .map(|intervals| {
                plain(Shape::Curve {
                    from,
                    to,
                    intervals,
                    closed,
                })
            })
            .collect()
    }
}

/// There are many high orders, and each single one is unlikely. The cost therefore grows as the logarithm of the order.
fn harmonic_cost(order: usize) -> f64 {
    (order as f64).ln()
}

/// The groups of tests that share one mount of a set-up component, each test alone, and each mount from a later test on.
fn mounts(problem: &Problem<'_>, component: &Component) -> Vec<Vec<String>> {
    let Component::Instrument { thing, .. } = component else {
        return Vec::new();
    };
    let shared_by = problem
        .session
        .instrument
        .unknowns()
        .iter()
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
        let of_mount = |test: &&&abbe_model::session::Test| test.group(shared_by) == mount;
        let later = problem.tests[first..].iter().filter(of_mount);
        let later: Vec<String> = later.map(|test| test.name.clone()).collect();
        if problem.tests[first - 1].group(shared_by) == mount && !mounts.contains(&later) {
            mounts.push(later);
        }
    }
    mounts
}
