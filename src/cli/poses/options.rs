//! What `abbe poses` asks for: tests, number, limits.

use abbe::model::Diagnostic;
use abbe::model::session::{Session, Test};
use abbe::plan::poses::candidates::{LineOfSight, PoseLimits};
use abbe::plan::poses::{PoseOptions, PoseSelection, measured_by, select};

use super::PoseArguments;
use crate::cli::{output, values};
use crate::report::poses as present;

/// Maximum number of poses.
const MAX_POSES: usize = 1000;
/// Maximum number of candidate poses.
const MAX_CANDIDATES: usize = 20_000;

impl PoseArguments {
    /// Selects the poses.
    pub fn select(&self, session: &Session) -> Result<PoseSelection, Diagnostic> {
        let options = PoseOptions {
            poses: values::count("--poses", "", self.poses, MAX_POSES)?,
            goal: self.criterion.clone(),
            candidates: values::count("--candidates", "", self.candidates, MAX_CANDIDATES)?,
            seed: self.common.seed,
            limits: self.limits()?,
            noise_mm: self.noise_um.map(|um| values::length_um("--noise-um", um)).transpose()?,
        };
        let found = select(session, &self.tests(session)?, &options)?;
        if let Some(path) = &self.out {
            output::write_whole(path, &output::csv(&present::exact_poses(&found))?)?;
        }
        Ok(found)
    }

    /// The tests whose instruments measure the poses.
    pub fn tests<'s>(&self, session: &'s Session) -> Result<Vec<&'s Test>, Diagnostic> {
        let tests = measured_by(session, self.test.as_deref());
        if tests.is_empty() {
            let names: Vec<&str> = session.tests.iter().map(|test| test.name.as_str()).collect();
            return Err(Diagnostic::other(format!(
                "`--test {}`: the session has no such test; its tests are {}",
                self.test.as_deref().unwrap_or_default(),
                names.join(", ")
            )));
        }
        let probed = |test: &&Test| test.station.probe().is_some();
        if self.height_mm.is_some() && !tests.iter().all(probed) {
            return Err(Diagnostic::other(format!(
                "`--height-mm` is of the cylinder that a probe touches; this session's instrument is a {}",
                session.instrument.word()
            )));
        }
        Ok(tests)
    }

    /// The limits of the poses.
    pub fn limits(&self) -> Result<PoseLimits, Diagnostic> {
        let fault = |flag: &str, words: &str| Err(Diagnostic::other(format!("`{flag}`: {words}")));
        let box_mm = match self.box_mm.as_deref() {
            None => None,
            Some(sides @ &[x, xx, y, yy, z, zz]) if x < xx && y < yy && z < zz => {
                values::COORDINATE_MM.all("--box-mm", sides)?;
                Some([[x, xx], [y, yy], [z, zz]])
            }
            Some(_) => return fault("--box-mm", "six numbers are expected: least and greatest X, Y, Z"),
        };
        let sight = match self.tracker_mm.as_deref() {
            None => None,
            Some(point) => Some(values::point_mm("--tracker-mm", point, [0.0; 3])?),
        };
        values::DISTANCE_MM.check("--sight-mm", self.sight_mm)?;
        let sight = sight.map(|from_mm| LineOfSight { from_mm, clearance_mm: self.sight_mm });
        let height_mm = match self.height_mm.as_deref() {
            None => [0.0; 2],
            Some(ends @ &[low, high]) if low <= high => {
                values::COORDINATE_MM.all("--height-mm", ends)?;
                [low, high]
            }
            Some(_) => return fault("--height-mm", "two numbers are expected: the least and the greatest height"),
        };
        Ok(PoseLimits { box_mm, sight, height_mm })
    }
}
