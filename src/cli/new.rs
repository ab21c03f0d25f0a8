//! `abbe new`: create a machine and a session from a template or from a structural code.

use std::path::PathBuf;

use abbe::model::ModelError;
use abbe::model::files::template;
use clap::Args;

use super::failure::Failure;
use super::folder::{self, NewFile};

/// Examples of `abbe new`.
pub const HELP: &str = "Examples:
  abbe new
  abbe new mymachine --template hermle-c600u
  abbe new mine --from-code \"[wCXbYZAt]\"

The first lists the templates. The last creates machine.toml and plan.toml with a comment on each line; `abbe plan mine/plan.toml` analyses them.";

/// `abbe new [DIR --template NAME | DIR --from-code CODE]`
#[derive(Args)]
#[command(group = clap::ArgGroup::new("start").args(["template", "from_code"]))]
pub struct NewArguments {
    /// The new folder. Without it, the templates are listed.
    #[arg(requires = "start")]
    folder: Option<PathBuf>,
    /// Copy this template.
    ///
    /// Example: --template hermle-c600u
    #[arg(long, value_name = "NAME", requires = "folder", allow_hyphen_values = true)]
    template: Option<String>,
    /// Create a machine with this structural code, from workpiece over bed to tool, and a plan for it.
    ///
    /// Example: --from-code [wCXbYZAt]
    #[arg(long, value_name = "CODE", requires = "folder")]
    from_code: Option<String>,
    /// List the templates.
    #[arg(long)]
    list: bool,
    /// Replace files in an existing folder.
    #[arg(long)]
    force: bool,
}

/// A session in the program.
struct Template {
    name: &'static str,
    about: &'static str,
    /// File name and contents.
    files: &'static [(&'static str, &'static str)],
}

/// Files of a folder of `sessions/`.
macro_rules! files {
    ($folder:literal: $($file:literal),+ $(,)?) => {
        &[$(($file, include_str!(concat!("../../sessions/", $folder, "/", $file)))),+]
    };
}

const TEMPLATES: &[Template] = &[
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
        name: "r-test",
        about: "R-test on machines with B, C and with A, B tables: plans of BK1 and BK2, and readings with pitch-compensation steps to trace",
        files: &[
            ("machine.toml", include_str!("../../sessions/r-test/machine.toml")),
            ("plan.toml", include_str!("../../sessions/r-test/plan.toml")),
            ("machine-b.toml", include_str!("../../sessions/r-test/machine-b.toml")),
            ("session.toml", include_str!("../../sessions/r-test/measured/session.toml")),
            ("BK1.csv", include_str!("../../sessions/r-test/measured/BK1.csv")),
            ("BK2.csv", include_str!("../../sessions/r-test/measured/BK2.csv")),
            ("C-alone.csv", include_str!("../../sessions/r-test/measured/C-alone.csv")),
        ],
    },
    Template {
        name: "self-calibration",
        about: "rotary table probed on an uncalibrated cylinder; a plan, and readings simulated from it",
        files: &[
            ("machine.toml", include_str!("../../sessions/self-calibration/machine.toml")),
            ("plan.toml", include_str!("../../sessions/self-calibration/session.toml")),
            ("session.toml", include_str!("../../sessions/self-calibration/measured/session.toml")),
            ("1a.csv", include_str!("../../sessions/self-calibration/measured/1a.csv")),
            ("1b.csv", include_str!("../../sessions/self-calibration/measured/1b.csv")),
            ("2.csv", include_str!("../../sessions/self-calibration/measured/2.csv")),
            ("3.csv", include_str!("../../sessions/self-calibration/measured/3.csv")),
        ],
    },
    Template {
        name: "volumetric",
        about: "five-axis machine with 33 error functions, to map and to compensate (`abbe volumetric --map`)",
        files: files!("volumetric": "machine.toml", "errors.toml"),
    },
    Template {
        name: "table-and-head",
        about: "five-axis machine with a rotary table and a tilting head; ball-bar plan of chapter 7, and simulated readings",
        files: &[
            ("machine.toml", include_str!("../../sessions/table-and-head/machine.toml")),
            ("plan.toml", include_str!("../../sessions/table-and-head/session.toml")),
            ("session.toml", include_str!("../../sessions/table-and-head/measured/session.toml")),
            ("A100.csv", include_str!("../../sessions/table-and-head/measured/A100.csv")),
            ("A150.csv", include_str!("../../sessions/table-and-head/measured/A150.csv")),
            ("C100.csv", include_str!("../../sessions/table-and-head/measured/C100.csv")),
            ("C150.csv", include_str!("../../sessions/table-and-head/measured/C150.csv")),
        ],
    },
    Template {
        name: "tilting-head",
        about: "five-axis machine with a tilting head; ball-bar plan of chapter 7, and simulated readings",
        files: &[
            ("machine.toml", include_str!("../../sessions/tilting-head/machine.toml")),
            ("plan.toml", include_str!("../../sessions/tilting-head/session.toml")),
            ("session.toml", include_str!("../../sessions/tilting-head/measured/session.toml")),
            ("B100.csv", include_str!("../../sessions/tilting-head/measured/B100.csv")),
            ("B150.csv", include_str!("../../sessions/tilting-head/measured/B150.csv")),
            ("C100.csv", include_str!("../../sessions/tilting-head/measured/C100.csv")),
            ("C150.csv", include_str!("../../sessions/tilting-head/measured/C150.csv")),
        ],
    },
    Template {
        name: "ur10",
        about: "six-axis robot measured by a laser tracker (public data set, to be downloaded)",
        files: files!("ur10": "machine.toml", "session.toml"),
    },
];

/// Runs `abbe new`.
pub fn run(arguments: &NewArguments, quiet: bool) -> Result<(), Failure> {
    let (Some(folder), false) = (&arguments.folder, arguments.list) else {
        list();
        return Ok(());
    };
    let files = match (&arguments.template, &arguments.from_code) {
        (Some(name), _) => copied(name)?,
        (None, Some(code)) => of_code(code)?,
        (None, None) => return Ok(()),
    };
    folder::write(folder, &files, arguments.force, |_| Ok(()))?;
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
fn of_code(code: &str) -> Result<Vec<NewFile>, Failure> {
    let [machine, plan] = template::of_code(code).map_err(|fault| match fault {
        ModelError::UnknownAxisKind { .. } => Failure::Other(format!(
            "{fault}; `abbe new DIR --template ur10` shows a machine whose axes state their kind and direction"
        )),
        fault => fault.into(),
    })?;
    Ok(vec![("machine.toml".into(), machine), ("plan.toml".into(), format!("{PLAN_HEAD}{plan}"))])
}

/// The files of a template.
fn copied(name: &str) -> Result<Vec<NewFile>, Failure> {
    let Some(template) = TEMPLATES.iter().find(|template| template.name == name) else {
        return Err(Failure::Other(format!("no template `{name}`; the templates are {}", names())));
    };
    let files = template.files.iter();
    Ok(files.map(|(name, text)| (name.to_string(), text.to_string())).collect())
}
