//! `abbe compare`: differences between sessions or models of one machine.

use std::path::{Path, PathBuf};

use abbe::analysis::{Analysis, Compared, ComparisonOptions, Given};
use abbe::files;
use abbe::identify::{fit, model_file, plausibility, repeated};
use abbe::model::Diagnostic;
use clap::Args;

use super::failure::command_line;
use super::output::{self, Outputs};
use super::results::{File, Read};
use super::{CommonArguments, DataArguments, Global};
use crate::report::block::Report;
use crate::report::repeated as present;

/// Examples of `abbe compare`.
pub const HELP: &str = include_str!("help/compare.txt");

/// `abbe compare A B …`
#[derive(Args)]
pub struct CompareArguments {
    /// Sessions or models, the first one being that with which the others are compared.
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    data: DataArguments,
    /// The sessions repeat one plan on an unchanged machine: state the standard uncertainty from the scatter of their fits
    /// (Type A) beside that of each fit (Type B).
    #[arg(long, conflicts_with_all = ["shared", "significance", "places"])]
    repeated: bool,
    /// Accept readings that contradict the machine, such as axes more than 5 % of a link beside their place. Without it they
    /// are refused where another reading of the file explains them.
    #[arg(long)]
    allow_implausible: bool,
    #[command(flatten)]
    options: ComparisonOptions,
    #[command(flatten)]
    common: CommonArguments,
}

/// Runs `abbe compare`.
pub fn run(arguments: &CompareArguments, _: Global) -> Result<(), Diagnostic> {
    let ComparisonOptions { significance: found, places, .. } = arguments.options;
    if !(found > 0.0 && found < 1.0) {
        return Err(command_line(format!("`--significance {found}`: a probability between 0 and 1 is expected")));
    }
    if places > 100 {
        return Err(command_line(format!("`--places {places}`: 100 is the most")));
    }
    let common = &arguments.common;
    let outputs = common.output.prepared(&[])?;
    if arguments.inputs.len() < 2 {
        return Err(command_line("at least two sessions or models are expected; name another"));
    }
    if arguments.allow_implausible && !arguments.repeated {
        let message = "`--allow-implausible` belongs to `--repeated`; state both or none";
        return Err(command_line(message));
    }
    if arguments.repeated {
        return compare_repeated(&arguments.inputs, &arguments.data, arguments.allow_implausible, common, &outputs);
    }
    let reading = arguments.data.options();
    let inputs: Vec<File> =
        arguments.inputs.iter().map(|file| File::read(file, None, &reading, &outputs)).collect::<Result<_, _>>()?;
    let names = arguments.inputs.iter().map(|file| file.display().to_string()).collect();
    let options = ComparisonOptions { names, ..arguments.options.clone() };
    let given: Vec<Given<'_>> = inputs.iter().map(File::given).collect();
    let found = Compared::run(&given, &options, common.seed, &|_| true)?;
    let commands = arguments.data.commands(Path::new(""));
    common.output.put_found(&outputs, &found, &commands, &Read::inputs(&inputs, common.seed))
}

/// Type A evaluation over repeated sessions beside the Type B evaluation of each fit: fits each session separately and
/// compares the fits.
fn compare_repeated(
    all: &[PathBuf],
    data: &DataArguments,
    allow_implausible: bool,
    common: &CommonArguments,
    outputs: &Outputs,
) -> Result<(), Diagnostic> {
    let mut read = Vec::with_capacity(all.len());
    for (place, path) in all.iter().enumerate() {
        if all[..place].iter().any(|earlier| output::is_same(earlier, path)) {
            return Err(Diagnostic::other(format!(
                "{} is named twice; name each repeated session once",
                path.display()
            )));
        }
        let source = files::text(path, "the session")?;
        if model_file::is_model(&source.text) {
            let file = path.display();
            return Err(Diagnostic::other(format!("{file} is a model; `--repeated` compares the fits of sessions")));
        }
        let (session, sources) = files::session_of(&source, &data.options())?;
        outputs.refuse_overwrite_of_sources(&sources)?;
        read.push((session, sources));
    }
    let (mut sessions, mut warnings) = (Vec::with_capacity(all.len()), Vec::new());
    for (path, (session, _)) in all.iter().zip(&read) {
        let (problem, found) = fit::prepare(session, common.seed)?;
        let own = fit::report(&problem, &found)?;
        if !allow_implausible {
            plausibility::accepted(&own.plausibility)?;
        }
        warnings.extend(own.warnings.iter().map(|warning| format!("{}: {warning}", path.display())));
        sessions.push(repeated::Session::new(&path.display().to_string(), &problem, &found));
    }
    let result = repeated::compare(&sessions)?;
    let report = Report { warnings, ..present::report(&read[0].0.machine.name, &result) };
    let sessions = read.iter().map(|(session, sources)| (session, sources)).collect();
    common.output.put(outputs, &report, &result, &Read { sessions, files: Vec::new(), seed: Some(common.seed) })
}
