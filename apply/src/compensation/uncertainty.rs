//! The standard uncertainty of each point of the compensation tables.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;

use super::curves::{Compensation, positions};

/// A point of a curve with its standard uncertainty (k = 1).
pub struct PointUncertainty {
    /// The error.
    pub error: ErrorName,
    /// Kind of its axis, which gives the unit of the position.
    pub axis: AxisKind,
    /// Position of the axis, mm or degrees.
    pub position: f64,
    /// Direction of travel: +1 or −1; `None` if the curve does not depend on it.
    pub direction: Option<f64>,
    /// The error there, in `unit`.
    pub value: f64,
    /// Its standard uncertainty, in `unit`.
    pub u: f64,
    /// `um` or `arcsec`.
    pub unit: &'static str,
}

/// Every point of each curve, and for both directions if the curve depends on them.
pub(super) fn of_curves(machine: &Machine, compensation: &Compensation, points: usize) -> Vec<PointUncertainty> {
    let mut found = Vec::new();
    for curve in &compensation.curves {
        let axis = machine.axes[curve.axis].kind;
        let unit = curve.error.freedom.unit().displayed();
        let directions: &[Option<f64>] = if curve.is_directional() { &[Some(1.0), Some(-1.0)] } else { &[None] };
        for direction in directions {
            let towards = direction.unwrap_or(1.0);
            found.extend(positions([curve], points).map(|q| PointUncertainty {
                error: curve.error.clone(),
                axis,
                position: axis.to_display(q),
                direction: *direction,
                value: unit.to_display(curve.at(q, towards)),
                u: unit.to_display(curve.u_at(q, towards)),
                unit: unit.name(),
            }));
        }
    }
    found
}
