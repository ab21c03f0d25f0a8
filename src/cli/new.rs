//! `abbe new`: create a machine and a session from a template, a structural code, or the file of a robot.

mod check;
mod robot;
mod sizes;
mod templates;

use std::path::PathBuf;

use abbe::files::template;
use abbe::model::Diagnostic;
use abbe::model::chain::UNKNOWN_AXIS_KIND;
use clap::Args;

use self::sizes::SizeArguments;
use self::templates::TEMPLATES;
use super::Global;
use super::folder::{self, NewFile};

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
    robot: robot::RobotArguments,
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
        check::planned(folder, &files)?;
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
