//! Declared effects in an equation: `component × driver × shape` as `component = Σ k_i · b_i(driver)`.
//!
//! The coefficients `k_i` are parameters like errors. The driver stays a symbol: the position of an axis, or a
//! [`DriverQuantity`]. The basis functions `b_i` are those of the fit, evaluated over symbols.

use abbe_model::Diagnostic;
use abbe_model::chain::{AxisPosition, Machine};
use abbe_model::driver::{Driver, DriverQuantity, DriverSample, SymbolInput};
use abbe_model::effect::{Component, Effect};
use abbe_model::instrument::InstrumentParameter;
use abbe_model::scalar::Nominal;

use crate::error;
use crate::variable::Variable;

/// Positions of the axes, and which axes the test holds fixed; those have no direction and no rate.
pub(crate) struct AxisStates<'m, N> {
    pub(crate) machine: &'m Machine,
    pub(crate) state: &'m [AxisPosition<N>],
    pub(crate) held: &'m [bool],
}

impl<N: Nominal> AxisStates<'_, N> {
    /// The state of an effect's driver at a reading. Only the quantities that the shape uses are named.
    pub(crate) fn sample(
        &self,
        effect: &Effect,
        nominal: &impl Fn(Variable) -> N,
    ) -> Result<DriverSample<N>, Diagnostic> {
        let input = SymbolInput {
            machine: self.machine,
            state: self.state,
            held: self.held,
            component_axis: effect.component.axis(self.machine),
            uses: effect.shape.uses(),
            lag_s: effect.shape.lag_s(),
        };
        let named = |quantity: DriverQuantity| nominal(Variable::Driver(quantity));
        let sample = effect.driver.symbols(&input, &named);
        sample.ok_or_else(|| match &effect.driver {
            Driver::Axis(name) => error::no_axis(self.machine, effect.id(), name),
            driver => {
                let axis = input.component_axis.map(|axis| self.machine.axes[axis].kind);
                let fault = driver.kind().check_component(&effect.component.to_string(), axis).err();
                let why =
                    fault.map_or_else(|| format!("the driver {driver} has no symbol here"), |fault| fault.message);
                error::effect_without_form(effect.id(), why)
            }
        })
    }

    /// The slots that a component changes (machine errors first), with the factor of a basis function in each slot.
    pub(crate) fn slots(
        &self,
        component: &Component,
        unknowns: &[InstrumentParameter],
        nominal: &impl Fn(Variable) -> N,
    ) -> Vec<(usize, Option<N>)> {
        let rate = |axis: usize| {
            let moves = !self.held[axis];
            moves.then(|| nominal(Variable::Driver(DriverQuantity::rate(&self.machine.axes[axis]))))
        };
        let times = |rate: &N, along: f64| *rate * N::constant(along);
        component.slots(self.machine, unknowns, rate, times)
    }
}
