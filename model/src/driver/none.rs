//! `none`: no driver, for a constant.

use super::kind::{DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::DriverSample;
use super::unit::DriverUnit;
use super::{Driver, axis};
use crate::axis::AxisKind;
use crate::scalar::Nominal;

/// No driver.
pub(super) struct NoDriver;

pub(super) const ENTRY: Entry = Entry { word: Some("none"), driver: |_| Driver::None, units: &[axis::MILLIMETRE] };

impl DriverKind for NoDriver {
    fn unit(&self, _: Option<AxisKind>) -> DriverUnit {
        axis::MILLIMETRE
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        Some(vec![DriverSample::plain(0.0, 0.0); input.model.rows()])
    }
    fn phrase(&self) -> String {
        "nothing".to_string()
    }
    fn is_observable(&self, _: &Recorded<'_>, _: Option<AxisKind>) -> bool {
        true
    }
}

impl Symbols for NoDriver {
    fn symbols<N: Nominal>(&self, _: &SymbolInput<'_, N>, _: &impl Fn(DriverQuantity) -> N) -> Option<DriverSample<N>> {
        let zero = N::constant(0.0);
        Some(DriverSample::plain(zero, zero))
    }
}
