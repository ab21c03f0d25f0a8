//! `time`: time since the session's first reading, s.

use super::Driver;
use super::kind::{DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::{DriverPart, DriverSample};
use super::unit::DriverUnit;
use crate::axis::AxisKind;
use crate::scalar::Nominal;
use crate::session::readings::Readings;
use crate::unit::Unit;

/// Time.
pub(super) struct Time;

const SECOND: DriverUnit = DriverUnit::plain(Unit::Second);
/// Seconds per hour.
pub const SECONDS_PER_HOUR: f64 = 3600.0;

pub(super) const ENTRY: Entry = Entry { word: Some("time"), driver: |_| Driver::Time, units: &[SECOND] };

impl DriverKind for Time {
    fn unit(&self, _: Option<AxisKind>) -> DriverUnit {
        SECOND
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        let time_s = &input.readings.time_s;
        let sample = |t: &f64| DriverSample::plain(t - input.reference.time_s, 1.0);
        (!time_s.is_empty()).then(|| time_s.iter().map(sample).collect())
    }
    fn phrase(&self) -> String {
        "time".to_string()
    }
    fn is_observable(&self, recorded: &Recorded<'_>, _: Option<AxisKind>) -> bool {
        recorded.time
    }
    /// An hour.
    fn default_scale(&self, _: Option<AxisKind>) -> f64 {
        SECONDS_PER_HOUR
    }
    fn missing_column(&self, _: &Readings) -> Option<String> {
        Some("time_s".to_string())
    }
    fn changes_with_feed(&self) -> bool {
        true
    }
}

impl Symbols for Time {
    fn symbols<N: Nominal>(
        &self,
        _: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>> {
        let time = DriverQuantity {
            driver: Driver::Time,
            part: DriverPart::Value,
            identifier: "time_s".to_string(),
            text: "t".to_string(),
            unit: "s",
            meaning: "time since the first reading of the session".to_string(),
            range: [0.0, SECONDS_PER_HOUR],
        };
        Some(DriverSample::plain(named(time), N::constant(0.0)))
    }
}
