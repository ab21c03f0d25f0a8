//! The coefficients of declared effects: parameters of an equation like errors.

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::driver::Driver;
use abbe_model::effect::shape::Per;
use abbe_model::effect::{Component, Effect};
use abbe_model::instrument::InstrumentParameter;
use abbe_model::parameter_id::{EffectId, ParameterId, Part};
use abbe_model::unit::InternalUnit;

use crate::error;

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
    /// If an effect is named twice, if the machine or the instrument lacks its component, or if its driver has no
    /// value.
    pub(crate) fn of_effects(
        effects: &[Effect],
        machine: &Machine,
        unknowns: &[InstrumentParameter],
    ) -> Result<Vec<Coefficient>, Diagnostic> {
        let mut coefficients = Vec::new();
        for (earlier, effect) in effects.iter().enumerate() {
            if effects[..earlier].contains(effect) {
                return Err(error::twice(effect.id()));
            }
            let count = effect.shape.coefficients();
            if count > MAX_COEFFICIENTS {
                return Err(Diagnostic::equation(format!(
                    "the effect `{}` has {count} coefficients, more than the limit of {MAX_COEFFICIENTS}; give its shape \
                     fewer intervals, steps or powers, or omit it by naming the errors to keep",
                    effect.id()
                )));
            }
            let component = unit_of_component(effect, machine, unknowns)?;
            let same_kind = match &effect.driver {
                Driver::Axis(name) => is_rotary(machine, effect, name)? == (component == Some(InternalUnit::Radian)),
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
        let name = self.effect.shape.coefficient_names().get(self.index).cloned().unwrap_or_default();
        ParameterId::Effect(Arc::new(EffectId::of(&self.effect, 1)), Part::Coefficient(name)).to_string()
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
) -> Result<Option<InternalUnit>, Diagnostic> {
    let unit = effect.component.unit(unknowns);
    match &effect.component {
        Component::Axis(name) if machine.axis_index(&name.axis).is_none() => {
            Err(error::no_axis(machine, effect.id(), &name.axis))
        }
        Component::Instrument { .. } if unit.is_none() => {
            Err(error::no_parameter(format!("`{}` of the effect `{}`", effect.component, effect.id())))
        }
        Component::Reading(test) => Err(error::effect_without_form(
            effect.id(),
            format!("it adds to the readings of {test} and is not part of the chain"),
        )),
        _ => Ok(unit),
    }
}

/// Whether the axis is rotary.
fn is_rotary(machine: &Machine, effect: &Effect, axis: &str) -> Result<bool, Diagnostic> {
    let index = machine.axis_index(axis);
    let index = index.ok_or_else(|| error::no_axis(machine, effect.id(), axis))?;
    Ok(machine.axes[index].kind == AxisKind::Rotary)
}
