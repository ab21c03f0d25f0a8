//! `abbe new`: create a machine and a session from a template, a structural code, or the file of a robot.

use std::path::{Path, PathBuf};

use abbe::files::robot::dh::{self, Convention};
use abbe::files::robot::{self, Measured, urdf};
use abbe::files::store::Store;
use abbe::files::template::{self, Sizes};
use abbe::files::{ReadOptions, foreign_text, session_with_sources};
use abbe::model::Diagnostic;
use abbe::model::chain::UNKNOWN_AXIS_KIND;
use abbe::plan::design::Goal;
use abbe::plan::poses::candidates::PoseLimits;
use abbe::plan::poses::{PoseOptions, measured_by, select};
use abbe::plan::{PlanOptions, analyse};
use clap::Args;

use super::Global;
use super::folder::{self, NewFile};
use super::message::{Kind, tell};
use super::values::{self, Words};

/// Examples of `abbe new`.
pub const HELP: &str = "Examples:
  abbe new
  abbe new mymachine --template hermle-c600u
  abbe new mine --from-code \"[wCXbYZAt]\"
  abbe new ours --from-code \"[wCXbYZAt]\" --pivot-mm 180 --gauge-mm 120 --table-mm=-80
  abbe new arm --from-urdf robot.urdf --tip tool0 --target-mm 0,0,60
  abbe new arm2 --from-dh robot.csv --convention standard --measured-by sockets

The first lists the templates. --from-code creates machine.toml and plan.toml with a comment on each line; `abbe plan mine/plan.toml` analyses them. --from-urdf reads links, joints and limits; --from-dh a table with the columns a, alpha, d, theta, one row for each joint. A plan for a tracker turns each joint alone; one for sockets has three of them.";

/// `abbe new [DIR --template NAME | DIR --from-code CODE]`
#[derive(Args)]
#[command(group = clap::ArgGroup::new("start").args(["template", "from_code", "from_urdf", "from_dh"]))]
pub struct NewArguments {
    /// The new folder. Without it, the templates are listed.
    #[arg(requires = "start", value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Copy this template.
    ///
    /// Example: --template hermle-c600u
    #[arg(long, value_name = "NAME", requires = "out", allow_hyphen_values = true)]
    template: Option<String>,
    /// Create a machine with this structural code, from workpiece over bed to tool, and a plan for it.
    ///
    /// Example: --from-code [wCXbYZAt]
    #[arg(long, value_name = "CODE", requires = "out")]
    from_code: Option<String>,
    #[command(flatten)]
    robot: RobotArguments,
    #[command(flatten)]
    sizes: SizeArguments,
    /// List the choices, and stop: the templates.
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    folder: super::ForceArguments,
}

/// Runs `abbe new`.
pub fn run(arguments: &NewArguments, Global { quiet, .. }: Global) -> Result<(), Diagnostic> {
    let (Some(folder), false) = (&arguments.out, arguments.list) else {
        list();
        return Ok(());
    };
    let files = match (&arguments.template, &arguments.from_code) {
        (Some(name), _) => copied(name)?,
        (None, Some(code)) => of_code(code, &arguments.sizes)?,
        (None, None) => arguments.robot.files()?,
    };
    // A template is read and planned by the tests of the project; some need data that are not here.
    if arguments.template.is_none() {
        planned(folder, &files)?;
    }
    folder::write(folder, &files, arguments.folder.force, |_| Ok(()))?;
    if quiet {
        return Ok(());
    }
    for (name, _) in files {
        say!("{}", folder.join(name).display());
    }
    Ok(())
}

/// Lists the templates, one per line.
fn list() {
    let width = TEMPLATES.iter().map(|template| template.name.len()).max().unwrap_or(0);
    for template in TEMPLATES {
        say!("  {:width$}  {}", template.name, template.about);
    }
}

fn names() -> String {
    let names: Vec<&str> = TEMPLATES.iter().map(|template| template.name).collect();
    names.join(", ")
}

/// What to do with a plan, at its start.
const PLAN_HEAD: &str = "# A plan. `abbe plan plan.toml` analyses which errors these tests identify, and with which uncertainty.\n\
    # Change the tests until the uncertainties suffice.\n\
    # `abbe simulate plan.toml --out run1 --error …` simulates readings. A measured test has a line `data = \"….csv\"`.\n\n";

/// The files of a structural code.
fn of_code(code: &str, sizes: &SizeArguments) -> Result<Vec<NewFile>, Diagnostic> {
    let [machine, plan] = template::of_code(code, sizes.stated()).map_err(|mut error| {
        if error.code == UNKNOWN_AXIS_KIND {
            error.message += "; `abbe new DIR --template ur10` shows one whose axes state their kind and direction";
        }
        error
    })?;
    Ok(vec![("machine.toml".into(), machine), ("plan.toml".into(), format!("{PLAN_HEAD}{plan}"))])
}

/// The files of a template.
fn copied(name: &str) -> Result<Vec<NewFile>, Diagnostic> {
    let Some(template) = TEMPLATES.iter().find(|template| template.name == name) else {
        return Err(Diagnostic::other(format!("no template `{name}`; the templates are {}", names())));
    };
    let files = template.files.iter();
    Ok(files.map(|(name, text)| (name.to_string(), text.to_string())).collect())
}

/// Sizes of the machine of a code.
#[derive(Args)]
struct SizeArguments {
    /// From the rotary axes of the head to the spindle nose, mm [default: 150, as a guess].
    ///
    /// Example: --from-code wCbXYZAt --pivot-mm 180
    #[arg(long, value_name = "MM", requires = "from_code", allow_negative_numbers = true)]
    pivot_mm: Option<f64>,
    /// Height of the table surface above the origin of R with all axes at zero, mm: where the rotary axes of the table
    /// meet, or the spindle ball of a machine without them [default: -100, as a guess].
    ///
    /// Example: --from-code wCAbXYZt --table-mm -60
    #[arg(long, value_name = "MM", requires = "from_code", allow_negative_numbers = true)]
    table_mm: Option<f64>,
    /// From the spindle nose to the centre of the spindle ball, mm [default: 100, as a guess].
    ///
    /// Example: --from-code wCbXYZAt --gauge-mm 120
    #[arg(long, value_name = "MM", requires = "from_code", allow_negative_numbers = true)]
    gauge_mm: Option<f64>,
}

impl SizeArguments {
    /// What the user states.
    pub fn stated(&self) -> Sizes {
        Sizes { pivot_mm: self.pivot_mm, table_mm: self.table_mm, gauge_mm: self.gauge_mm }
    }
}

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

/// A session in the program.
struct Template {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// File name and contents.
    pub files: &'static [(&'static str, &'static str)],
}

/// Files of folders of `sessions/`, some under another name.
macro_rules! files {
    ($($folder:literal: $($file:literal $(as $name:literal)?),+);+ $(;)?) => {
        &[$($((name!($file $(, $name)?), include_str!(concat!("../../sessions/", $folder, "/", $file)))),+),+]
    };
}

macro_rules! name {
    ($file:literal) => {
        $file
    };
    ($file:literal, $name:literal) => {
        $name
    };
}

/// The templates.
const TEMPLATES: &[Template] = &[
    Template {
        name: "angle",
        about: "rotary table with a polygon, and a level on a carriage; a plan, and simulated readings",
        files: files!("angle": "machine.toml", "plan.toml", "session.toml", "level.csv", "polygon.csv"),
    },
    Template {
        name: "diagonals",
        about: "three-axis machine and a laser along its axes and four body diagonals (ISO 230-6); a plan, and simulated readings",
        files: files!("diagonals": "machine.toml", "plan.toml", "session.toml", "X.csv", "Y.csv", "Z.csv", "PPP.csv", "NPP.csv", "PNP.csv", "PPN.csv"),
    },
    Template {
        name: "distance",
        about: "three-axis machine and a tracking interferometer at four unknown places; a plan, and simulated readings",
        files: files!("distance": "machine.toml", "plan.toml", "session.toml", "S1.csv", "S2.csv", "S3.csv", "S4.csv"),
    },
    Template {
        name: "hermle-c600u",
        about: "five-axis machine with a tilting rotary table; three ball-bar methods as plans",
        files: files!("hermle-c600u": "machine.toml", "chapter4.toml", "chapter5.toml", "chapter6.toml"),
    },
    Template {
        name: "hermle-c600u-measured",
        about: "the same machine with simulated readings and an effect to trace",
        files: files!(
            "hermle-c600u/measured": "machine.toml", "A100.csv", "A150.csv", "C100.csv", "C150.csv", "session.toml"
        ),
    },
    Template {
        name: "kuka-iiwa14",
        about: "seven-axis robot with its ball in sockets (public data set, to be downloaded)",
        files: files!("kuka-iiwa14": "machine.toml", "session.toml"),
    },
    Template {
        name: "laser",
        about: "three-axis machine and a laser interferometer along X: displacement, straightness, pitch; a plan, and simulated readings",
        files: files!("laser": "machine.toml", "plan.toml", "session.toml", "LX.csv"),
    },
    Template {
        name: "pose",
        about: "six-axis robot before a camera system that reads poses, and before a tracker with range and angles; a plan, and simulated readings",
        files: files!("pose": "machine.toml", "plan.toml", "session.toml", "tracker.toml", "body.csv", "target.csv"),
    },
    Template {
        name: "r-test",
        about: "R-test on machines with B, C and with A, B tables: plans of BK1 and BK2, and readings with pitch-compensation steps to trace",
        files: files!(
            "r-test": "machine.toml", "plan.toml", "machine-b.toml";
            "r-test/measured": "session.toml", "BK1.csv", "BK2.csv", "C-alone.csv"
        ),
    },
    Template {
        name: "self-calibration",
        about: "rotary table probed on an uncalibrated cylinder; a plan, and readings simulated from it",
        files: files!(
            "self-calibration": "machine.toml", "session.toml" as "plan.toml";
            "self-calibration/measured": "session.toml", "1a.csv", "1b.csv", "2.csv", "3.csv"
        ),
    },
    Template {
        name: "telescope",
        about: "alt-azimuth mounts: stars of the LSST auxiliary telescope and of the MMT (public data, to be downloaded)",
        files: files!("telescope": "machine.toml", "auxtel.toml", "mmt.toml"),
    },
    Template {
        name: "volumetric",
        about: "five-axis machine with 33 error functions, to map and to compensate",
        files: files!("volumetric": "machine.toml", "errors.toml"),
    },
    Template {
        name: "table-and-head",
        about: "five-axis machine with a rotary table and a tilting head; ball-bar plan of chapter 7, and simulated readings",
        files: files!(
            "table-and-head": "machine.toml", "session.toml" as "plan.toml";
            "table-and-head/measured": "session.toml", "A100.csv", "A150.csv", "C100.csv", "C150.csv"
        ),
    },
    Template {
        name: "tilting-head",
        about: "five-axis machine with a tilting head; ball-bar plan of chapter 7, and simulated readings",
        files: files!(
            "tilting-head": "machine.toml", "session.toml" as "plan.toml";
            "tilting-head/measured": "session.toml", "B100.csv", "B150.csv", "C100.csv", "C150.csv"
        ),
    },
    Template {
        name: "ur10",
        about: "six-axis robot measured by a laser tracker (public data set, to be downloaded)",
        files: files!("ur10": "machine.toml", "session.toml"),
    },
];

/// The conventions of a table.
const CONVENTIONS: Words<Convention> = &Convention::WORDS;
/// How a robot is measured.
const MEASURED: Words<Measured> = &Measured::WORDS;

/// The file of a robot.
#[derive(Args)]
struct RobotArguments {
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
