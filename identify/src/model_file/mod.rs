//! The identified model as a value, and as a file that a later session is compared with.
//!
//! A model holds what a fit or a trace found: the machine, the values of all parameters with their covariance, the
//! effects, the noise, and the range of axes and drivers that the readings covered. Values are those of a base
//! parametrisation ([`crate::fit::base`]): parameters that are not separable are held at nominal, and predictions do
//! not depend on which ones.
//!
//! - `of_fit`: the model of a fit; [`carried`]: the part that another session shares, with the errors of the machine at
//!   any state;
//! - [`range`]: the range of axes and drivers; [`motion`]: that of error motions over their own axis;
//! - [`document`]: the model and its JSON form; `read`: the checks of a file; `write`: its text, with a checksum.

pub mod carried;
pub mod document;
pub mod errors;
pub mod motion;
pub mod range;
mod read;
mod write;

use abbe_model::Diagnostic;
use abbe_model::document::value::Positive;
use abbe_model::driver::Reference;
use abbe_model::session::{Prior, Session};
pub use document::{DriverRange, IdentifiedModel, InputFile, Location, ModelParameter, MotionRange, Provenance};
use document::{Role, SCHEMA, SCHEMA_VERSION};
pub use read::{is_model, of_source, read};

use crate::error;
use crate::fit::base::{Gauge, base_parameters};
use crate::fit::frames::frames;
use crate::fit::{Fit, minimum};
use crate::heldout::stated_rms_mm;
use crate::parameters::Parameter;
use crate::problem::Problem;
use crate::results::{Goodness, GoodnessVerdict, ModelFit, ParameterChange};

impl ModelParameter {
    /// A change by a value with a standard uncertainty, both in internal units.
    pub fn change(&self, value: f64, u: f64) -> ParameterChange {
        let display = self.display_per_internal;
        ParameterChange { id: self.id.to_string(), value: value * display, u: u * display, unit: self.unit.clone() }
    }
}

impl IdentifiedModel {
    /// Standard uncertainty of a parameter, internal units; 0 if it is held.
    pub fn u(&self, parameter: usize) -> f64 {
        self.covariance[(parameter, parameter)].max(0.0).sqrt()
    }

    /// Whether the readings determine a parameter, alone or in a combination. The others stay at nominal.
    pub fn is_estimated(&self, parameter: usize) -> bool {
        !self.parameters[parameter].held && self.u(parameter) > 0.0
    }

    /// Why nothing can be decided from its estimates; `None` if something can. A model states only that its residual exceeded
    /// the noise.
    pub fn forbids_decisions(&self) -> Option<&'static str> {
        let exceeds = Goodness::default().with_verdict(GoodnessVerdict::Exceeds).forbids_decisions();
        exceeds.filter(|_| self.fit.u_enlargement > 1.0)
    }
}

impl IdentifiedModel {
    /// The model of a fit, in the base parametrisation of [`Gauge::OwnDirection`].
    ///
    /// # Errors
    /// If no parameter is identifiable, or the fit of the location errors alone does not converge.
    pub fn of_fit(problem: &Problem, fit: &Fit, provenance: Provenance) -> Result<IdentifiedModel, Diagnostic> {
        if fit.rank.identifiable_basis.ncols() == 0 {
            return Err(error::nothing_identifiable("no model to save"));
        }
        let base = base_parameters(problem, fit, Gauge::OwnDirection)?;
        let list = &problem.parameters.list;
        let parameters = list.iter().enumerate().map(|(j, parameter)| ModelParameter {
            id: parameter.id.clone(),
            role: Role::of(&parameter.id),
            effect: parameter.effect,
            index: parameter.effect.map(|_| parameter.index),
            displayed: 0.0,
            displayed_u: None,
            unit: parameter.unit.name.clone(),
            display_per_internal: parameter.unit.display_per_internal,
            value: base.beta[j] + parameter.found,
            held: base.held.contains(&j),
            identifiable: fit.rank.is_identifiable(j),
            prior_u: match parameter.prior {
                Prior::Gaussian(u) => Some(Positive(u)),
                Prior::Free | Prior::Known => None,
            },
            size: parameter.size,
        });
        let null_directions = base.null_space.col_iter();
        // Values of the set-up count from the stated points.
        let of_first = problem.session.tests.iter().find(|test| test.name == problem.tests[0].name);
        let stated = of_first.map_or(problem.models[0].station(), |test| &test.station);
        let mut model = IdentifiedModel {
            schema: SCHEMA.to_string(),
            schema_version: SCHEMA_VERSION,
            sha256: String::new(),
            machine: problem.session.machine.as_ref().clone(),
            instrument: problem.session.instrument,
            effects: problem.parameters.effects.clone(),
            parameters: parameters.collect(),
            covariance: base.covariance,
            null_directions: null_directions
                .map(|direction| direction.iter().zip(list).map(|(share, of)| share * of.size).collect())
                .collect(),
            locations: locations(problem, fit)?,
            noise: problem.noise.clone(),
            unit: problem.unit(),
            fit: ModelFit {
                readings: problem.readings(),
                rms_um: stated_rms_mm(problem, &fit.residuals) * 1e3,
                heldout_rms_um: stated_rms_mm(problem, &fit.held_out.residuals) * 1e3,
                u_enlargement: fit.u_enlargement,
            },
            ranges: range::of_problem(problem, &problem.parameters.effects),
            motion_ranges: motion::of_problem(problem),
            tool_mm: stated.tool_point().mm,
            table_mm: stated.table_point().map_or([0.0; 3], |point| point.mm),
            frames: frames(problem, fit),
            reference: Reference::without_history(problem.reference.time_s, problem.reference.means.clone()),
            provenance,
        };
        for j in 0..model.parameters.len() {
            let (value, u) = (model.estimate(j), model.u(j));
            let parameter = &mut model.parameters[j];
            parameter.displayed = value * parameter.display_per_internal;
            parameter.displayed_u = (!parameter.held).then_some(u * parameter.display_per_internal);
        }
        Ok(model)
    }
}

/// The location errors as the same readings give them without any effect.
fn locations(problem: &Problem, fit: &Fit) -> Result<Vec<Location>, Diagnostic> {
    let named = |problem: &Problem, beta: &[f64]| {
        let location = |(parameter, value): (&Parameter, &f64)| {
            let name = parameter.id.error()?;
            let unit = name.freedom.unit().displayed();
            let (displayed, value) = (unit.to_display(*value), *value);
            Some(Location { id: name.to_string(), displayed, unit: unit.name().to_string(), value })
        };
        problem.parameters.list.iter().zip(beta).filter_map(location).collect()
    };
    if problem.parameters.effects.is_empty() {
        return Ok(named(problem, &fit.beta));
    }
    let session = Session { effects: Vec::new(), ..problem.session.as_ref().clone() };
    let mut alone = Problem::new(&session, problem.noise.clone(), 1)?;
    alone.rejected.clone_from(&problem.rejected);
    let beta = minimum(&alone, None)?.beta;
    Ok(named(&alone, &beta))
}

#[cfg(test)]
mod tests;
