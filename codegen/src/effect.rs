//! Declared effects in an equation: `component × driver × shape` as `component = Σ k_i · b_i(driver)`.
//!
//! The coefficients `k_i` are parameters like errors. The driver stays a symbol: the position of an axis, or a
//! [`DriverQuantity`](crate::DriverQuantity). The basis functions `b_i` are those of the fit, evaluated over symbols.

use abbe_model::chain::{AxisPosition, Machine};
use abbe_model::component::ErrorName;
use abbe_model::effect::{Component, Driver, DriverSample, Effect, Shape};
use abbe_model::instrument::InstrumentParameter;
use abbe_model::scalar::Nominal;

use crate::driver_quantity::DriverQuantity;
use crate::error::CodegenError;
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
    ) -> Result<DriverSample<N>, CodegenError> {
        let zero = N::constant(0.0);
        let mut sample = DriverSample {
            value: zero,
            direction: N::constant(1.0),
            rate: zero,
            since_reversal: zero,
            since_reversal_s: zero,
        };
        let followed = |followed: DriverQuantity| nominal(Variable::Driver(followed));
        match &effect.driver {
            Driver::None => {}
            Driver::Time => sample.value = followed(DriverQuantity::Time),
            Driver::Temperature => sample.value = followed(DriverQuantity::Temperature),
            Driver::Gravity => {
                let Component::Axis(ErrorName { axis, .. }) = &effect.component else {
                    return Err(CodegenError::EffectWithoutForm {
                        effect: effect.id(),
                        why:
                            "gravity needs an axis about which it exerts a moment, and the component has none"
                                .to_string(),
                    });
                };
                sample.value = followed(DriverQuantity::Gravity(axis.clone()));
            }
            Driver::Axis(name) => {
                let index = self.machine.axis_index(name);
                let index = index.ok_or_else(|| CodegenError::no_axis(self.machine, effect.id(), name))?;
                let direction = || match self.held[index] {
                    true => zero,
                    false => followed(DriverQuantity::Direction(name.clone())),
                };
                match effect.shape {
                    Shape::Backlash => sample.direction = direction(),
                    Shape::Lag => sample.rate = self.rate(index, nominal),
                    Shape::ReversalSpike { .. } => {
                        sample.direction = direction();
                        if !self.held[index] {
                            let kind = self.machine.axes[index].kind;
                            sample.since_reversal =
                                followed(DriverQuantity::SinceReversal(name.clone(), kind));
                        }
                    }
                    _ => sample.value = self.state[index].value,
                }
            }
        }
        Ok(sample)
    }

    /// The rate of an axis.
    fn rate(&self, index: usize, nominal: &impl Fn(Variable) -> N) -> N {
        if self.held[index] {
            return N::constant(0.0);
        }
        let axis = &self.machine.axes[index];
        nominal(Variable::Driver(DriverQuantity::Rate(
            axis.name.clone(),
            axis.kind,
        )))
    }

    /// The slots that an effect changes (machine errors first), with the factor of its basis function in each slot.
    pub(crate) fn slots(
        &self,
        effect: &Effect,
        unknowns: &[InstrumentParameter],
        nominal: &impl Fn(Variable) -> N,
    ) -> Vec<(usize, Option<N>)> {
        match &effect.component {
            Component::Axis(name) => {
                let slot = self.machine.error_slot(name);
                slot.map(|slot| (slot, None)).into_iter().collect()
            }
            Component::Instrument { thing, coordinate } => {
                let own = |unknown: &InstrumentParameter| {
                    unknown.thing == thing && unknown.coordinate == coordinate
                };
                let position = unknowns.iter().position(own);
                let slot = position.map(|position| (self.machine.error_slots() + position, None));
                slot.into_iter().collect()
            }
            Component::TriggerDelay => {
                let moving = (0..self.machine.axes.len()).filter(|index| !self.held[*index]);
                let slots = moving.flat_map(|index| {
                    let rate = self.rate(index, nominal);
                    let shares = self.machine.slots_along(index);
                    shares.map(move |(slot, along)| (slot, Some(rate * N::constant(along))))
                });
                slots.collect()
            }
        }
    }
}
