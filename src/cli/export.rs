//! `abbe export`: the calibrated machine for other programs and for controls.

mod travel;

use std::path::PathBuf;

use abbe::apply::export::control::ENTRIES;
use abbe::exports::{self, ExportOptions, FORMATS};
use abbe::identify::model_file;
use abbe::model::files;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::failure::Failure;
use super::results::{OutputArguments, Read};
use super::{output, values};
use crate::report::export as present;

/// Examples of `abbe export`.
pub const HELP: &str = include_str!("help/export.txt");

fn formats() -> PossibleValuesParser {
    PossibleValuesParser::new(FORMATS.iter().map(|format| PossibleValue::new(format.word).help(format.about)))
}

fn entries() -> PossibleValuesParser {
    PossibleValuesParser::new(ENTRIES.iter().map(|(_, word, about)| PossibleValue::new(*word).help(*about)))
}

/// `abbe export MODEL --as FORMAT --out FILE`
#[derive(Args)]
pub struct ExportArguments {
    /// The identified model: `abbe fit --save` or `abbe trace --save`.
    model: PathBuf,
    /// What is written.
    ///
    /// Example: --as urdf
    #[arg(long = "as", value_parser = formats(), value_name = "FORMAT")]
    format: String,
    /// Where it is written; `-` is standard output.
    ///
    /// Example: --out robot.urdf
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The tool point in the tool frame, for urdf, dh and controls [default: the instrument's point in the model].
    ///
    /// Example: --tool-mm 0,0,120
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    tool_mm: Vec<f64>,
    /// Which entries of linuxcnc and fanuc are written.
    #[arg(long, value_parser = entries(), value_name = "ENTRIES", default_value = "best")]
    entries: String,
    /// Travel of an axis over which the error of the entries counts, mm or degrees [default: the measured range].
    ///
    /// Example: --travel A=-30..110 --travel C=-180..180
    #[arg(long, value_name = "AXIS=FROM..TO", allow_hyphen_values = true)]
    travel: Vec<String>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Runs `abbe export`.
pub fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    let outputs = arguments.output.prepared(&[Some(&arguments.out)])?;
    outputs.refuse_overwrite([arguments.model.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::of_source(&source)?;
    let format = exports::format(&arguments.format)?;
    let options = ExportOptions {
        tool_mm: values::point_mm("--tool-mm", &arguments.tool_mm, model.tool_mm)?,
        entries: exports::entries(&arguments.entries)?,
        travel: travel::stated(&arguments.travel, &model)?,
    };
    if let Some(option) = format.ignored(&options) {
        return Err(Failure::CommandLine(format!("`--{option}` belongs to `--as linuxcnc` and `--as fanuc`")));
    }
    let exported = format.export(&model, &options)?;
    output::write_whole(&arguments.out, &exported.text)?;
    let left_out = &exported.result.left_out;
    let report = present::report(&model.machine.name, &arguments.out, exported.table, left_out);
    arguments.output.put(&outputs, &report, &exported.result, &Read::files(&source.stamp))
}
