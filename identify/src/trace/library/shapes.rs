//! The shapes that a family of the library takes for a component and a driver, as far as the session samples them.

use std::f64::consts::TAU;

use abbe_model::axis::AxisKind;
use abbe_model::effect::{Component, Driver, Shape};
use abbe_model::instrument::SharedBy;

use super::sampling::Sampling;
use super::{Family, PLACES_OF_STEPS};
use crate::problem::Problem;

/// The highest harmonic that is looked for, however dense the sampling.
const HIGHEST_ORDER: usize = 120;
/// The highest harmonic for poses, which sample an axis at random: an independent search found nothing real above it.
const HIGHEST_ORDER_OF_POSES: usize = 40;
/// Readings in a cycle of the shortest wave that is looked for; two would just carry it.
const READINGS_A_CYCLE: f64 = 2.4;

/// Shapes of a family for a component and a driver: shape, the tests it is confined to, and what it costs beyond its family.
pub(super) fn shapes(
    problem: &Problem<'_>,
    sampling: &Sampling,
    family: &Family,
    component: &Component,
    driver: &Driver,
) -> Vec<(Shape, Vec<String>, f64)> {
    let all = |shape: Shape, extra: f64| (shape, Vec::new(), extra);
    let axis = match driver {
        Driver::Axis(name) => problem.session.machine.axis_index(name),
        _ => None,
    };
    let rotary = axis.is_some_and(|axis| problem.session.machine.axes[axis].kind == AxisKind::Rotary);
    let span = axis.map_or(1.0, |axis| sampling.span(axis));
    let poses = sampling.is_poses();
    let step = axis.map_or(0.0, |axis| sampling.step[axis]);
    match family.shape.as_str() {
        "constant" => vec![all(Shape::Constant, 0.0)],
        "constant-per-mount" => mounts(problem, component)
            .into_iter()
            .map(|tests| (Shape::Constant, tests, 0.0))
            .collect(),
        "harmonic" => {
            let most = if poses {
                HIGHEST_ORDER_OF_POSES
            } else if step > 0.0 {
                ((TAU / (READINGS_A_CYCLE * step)) as usize).clamp(1, HIGHEST_ORDER)
            } else {
                0
            };
            (1..=most)
                .map(|order| all(Shape::Harmonic { order: order as f64 }, harmonic_cost(order)))
                .collect()
        }
        "harmonic-low" => {
            if rotary {
                (1..=2)
                    .map(|order| all(Shape::Harmonic { order: order as f64 }, harmonic_cost(order)))
                    .collect()
            } else {
                (1..=2)
                    .map(|degree| {
                        all(
                            Shape::Power {
                                degree,
                                scale: half(span),
                            },
                            0.2 * degree as f64,
                        )
                    })
                    .collect()
            }
        }
        "power" => family
            .degrees
            .iter()
            .map(|degree| {
                let scale = match driver {
                    Driver::Axis(_) => half(span),
                    _ => 1.0,
                };
                all(
                    Shape::Power {
                        degree: *degree,
                        scale,
                    },
                    0.2 * *degree as f64,
                )
            })
            .collect(),
        "periodic" => {
            // Frequencies half a cycle over the travel apart, from one cycle on.
            if step <= 0.0 || poses {
                return Vec::new();
            }
            let most = ((2.0 * span / (READINGS_A_CYCLE * step)) as usize).min(240);
            // Over a full turn whole cycles are harmonics.
            let turn = rotary && (span / TAU - (span / TAU).round()).abs() < 0.01;
            (2..=most)
                .filter(|half_cycles| !turn || half_cycles % 2 == 1)
                .map(|half_cycles| {
                    all(
                        Shape::Periodic {
                            period: 2.0 * span / half_cycles as f64,
                        },
                        0.5,
                    )
                })
                .collect()
        }
        "backlash" => {
            let seen = axis.is_some_and(|axis| sampling.both_directions[axis]);
            if seen && !poses {
                vec![all(Shape::Backlash, 0.0)]
            } else {
                Vec::new()
            }
        }
        "lag" => {
            if sampling.has_time && !poses {
                vec![all(Shape::Lag, 0.0)]
            } else {
                Vec::new()
            }
        }
        "reversal-spike" => {
            // A run that begins where the one before it ended begins with a reversal.
            let seen = axis
                .is_some_and(|axis| sampling.reverses_inside_runs[axis] || sampling.both_directions[axis]);
            if !seen || poses {
                return Vec::new();
            }
            [0.002, 0.005, 0.01, 0.02, 0.05]
                .map(|share| all(Shape::ReversalSpike { width: share * span }, 0.0))
                .to_vec()
        }
        "drift" => vec![all(Shape::Drift, 0.0)],
        "warmup" => family
            .tau_s
            .iter()
            .filter(|tau| **tau < 2.0 * sampling.duration_s)
            .map(|tau| all(Shape::Warmup { tau_s: *tau }, 0.0))
            .collect(),
        "steps" => {
            if poses || step <= 0.0 {
                return Vec::new();
            }
            let axis = axis.unwrap_or(0);
            let places =
                (1..PLACES_OF_STEPS).map(|k| sampling.low[axis] + span * k as f64 / PLACES_OF_STEPS as f64);
            let singles = places
                .clone()
                .map(|place| all(Shape::Steps { at: vec![place] }, 0.0));
            let dictionary = all(
                Shape::Steps {
                    at: places.clone().collect(),
                },
                0.0,
            );
            singles.chain([dictionary]).collect()
        }
        "local" => {
            if poses {
                return Vec::new();
            }
            let Some(axis) = axis else { return Vec::new() };
            let turn = rotary && span > 0.99 * TAU;
            let recurs = turn.then_some(TAU);
            let mut grid = Vec::new();
            for share in [0.02, 0.04, 0.08] {
                let width = share * span;
                let count = (1.0 / share) as usize;
                for k in 0..count {
                    let centre = sampling.low[axis] + span * (k as f64 + 0.5) / count as f64;
                    grid.push(all(
                        Shape::Local {
                            centre,
                            width,
                            recurs,
                        },
                        0.0,
                    ));
                }
            }
            grid
        }
        "curve" => {
            let Some(axis) = axis else { return Vec::new() };
            if poses && !rotary {
                return Vec::new();
            }
            let turn = rotary && span > 0.99 * TAU;
            let (from, to) = if turn {
                (sampling.low[axis], sampling.low[axis] + TAU)
            } else {
                (sampling.low[axis], sampling.high[axis])
            };
            // At least one reading and a half an interval.
            [8, 16, 32, 64]
                .into_iter()
                .filter(|intervals| {
                    poses && *intervals <= 16 || step > 0.0 && 1.5 * step * *intervals as f64 <= span
                })
                .map(|intervals| {
                    all(
                        Shape::Curve {
                            from,
                            to,
                            intervals,
                            closed: turn,
                        },
                        0.0,
                    )
                })
                .collect()
        }
        _ => Vec::new(),
    }
}

fn half(span: f64) -> f64 {
    if span > 0.0 { span / 2.0 } else { 1.0 }
}

/// High orders are many, and each by itself is unlikely: the cost of naming one grows as the logarithm of the order.
fn harmonic_cost(order: usize) -> f64 {
    (order as f64).ln()
}

/// The groups of tests that share a mount of a component's thing, where there is more than one group.
fn mounts(problem: &Problem<'_>, component: &Component) -> Vec<Vec<String>> {
    let Component::Instrument { thing, .. } = component else {
        return Vec::new();
    };
    let shared_by = problem
        .session
        .instrument
        .unknowns()
        .iter()
        .find(|unknown| unknown.thing == thing)
        .map_or(SharedBy::Session, |unknown| unknown.shared_by);
    let mut groups: Vec<(String, Vec<String>)> = Vec::new();
    for test in &problem.tests {
        let name = test.group(shared_by).to_string();
        match groups.iter_mut().find(|(group, _)| *group == name) {
            Some((_, tests)) => tests.push(test.name.clone()),
            None => groups.push((name, vec![test.name.clone()])),
        }
    }
    // A mount that tests share may have been disturbed between them: each test by itself as well.
    let mut mounts: Vec<Vec<String>> = groups.into_iter().map(|(_, tests)| tests).collect();
    for test in &problem.tests {
        let alone = vec![test.name.clone()];
        if !mounts.contains(&alone) {
            mounts.push(alone);
        }
    }
    // And from a test on.
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
