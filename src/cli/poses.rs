//! `abbe poses`: poses for an instrument that measures at rest.

use std::path::PathBuf;

use abbe::files::{self, ReadOptions};
use abbe::model::Diagnostic;
use abbe::model::session::{Session, Test};
use abbe::plan::design::Goal;
use abbe::plan::poses::candidates::{LineOfSight, PoseLimits};
use abbe::plan::poses::{PoseOptions, PoseSelection, measured_by, select, without_place};
use clap::Args;

use super::results::Read;
use super::values::{self, Words};
use super::{CommonArguments, Global, SessionArguments, output};
use crate::report::poses as present;

/// Examples of `abbe poses`.
pub const HELP: &str = include_str!("help/poses.txt");

/// Criteria of a selection.
const CRITERIA: Words<Goal> = &[("d", Goal::D), ("a", Goal::A), ("worst", Goal::WorstUncertainty)];

/// `abbe poses SESSION --poses N`
#[derive(Args)]
pub struct PoseArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    /// Number of poses to choose, by exchange over candidates within the travel of the axes.
    ///
    /// Example: --poses 30
    #[arg(long, value_name = "N")]
    poses: usize,
    /// Where the result is written: the poses as CSV, one row per pose, with the columns of data files.
    ///
    /// Example: --out poses.csv
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Standard deviation of a reading, µm, instead of the session's.
    ///
    /// Example: --noise-um 50
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    noise_um: Option<f64>,
    /// Optimality criterion: `d` the volume of the confidence ellipsoid, `a` the mean variance, `worst` the
    /// largest standard uncertainty.
    ///
    /// Example: --criterion d
    #[arg(long, value_parser = values::words(CRITERIA), default_value = "worst")]
    criterion: Goal,
    /// Name of a test of the session: its instrument measures the poses [default: the last test; of sockets all].
    ///
    /// Example: --test A
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    test: Option<String>,
    /// Number of candidate poses.
    ///
    /// Example: --candidates 2000
    #[arg(long, value_name = "N", default_value_t = 1000)]
    candidates: usize,
    /// Box that contains the instrument's point of the tool, in R.
    ///
    /// Example: --box-mm -800,800,-800,800,100,1200
    #[arg(long, value_name = "X,X,Y,Y,Z,Z", value_delimiter = ',', allow_hyphen_values = true)]
    box_mm: Option<Vec<f64>>,
    /// Position of the tracker in R. The line from it to the target keeps a distance from the links of the machine.
    ///
    /// Example: --tracker-mm 3000,0,1000
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    tracker_mm: Option<Vec<f64>>,
    /// Distance of the line of sight from the links: the lines between the origins of the axes.
    ///
    /// Example: --tracker-mm 3000,0,1000 --sight-mm 150
    #[arg(long, value_name = "MM", default_value_t = 100.0, requires = "tracker_mm", allow_negative_numbers = true)]
    sight_mm: f64,
    /// Part of the cylinder that a probe may touch: least and greatest distance along its axis from `artefact_mm`
    /// [default: 0,0].
    ///
    /// Example: --height-mm -20,20
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', allow_hyphen_values = true)]
    height_mm: Option<Vec<f64>>,
}

/// Runs `abbe poses`, without the data of the session unless only they tell where a socket is.
pub fn run(arguments: &PoseArguments, _: Global) -> Result<(), Diagnostic> {
    let common = &arguments.common;
    let outputs = common.output.prepared(&[arguments.out.as_ref()])?;
    let reading = ReadOptions { read_data: false, ..arguments.session.options() };
    let source = files::text(&arguments.session.session, "the session file")?;
    let (mut session, mut sources) = files::session_of(&source, &reading)?;
    if let Some(test) = without_place(&session, &arguments.tests(&session)?).first() {
        let with_data = files::session_of(&source, &arguments.session.options());
        (session, sources) = with_data.map_err(|error| {
            Diagnostic::other(format!(
                "test \"{}\" states no `socket_mm`, and its data do not tell where its socket is: {error}",
                test.name
            ))
        })?;
    }
    outputs.refuse_overwrite_of_sources(&sources)?;
    let found = arguments.select(&session)?;
    let read = Read::session(&session, &sources, common.seed);
    common.output.put(&outputs, &present::report(&session, &found), &found, &read)
}

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
