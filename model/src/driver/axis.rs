//! An axis: its position, direction of travel, rate and distance since the last reversal. Its word is the name of the
//! axis.

use std::f64::consts::PI;

use super::Driver;
use super::kind::{DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::{DriverPart, DriverSample};
use super::unit::DriverUnit;
use crate::axis::AxisKind;
use crate::scalar::Nominal;
use crate::unit::Unit;

/// The position of an axis of this name.
pub(super) struct AxisDriver<'a>(pub &'a str);

/// Positions of a linear axis.
pub(super) const MILLIMETRE: DriverUnit = DriverUnit::plain(Unit::Millimetre);

pub(super) const ENTRY: Entry =
    Entry { word: None, driver: |name| Driver::Axis(name.to_string()), units: &[MILLIMETRE, DriverUnit::ANGLE] };

impl DriverKind for AxisDriver<'_> {
    fn unit(&self, axis: Option<AxisKind>) -> DriverUnit {
        match axis {
            Some(AxisKind::Rotary) => DriverUnit::ANGLE,
            _ => MILLIMETRE,
        }
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        let axis = input.machine.axis_index(self.0)?;
        Some(input.readings.axis_samples(axis, input.machine.axes[axis].kind))
    }
    fn phrase(&self) -> String {
        format!("axis {}", self.0)
    }
    fn is_observable(&self, _: &Recorded<'_>, _: Option<AxisKind>) -> bool {
        true
    }
    /// 100 mm for a linear axis, half a revolution for a rotary one.
    fn default_scale(&self, axis: Option<AxisKind>) -> f64 {
        match axis {
            Some(AxisKind::Rotary) => PI,
            _ => 100.0,
        }
    }
}

impl Symbols for AxisDriver<'_> {
    fn symbols<N: Nominal>(
        &self,
        input: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>> {
        let index = input.machine.axis_index(self.0)?;
        let (axis, held) = (&input.machine.axes[index], input.held[index]);
        let zero = N::constant(0.0);
        let unless_held = |quantity: fn(&_) -> DriverQuantity| if held { zero } else { named(quantity(axis)) };
        let mut sample = DriverSample::plain(zero, zero);
        match input.uses {
            DriverPart::Direction => sample.direction = unless_held(DriverQuantity::direction),
            DriverPart::Rate => sample.rate = unless_held(DriverQuantity::rate),
            DriverPart::SinceReversal => {
                sample.direction = unless_held(DriverQuantity::direction);
                sample.since_reversal = unless_held(DriverQuantity::since_reversal);
            }
            DriverPart::Value => sample.value = input.state[index].value,
        }
        Some(sample)
    }
}
