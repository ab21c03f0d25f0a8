//! `temperature`: a temperature column, °C above the session's mean.

use super::Driver;
use super::kind::{DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::{DriverPart, DriverSample};
use super::unit::DriverUnit;
use crate::axis::AxisKind;
use crate::scalar::Nominal;

/// Temperature.
pub(super) struct Temperature;

/// A difference in results is in kelvins.
const CELSIUS: DriverUnit = DriverUnit::new("c", "c", "K", " °C");

pub(super) const ENTRY: Entry = Entry { word: Some("temperature"), driver: |_| Driver::Temperature, units: &[CELSIUS] };

impl DriverKind for Temperature {
    fn unit(&self, _: Option<AxisKind>) -> DriverUnit {
        CELSIUS
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        let temperature_c = &input.readings.temperature_c;
        let sample = |t: &f64| DriverSample::plain(t - input.reference.temperature_c, 0.0);
        (!temperature_c.is_empty()).then(|| temperature_c.iter().map(sample).collect())
    }
    fn phrase(&self) -> String {
        "the temperature".to_string()
    }
    fn is_observable(&self, recorded: &Recorded, _: Option<AxisKind>) -> bool {
        recorded.temperature
    }
    fn column(&self) -> Option<&'static str> {
        Some("temperature_c")
    }
    fn per(&self) -> Option<&'static str> {
        Some("K")
    }
    fn proportional(&self) -> Option<&'static str> {
        Some(", following the temperature")
    }
}

impl Symbols for Temperature {
    fn symbols<N: Nominal>(
        &self,
        _: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>> {
        let temperature = DriverQuantity {
            driver: Driver::Temperature,
            part: DriverPart::Value,
            identifier: "temperature_c".to_string(),
            text: "T".to_string(),
            unit: "°C",
            meaning: "temperature above the mean of the session".to_string(),
            range: [-5.0, 5.0],
        };
        Some(DriverSample::plain(named(temperature), N::constant(0.0)))
    }
}
