//! Circular figures as they stand in JSON.

use schemars::JsonSchema;
use serde::Serialize;

use crate::results::ParameterResult;

/// What a circular test shows.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CircularTest {
    /// The test.
    pub test: String,
    /// The axes that make the path: `XY` for a circle of two linear axes, `C` for a rotary axis.
    pub axes: String,
    /// Radius of the path, mm; of a circle of linear axes only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// Feed along the path, mm/min; where the data have a time column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_mm_min: Option<f64>,
    /// How far round the path goes, degrees. ISO 230-4 speaks of full circles.
    pub arc_deg: f64,
    /// Each direction in which it was run.
    pub directions: Vec<DirectionFigures>,
    /// Bidirectional circular deviation G(b), µm: radial range of both paths about their common least-squares circle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bidirectional_circular_deviation_um: Option<f64>,
    /// Mean bidirectional radial deviation D, µm: radius of that circle less the nominal one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_bidirectional_radial_deviation_um: Option<f64>,
    /// Circular hysteresis H, µm: the greatest difference of radius between the two directions at one angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hysteresis_um: Option<f64>,
    /// What the path is made of, the greatest share first; of circles of two linear axes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub diagnosis: Vec<Diagnosis>,
    /// The residual of the diagnosis, rms, µm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diagnosis_rms_um: Option<f64>,
    /// What this test does not identify, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_identifiable: Vec<String>,
}

/// Figures of the runs in one direction, of their mean path.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DirectionFigures {
    /// `+`: from the first axis of the plane towards the second, or the rotary axis' positive turn; `-`: the other way.
    pub direction: String,
    /// How many runs.
    pub runs: usize,
    /// Circular deviation G, µm: radial range about the least-squares circle.
    pub circular_deviation_um: f64,
    /// Radial deviation F, greatest, µm: about the nominal radius, from the centre of the least-squares circle.
    pub radial_deviation_max_um: f64,
    /// Radial deviation F, least, µm.
    pub radial_deviation_min_um: f64,
}

/// One classical fault.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Diagnosis {
    /// `backlash`, `squareness`, `scale mismatch`, `servo mismatch`, `straightness`, `cyclic error`, `reversal spike`, `lateral play`,
    /// `third-order positioning`, `third-order straightness`.
    pub fault: String,
    /// The axis, or the two axes.
    pub axes: String,
    /// Its figures. Those of one axis have the sign of that axis' error motion along R, as the effect of the same name has: `backlash` of X that of
    /// `EXX~X:backlash`, `lateral play` that of `EYX~X:backlash`, `straightness` that of `EYX~X:power2`, `squareness` of X and Y that of `EC0Y`.
    pub values: Vec<ParameterResult>,
    /// What it does to the path, greatest less least, µm.
    pub circularity_um: f64,
    /// That, as a share of the sum over all faults, %.
    pub share_percent: f64,
}
