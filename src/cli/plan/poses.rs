//! `abbe plan --poses`: poses for an instrument that measures at rest.

mod options;

use std::path::PathBuf;

use abbe::model::files::{self, ReadOptions};
use abbe::plan::design::Goal;
use abbe::plan::poses::without_place;
use clap::Args;

use super::PlanArguments;
use super::overrides::positive;
use crate::cli::failure::Failure;
use crate::cli::output::Outputs;
use crate::cli::results::Read;
use crate::cli::values::{self, Words};
use crate::report::poses as present;

/// Criteria of a selection.
const CRITERIA: Words<Goal> = &[("d", Goal::D), ("a", Goal::A), ("worst", Goal::WorstUncertainty)];

/// The selection of poses.
#[derive(Args)]
pub struct PoseArguments {
    /// Choose this many poses that determine the errors best, by exchange over candidates within the travel of the axes.
    ///
    /// Example: --poses 30
    #[arg(long, value_name = "N", conflicts_with_all = ["improve", "separate", "range", "patterns", "global"])]
    poses: Option<usize>,
    /// Optimality criterion: `d` the volume of the confidence ellipsoid, `a` the mean variance, `worst` the
    /// largest standard uncertainty.
    ///
    /// Example: --poses 30 --criterion d
    #[arg(long, value_parser = values::words(CRITERIA), default_value = "worst", requires = "poses")]
    criterion: Goal,
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
    #[arg(long, value_name = "MM", default_value_t = 100.0, requires = "tracker_mm", allow_negative_numbers = true)]
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

/// Runs `abbe plan --poses`, without the data of the session unless only they tell where a socket is.
pub fn run(arguments: &PlanArguments, outputs: &Outputs) -> Result<(), Failure> {
    let reading = ReadOptions { read_data: false, ..arguments.session.options() };
    let source = files::text(&arguments.session.session, "the session file")?;
    let (mut session, mut sources) = files::session_of(&source, &reading)?;
    if let Some(test) = without_place(&session, &arguments.poses.tests(&session)?).first() {
        let with_data = files::session_of(&source, &arguments.session.options());
        (session, sources) = with_data.map_err(|error| {
            Failure::Other(format!(
                "test \"{}\" states no `socket_mm`, and its data do not tell where its socket is: {error}",
                test.name
            ))
        })?;
    }
    outputs.refuse_overwrite_of_sources(&sources)?;
    let noise_mm = arguments.noise_um.map(|um| positive("--noise-um", um)).transpose()?;
    let common = &arguments.common;
    let found = arguments.poses.select(&session, noise_mm, common.seed)?;
    let read = Read::session(&session, &sources, common.seed);
    common.output.put(outputs, &present::report(&session, &found), &found, &read)
}
