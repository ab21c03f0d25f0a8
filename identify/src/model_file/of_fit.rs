//! The model of a fit.

use abbe_model::Diagnostic;
use abbe_model::component::ErrorName;
use abbe_model::driver::Reference;
use abbe_model::session::Session;

use super::{IdentifiedModel, ModelParameter, Provenance, motion, range};
use crate::error;
use crate::fit::base::{Gauge, base_parameters};
use crate::fit::{Fit, minimum};
use crate::heldout::stated_rms_mm;
use crate::problem::Problem;
use crate::results::ModelFit;

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
            effect: parameter.effect,
            index: parameter.index,
            unit: parameter.unit.clone(),
            value: base.beta[j] + parameter.found,
            held: base.held.contains(&j),
            identifiable: fit.rank.is_identifiable(j),
            prior: parameter.prior,
            size: parameter.size,
        });
        let null_directions = base.null_space.col_iter();
        // Values of the set-up count from the stated points.
        let of_first = problem.session.tests.iter().find(|test| test.name == problem.tests[0].name);
        let stated = of_first.map_or(problem.models[0].station(), |test| &test.station);
        Ok(IdentifiedModel {
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
            tool_mm: stated.tool_point_mm(),
            table_mm: stated.table_point_mm().unwrap_or_default(),
            reference: Reference::without_history(problem.reference.time_s, problem.reference.means.clone()),
            provenance,
        })
    }
}

/// The location errors as the same readings give them without any effect.
fn locations(problem: &Problem, fit: &Fit) -> Result<Vec<(ErrorName, f64)>, Diagnostic> {
    let named = |problem: &Problem, beta: &[f64]| {
        let values = problem.parameters.list.iter().zip(beta);
        values.filter_map(|(parameter, value)| Some((parameter.id.error()?.clone(), *value))).collect()
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
