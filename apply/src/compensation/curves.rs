//! Identified error motions of a model as functions of the position of their own axis.
//!
//! `E(q) = Σ kᵢ·bᵢ(q)` sums the declared effects of one error motion that depend on the position of its own axis or on
//! its direction of travel. A curve covers the positions through which its axis moved in runs that observe the error.
//! Other positions would be an extrapolation: there the axis stood still, or no reading observes the error. The
//! covariance of the coefficients gives the uncertainty at a position, `u²(q) = b(q)ᵀ·Cov·b(q)`.
//!
//! A table over a position cannot hold an effect of time, temperature or speed. Such effects are listed as excluded.

use std::ops::Range;

use abbe_identify::error;
use abbe_model::Diagnostic;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::driver::{DriverPart, DriverSample};
use abbe_model::effect::{Component, Effect};

use abbe_identify::model_file::motion::over_own_axis;
use abbe_identify::model_file::{IdentifiedModel, ModelParameter};

/// One error motion as a function of the position of its axis.
#[derive(Clone, Debug)]
pub struct ErrorCurve {
    /// The error, for example `EXX`.
    pub error: ErrorName,
    /// Its axis, by index in the machine.
    pub axis: usize,
    /// The positions through which the axis moved while readings observed the error, mm or rad.
    pub range: Range<f64>,
    /// The position at which the error counts as zero: the stated reference position of the axis, else the first one of the
    /// range, if the range does not contain the zero of the axis. There the model is an extrapolation, and its error no
    /// measured one.
    pub zero: Option<f64>,
    terms: Vec<(Effect, Vec<f64>)>,
    /// The indices of the terms' coefficients and estimated numbers among the model's parameters, term by term.
    unknowns: Vec<usize>,
    /// Their covariance, row by row, internal units.
    covariance: Vec<Vec<f64>>,
}

impl ErrorCurve {
    /// The derivatives of the error by the unknowns of all terms at a position (mm or rad), approached in a direction (+1
    /// or −1).
    fn basis(&self, position: f64, direction: f64) -> Vec<f64> {
        let mut basis = self.basis_of_model(position, direction);
        for (zero, towards) in self.zero.into_iter().flat_map(|zero| [(zero, 1.0), (zero, -1.0)]) {
            let reference = self.basis_of_model(zero, towards);
            basis.iter_mut().zip(reference).for_each(|(own, reference)| *own -= 0.5 * reference);
        }
        basis
    }

    /// The same of the model, whose error is zero where its functions are.
    fn basis_of_model(&self, position: f64, direction: f64) -> Vec<f64> {
        let sample = DriverSample { value: position, direction, ..DriverSample::default() };
        let mut basis = Vec::with_capacity(self.unknowns.len());
        for (effect, coefficients) in &self.terms {
            effect.basis_with_numbers(&sample, coefficients, &mut basis);
        }
        basis
    }

    /// The error at a position (mm or rad), approached in a direction (+1 or −1), mm or rad, less the mean of both
    /// directions at [`ErrorCurve::zero`].
    pub fn at(&self, position: f64, direction: f64) -> f64 {
        let reference = self.zero.map_or(0.0, |zero| 0.5 * (self.of_model(zero, 1.0) + self.of_model(zero, -1.0)));
        self.of_model(position, direction) - reference
    }

    /// The same of the model, whose error is zero where its functions are.
    fn of_model(&self, position: f64, direction: f64) -> f64 {
        let sample = DriverSample { value: position, direction, ..DriverSample::default() };
        let mut basis = Vec::new();
        let mut sum = 0.0;
        for (effect, coefficients) in &self.terms {
            basis.clear();
            effect.shape.basis(&sample, &mut basis);
            sum += basis.iter().zip(coefficients).map(|(b, k)| b * k).sum::<f64>();
        }
        sum
    }

    /// The standard uncertainty of [`ErrorCurve::at`], mm or rad.
    pub fn u_at(&self, position: f64, direction: f64) -> f64 {
        self.u_of(&self.basis(position, direction))
    }

    /// The mean of both directions at a position.
    pub fn mean_at(&self, position: f64) -> f64 {
        0.5 * (self.at(position, 1.0) + self.at(position, -1.0))
    }

    /// The standard uncertainty of [`ErrorCurve::mean_at`].
    pub fn u_of_mean_at(&self, position: f64) -> f64 {
        let [there, back] = [1.0, -1.0].map(|direction| self.basis(position, direction));
        let mean: Vec<f64> = there.iter().zip(&back).map(|(a, b)| 0.5 * (a + b)).collect();
        self.u_of(&mean)
    }

    fn u_of(&self, basis: &[f64]) -> f64 {
        let rows = self.covariance.iter().zip(basis);
        let variance: f64 = rows.map(|(row, b)| b * row.iter().zip(basis).map(|(c, d)| c * d).sum::<f64>()).sum();
        variance.max(0.0).sqrt()
    }

    /// Whether it depends on the direction of travel.
    pub fn is_directional(&self) -> bool {
        self.terms.iter().any(|(effect, _)| effect.shape.uses() == DriverPart::Direction)
    }
}

/// Equidistant positions that all of these curves cover, internal units. Curves without a common position have none.
pub(crate) fn positions<'c>(
    curves: impl IntoIterator<Item = &'c ErrorCurve>,
    points: usize,
) -> impl Iterator<Item = f64> {
    let ranges = curves.into_iter().map(|curve| &curve.range);
    let (from, to) =
        ranges.fold((f64::NEG_INFINITY, f64::INFINITY), |(from, to), range| (from.max(range.start), to.min(range.end)));
    let points = if from < to { points } else { 0 };
    (0..points).map(move |k| from + (to - from) * k as f64 / (points - 1) as f64)
}

/// The identified errors that a control can compensate, and those that it cannot.
#[derive(Clone, Debug, Default)]
pub struct Compensation {
    /// Error motions as functions of their own axis.
    pub curves: Vec<ErrorCurve>,
    /// Identified location errors, mm or rad.
    pub locations: Vec<(ErrorName, f64)>,
    /// Identified machine errors that are in neither list, with the reason.
    pub left_out: Vec<String>,
}

/// The curves and location errors of a model. `references` are the positions of axes at which a control has its zero, mm or
/// degrees: the errors of such an axis are those less the error there.
///
/// # Errors
/// If a reference position is of no axis with a curve, or outside the range of one of its curves.
pub fn of_model(model: &IdentifiedModel, references: &[(String, f64)]) -> Result<Compensation, Diagnostic> {
    let mut result = Compensation::default();
    let machine = &model.machine;
    let list = &model.parameters;
    for parameter in list {
        match parameter.id.error().filter(|_| parameter.identifiable) {
            None => {}
            Some(name) if name.kind == ErrorKind::Location => result.locations.push((name.clone(), parameter.value)),
            _ => result
                .left_out
                .push(format!("{}: a constant error motion is not a function of the position", parameter.id)),
        }
    }
    for (index, effect) in model.effects.iter().enumerate() {
        if !matches!(effect.component, Component::Axis(_)) {
            continue;
        }
        let mut left_out = |why: &str| result.left_out.push(format!("{}: {why}", effect.id()));
        let Some(error) = over_own_axis(effect) else {
            left_out("a table over the position of its axis cannot represent it");
            continue;
        };
        if !effect.tests.is_empty() {
            left_out("it acts in some tests only, so it is not a property of the axis");
            continue;
        }
        let own =
            |other: &ModelParameter, is_number: bool| other.effect == Some(index) && other.id.is_number() == is_number;
        let of_effect = |wanted: usize| list.iter().position(|other| own(other, false) && other.index == Some(wanted));
        let coefficients = (0..effect.shape.coefficients()).map(|k| of_effect(k).filter(|j| list[*j].identifiable));
        let (Some(axis), Some(coefficients)) =
            (machine.axis_index(&error.axis), coefficients.collect::<Option<Vec<usize>>>())
        else {
            left_out("not all of its coefficients are identifiable");
            continue;
        };
        let term = (effect.clone(), coefficients.iter().map(|j| list[*j].value).collect());
        let unknowns = coefficients.into_iter().chain((0..list.len()).filter(|j| own(&list[*j], true)));
        if let Some(curve) = result.curves.iter_mut().find(|curve| curve.error == *error) {
            curve.terms.push(term);
            curve.unknowns.extend(unknowns);
            continue;
        }
        let id = error.to_string();
        let Some(observed) = model.motion_ranges.iter().find(|range| range.error == id) else {
            left_out("the model does not state where it was observed; save it again with this version");
            continue;
        };
        let Some((range, unconnected)) = observed.internal.split_first() else {
            left_out("its axis stands still wherever readings observe it, and the positions between are not measured");
            continue;
        };
        let kind = machine.axes[axis].kind;
        for [start, end] in unconnected.iter().map(|ends| ends.map(|end| kind.to_display(end))) {
            result.left_out.push(format!(
                "{error} from {start:.3} to {end:.3} {}: not connected to the longest range of motion of the axis",
                kind.unit()
            ));
        }
        let stated = references.iter().find(|(name, _)| *name == error.axis).map(|(_, place)| *place);
        let within = [range[0], range[1]].map(|end| kind.to_display(end));
        if let Some(found) = stated.filter(|place| !(within[0]..=within[1]).contains(place)) {
            let name = format!("the reference position of {} in the table of {error}", error.axis);
            return Err(error::out_of_range(name, found, within, kind.unit().name()));
        }
        let stated = stated.map(|place| kind.to_internal(place));
        let zero = stated.or((!(range[0]..=range[1]).contains(&0.0)).then_some(range[0]));
        if let Some(zero) = zero.filter(|_| stated.is_none()).map(|zero| kind.to_display(zero)) {
            result.left_out.push(format!(
                "{error} at {zero:.3} {}: the zero of the table; at 0 the error is not measured",
                kind.unit()
            ));
        }
        result.curves.push(ErrorCurve {
            error: error.clone(),
            axis,
            range: range[0]..range[1],
            zero,
            terms: vec![term],
            unknowns: unknowns.collect(),
            covariance: Vec::new(),
        });
    }
    for (name, _) in references {
        machine.axis_index(name).ok_or_else(|| error::no_axis(machine, "", name))?;
        if !result.curves.iter().any(|curve| curve.error.axis == *name) {
            let found = "the model has no compensation table over it";
            let expected = "state the reference position of an axis whose error motions are written";
            return Err(error::not_applicable(format!("axis `{name}`"), found, expected));
        }
    }
    for curve in &mut result.curves {
        let row = |j: &usize| curve.unknowns.iter().map(|k| model.covariance[(*j, *k)]).collect();
        curve.covariance = curve.unknowns.iter().map(row).collect();
    }
    Ok(result)
}
