//! The result of a fit, as JSON has it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::base::BaseResult;
use super::frames::SetUpFrame;
use super::tpoint::PointingTerms;
use crate::circular::CircularTest;
use crate::plausibility::Plausibility;
use crate::positioning::PositioningTest;
use crate::positioning::diagonal::{DiagonalTest, LargestOfDiagonals};
use crate::propagation::FitMonteCarlo;
use crate::results::ModelResult;
use crate::straightness::StraightnessTest;
use crate::tolerance::Conformity;

/// The fit of a session.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FitResult {
    /// The fitted model.
    #[serde(flatten)]
    pub model: ModelResult,
    /// Where the instruments stand and how their targets are mounted, of trackers, poses, sockets and distances.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<SetUpFrame>,
    /// Ball-bar figures of the tests whose path is a circle.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub circular: Vec<CircularTest>,
    /// Figures of ISO 230-2 of the tests in which a laser or a sensor of angles reads the axis that moves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub positioning: Vec<PositioningTest>,
    /// Figures of ISO 230-6 of the tests in which a laser reads along a diagonal.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub diagonals: Vec<DiagonalTest>,
    /// The largest figures over the body diagonals, and over the face diagonals.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub largest_of_diagonals: Vec<LargestOfDiagonals>,
    /// Straightness of axes by ISO 230-1, from tests in which one linear axis moves under a laser.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub straightness: Vec<StraightnessTest>,
    /// Decisions of conformity, if the session states limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conformity: Option<Conformity>,
    /// Statements of the session that the readings contradict, and what may be wrong.
    #[serde(flatten)]
    pub plausibility: Plausibility,
    /// Warnings in words.
    pub warnings: Vec<String>,
    /// Notes of the session file's `[about]`: `serial_number`, `operator`, `date`, `comment` and others.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub about: BTreeMap<String, String>,
    /// The base parameters, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<BaseResult>,
    /// The terms of TPOINT, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tpoint: Option<PointingTerms>,
    /// The fit by Monte Carlo, if requested. `u` in `parameters` then is the quoted one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<FitMonteCarlo>,
}
