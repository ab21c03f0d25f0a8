//! Summary of a map of the volumetric error, as JSON has it.

use schemars::JsonSchema;
use serde::Serialize;

/// Largest and root mean square of a length over a map, µm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Size {
    /// Largest absolute value, µm.
    pub largest_um: f64,
    /// Root mean square, µm.
    pub rms_um: f64,
}

impl Size {
    pub(super) fn of(lengths_mm: impl Iterator<Item = f64>) -> Size {
        let (mut largest, mut sum, mut count) = (0.0_f64, 0.0, 0);
        for length in lengths_mm {
            largest = largest.max(length.abs());
            sum += length * length;
            count += 1;
        }
        Size { largest_um: largest * 1e3, rms_um: (sum / f64::from(count.max(1))).sqrt() * 1e3 }
    }
}

/// Position of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MapPosition {
    /// The axis.
    pub axis: String,
    /// Its position, in `unit`.
    pub position: f64,
    /// `mm` or `deg`.
    pub unit: String,
}

/// Error vector by the errors of one axis.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AxisShare {
    /// The axis.
    pub axis: String,
    /// Length of the error vector over the map.
    #[serde(flatten)]
    pub size: Size,
}

/// Coordinates of the error vector in the table frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Coordinates {
    /// Along X.
    pub x: Size,
    /// Along Y.
    pub y: Size,
    /// Along Z.
    pub z: Size,
}

/// Summary of a map of the volumetric error.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// Number of points of the map.
    pub points: usize,
    /// Length of the error vector.
    pub error: Size,
    /// Position of each axis where the error is largest.
    pub largest_at: Vec<MapPosition>,
    /// Coordinates of the error vector in the table frame.
    pub coordinates: Coordinates,
    /// Length of the error vector by the errors of each axis alone.
    pub by_axis: Vec<AxisShare>,
    /// Length of the error vector after compensation; absent where no compensation was requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<Size>,
}
