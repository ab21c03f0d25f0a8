//! What `abbe new` writes can be planned.

use std::path::Path;

use abbe::files::store::Store;
use abbe::files::{ReadOptions, session_with_sources};
use abbe::model::Diagnostic;
use abbe::plan::design::Goal;
use abbe::plan::poses::candidates::PoseLimits;
use abbe::plan::poses::{PoseOptions, measured_by, select};
use abbe::plan::{PlanOptions, analyse};

use crate::cli::folder::NewFile;

/// Least number of poses in sockets that have to be possible. A pose has three readings, and an axis has four errors.
const MIN_POSES: usize = 40;
/// Poses for each axis.
const POSES_PER_AXIS: usize = 2;
/// Candidates for each pose.
const CANDIDATES_PER_POSE: usize = 5;

/// Refuses files that `abbe plan` would refuse, before they are written. They are in memory, by their final paths. For sockets,
/// which have no poses yet, some are chosen.
pub fn planned(folder: &Path, files: &[NewFile]) -> Result<(), Diagnostic> {
    let in_memory = files.iter().map(|(name, text)| (folder.join(name), text.clone().into_bytes()));
    let options = ReadOptions { store: Store::in_memory(in_memory), read_data: false, ..ReadOptions::default() };
    let refused = |error: &dyn std::error::Error, help: Option<&str>| {
        let help = help.map_or(String::new(), |help| format!("; {help}"));
        Diagnostic::other(format!("nothing is written, because `abbe plan` would refuse the session: {error}{help}"))
    };
    let (session, _) =
        session_with_sources(&folder.join("plan.toml"), &options).map_err(|error| refused(&error, error.help()))?;
    let planned = if session.tests.iter().any(|test| test.motion.is_none()) {
        let poses = MIN_POSES.max(POSES_PER_AXIS * session.machine.axes.len());
        let options = PoseOptions {
            poses,
            goal: Goal::WorstUncertainty,
            candidates: CANDIDATES_PER_POSE * poses,
            seed: 1,
            limits: PoseLimits::default(),
            noise_mm: None,
        };
        select(&session, &measured_by(&session, None), &options).map(|_| ())
    } else {
        analyse(&session, &PlanOptions { effects: false, ..PlanOptions::default() }).map(|_| ())
    };
    planned.map_err(|error| refused(&error, None))
}
