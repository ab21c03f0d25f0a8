//! `abbe plan --poses`: poses for an instrument that measures at rest.

use std::path::PathBuf;

use abbe::identify::plan::poses::candidates::{LineOfSight, PoseLimits};
use abbe::identify::plan::poses::{PoseCriterion, PoseOptions, PoseSelection, measured_by, select};
use abbe::model::instrument::InstrumentKind;
use abbe::model::session::{Session, Test};
use clap::{Args, ValueEnum};

use crate::cli::failure::Failure;
use crate::cli::{output, values};
use crate::report::poses as present;

/// Maximum number of poses.
const MAX_POSES: usize = 1000;
/// Maximum number of candidate poses.
const MAX_CANDIDATES: usize = 20_000;

/// What the poses are to make small.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Criterion {
    /// Volume of the confidence ellipsoid.
    D,
    /// Mean variance.
    A,
    /// Largest standard uncertainty.
    Worst,
}

/// The selection of poses.
#[derive(Args)]
pub struct PoseArguments {
    /// Choose this many poses that determine the errors best, by exchange over candidates within the travel of the axes.
    ///
    /// Example: --poses 30
    #[arg(long, value_name = "N", conflicts_with_all = ["improve", "separate", "range", "patterns", "global"])]
    poses: Option<usize>,
    /// What the poses are to make small.
    ///
    /// Example: --poses 30 --criterion d
    #[arg(long, value_enum, default_value = "worst", requires = "poses")]
    criterion: Criterion,
    /// The test whose instrument measures the poses [default: the last; of sockets all].
    ///
    /// Example: --poses 30 --pose-test A
    #[arg(long, value_name = "TEST", requires = "poses", allow_hyphen_values = true)]
    pose_test: Option<String>,
    /// Number of candidate poses.
    ///
    /// Example: --poses 30 --candidates 2000
    #[arg(long, value_name = "N", default_value_t = 1000, requires = "poses")]
    candidates: usize,
    /// Box that contains the instrument's point of the tool, in R.
    ///
    /// Example: --poses 30 --box-mm -800,800,-800,800,100,1200
    #[arg(long, value_name = "X,X,Y,Y,Z,Z", value_delimiter = ',', requires = "poses", allow_hyphen_values = true)]
    box_mm: Option<Vec<f64>>,
    /// Position of the tracker in R. The line from it to the target keeps a distance from the links of the machine.
    ///
    /// Example: --poses 30 --tracker-mm 3000,0,1000
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', requires = "poses", allow_hyphen_values = true)]
    tracker_mm: Option<Vec<f64>>,
    /// Distance of the line of sight from the links: the lines between the origins of the axes.
    ///
    /// Example: --poses 30 --tracker-mm 3000,0,1000 --sight-mm 150
    #[arg(long, value_name = "MM", default_value_t = 100.0, requires = "tracker_mm")]
    sight_mm: f64,
    /// Part of the cylinder that a probe may touch: least and greatest distance along its axis from `artefact_mm`
    /// [default: 0,0].
    ///
    /// Example: --poses 12 --height-mm -20,20
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', requires = "poses", allow_hyphen_values = true)]
    height_mm: Option<Vec<f64>>,
    /// Write the poses as CSV, one row per pose, with the columns of data files.
    ///
    /// Example: --poses 30 --poses-csv poses.csv
    #[arg(long, value_name = "FILE.csv", requires = "poses")]
    poses_csv: Option<PathBuf>,
}

impl PoseArguments {
    /// Whether poses are requested.
    pub fn asked(&self) -> bool {
        self.poses.is_some()
    }

    /// The file of the poses.
    pub fn file(&self) -> Option<&PathBuf> {
        self.poses_csv.as_ref()
    }

    /// Selects and shows the poses.
    pub fn run(
        &self,
        session: &Session,
        noise_mm: Option<f64>,
        seed: u64,
        tables: bool,
    ) -> Result<PoseSelection, Failure> {
        let within = |flag: &str, value: usize, most: usize| match value {
            value if (1..=most).contains(&value) => Ok(value),
            value => Err(Failure::Other(format!("`{flag} {value}`: a number from 1 to {most} is expected"))),
        };
        let options = PoseOptions {
            poses: within("--poses", self.poses.unwrap_or(1), MAX_POSES)?,
            criterion: match self.criterion {
                Criterion::D => PoseCriterion::D,
                Criterion::A => PoseCriterion::A,
                Criterion::Worst => PoseCriterion::WorstUncertainty,
            },
            candidates: within("--candidates", self.candidates, MAX_CANDIDATES)?,
            seed,
            limits: self.limits()?,
            noise_mm,
        };
        let tests = self.tests(session)?;
        let found = select(session, &tests, &options)?;
        if tables {
            say!("{}", present::sentence(&found));
            output::print(&present::uncertainties(&found));
            output::print(&present::poses(&found));
        }
        if let Some(path) = &self.poses_csv {
            output::write_whole(path, &output::csv(&present::exact_poses(&found))?)?;
        }
        Ok(found)
    }

    /// The tests whose instruments measure the poses.
    pub fn tests<'s>(&self, session: &'s Session) -> Result<Vec<&'s Test>, Failure> {
        let tests = measured_by(session, self.pose_test.as_deref());
        if tests.is_empty() {
            let names: Vec<&str> = session.tests.iter().map(|test| test.name.as_str()).collect();
            return Err(Failure::Other(format!(
                "`--pose-test {}`: the session has no such test; its tests are {}",
                self.pose_test.as_deref().unwrap_or_default(),
                names.join(", ")
            )));
        }
        let probed = |test: &&Test| test.station.kind() == InstrumentKind::Probe;
        if self.height_mm.is_some() && !tests.iter().all(probed) {
            return Err(Failure::Other(format!(
                "`--height-mm` is of the cylinder that a probe touches; this session's instrument is a {}",
                session.instrument.word()
            )));
        }
        Ok(tests)
    }

    fn limits(&self) -> Result<PoseLimits, Failure> {
        let fault = |flag: &str, words: &str| Err(Failure::Other(format!("`{flag}`: {words}")));
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
