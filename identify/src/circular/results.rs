//! Ball-bar figures of circular tests, as JSON has them.

use schemars::JsonSchema;
use serde::Serialize;

use crate::figure::Figure;
use crate::results::Estimate;

/// Ball-bar figures of a circular test (ISO 230-4).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CircularTest {
    /// The test.
    pub test: String,
    /// The axes of the path: `XY` for a circle of two linear axes, `C` for a rotary axis.
    pub axes: String,
    /// Name in ISO 10791-6 of the synchronous motion of a rotary axis of a table and two linear axes: `BK1` for A or B,
    /// `BK2` for C, if both rotary axes are on the table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iso_10791_6: Option<String>,
    /// Direction of the bar in a synchronous motion: `radial`, `tangential`, `axial`. Absent for every other path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bar_direction: Option<String>,
    /// Radius of the path, mm; absent for a rotary axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// Feed along the path, mm/min; absent where the data have no time column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_mm_min: Option<f64>,
    /// Angle of the path, degrees. ISO 230-4 requires a full circle.
    pub arc_deg: f64,
    /// Figures of each direction of travel.
    pub directions: Vec<DirectionFigures>,
    /// Figures of both directions together: G(b), D, H.
    pub figures: Vec<Figure>,
    /// Contributions of classical faults to the path, the largest first; absent for a rotary axis.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub diagnosis: Vec<Diagnosis>,
    /// Rms of the residual of the diagnosis, µm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diagnosis_rms_um: Option<f64>,
    /// What this test does not identify, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_identifiable: Vec<String>,
}

/// Figures of the mean path of the runs in one direction.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DirectionFigures {
    /// `+`: from the first axis of the plane towards the second, or the positive rotation of the rotary axis; `-`: the
    /// opposite direction.
    pub direction: String,
    /// Number of runs.
    pub runs: usize,
    /// Figures of this direction: G, F, and the error motions of a rotary axis that makes a full turn alone.
    pub figures: Vec<Figure>,
}

/// Contribution of one classical fault.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Diagnosis {
    /// `backlash`, `squareness`, `scale mismatch`, `servo mismatch`, `straightness`, `cyclic error`, `reversal spike`,
    /// `lateral play`, `third-order positioning`, `third-order straightness`.
    pub fault: String,
    /// The axis, or the two axes.
    pub axes: String,
    /// Its estimates, with the signs of the error motions along R: `backlash` of X is that of `EXX~X:backlash`,
    /// `lateral play` that of `EYX~X:backlash`, `straightness` that of `EYX~X:power2`, `squareness` of X and Y that of
    /// `EC0Y`.
    pub values: Vec<Estimate>,
    /// Contribution to the path, largest less smallest radius, µm.
    pub circularity_um: f64,
    /// Share of this contribution in the sum over all faults, %.
    pub share_percent: f64,
}
