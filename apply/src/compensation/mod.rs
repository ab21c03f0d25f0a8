//! Estimated errors as compensation tables of controls, as far as their formats are publicly documented.
//!
//! - [`curves`]: the errors of a model as functions of the position;
//! - [`TableFormat`]: the format of a control ([`crate::control`]); `position`: errors as changes of an axis position.

pub mod curves;
mod format;
pub(crate) mod position;
mod uncertainty;

use abbe_model::chain::Machine;

pub use self::curves::Compensation;
pub use self::format::{FileText, TableFormat};
pub use self::uncertainty::PointUncertainty;

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
    Tables { files, uncertainties: uncertainty::of_curves(machine, compensation, points), left_out }
}
