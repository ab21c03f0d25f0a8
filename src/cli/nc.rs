//! `abbe nc`: NC programs of the planned tests.

pub mod motion;

use std::path::PathBuf;

use abbe::codegen::nc::{self, NcFiles};
use abbe::model::Diagnostic;
use abbe::plan::collision;
use clap::Args;

use self::motion::MotionArguments;
use super::message::print_warnings;
use super::{Global, SessionArguments, folder, output};
use crate::printers::terminal;
use crate::report::nc as present;

/// Examples of `abbe nc`.
pub const HELP: &str = include_str!("help/nc.txt");

/// `abbe nc SESSION --control C --out DIR`
#[derive(Args)]
pub struct NcArguments {
    #[command(flatten)]
    session: SessionArguments,
    /// The control of the NC programs.
    ///
    /// Example: --control linuxcnc
    #[arg(long, value_name = "CONTROL", value_parser = motion::controls())]
    control: &'static dyn nc::Control,
    /// Where the result is written: a new folder for the programs.
    ///
    /// Example: --out programs
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    motion: MotionArguments,
    #[command(flatten)]
    folder: super::ForceArguments,
}

/// Runs `abbe nc`.
pub fn run(arguments: &NcArguments, Global { quiet, .. }: Global) -> Result<(), Diagnostic> {
    let control = arguments.control;
    let options = arguments.motion.options();
    let (session, sources) = arguments.session.read_planned(|session| nc::has_letters(&session.machine))?;
    let NcFiles { files: written, warnings, moves, runs } = nc::files(&session, control, &options)?;
    output::Outputs::in_folder(&arguments.out, written.iter().map(|(name, _)| name))
        .refuse_overwrite_of_sources(&sources)?;
    folder::write(&arguments.out, &written, arguments.folder.force, |_| Ok(()))?;
    print_warnings(&warnings);
    print_warnings(&collision::warnings_of_programs(&session, &moves)?);
    if !quiet {
        let report = present::report(&session, &written, &runs, control);
        output::whole(&terminal::report(&report, None));
    }
    Ok(())
}
