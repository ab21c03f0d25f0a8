//! `abbe import`: foreign files of readings as a session.

use std::path::PathBuf;

use abbe::files::import::{Foreign, Hint, session};
use abbe::files::store::Store;
use abbe::identify::error::CONTRADICTED;
use abbe::import::{ImportOptions, Target, import, key_of_new_session};
use abbe::model::Diagnostic;
use abbe::model::instrument;
use clap::Args;
use clap::builder::PossibleValuesParser;

use super::failure::command_line;
use super::message::{Kind, tell};
use super::results::{OutputArguments, Read};
use super::{Global, folder, output};
use crate::report::import as present;

/// Examples of `abbe import`.
pub const HELP: &str = include_str!("help/import.txt");

fn kinds() -> PossibleValuesParser {
    PossibleValuesParser::new(instrument::kinds().iter().map(|kind| kind.word()))
}

/// `abbe import FILE… (--machine MACHINE --out FOLDER | --session SESSION)`
#[derive(Args)]
#[command(group = clap::ArgGroup::new("target").args(["machine", "session"]).required(true))]
pub struct ImportArguments {
    /// The files of readings; each becomes the test of its name.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The machine file of a new session.
    ///
    /// Example: --machine robot/machine.toml --out run1
    #[arg(long, value_name = "MACHINE", requires = "out")]
    machine: Option<PathBuf>,
    /// Where the result is written: a new folder for the session.
    ///
    /// Example: --out run1
    #[arg(long, value_name = "DIR", conflicts_with = "session")]
    out: Option<PathBuf>,
    /// The session to which the tests are added. A file with the name of a planned test gives it its readings.
    ///
    /// Example: --session plan.toml
    #[arg(long, value_name = "SESSION")]
    session: Option<PathBuf>,
    /// The instrument, if the columns do not tell.
    ///
    /// Example: --kind tracker
    #[arg(long, value_name = "KIND", value_parser = kinds(), conflicts_with = "session")]
    kind: Option<String>,
    /// A key of the new tests, as in [[test]]; may be repeated.
    ///
    /// Example: --set bar_mm=150 --set workpiece_ball_mm=[0,100,0]
    #[arg(long, value_name = "KEY=VALUE", allow_hyphen_values = true)]
    set: Vec<String>,
    /// What a column holds: our name with its unit, and the name or the number in the file; may be repeated.
    ///
    /// Example: --column c_deg=3 --column length_mm=Messwert
    #[arg(long, value_name = "OWN=THEIRS")]
    column: Vec<String>,
    /// The test of the session whose set-up new tests have.
    ///
    /// Example: --like C100
    #[arg(long, value_name = "TEST", requires = "session", allow_hyphen_values = true)]
    like: Option<String>,
    /// Allow a session to read files outside its own folder.
    #[arg(long)]
    allow_outside: bool,
    /// Accept readings that contradict the machine, such as axes more than 5 % of a link beside their place.
    #[arg(long)]
    allow_implausible: bool,
    #[command(flatten)]
    output: OutputArguments,
}

/// Runs `abbe import`.
pub fn run(arguments: &ImportArguments, _: Global) -> Result<(), Diagnostic> {
    let outputs = arguments.output.prepared(&[])?;
    let of_words = |(message, help): (String, String)| command_line(format!("{message}; {help}"));
    let options = ImportOptions {
        kind: arguments.kind.as_deref().map(str::parse).transpose()?,
        set: session::keys(&arguments.set).map_err(of_words)?,
        hints: arguments.column.iter().map(|text| Hint::parse(text)).collect::<Result<_, _>>().map_err(of_words)?,
        like: arguments.like.clone(),
        store: Store::Disk,
        allow_outside: arguments.allow_outside,
        allow_implausible: arguments.allow_implausible,
    };
    let read = arguments.files.iter().map(|path| Foreign::read(&Store::Disk, path));
    let (files, stamps): (Vec<_>, Vec<_>) = read.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    let (target, into) = match (&arguments.machine, &arguments.session, &arguments.out) {
        (Some(machine), None, Some(out)) => (Target::Machine(machine), out.as_path()),
        (None, Some(session), _) => (Target::Session(session), output::folder_of(session)),
        _ => return Err(command_line("state --machine with --out, or --session")),
    };
    let imported = import(&files, target, &options).map_err(refused)?;
    match target {
        Target::Machine(_) => folder::write(into, &imported.files, arguments.output.folder.force, |_| Ok(()))?,
        Target::Session(_) => folder::add(into, &imported.files, &arguments.files, arguments.output.folder.force)?,
    }
    let session = into.join(&imported.result.session);
    let report = present::report(&imported.result, &session.display().to_string());
    arguments.output.put(&outputs, &report, &imported.result, &Read::files(&stamps))
}

/// What the command can do about readings that contradict the machine, or about keys that its session lacks.
fn refused(error: Diagnostic) -> Diagnostic {
    let note = if error.code == CONTRADICTED {
        "--allow-implausible writes the session all the same".to_string()
    } else if let Some(key) = key_of_new_session(&error) {
        format!("--set states a key of the new tests, as in --set {key}")
    } else {
        return error;
    };
    tell(Kind::Note, &format!("nothing is written; {note}"));
    error
}
