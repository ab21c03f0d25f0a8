//! Estimated errors as compensation tables of controls, as far as their formats are publicly documented.
//!
//! - [`curves`]: the errors of a model as functions of the position;
//! - [`TableFormat`]: the format of a control ([`crate::control`]); `position`: errors as changes of an axis position.

pub mod curves;
pub(crate) mod position;

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use curves::positions;

pub use self::curves::Compensation;

/// Maximum number of points of a table: LinuxCNC reads 256 triplets per joint, Heidenhain 256 points per table.
pub const MAX_POINTS: usize = 256;

/// The tables of a control.
pub struct Tables {
    /// The files; none if the format can hold no error of the model.
    pub files: Vec<FileText>,
    /// The standard uncertainty of each point of each curve.
    pub uncertainties: Vec<PointUncertainty>,
    /// Identified errors that the files do not hold, with the reason.
    pub left_out: Vec<String>,
}

/// The tables of the identified errors in a format, with a number of points, at least 2, over the range of each curve.
pub fn tables(machine: &Machine, compensation: &Compensation, format: &TableFormat, points: usize) -> Tables {
    let mut left_out = compensation.left_out.clone();
    if !format.holds_locations {
        left_out.extend(compensation.locations.iter().map(|(name, _)| {
            format!("{name}: a location error belongs in the kinematics of the control, not in this table")
        }));
    }
    let files = (format.files)(machine, compensation, points, &mut left_out);
    Tables { files, uncertainties: of_curves(machine, compensation, points), left_out }
}

/// A file to write: its name and its text.
pub type FileText = (String, String);

/// The format of the tables of a control.
pub struct TableFormat {
    /// The word by which it is requested.
    pub word: &'static str,
    /// The file.
    pub about: &'static str,
    /// How the control reads the files, one sentence or two.
    pub import: &'static [&'static str],
    /// Whether the files hold location errors.
    pub holds_locations: bool,
    /// Writes the files with a number of points, and adds the errors that they do not hold to the list.
    pub(crate) files: fn(&Machine, &Compensation, usize, &mut Vec<String>) -> Vec<FileText>,
}

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
