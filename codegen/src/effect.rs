//! Declared effects in an equation: `component × driver × shape` as `component = Σ k_i · b_i(driver)`.
//!
//! The coefficients `k_i` are parameters like errors. The driver stays a symbol: the position of an axis, or one of the quantities named
//! here. The basis functions `b_i` are those of the fit, evaluated over symbols.

use std::sync::Arc;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, Machine};
use abbe_model::component::ErrorName;
use abbe_model::effect::{Component, Driver, DriverSample, Effect, Shape};
use abbe_model::instrument::{InstrumentParameter, InternalUnit};
use abbe_model::scalar::Nominal;

use crate::error::CodegenError;
use crate::variable::Variable;

/// The driver of an effect, if it is not the position of an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum DriverQuantity {
    /// Direction of the last movement of an axis: −1, 0 or 1.
    Direction(String),
    /// The rate of an axis, mm/s or rad/s.
    Rate(String, AxisKind),
    /// Distance that an axis has travelled since its last reversal, mm or rad.
    SinceReversal(String, AxisKind),
    /// Time since the session's first reading, s.
    Time,
    /// Temperature above the session's mean, °C.
    Temperature,
    /// Moment about an axis of a unit weight at the instrument's point, m.
    Gravity(String),
}

impl DriverQuantity {
    pub(crate) fn unit(&self) -> &'static str {
        match self {
            DriverQuantity::Direction(_) => "1",
            DriverQuantity::Rate(_, AxisKind::Linear) => "mm/s",
            DriverQuantity::Rate(_, AxisKind::Rotary) => "rad/s",
            DriverQuantity::SinceReversal(_, AxisKind::Linear) => "mm",
            DriverQuantity::SinceReversal(_, AxisKind::Rotary) => "rad",
            DriverQuantity::Time => "s",
            DriverQuantity::Temperature => "°C",
            DriverQuantity::Gravity(_) => "m",
        }
    }

    pub(crate) fn meaning(&self) -> String {
        match self {
            DriverQuantity::Direction(axis) => {
                format!("direction of the last movement of axis {axis}: −1, 0 or 1")
            }
            DriverQuantity::Rate(axis, _) => format!("rate of axis {axis}"),
            DriverQuantity::SinceReversal(axis, _) => {
                format!("distance of axis {axis} since its last reversal")
            }
            DriverQuantity::Time => "time since the first reading of the session".to_string(),
            DriverQuantity::Temperature => "temperature above the mean of the session".to_string(),
            DriverQuantity::Gravity(axis) => {
                format!("moment of a unit weight about axis {axis}")
            }
        }
    }

    /// The name in plain text; typeset output takes the letter and the subscript from it.
    pub(crate) fn text(&self) -> String {
        let of = |letter: &str, axis: &str| format!("{letter}_{}", axis.to_lowercase());
        match self {
            DriverQuantity::Direction(axis) => of("σ", axis),
            DriverQuantity::Rate(axis, _) => of("v", axis),
            DriverQuantity::SinceReversal(axis, _) => of("w", axis),
            DriverQuantity::Time => "t".to_string(),
            DriverQuantity::Temperature => "T".to_string(),
            DriverQuantity::Gravity(axis) => of("g", axis),
        }
    }

    pub(crate) fn identifier(&self) -> String {
        match self {
            DriverQuantity::Direction(axis) => format!("direction_{axis}"),
            DriverQuantity::Rate(axis, _) => format!("rate_{axis}"),
            DriverQuantity::SinceReversal(axis, _) => format!("since_reversal_{axis}"),
            DriverQuantity::Time => "time_s".to_string(),
            DriverQuantity::Temperature => "temperature_c".to_string(),
            DriverQuantity::Gravity(axis) => format!("gravity_{axis}"),
        }
    }
}

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
        match (&self.effect.shape, component) {
            (Shape::Lag, _) if self.same_kind => "s",
            (Shape::Lag, InternalUnit::Millimetre) => "mm·s/rad",
            (Shape::Lag, InternalUnit::Radian) => "rad·s/mm",
            (Shape::Lag, InternalUnit::Ratio) => "1/rate",
            (Shape::Drift, InternalUnit::Millimetre) => "mm/h",
            (Shape::Drift, InternalUnit::Radian) => "rad/h",
            (Shape::Drift, InternalUnit::Ratio) => "1/h",
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
    match &effect.component {
        Component::Axis(name) => match machine.axis_index(&name.axis) {
            Some(_) if name.freedom.is_angle() => Ok(Some(InternalUnit::Radian)),
            Some(_) => Ok(Some(InternalUnit::Millimetre)),
            None => Err(no_axis(machine, effect, &name.axis)),
        },
        Component::Instrument { thing, coordinate } => {
            let own =
                |unknown: &&InstrumentParameter| unknown.thing == thing && unknown.coordinate == coordinate;
            let found = unknowns.iter().find(own);
            found
                .map(|unknown| Some(unknown.unit))
                .ok_or_else(|| CodegenError::NoSuchParameter {
                    parameter: format!("`{}` of the effect `{}`", effect.component, effect.id()),
                })
        }
        Component::TriggerDelay => Ok(None),
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
                let index = index.ok_or_else(|| no_axis(self.machine, effect, name))?;
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
