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
mod of_fit;
pub mod range;
mod read;
mod write;

use crate::results::{Goodness, GoodnessVerdict, ParameterChange};
pub use document::{DriverRange, IdentifiedModel, InputFile, Location, ModelParameter, MotionRange, Provenance};
pub use read::{is_model, of_source, read};

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

#[cfg(test)]
mod tests;
