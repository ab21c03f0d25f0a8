//! `abbe new --from-urdf` and `--from-dh`: a robot from the file of its maker.

use std::path::{Path, PathBuf};

use abbe::files::foreign_text;
use abbe::files::robot::dh::Convention;
use abbe::files::robot::{self, Measured, dh, urdf};
use abbe::model::Diagnostic;
use clap::Args;

use crate::cli::folder::NewFile;
use crate::cli::message::{Kind, tell};
use crate::cli::values::{self, Words};

/// The conventions of a table.
const CONVENTIONS: Words<Convention> = &Convention::WORDS;
/// How a robot is measured.
const MEASURED: Words<Measured> = &Measured::WORDS;

/// The file of a robot.
#[derive(Args)]
pub struct RobotArguments {
    /// Create the machine of this URDF file, and a plan for it.
    ///
    /// Example: --from-urdf robot.urdf
    #[arg(long, value_name = "FILE", requires = "out")]
    from_urdf: Option<PathBuf>,
    /// The link at which the chain of the URDF ends [default: the end of the arm].
    ///
    /// Example: --from-urdf robot.urdf --tip tool0
    #[arg(long, value_name = "LINK", requires = "from_urdf", allow_hyphen_values = true)]
    tip: Option<String>,
    /// Create the machine of this table of Denavit-Hartenberg parameters (CSV), and a plan for it.
    ///
    /// Example: --from-dh robot.csv --convention modified
    #[arg(long, value_name = "FILE", requires = "convention")]
    from_dh: Option<PathBuf>,
    /// The convention of Denavit-Hartenberg parameters: standard is Rz(θ)·Tz(d)·Tx(a)·Rx(α), modified is
    /// Tx(a)·Rx(α)·Rz(θ)·Tz(d).
    ///
    /// Example: --from-dh robot.csv --convention standard
    #[arg(long, value_parser = values::words(CONVENTIONS), requires = "from_dh")]
    convention: Option<Convention>,
    /// What measures the robot: a tracker with a target at the flange, or sockets for a ball at the flange.
    ///
    /// Example: --from-urdf robot.urdf --measured-by sockets
    #[arg(long, value_parser = values::words(MEASURED), default_value = "tracker")]
    measured_by: Measured,
    /// The target or the ball in the frame of the flange [default: its origin].
    ///
    /// Example: --from-urdf robot.urdf --target-mm 0,0,60
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    target_mm: Vec<f64>,
}

impl RobotArguments {
    /// The files of the robot; none without one.
    pub fn files(&self) -> Result<Vec<NewFile>, Diagnostic> {
        let chain = match (&self.from_urdf, &self.from_dh, self.convention) {
            (Some(file), ..) => urdf::read(&foreign_text(file, "the URDF file")?)?.chain(file, self.tip.as_deref())?,
            (None, Some(file), Some(convention)) => {
                let name = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
                dh::read(&foreign_text(file, "the table")?, convention)?.chain(&name)
            }
            _ => return Ok(Vec::new()),
        };
        for assumed in &chain.assumed {
            tell(Kind::Warning, assumed);
        }
        let source = self.from_urdf.as_ref().or(self.from_dh.as_ref()).map(|file| name_of(file)).unwrap_or_default();
        let target_mm = values::point_mm("--target-mm", &self.target_mm, [0.0; 3])?;
        Ok(robot::files(&chain, &source, self.measured_by, target_mm))
    }
}

fn name_of(file: &Path) -> String {
    file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}
