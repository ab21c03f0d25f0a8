//! Declared effects in an equation: `component × driver × shape` as `component = Σ k_i · b_i(driver)`.
//!
//! The coefficients `k_i` are parameters like errors. The driver stays a symbol: the position of an axis, or one of the quantities named
//! here. The basis functions `b_i` are those of the fit, evaluated over symbols.

use std::sync::Arc;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, Machine};
use abbe_model::driver::{Driver, DriverQuantity, DriverSample, SymbolInput};
use abbe_model::effect::shape::Per;
use abbe_model::effect::{Component, Effect};
use abbe_model::instrument::{InstrumentParameter, InternalUnit};
use abbe_model::scalar::Nominal;

use crate::error::CodegenError;
use crate::variable::Variable;

/// A coefficient of an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficient {
    /// Its number in the equation, from 1.
    pub number: usize,
    /// The effect.
    pub effect: Arc<Effect>,
    /// Index among the coefficients of the effect.
    pub index: usize,
    /// The unit of the component; `None` for a delay.
    pub component: Option<InternalUnit>,
    /// Whether component and driver are both lengths or both angles.
    pub same_kind: bool,
}

impl Coefficient {
    /// The coefficients of all effects, numbered consecutively.
    ///
    /// # Errors
    /// If an effect is named twice, if the machine or the instrument lacks its component, or if its driver has no value.
    pub(crate) fn of_effects(
        effects: &[Effect],
        machine: &Machine,
        unknowns: &[InstrumentParameter],
    ) -> Result<Vec<Coefficient>, CodegenError> {
        let mut coefficients = Vec::new();
        for (earlier, effect) in effects.iter().enumerate() {
            if effects[..earlier].contains(effect) {
                return Err(CodegenError::Twice { name: effect.id() });
            }
            let count = effect.shape.coefficients();
            if count > MAX_COEFFICIENTS {
                return Err(CodegenError::EffectTooLong {
                    effect: effect.id(),
                    coefficients: count,
                    most: MAX_COEFFICIENTS,
                });
            }
            let component = unit_of_component(effect, machine, unknowns)?;
            let same_kind = match &effect.driver {
                Driver::Axis(name) => {
                    kind_of(machine, effect, name)? == (component == Some(InternalUnit::Radian))
                }
                _ => false,
            };
            let shared = Arc::new(effect.clone());
            for index in 0..count {
                coefficients.push(Coefficient {
                    number: coefficients.len() + 1,
                    effect: Arc::clone(&shared),
                    index,
                    component,
                    same_kind,
                });
            }
        }
        Ok(coefficients)
    }

    /// The identifier as in the results of a fit: `EZC~C:h2.cos`.
    pub fn id(&self) -> String {
        let names = self.effect.shape.coefficient_names();
        match names.get(self.index).map(String::as_str) {
            None | Some("") => self.effect.id(),
            Some(name) => format!("{}.{name}", self.effect.id()),
        }
    }

    pub(crate) fn meaning(&self) -> String {
        let what = match self.effect.component {
            Component::TriggerDelay => "delay of the reading".to_string(),
            _ => format!("{} coefficient", self.effect.shape.word()),
        };
        format!("{what} ({})", self.id())
    }

    pub(crate) fn unit(&self) -> &'static str {
        let Some(component) = self.component else {
            return "s";
        };
        match (self.effect.shape.per(self.index), component) {
            (Per::Rate, _) if self.same_kind => "s",
            (Per::Rate, InternalUnit::Millimetre) => "mm·s/rad",
            (Per::Rate, InternalUnit::Radian) => "rad·s/mm",
            (Per::Rate, InternalUnit::Ratio) => "1/rate",
            (Per::Hour, InternalUnit::Millimetre) => "mm/h",
            (Per::Hour, InternalUnit::Radian) => "rad/h",
            (Per::Hour, InternalUnit::Ratio) => "1/h",
            (_, InternalUnit::Millimetre) => "mm",
            (_, InternalUnit::Radian) => "rad",
            (_, InternalUnit::Ratio) => "1",
        }
    }
}

/// Largest number of coefficients of one effect. More would be unreadable and too much for a compiler in one function.
const MAX_COEFFICIENTS: usize = 40;

fn unit_of_component(
    effect: &Effect,
    machine: &Machine,
    unknowns: &[InstrumentParameter],
) -> Result<Option<InternalUnit>, CodegenError> {
    let unit = effect.component.unit(unknowns);
    match &effect.component {
        Component::Axis(name) if machine.axis_index(&name.axis).is_none() => {
            Err(no_axis(machine, effect, &name.axis))
        }
        Component::Instrument { .. } if unit.is_none() => Err(CodegenError::NoSuchParameter {
            parameter: format!("`{}` of the effect `{}`", effect.component, effect.id()),
        }),
        Component::Axis(_) | Component::Instrument { .. } | Component::TriggerDelay => Ok(unit),
    }
}

fn no_axis(machine: &Machine, effect: &Effect, axis: &str) -> CodegenError {
    CodegenError::NoSuchAxis {
        error: effect.id(),
        axis: axis.to_string(),
        machine: machine.code(),
    }
}

/// The kind of the axis.
fn kind_of(machine: &Machine, effect: &Effect, axis: &str) -> Result<bool, CodegenError> {
    let index = machine.axis_index(axis);
    let index = index.ok_or_else(|| no_axis(machine, effect, axis))?;
    Ok(machine.axes[index].kind == AxisKind::Rotary)
}

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
        let input = SymbolInput {
            machine: self.machine,
            state: self.state,
            held: self.held,
            component_axis: effect.component.axis(self.machine),
            uses: effect.shape.uses(),
        };
        let named = |quantity: DriverQuantity| nominal(Variable::Driver(quantity));
        effect
            .driver
            .symbols(&input, &named)
            .ok_or_else(|| match &effect.driver {
                Driver::Axis(name) => no_axis(self.machine, effect, name),
                driver => CodegenError::EffectWithoutForm {
                    effect: effect.id(),
                    why: format!(
                        "{driver} needs an axis about which it exerts a moment, and the component has none"
                    ),
                },
            })
    }

    /// The slots that an effect changes (machine errors first), with the factor of its basis function in each slot.
    pub(crate) fn slots(
        &self,
        effect: &Effect,
        unknowns: &[InstrumentParameter],
        nominal: &impl Fn(Variable) -> N,
    ) -> Vec<(usize, Option<N>)> {
        let rate = |axis: usize| {
            let moves = !self.held[axis];
            moves.then(|| nominal(Variable::Driver(DriverQuantity::rate(&self.machine.axes[axis]))))
        };
        let times = |rate: &N, along: f64| *rate * N::constant(along);
        effect.component.slots(self.machine, unknowns, rate, times)
    }
}
