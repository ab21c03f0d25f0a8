//! `abbe poses`: poses for an instrument that measures at rest.

mod options;

use std::path::PathBuf;

use abbe::files::{self, ReadOptions};
use abbe::model::Diagnostic;
use abbe::plan::design::Goal;
use abbe::plan::poses::without_place;
use clap::Args;

use super::results::Read;
use super::values::{self, Words};
use super::{CommonArguments, Global, SessionArguments};
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
