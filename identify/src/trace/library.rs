//! The library of effects: data in `library.toml`, laid out for a session here.

use std::f64::consts::TAU;

use abbe_model::axis::AxisKind;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::effect::{Component, Driver, Effect, Shape};
use abbe_model::instrument::SharedBy;
use serde::Deserialize;

use crate::error::IdentifyError;
use crate::problem::Problem;

const LIBRARY: &str = include_str!("library.toml");

/// The highest harmonic that is looked for, however dense the sampling.
const HIGHEST_ORDER: usize = 120;
/// The highest harmonic for poses, which sample an axis at random: an independent search found nothing real above it.
const HIGHEST_ORDER_OF_POSES: usize = 40;
/// Readings in a cycle of the shortest wave that is looked for; two would just carry it.
const READINGS_A_CYCLE: f64 = 2.4;

/// Intervals of the travel between the places where steps are looked for.
const PLACES_OF_STEPS: usize = 40;

/// A family of effects, as it stands in the library.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Family {
    /// In words.
    pub name: String,
    components: Components,
    driver: DriverChoice,
    shape: String,
    #[serde(default)]
    degrees: Vec<usize>,
    #[serde(default)]
    tau_s: Vec<f64>,
    /// What a member costs in the score.
    pub simplicity: f64,
    /// Whether it is tried only when nothing simpler is left to find and structure remains.
    #[serde(default)]
    pub last_resort: bool,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum Components {
    Motion,
    OwnMotion,
    AnyMotion,
    Location,
    Body,
    Balls,
    Bar,
    Gain,
    Trigger,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum DriverChoice {
    None,
    Own,
    OwnRotary,
    OwnLinear,
    Other,
    Time,
    Temperature,
    Gravity,
}

#[derive(Deserialize)]
struct Library {
    family: Vec<Family>,
}

/// An effect that is looked for.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The effect.
    pub effect: Effect,
    /// Index of its family.
    pub family: usize,
    /// What it costs in the score beside its coefficients, in natural-log units.
    pub cost: f64,
    /// What the choice of its places takes from its evidence, where it is composed of several; 0 for an entry of the library.
    pub price: f64,
    /// Whether it is tried only when nothing simpler is left to find and structure remains.
    pub last_resort: bool,
    /// Whether it holds the places that an effect may be composed of ([`super::compose`]) and is no effect itself.
    pub dictionary: bool,
    /// How far apart the entries of the library are in the number of the shape that is the first to be tuned, in the driver's unit; 0 without one.
    pub grid: f64,
}

impl Candidate {
    /// How long it takes to say what it is: the simplest is the shortest.
    pub fn length(&self) -> f64 {
        self.cost + self.price
    }
}

/// How the axes are sampled in a session.
struct Sampling {
    moves: Vec<bool>,
    low: Vec<f64>,
    high: Vec<f64>,
    /// Typical step between readings where the axis moves; 0 for poses.
    step: Vec<f64>,
    has_time: bool,
    duration_s: f64,
    has_temperature: bool,
    reverses_inside_runs: Vec<bool>,
    both_directions: Vec<bool>,
}

/// The families of the library.
///
/// # Errors
/// Only if the library that is compiled in cannot be read.
pub fn families() -> Result<Vec<Family>, IdentifyError> {
    let library: Library = toml::from_str(LIBRARY)
        .map_err(|fault| IdentifyError::Request(format!("the library of effects cannot be read: {fault}")))?;
    Ok(library.family)
}

/// The library laid out for a session: every member that its axes, its instrument and its columns allow, less what the model has already.
///
/// # Errors
/// See [`families`].
pub fn candidates(problem: &Problem<'_>) -> Result<Vec<Candidate>, IdentifyError> {
    let sampling = Sampling::of(problem);
    let families = families()?;
    let mut candidates = Vec::new();
    for (number, family) in families.iter().enumerate() {
        for component in components(problem, &sampling, family.components) {
            for driver in drivers(problem, &sampling, family.driver, &component) {
                for (shape, tests, extra) in shapes(problem, &sampling, family, &component, &driver) {
                    let effect = Effect {
                        component: component.clone(),
                        driver: driver.clone(),
                        shape,
                        tests,
                    };
                    let cost = family.simplicity + extra + tilt_cost(problem, &component);
                    let last_resort = family.last_resort;
                    let span = match &driver {
                        Driver::Axis(name) => problem
                            .session
                            .machine
                            .axis_index(name)
                            .map_or(0.0, |axis| sampling.span(axis)),
                        _ => 0.0,
                    };
                    let grid = match &effect.shape {
                        // Frequencies lie half a cycle over the travel apart.
                        Shape::Periodic { period } => 0.5 * period * period / span,
                        Shape::Steps { .. } => span / PLACES_OF_STEPS as f64,
                        Shape::Local { width, .. } => *width,
                        _ => 0.0,
                    };
                    let dictionary = matches!(&effect.shape, Shape::Steps { at } if at.len() > 1);
                    candidates.push(Candidate {
                        effect,
                        family: number,
                        cost,
                        price: 0.0,
                        last_resort,
                        dictionary,
                        grid,
                    });
                }
            }
        }
    }
    let declared: Vec<String> = problem
        .parameters
        .list
        .iter()
        .map(|parameter| parameter.id.clone())
        .collect();
    candidates.retain(|candidate| {
        let constant = candidate.effect.shape == Shape::Constant;
        let same_error = constant && declared.contains(&candidate.effect.component.to_string());
        let free = constant && is_free_setup(problem, &candidate.effect);
        !same_error && !free && !problem.parameters.effects.contains(&candidate.effect)
    });
    Ok(candidates)
}

/// Whether a set-up quantity is free already, so that freeing it is no effect.
fn is_free_setup(problem: &Problem<'_>, effect: &Effect) -> bool {
    let Component::Instrument { thing, coordinate } = &effect.component else {
        return false;
    };
    let Some(test) = problem
        .tests
        .iter()
        .find(|test| effect.tests.contains(&test.name))
    else {
        return false;
    };
    let unknowns = problem.session.instrument.unknowns();
    let place = unknowns
        .iter()
        .position(|u| u.thing == thing && u.coordinate == coordinate);
    place.is_some_and(|place| test.priors[place] == abbe_model::session::Prior::Free)
}

impl Sampling {
    fn of(problem: &Problem<'_>) -> Sampling {
        let axes = problem.session.machine.axes.len();
        let mut sampling = Sampling {
            moves: vec![false; axes],
            low: vec![f64::INFINITY; axes],
            high: vec![f64::NEG_INFINITY; axes],
            step: vec![0.0; axes],
            has_time: true,
            duration_s: 0.0,
            has_temperature: true,
            reverses_inside_runs: vec![false; axes],
            both_directions: vec![false; axes],
        };
        for test in &problem.tests {
            let Some(readings) = &test.readings else { continue };
            sampling.has_time &= !readings.time_s.is_empty();
            sampling.has_temperature &= !readings.temperature_c.is_empty();
            for (axis, column) in readings.positions.iter().enumerate() {
                for value in column {
                    sampling.low[axis] = sampling.low[axis].min(*value);
                    sampling.high[axis] = sampling.high[axis].max(*value);
                }
                let kind = problem.session.machine.axes[axis].kind;
                let samples = readings.axis_samples(axis, kind);
                let directions = |range: std::ops::Range<usize>| {
                    samples[range]
                        .iter()
                        .map(|s| s.direction as i32)
                        .filter(|d| *d != 0)
                        .collect::<std::collections::BTreeSet<_>>()
                };
                sampling.both_directions[axis] |= directions(0..samples.len()).len() > 1;
                for run in readings.runs() {
                    sampling.reverses_inside_runs[axis] |= directions(run).len() > 1;
                }
                if !readings.run.is_empty() && column.len() > 1 {
                    let mut steps: Vec<f64> = column
                        .windows(2)
                        .map(|pair| (pair[1] - pair[0]).abs())
                        .filter(|step| *step > 1e-9)
                        .collect();
                    sampling.step[axis] = sampling.step[axis].max(crate::outliers::median(&mut steps));
                }
            }
            let last = readings.time_s.iter().copied().fold(0.0, f64::max);
            sampling.duration_s = sampling.duration_s.max(last - problem.origin.time_s);
        }
        for axis in 0..axes {
            sampling.moves[axis] = sampling.high[axis] - sampling.low[axis] > 1e-6;
        }
        sampling
    }

    /// Whether rows are independent poses: no axis is swept.
    fn is_poses(&self) -> bool {
        self.step.iter().all(|step| *step == 0.0)
    }

    fn span(&self, axis: usize) -> f64 {
        self.high[axis] - self.low[axis]
    }
}

fn components(problem: &Problem<'_>, sampling: &Sampling, choice: Components) -> Vec<Component> {
    let machine = &problem.session.machine;
    let error = |axis: usize, kind: ErrorKind, freedom: Freedom| {
        Component::Axis(ErrorName {
            kind,
            freedom,
            axis: machine.axes[axis].name.clone(),
        })
    };
    let moving = || (0..machine.axes.len()).filter(|axis| sampling.moves[*axis]);
    let things = |names: &[&str]| -> Vec<Component> {
        problem
            .session
            .instrument
            .unknowns()
            .iter()
            .filter(|unknown| names.contains(&unknown.thing))
            .map(|unknown| Component::Instrument {
                thing: unknown.thing.to_string(),
                coordinate: unknown.coordinate.to_string(),
            })
            .collect()
    };
    match choice {
        Components::Motion => moving()
            .flat_map(|axis| Freedom::ALL.map(|freedom| error(axis, ErrorKind::Motion, freedom)))
            .collect(),
        Components::OwnMotion => moving()
            .map(|axis| error(axis, ErrorKind::Motion, machine.axes[axis].own_freedom()))
            .collect(),
        Components::AnyMotion => (0..machine.axes.len())
            .filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary)
            .flat_map(|axis| Freedom::ALL.map(|freedom| error(axis, ErrorKind::Motion, freedom)))
            .collect(),
        Components::Location | Components::Body => (0..machine.axes.len())
            .flat_map(|axis| {
                let own = machine.axes[axis].own_freedom();
                let rotary = machine.axes[axis].kind == AxisKind::Rotary;
                let along = Freedom::ALL[own.index() % 3];
                let body = choice == Components::Body;
                Freedom::ALL
                    .into_iter()
                    // An axis is a line: it has no location along itself, and its zero is no error of the line. What it carries may well move there.
                    .filter(move |f| {
                        if rotary {
                            body || *f != own && *f != along
                        } else {
                            f.is_angle() && f.index() != own.index() + 3
                        }
                    })
                    .map(move |freedom| error(axis, ErrorKind::Location, freedom))
            })
            .collect(),
        Components::Balls => things(&["workpiece_ball", "spindle_ball"]),
        Components::Bar => things(&["bar"]),
        Components::Gain => things(&["gain"]),
        Components::Trigger => {
            if sampling.has_time && sampling.step.iter().any(|step| *step > 0.0) {
                vec![Component::TriggerDelay]
            } else {
                Vec::new()
            }
        }
    }
}

fn drivers(
    problem: &Problem<'_>,
    sampling: &Sampling,
    choice: DriverChoice,
    component: &Component,
) -> Vec<Driver> {
    let machine = &problem.session.machine;
    let own = crate::drivers::component_axis(problem.session, component);
    let own_of_kind = |kind: Option<AxisKind>| -> Vec<Driver> {
        own.filter(|axis| kind.is_none_or(|kind| machine.axes[*axis].kind == kind))
            .map(|axis| Driver::Axis(machine.axes[axis].name.clone()))
            .into_iter()
            .collect()
    };
    match choice {
        DriverChoice::None => vec![Driver::None],
        DriverChoice::Own => own_of_kind(None),
        DriverChoice::OwnRotary => own_of_kind(Some(AxisKind::Rotary)),
        DriverChoice::OwnLinear => own_of_kind(Some(AxisKind::Linear)),
        // Among independent poses every axis moves at once and any pair could be blamed; what a body gives there, the moment tells.
        DriverChoice::Other if sampling.is_poses() => Vec::new(),
        DriverChoice::Other => (0..machine.axes.len())
            .filter(|axis| sampling.moves[*axis] && Some(*axis) != own)
            .map(|axis| Driver::Axis(machine.axes[axis].name.clone()))
            .collect(),
        DriverChoice::Time => {
            if sampling.has_time {
                vec![Driver::Time]
            } else {
                Vec::new()
            }
        }
        DriverChoice::Temperature => {
            if sampling.has_temperature {
                vec![Driver::Temperature]
            } else {
                Vec::new()
            }
        }
        DriverChoice::Gravity => {
            let turns = own.is_some_and(|axis| machine.axes[axis].kind == AxisKind::Rotary);
            if turns { vec![Driver::Gravity] } else { Vec::new() }
        }
    }
}

/// Shapes of a family for a component and a driver: shape, the tests it is confined to, and what it costs beyond its family.
fn shapes(
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

/// A translation is a simpler cause than a tilt that moves the point as much; the angle that an axis itself turns is no tilt, nor is the squareness of a
/// linear axis, which slides askew and turns nothing.
fn tilt_cost(problem: &Problem<'_>, component: &Component) -> f64 {
    match component {
        Component::Axis(name) if name.freedom.is_angle() => {
            let machine = &problem.session.machine;
            let axis = machine.axis_index(&name.axis).map(|axis| &machine.axes[axis]);
            let own = axis.is_some_and(|axis| axis.own_freedom() == name.freedom);
            let slides = axis.is_some_and(|axis| axis.kind == AxisKind::Linear);
            let squareness = slides && name.kind == ErrorKind::Location;
            if own || squareness { 0.0 } else { 1.0 }
        }
        _ => 0.0,
    }
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
