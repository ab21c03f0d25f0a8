//! Identified error motions as curves over their own axis: what a control compensates.
//!
//! `E(q) = Σ kᵢ·bᵢ(q)` over the declared effects of one error motion that follow the position of its own axis, or its direction of travel.
//! What follows anything else (time, temperature, speed) no table over a position can hold; it is left out by name.

use std::ops::Range;

use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::effect::{Component, Driver, DriverSample, Effect, Shape};

use crate::fit::Fit;
use crate::parameters::Role;
use crate::problem::Problem;

/// One error motion over the position of its axis.
#[derive(Clone, Debug)]
pub struct ErrorCurve {
    /// Which, as `EXX`.
    pub error: ErrorName,
    /// Its axis, by index in the machine.
    pub axis: usize,
    /// The positions that the readings cover, mm or rad.
    pub range: Range<f64>,
    terms: Vec<(Effect, Vec<f64>)>,
}

impl ErrorCurve {
    /// The error at a position (mm or rad) reached in a direction (+1 or −1), mm or rad.
    pub fn at(&self, position: f64, direction: f64) -> f64 {
        let sample = DriverSample {
            value: position,
            direction,
            ..DriverSample::default()
        };
        let mut basis = Vec::new();
        self.terms
            .iter()
            .map(|(effect, coefficients)| {
                basis.clear();
                effect.shape.basis(&sample, &mut basis);
                basis.iter().zip(coefficients).map(|(b, k)| b * k).sum::<f64>()
            })
            .sum()
    }

    /// Whether it depends on the direction of travel.
    pub fn is_directional(&self) -> bool {
        self.terms
            .iter()
            .any(|(effect, _)| effect.shape == Shape::Backlash)
    }
}

/// What can be compensated, and what not.
#[derive(Clone, Debug, Default)]
pub struct Compensation {
    /// Error motions over their own axis.
    pub curves: Vec<ErrorCurve>,
    /// Location errors that were identified, mm or rad.
    pub locations: Vec<(ErrorName, f64)>,
    /// What was identified of the machine and is in neither, with the reason.
    pub left_out: Vec<String>,
}

/// The curves and location errors of a fit.
pub fn of_fit(problem: &Problem<'_>, fit: &Fit) -> Compensation {
    let mut result = Compensation::default();
    let machine = &problem.session.machine;
    let list = &problem.parameters.list;
    for (j, parameter) in list.iter().enumerate() {
        if parameter.role != Role::Error || !fit.rank.is_seen(j) {
            continue;
        }
        match ErrorName::parse(&parameter.id) {
            Some(name) if name.kind == ErrorKind::Location => result.locations.push((name, fit.beta[j])),
            _ => result.left_out.push(format!(
                "{}: a constant of an error motion is no curve",
                parameter.id
            )),
        }
    }
    for (index, effect) in problem.parameters.effects.iter().enumerate() {
        let Component::Axis(error) = &effect.component else {
            continue;
        };
        let id = effect.id();
        let mut coefficients = vec![None; effect.shape.coefficients()];
        for (j, parameter) in list.iter().enumerate() {
            if let Role::Coefficient {
                effect: of,
                coefficient,
            } = parameter.role
                && of == index
                && fit.rank.is_seen(j)
            {
                coefficients[coefficient] = Some(fit.beta[j]);
            }
        }
        let fits_table = match &effect.shape {
            Shape::Lag
            | Shape::ReversalSpike { .. }
            | Shape::Drift
            | Shape::Warmup { .. }
            | Shape::Constant => false,
            _ => matches!(&effect.driver, Driver::Axis(driver) if *driver == error.axis),
        };
        if error.kind != ErrorKind::Motion || !fits_table {
            result.left_out.push(format!(
                "{id}: no table over the position of its axis can hold it"
            ));
            continue;
        }
        if !effect.tests.is_empty() {
            let why = "it is confined to some tests, and so no property of the axis";
            result.left_out.push(format!("{id}: {why}"));
            continue;
        }
        let (Some(axis), Some(coefficients)) = (
            machine.axis_index(&error.axis),
            coefficients.into_iter().collect::<Option<Vec<f64>>>(),
        ) else {
            result
                .left_out
                .push(format!("{id}: the readings do not tell all of it"));
            continue;
        };
        let range = covered(problem, axis);
        match result.curves.iter_mut().find(|curve| curve.error == *error) {
            Some(curve) => curve.terms.push((effect.clone(), coefficients)),
            None => result.curves.push(ErrorCurve {
                error: error.clone(),
                axis,
                range,
                terms: vec![(effect.clone(), coefficients)],
            }),
        }
    }
    result
}

/// The positions of an axis that the readings cover.
fn covered(problem: &Problem<'_>, axis: usize) -> Range<f64> {
    let positions = problem
        .tests
        .iter()
        .filter_map(|test| test.readings.as_ref())
        .flat_map(|readings| readings.positions[axis].iter().copied());
    let (least, most) = positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
        (a.min(x), b.max(x))
    });
    least..most
}
