//! `gravity`: the moment of a unit weight about the component's own axis, m.
//!
//! For an axis on the tool side the weight acts at the instrument's point in the tool frame (spindle ball, stylus,
//! target). For an axis on the workpiece side it acts at the instrument's point in the table frame (workpiece ball,
//! point of the artefact), not at the centre of mass of table and workpiece.

use super::Driver;
use super::kind::{DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::{DriverPart, DriverSample};
use super::unit::DriverUnit;
use crate::Diagnostic;
use crate::axis::AxisKind;
use crate::scalar::Nominal;
use crate::unit::Unit;

/// The moment of gravity.
pub(super) struct Gravity<'n> {
    /// The axis at whose origin the weight is; `None` for the point of the instrument.
    pub at: Option<&'n str>,
}

pub(super) const METRE: DriverUnit = DriverUnit::plain(Unit::Metre);

pub(super) const ENTRY: Entry = Entry { word: Some("gravity"), driver: |_| Driver::Gravity, units: &[METRE] };

impl DriverKind for Gravity<'_> {
    fn unit(&self, _: Option<AxisKind>) -> DriverUnit {
        METRE
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        let DriverInput { machine, model, .. } = input;
        let axis = input.component_axis?;
        let station = model.station();
        let point = if axis < machine.workpiece_side { station.table_point() } else { Some(station.tool_point()) };
        let loaded = match self.at {
            Some(name) => Some(machine.axis_index(name)?),
            None => None,
        };
        let moment = |row| match loaded {
            Some(loaded) => machine.gravity_moment_of_axis_mm(axis, &model.state(row), loaded),
            None => point.map(|point| machine.gravity_moment_mm(axis, &model.state(row), point.frame, point.mm)),
        };
        let sample = |row| Some(DriverSample::plain(Unit::Metre.to_display(moment(row)?), 0.0));
        (0..model.rows()).map(sample).collect()
    }
    fn phrase(&self) -> String {
        match self.at {
            Some(axis) => format!("the moment of a weight at {axis}"),
            None => "the moment of gravity".to_string(),
        }
    }
    fn is_observable(&self, _: &Recorded<'_>, axis: Option<AxisKind>) -> bool {
        axis == Some(AxisKind::Rotary)
    }
    fn per(&self) -> Option<&'static str> {
        Some("m")
    }
    fn proportional(&self) -> Option<String> {
        Some(match self.at {
            Some(axis) => format!(" under a weight at {axis} (compliance)"),
            None => " under gravity (compliance)".to_string(),
        })
    }
    fn is_of_component(&self) -> bool {
        true
    }
    fn check_component(&self, component: &str, axis: Option<AxisKind>) -> Result<(), Diagnostic> {
        if axis == Some(AxisKind::Rotary) {
            return Ok(());
        }
        Err(Diagnostic::session(
            format!("gravity exerts no moment about \"{component}\""),
            "gravity acts on the errors of rotary axes, by a moment about the axis",
        ))
    }
}

impl Symbols for Gravity<'_> {
    fn symbols<N: Nominal>(
        &self,
        input: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>> {
        let axis = &input.machine.axes[input.component_axis?].name;
        let lower = axis.to_lowercase();
        let (driver, identifier, text, weight) = match self.at {
            Some(at) => (
                Driver::GravityAt(at.to_string()),
                format!("gravity_{axis}_{at}"),
                format!("g_{lower}_{}", at.to_lowercase()),
                format!("a unit weight at {at}"),
            ),
            None => (Driver::Gravity, format!("gravity_{axis}"), format!("g_{lower}"), "a unit weight".to_string()),
        };
        let moment = DriverQuantity {
            driver,
            part: DriverPart::Value,
            identifier,
            text,
            unit: "m",
            meaning: format!("moment of {weight} about axis {axis}"),
            range: [-1.0, 1.0],
        };
        Some(DriverSample::plain(named(moment), N::constant(0.0)))
    }
}
