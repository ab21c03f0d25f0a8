//! `gravity`: the moment of a unit weight about the component's own axis, m.
//!
//! For an axis on the tool side the weight acts at the instrument's point in the tool frame (spindle ball, stylus,
//! target). For an axis on the workpiece side it acts at the instrument's point in the table frame (workpiece ball,
//! point of the artefact), not at the centre of mass of table and workpiece.

use super::Driver;
use super::kind::{DriverFault, DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::{DriverPart, DriverSample};
use super::unit::DriverUnit;
use crate::axis::AxisKind;
use crate::scalar::Nominal;

/// The moment of gravity.
pub(super) struct Gravity;

pub(super) const METRE: DriverUnit = DriverUnit::new("m", "m", "m", " m");
const MILLIMETRES_PER_METRE: f64 = 1000.0;

pub(super) const ENTRY: Entry = Entry { word: Some("gravity"), driver: |_| Driver::Gravity, units: &[METRE] };

impl DriverKind for Gravity {
    fn unit(&self, _: Option<AxisKind>) -> DriverUnit {
        METRE
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        let DriverInput { machine, model, .. } = input;
        let axis = input.component_axis?;
        let station = model.station();
        let point = if axis < machine.workpiece_side { station.table_point_mm()? } else { station.tool_point_mm() };
        let moment = |row| machine.gravity_moment_mm(axis, &model.state(row), point) / MILLIMETRES_PER_METRE;
        let sample = |row| DriverSample::plain(moment(row), 0.0);
        Some((0..model.rows()).map(sample).collect())
    }
    fn phrase(&self) -> String {
        "the moment of gravity".to_string()
    }
    fn is_observable(&self, _: &Recorded<'_>, axis: Option<AxisKind>) -> bool {
        axis == Some(AxisKind::Rotary)
    }
    fn per(&self) -> Option<&'static str> {
        Some("m")
    }
    fn proportional(&self) -> Option<String> {
        Some(" under gravity (compliance)".to_string())
    }
    fn is_of_component(&self) -> bool {
        true
    }
    fn check_component(&self, component: &str, axis: Option<AxisKind>) -> Result<(), DriverFault> {
        check_component(component, axis)
    }
}

/// Checks that a weight has a moment about the axis of a component.
pub(super) fn check_component(component: &str, axis: Option<AxisKind>) -> Result<(), DriverFault> {
    if axis == Some(AxisKind::Rotary) {
        return Ok(());
    }
    Err(DriverFault {
        message: format!("gravity exerts no moment about \"{component}\""),
        help: "gravity acts on the errors of rotary axes, by a moment about the axis",
    })
}

impl Symbols for Gravity {
    fn symbols<N: Nominal>(
        &self,
        input: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>> {
        let axis = &input.machine.axes[input.component_axis?].name;
        let moment = DriverQuantity {
            driver: Driver::Gravity,
            part: DriverPart::Value,
            identifier: format!("gravity_{axis}"),
            text: format!("g_{}", axis.to_lowercase()),
            unit: "m",
            meaning: format!("moment of a unit weight about axis {axis}"),
            range: [-1.0, 1.0],
        };
        Some(DriverSample::plain(named(moment), N::constant(0.0)))
    }
}
