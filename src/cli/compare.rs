//! `abbe compare`: differences between sessions or models of one machine.

use std::path::{Path, PathBuf};

use abbe::identify::compare::results::{Comparison, ExcludedReading};
use abbe::identify::compare::{CompareOptions, Input, Named, SIGNIFICANCE, compare, models, one_machine};
use abbe::identify::model_file::{self, IdentifiedModel};
use abbe::identify::results::Outlier;
use abbe::model::files::{self, ReadOptions};
use clap::Args;

use super::failure::Failure;
use super::json::{self, Origin};
use super::output;
use super::{CommonArguments, output::Outputs};
use crate::report::compare as present;

/// Examples of `abbe compare`.
pub const HELP: &str = "Each input is a session, which is fitted as declared, or a model of `abbe fit --save` or `abbe trace --save`. Sessions are fitted \
with the errors and effects that any input has, models included, so that their parameters are the same. The others are compared with the first.

A difference is significant if Holm's procedure rejects that it is zero: the probability of any false claim between two inputs is at \
most the level of --significance. Bars of the same name with the same prior are taken for one bar, whose deviation cancels, \
unless the readings show that they are two; --shared names other set-up quantities that were not mounted again.

Examples:
  abbe compare run1/session.toml run2/session.toml
  abbe compare run1/session.toml run2/session.toml --shared bar --shared workpiece_ball
  abbe fit run1/session.toml --save model.json
  abbe compare model.json run2/session.toml --json differences.json
  abbe compare model.json run2/session.toml --significance 0.01 --places 7 --csv differences.csv";

/// `abbe compare A B …`
#[derive(Args)]
pub struct CompareArguments {
    /// Sessions or models, the first one being that with which the others are compared.
    #[arg(required = true, num_args = 2..)]
    inputs: Vec<PathBuf>,
    /// Folder of the data files of the sessions, if they do not lie beside the session files.
    ///
    /// Example: --data measurements
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Allow the sessions to read files outside their own folder and the folder of --data.
    #[arg(long)]
    allow_outside: bool,
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
    /// Places along each axis at which the volumetric error is evaluated; 0 for none.
    ///
    /// Example: --places 7
    #[arg(long, value_name = "N", default_value_t = 5)]
    places: usize,
    /// List every difference.
    #[arg(long)]
    all: bool,
    /// Write the differences as CSV.
    ///
    /// Example: --csv differences.csv
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
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
    let outputs = arguments.common.outputs(&[arguments.csv.as_ref()])?;
    let mut origin = Origin::default();
    let inputs: Vec<Input> =
        arguments.inputs.iter().map(|file| read(file, arguments, &outputs, &mut origin)).collect::<Result<_, _>>()?;
    let names: Vec<String> = arguments.inputs.iter().map(|file| file.display().to_string()).collect();
    for (name, input) in names.iter().zip(&inputs).skip(1) {
        one_machine((&names[0], inputs[0].machine()), (name, input.machine()))?;
    }
    let (models, outliers): (Vec<IdentifiedModel>, Vec<Vec<Outlier>>) =
        models(inputs, arguments.common.seed)?.into_iter().unzip();
    let excluded = names.iter().zip(outliers).flat_map(|(input, outliers)| {
        outliers.into_iter().map(|outlier| ExcludedReading { input: input.clone(), outlier })
    });
    let excluded: Vec<ExcludedReading> = excluded.collect();
    let named: Vec<Named<'_>> = names.into_iter().zip(&models).map(|(name, model)| Named { name, model }).collect();
    let options = CompareOptions {
        significance: arguments.significance,
        shared: (!arguments.shared.is_empty()).then(|| arguments.shared.clone()),
        places: arguments.places,
    };
    let comparison = Comparison { outliers: excluded, ..compare(&named, &options)? };
    if outputs.tables(arguments.common.quiet) {
        for (number, pair) in comparison.pairs.iter().enumerate() {
            if number > 0 {
                say!("");
            }
            for line in present::headline(&comparison, pair) {
                say!("{line}");
            }
            output::print(&present::differences(&comparison, pair, arguments.all));
        }
        match comparison.workspace.is_empty() {
            false => output::print(&present::workspace(&comparison)),
            true if arguments.places > 0 => {
                say!("");
                say!("Volumetric error: not evaluated, because the ranges of the axes have nothing in common");
            }
            true => {}
        }
    }
    if let Some(path) = &arguments.csv {
        output::write_figures(path, &present::figures(&comparison))?;
    }
    match &arguments.common.json {
        Some(path) => json::write(path, origin, Some(arguments.common.seed), &comparison),
        None => Ok(()),
    }
}

fn read(file: &Path, arguments: &CompareArguments, outputs: &Outputs, origin: &mut Origin) -> Result<Input, Failure> {
    let source = files::text(file, "the session or model")?;
    // A model is JSON; no session begins with a brace.
    if source.text.trim_start().starts_with('{') {
        outputs.refuse_overwrite([file])?;
        origin.add(Origin::of_files(&source.stamp));
        return Ok(Input::Model(Box::new(model_file::read_text(file, &source.text)?)));
    }
    let options = ReadOptions {
        data_directory: arguments.data.clone(),
        allow_outside: arguments.allow_outside,
        ..ReadOptions::default()
    };
    let (session, sources) = files::session_of(&source, &options)?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    origin.add(Origin::of_session(&sources));
    Ok(Input::Session(Box::new(session)))
}
