//! `abbe compare`: differences between sessions or models of one machine.

use std::path::{Path, PathBuf};

use abbe::apply::compare::{CompareOptions, Input, SIGNIFICANCE, compare_inputs};
use abbe::document::StatedComparison;
use abbe::files::stamp::FileStamp;
use abbe::files::{self, ReadOptions, SourceMap};
use abbe::identify::model_file;
use clap::Args;

use super::failure::Failure;
use super::output::Outputs;
use super::results::Read;
use super::{CommonArguments, DataArguments, PlausibilityArguments, repeated};
use crate::report;

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
    #[command(flatten)]
    plausibility: PlausibilityArguments,
    /// Set-up quantity that was not mounted again between the sessions: bar, workpiece_ball, spindle_ball, `none`; may be
    /// repeated [default: bars of the same name with the same prior].
    ///
    /// Example: --shared workpiece_ball
    #[arg(long = "shared", value_name = "THING", allow_hyphen_values = true)]
    shared: Vec<String>,
    /// Probability of any false claim of a difference between two inputs.
    ///
    /// Example: --significance 0.01
    #[arg(long, value_name = "P", default_value_t = SIGNIFICANCE)]
    significance: f64,
    /// Number of places along each axis: here of the volumetric error, 0 for none.
    ///
    /// Example: --places 7
    #[arg(long, value_name = "N", default_value_t = 5)]
    places: usize,
    #[command(flatten)]
    common: CommonArguments,
}

/// Runs `abbe compare`.
pub fn run(arguments: &CompareArguments) -> Result<(), Failure> {
    if !(arguments.significance > 0.0 && arguments.significance < 1.0) {
        let found = arguments.significance;
        return Err(Failure::CommandLine(format!(
            "`--significance {found}`: a probability between 0 and 1 is expected"
        )));
    }
    if arguments.places > 100 {
        return Err(Failure::CommandLine(format!("`--places {}`: 100 is the most", arguments.places)));
    }
    let common = &arguments.common;
    let outputs = common.output.prepared(&[])?;
    if arguments.inputs.len() < 2 {
        return Err(Failure::CommandLine("at least two sessions or models are expected; name another".into()));
    }
    arguments.plausibility.belongs_to("--repeated", arguments.repeated)?;
    if arguments.repeated {
        return repeated::run(&arguments.inputs, &arguments.data, arguments.plausibility, common, &outputs);
    }
    let reading = arguments.data.options();
    let inputs: Vec<File> =
        arguments.inputs.iter().map(|file| read(file, &reading, &outputs)).collect::<Result<_, _>>()?;
    let names: Vec<String> = arguments.inputs.iter().map(|file| file.display().to_string()).collect();
    let given: Vec<Input> = inputs.iter().map(|(input, _)| input.clone()).collect();
    let options = CompareOptions {
        significance: arguments.significance,
        shared: (!arguments.shared.is_empty()).then(|| arguments.shared.clone()),
        places: arguments.places,
    };
    let found = compare_inputs(names, given, &options, common.seed)?;
    let mut from = Read { seed: Some(common.seed), ..Read::default() };
    for input in &inputs {
        match input {
            (Input::Session(session), InputFiles::Session(sources)) => from.sessions.push((session, sources)),
            (_, InputFiles::Model(stamp)) => from.files.extend(stamp),
            _ => {}
        }
    }
    let stated = StatedComparison::of_comparison(&found);
    let commands = arguments.data.commands(Path::new(""));
    let machine = &inputs[0].0.machine().name;
    let report = report::compare::report(machine, &stated, arguments.places > 0, &commands);
    common.output.put(&outputs, &report, &stated, &from)
}

/// What an input was read from.
enum InputFiles {
    Session(Box<SourceMap>),
    Model(Option<FileStamp>),
}

/// An input with its files.
type File = (Input, InputFiles);

fn read(file: &Path, options: &ReadOptions, outputs: &Outputs) -> Result<File, Failure> {
    let source = files::text(file, "the session or model")?;
    if model_file::is_model(&source.text) {
        outputs.refuse_overwrite([file])?;
        let model = model_file::of_source(&source)?;
        return Ok((Input::Model(Box::new(model)), InputFiles::Model(source.stamp)));
    }
    let (session, sources) = files::session_of(&source, options)?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    Ok((Input::Session(Box::new(session)), InputFiles::Session(Box::new(sources))))
}
