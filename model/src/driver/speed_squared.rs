//! `speed-squared`: the square of the speed of the component's own axis, (mm/s)² or (rad/s)², as centrifugal force
//! follows it.

use super::Driver;
use super::kind::{DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::DriverSample;
use super::unit::DriverUnit;
use crate::Diagnostic;
use crate::axis::AxisKind;
use crate::scalar::Nominal;
use crate::session::readings::Readings;
use crate::unit::Unit;

/// The square of the speed.
pub(super) struct SpeedSquared;

const LINEAR: DriverUnit = DriverUnit::plain(Unit::SquareOfSpeed);
const ROTARY: DriverUnit = DriverUnit::plain(Unit::SquareOfRate);

/// The square of 100 mm/s, which is 6 m/min.
const LINEAR_SCALE: f64 = 1e4;
/// The square of 1 rad/s.
const ROTARY_SCALE: f64 = 1.0;

pub(super) const ENTRY: Entry =
    Entry { word: Some("speed-squared"), driver: |_| Driver::SpeedSquared, units: &[LINEAR, ROTARY] };

impl DriverKind for SpeedSquared {
    fn unit(&self, axis: Option<AxisKind>) -> DriverUnit {
        if axis == Some(AxisKind::Rotary) { ROTARY } else { LINEAR }
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        let axis = input.component_axis?;
        let samples = input.readings.axis_samples(axis, input.machine.axes[axis].kind);
        let squared = |sample: &DriverSample<f64>| DriverSample::plain(sample.rate * sample.rate, 0.0);
        (!input.readings.time_s.is_empty()).then(|| samples.iter().map(squared).collect())
    }
    fn phrase(&self) -> String {
        "the square of its speed".to_string()
    }
    fn is_observable(&self, recorded: &Recorded<'_>, axis: Option<AxisKind>) -> bool {
        recorded.time && recorded.swept && axis.is_some()
    }
    /// The square of 100 mm/s, or of 1 rad/s.
    fn default_scale(&self, axis: Option<AxisKind>) -> f64 {
        if axis == Some(AxisKind::Rotary) { ROTARY_SCALE } else { LINEAR_SCALE }
    }
    fn missing_column(&self, _: &Readings) -> Option<String> {
        Some("time_s".to_string())
    }
    fn is_of_component(&self) -> bool {
        true
    }
    fn changes_with_feed(&self) -> bool {
        true
    }
    fn check_component(&self, component: &str, axis: Option<AxisKind>) -> Result<(), Diagnostic> {
        if axis.is_some() {
            return Ok(());
        }
        Err(Diagnostic::session(
            format!("\"{component}\" belongs to no axis, so it has no speed"),
            "the driver is the speed of the component's own axis; name an error of an axis",
        ))
    }
}

impl Symbols for SpeedSquared {
    fn symbols<N: Nominal>(
        &self,
        input: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>> {
        let axis = input.component_axis?;
        let zero = N::constant(0.0);
        if input.held[axis] {
            return Some(DriverSample::plain(zero, zero));
        }
        let rate = named(DriverQuantity::rate(&input.machine.axes[axis]));
        Some(DriverSample::plain(rate * rate, zero))
    }
}
