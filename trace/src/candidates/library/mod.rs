//! The library of effects. Its data are in `library.toml`. This module lists its members for a session.

mod shapes;

use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::driver::{Driver, Recorded};
use abbe_model::effect::{Component, Effect, Shape};
use serde::Deserialize;
use shapes::shapes;

use super::sampling::Sampling;

const LIBRARY: &str = include_str!("library.toml");

/// The words of the library for drivers that a session names: axes, and columns of the data.
const NAMED_DRIVERS: [&str; 6] = ["own", "own-rotary", "own-linear", "other", CARRIER, COLUMN];
/// The word for the rotary axis that carries the axis of the component.
const CARRIER: &str = "carrier";
/// The word for each driver column of the data.
const COLUMN: &str = "column";

/// A family of effects in the library.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Family {
    /// Description of the family.
    pub name: String,
    components: Components,
    driver: String,
    shape: String,
    /// The numbers of the shape's members, if the shape takes them from the library: degrees, time constants.
    #[serde(default)]
    numbers: Vec<f64>,
    /// Cost of a member in the score.
    pub simplicity: f64,
    /// Whether it is searched only if no simpler candidate is significant and structure remains.
    #[serde(default)]
    pub last_resort: bool,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum Components {
    Motion,
    OwnMotion,
    Transversal,
    AnyMotion,
    Location,
    Body,
    Balls,
    Bar,
    Gain,
    Trigger,
}

#[derive(Deserialize)]
struct Library {
    family: Vec<Family>,
}

/// A member of the library for a session.
#[derive(Clone, Debug)]
pub struct LibraryEffect {
    /// The effect.
    pub effect: Effect,
    /// Index of its family.
    pub family: usize,
    /// Cost in the score in addition to its degrees of freedom, in natural-logarithm units.
    pub cost: f64,
    /// Whether it is searched only if no simpler candidate is significant and structure remains.
    pub last_resort: bool,
    /// Whether it is a dictionary of positions for step tables and not an effect itself.
    pub dictionary: bool,
    /// Spacing of the members in the first tunable shape number, in the driver's unit; 0 if there is none.
    pub grid: f64,
}

/// The families of the library.
///
/// # Errors
/// Only if the compiled library cannot be read.
pub fn families() -> Result<Vec<Family>, Diagnostic> {
    let damaged =
        |cause: toml::de::Error| Diagnostic::identification(format!("the library of effects cannot be read: {cause}"));
    let library: Library = toml::from_str(LIBRARY).map_err(damaged)?;
    for family in &library.family {
        let is_named = matches!(Driver::parse(&family.driver), Driver::Axis(_));
        if is_named && !NAMED_DRIVERS.contains(&family.driver.as_str()) || !shapes::is_known(&family.shape) {
            let fault = format!("unknown driver or shape in \"{}\"", family.name);
            return Err(damaged(serde::de::Error::custom(fault)));
        }
    }
    Ok(library.family)
}

/// The candidates of a session: all members that its axes, instrument and columns permit, except effects that the model
/// already has.
///
/// # Errors
/// See [`families`].
pub fn candidates(problem: &Problem) -> Result<Vec<LibraryEffect>, Diagnostic> {
    let sampling = Sampling::of(problem);
    let families = families()?;
    let mut candidates = Vec::new();
    for (number, family) in families.iter().enumerate() {
        for component in components(problem, &sampling, family.components) {
            for driver in drivers(problem, &sampling, &family.driver, &component) {
                for (shape, tests, extra) in shapes(problem, &sampling, family, &component, &driver) {
                    let effect = Effect { tests, ..Effect::new(component.clone(), driver.clone(), shape) };
                    let cost = family.simplicity + extra + tilt_cost(problem, &component);
                    let last_resort = family.last_resort;
                    let grid = grid(problem, &sampling, &effect);
                    let dictionary = effect.shape.positions().len() > 1;
                    candidates.push(LibraryEffect { effect, family: number, cost, last_resort, dictionary, grid });
                }
            }
        }
    }
    let declared: Vec<String> = problem.parameters.list.iter().map(|parameter| parameter.id.to_string()).collect();
    candidates.retain(|candidate| {
        let constant = candidate.effect.shape == Shape::Constant;
        let same_error = constant && declared.contains(&candidate.effect.component.to_string());
        let free = constant && is_free_setup(problem, &candidate.effect);
        !same_error && !free && !problem.parameters.effects.contains(&candidate.effect)
    });
    Ok(candidates)
}

/// See [`LibraryEffect::grid`].
fn grid(problem: &Problem, sampling: &Sampling, effect: &Effect) -> f64 {
    let axis = effect.driver.axis(&problem.session.machine);
    effect.shape.spacing(axis.map_or(0.0, |axis| sampling.span(axis)))
}

/// Whether a set-up quantity is a free parameter already, so that it is no further effect.
fn is_free_setup(problem: &Problem, effect: &Effect) -> bool {
    let Component::Instrument { thing, coordinate } = &effect.component else {
        return false;
    };
    let Some(test) = problem.tests.iter().find(|test| effect.tests.contains(&test.name)) else {
        return false;
    };
    let setup_parameters = test.station.kind().unknowns();
    let index = setup_parameters.iter().position(|u| u.thing == thing && u.coordinate == coordinate);
    index.is_some_and(|index| test.priors[index] == abbe_model::session::Prior::Free)
}

fn components(problem: &Problem, sampling: &Sampling, choice: Components) -> Vec<Component> {
    let machine = &problem.session.machine;
    let error = |axis: usize, kind: ErrorKind, freedom: Freedom| {
        Component::Axis(ErrorName { kind, freedom, axis: machine.axes[axis].name.clone() })
    };
    let moving = || (0..machine.axes.len()).filter(|axis| sampling.moves[*axis]);
    let things = |names: &[&str]| -> Vec<Component> {
        problem
            .session
            .instrument_parameters()
            .into_iter()
            .filter(|parameter| names.contains(&parameter.thing))
            .map(|parameter| Component::Instrument {
                thing: parameter.thing.to_string(),
                coordinate: parameter.coordinate.to_string(),
            })
            .collect()
    };
    match choice {
        Components::Motion => {
            moving().flat_map(|axis| Freedom::ALL.map(|freedom| error(axis, ErrorKind::Motion, freedom))).collect()
        }
        Components::OwnMotion => {
            moving().map(|axis| error(axis, ErrorKind::Motion, machine.axes[axis].own_freedom())).collect()
        }
        Components::Transversal => moving()
            .filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary)
            .flat_map(|axis| {
                let next = (machine.axes[axis].own_freedom().index() + 1) % 3;
                [next, next + 3].map(|freedom| error(axis, ErrorKind::Motion, Freedom::ALL[freedom]))
            })
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
                    // An axis is a line. It has no location error along itself, and its zero offset is no error of the
                    // line. The body that it carries can move in these directions too.
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

/// The drivers of a component: axes by their relation to the component's own, or the driver of that word.
fn drivers(problem: &Problem, sampling: &Sampling, choice: &str, component: &Component) -> Vec<Driver> {
    let machine = &problem.session.machine;
    let own = component.axis(machine);
    let own_of_kind = |kind: Option<AxisKind>| -> Vec<Driver> {
        own.filter(|axis| kind.is_none_or(|kind| machine.axes[*axis].kind == kind))
            .map(|axis| Driver::Axis(machine.axes[axis].name.clone()))
            .into_iter()
            .collect()
    };
    match choice {
        "own" => own_of_kind(None),
        "own-rotary" => own_of_kind(Some(AxisKind::Rotary)),
        "own-linear" => own_of_kind(Some(AxisKind::Linear)),
        // With independent poses every axis moves at once, so that any pair of axes would be a candidate. There gravity
        // covers compliance.
        "other" if sampling.is_poses() => Vec::new(),
        "other" => (0..machine.axes.len())
            .filter(|axis| sampling.moves[*axis] && Some(*axis) != own)
            .map(|axis| Driver::Axis(machine.axes[axis].name.clone()))
            .collect(),
        // Along runs `other` has it.
        CARRIER if !sampling.is_poses() => Vec::new(),
        CARRIER => own
            .and_then(|axis| machine.carrier(axis))
            .filter(|axis| sampling.moves[*axis] && machine.axes[*axis].kind == AxisKind::Rotary)
            .map(|axis| Driver::Axis(machine.axes[axis].name.clone()))
            .into_iter()
            .collect(),
        COLUMN => sampling.columns.iter().map(|column| Driver::Column(column.name.clone())).collect(),
        word => {
            let driver = Driver::parse(word);
            let columns: Vec<&str> = sampling.columns.iter().map(|column| column.name.as_str()).collect();
            let recorded = Recorded { time: sampling.has_time, columns: &columns, swept: !sampling.is_poses() };
            let kind = own.map(|axis| machine.axes[axis].kind);
            let observable = driver.kind().is_observable(&recorded, kind);
            observable.then_some(driver).into_iter().collect()
        }
    }
}

/// Additional cost of a tilt. A translation is a simpler cause than a tilt that displaces the point equally. The
/// rotation about the axis itself is no tilt, and neither is the squareness of a linear axis.
fn tilt_cost(problem: &Problem, component: &Component) -> f64 {
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
