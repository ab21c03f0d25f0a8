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
//! - [`document`]: the JSON form; `read`, `write`: from and to a file, with a checksum.

pub mod carried;
pub mod document;
pub mod errors;
pub mod motion;
mod of_fit;
pub mod range;
mod read;
mod write;

use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::driver::Reference;
use abbe_model::effect::Effect;
use abbe_model::instrument::InstrumentKind;
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::Prior;
use abbe_model::unit::Unit;
use faer::Mat;

use crate::noise::Noise;
use crate::results::{Goodness, GoodnessVerdict, ModelFit, ParameterChange};
use crate::unit::ParameterUnit;
pub use document::{InputFile, MotionRange, Provenance};
pub use range::DriverRange;
pub use read::{is_model, of_source, read};

/// A parameter of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelParameter {
    /// What it is.
    pub id: ParameterId,
    /// Index of its effect among [`IdentifiedModel::effects`], of a coefficient or a number of a shape.
    pub effect: Option<usize>,
    /// Index among the coefficients of its effect, or among the numbers of its shape.
    pub index: usize,
    /// Display unit.
    pub unit: ParameterUnit,
    /// Value in internal units (mm, rad); 0 if it is held.
    pub value: f64,
    /// Whether it is held at nominal, since the readings do not separate it from other parameters.
    pub held: bool,
    /// Whether the readings determine it by itself, not only in combination with others.
    pub identifiable: bool,
    /// The prior of the fit.
    pub prior: Prior,
    /// Physical size, internal units: 1 mm, 0.01 rad, or the value that changes the component by that much.
    pub size: f64,
}

impl ModelParameter {
    /// A change by a value with a standard uncertainty, both in internal units.
    pub fn change(&self, value: f64, u: f64) -> ParameterChange {
        let display = self.unit.display_per_internal;
        ParameterChange {
            id: self.id.to_string(),
            value: value * display,
            u: u * display,
            unit: self.unit.name.clone(),
        }
    }
}

/// An identified model.
#[derive(Clone, Debug)]
pub struct IdentifiedModel {
    /// The machine.
    pub machine: Machine,
    /// The instrument of the readings.
    pub instrument: InstrumentKind,
    /// All effects.
    pub effects: Vec<Effect>,
    /// All parameters: location errors, set-up quantities, coefficients of effects.
    pub parameters: Vec<ModelParameter>,
    /// Covariance of the parameters, internal units; 0 for held ones.
    pub covariance: Mat<f64>,
    /// Directions that the readings do not determine, one row each, internal units; a row is one physical size long.
    /// They change no reading of the session of the model by more than its noise.
    pub null_directions: Vec<Vec<f64>>,
    /// Location errors as estimated without any effect, internal units.
    pub locations: Vec<(ErrorName, f64)>,
    /// The noise of a reading.
    pub noise: Noise,
    /// The unit of noise and residuals.
    pub unit: Unit,
    /// How well the model describes its own readings.
    pub fit: ModelFit,
    /// The range of every axis and driver.
    pub ranges: Vec<DriverRange>,
    /// The ranges of the error motions that are functions of the position of their own axis.
    pub motion_ranges: Vec<MotionRange>,
    /// The instrument's point in the tool frame at the first test, mm: the load point of gravity, and the tool point if
    /// no other is stated.
    pub tool_mm: [f64; 3],
    /// The instrument's point in the table frame there, mm; 0 for instruments without one.
    pub table_mm: [f64; 3],
    /// Reference values, from which drivers count.
    pub reference: Reference,
    /// Where the model comes from.
    pub provenance: Provenance,
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

#[cfg(test)]
mod tests;
