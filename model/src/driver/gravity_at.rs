//! `gravity-J4`: the moment of a unit weight at the origin of the axis J4 about the component's own axis, m.
//!
//! The weight of a link acts between the joints at its ends. Its moment about an axis is a sum of the moments of weights at
//! these joints, so the weights of all links and of the load are those at the origins of the joints and at the tool point
//! (`gravity`).

use super::Driver;
use super::gravity::METRE;
use super::kind::{DriverFault, DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::{DriverPart, DriverSample};
use super::unit::DriverUnit;
use crate::axis::AxisKind;
use crate::scalar::Nominal;

/// The moment of a weight at the origin of the named axis.
pub(super) struct GravityAt<'n>(pub &'n str);

/// Begins the word in files; the name of the axis follows.
const PREFIX: &str = "gravity-";
const MILLIMETRES_PER_METRE: f64 = 1000.0;

pub(super) const ENTRY: Entry =
    Entry { word: None, driver: |word| Driver::GravityAt(named(word).unwrap_or(word).to_string()), units: &[METRE] };

/// The axis that a word names; `None` for the word of another driver.
pub(super) fn named(word: &str) -> Option<&str> {
    word.strip_prefix(PREFIX).filter(|name| !name.is_empty())
}

/// The word of the driver in files.
pub(super) fn word(axis: &str) -> String {
    format!("{PREFIX}{axis}")
}

impl DriverKind for GravityAt<'_> {
    fn unit(&self, _: Option<AxisKind>) -> DriverUnit {
        METRE
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        let DriverInput { machine, model, .. } = input;
        let (axis, loaded) = (input.component_axis?, machine.axis_index(self.0)?);
        let moment = |row| machine.gravity_moment_of_axis_mm(axis, &model.state(row), loaded);
        let sample = |row| Some(DriverSample::plain(moment(row)? / MILLIMETRES_PER_METRE, 0.0));
        (0..model.rows()).map(sample).collect()
    }
    fn phrase(&self) -> String {
        format!("the moment of a weight at {}", self.0)
    }
    fn is_observable(&self, _: &Recorded<'_>, axis: Option<AxisKind>) -> bool {
        axis == Some(AxisKind::Rotary)
    }
    fn per(&self) -> Option<&'static str> {
        Some("m")
    }
    fn proportional(&self) -> Option<String> {
        Some(format!(" under a weight at {} (compliance)", self.0))
    }
    fn is_of_component(&self) -> bool {
        true
    }
    fn check_component(&self, component: &str, axis: Option<AxisKind>) -> Result<(), DriverFault> {
        super::gravity::check_component(component, axis)
    }
}

impl Symbols for GravityAt<'_> {
    fn symbols<N: Nominal>(
        &self,
        input: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>> {
        let axis = &input.machine.axes[input.component_axis?].name;
        let moment = DriverQuantity {
            driver: Driver::GravityAt(self.0.to_string()),
            part: DriverPart::Value,
            identifier: format!("gravity_{axis}_{}", self.0),
            text: format!("g_{}_{}", axis.to_lowercase(), self.0.to_lowercase()),
            unit: "m",
            meaning: format!("moment of a unit weight at {} about axis {axis}", self.0),
            range: [-1.0, 1.0],
        };
        Some(DriverSample::plain(named(moment), N::constant(0.0)))
    }
}
